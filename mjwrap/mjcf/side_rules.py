"""The rules by which a side site picks the way round a cylinder; MuJoCo 4 has another one than MuJoCo 3.

Seen along the axis, a string that is bent round a cylinder can go either way. MuJoCo 3 (`mju_wrap`) compares the
middles of the chords between the contact points, and takes the way whose middle lies in a direction nearer to that of
the side site, even if that is the long way round. MuJoCo 4 takes the way of a string that is pulled tight from the
polyline that leads from one end over the side site to the other: the long way only if the two legs of this polyline
together go round the axis by more than half a turn.

MuJoCo asks its rule at every pose anew, and its tendon jumps where the answer changes. mjwrap asks it once, at the
model's reference pose, and a path that starts at another pose goes round as if it had come from there.

All points are (T, 3) in the cylinder's frame [m], its axis is z. Ways are given by their turn: the angle by which they
go round the axis, counter-clockwise positive [rad].
"""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.errors import ModelError
from mjwrap.mjcf.marks import stored_side_rule
from mjwrap.validation import described

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
SIDE_RULES = MUJOCO_3, MUJOCO_4 = 3, 4
AUTHORS = 0  # of hints that mjwrap's tuples list: the hint itself decides, wherever a path starts
_CYLINDER = int(mujoco.mjtGeom.mjGEOM_CYLINDER)


def running_side_rule() -> int:
    """Return the rule of the MuJoCo that is running."""
    return MUJOCO_4 if int(mujoco.__version__.split(".")[0]) >= MUJOCO_4 else MUJOCO_3


def check_side_rule(rule: int | None) -> None:
    """Raise `ModelError` unless `rule` is one of `SIDE_RULES`, or None."""
    if rule is not None and not (isinstance(rule, int | np.integer) and rule in SIDE_RULES):
        raise ModelError(
            f"side_rule {described(rule)} does not exist; it is 3, 4, or None for the running MuJoCo's"
        )


def choose_side_rule(model: mujoco.MjModel, rule: int | None) -> int:
    """Return the rule for a model: the given one, else the one stored by `install`, else the running MuJoCo's."""
    check_side_rule(rule)
    return rule or stored_side_rule(model) or running_side_rule()


def reference_turn(
    model: mujoco.MjModel, rest: mujoco.MjData, geom: int, side: int, ends: tuple[int, int], rule: int
) -> float:
    """Return the turn of a tendon at the reference pose, whose kinematics `rest` has; 0 for a geom that is no cylinder.

    side, ends: the side site, and the sites before and after the geom. A turn of 0 round a cylinder is given as 1e-12.
    """
    if int(model.geom_type[geom]) != _CYLINDER:
        return 0.0
    points = rest.site_xpos[[*ends, side]] - rest.geom_xpos[geom]
    a, b, s = (points @ rest.geom_xmat[geom].reshape(3, 3))[:, None, :]
    return float(turn_by_rule(rule, float(model.geom_size[geom, 0]), a, b, s)[0]) or 1e-12


def turn_by_rule(rule: int, radius: float, a: Array, b: Array, side: Array) -> Array:
    """Return the turn (T,) of a string from a to b with a side site by the rule of MuJoCo 3 or 4."""
    turn = _angle(a, b)
    one_way = np.where(turn >= 0.0, 1.0, -1.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        alpha, beta = (np.arccos(np.minimum(radius / np.hypot(x[:, 0], x[:, 1]), 1.0)) for x in (a, b))
    short, short_crosses = _chord(radius, a, b, one_way, alpha, beta)
    long, long_crosses = _chord(radius, a, b, -one_way, alpha, beta)
    if rule == MUJOCO_4:
        laid = _angle(a, side) + _angle(side, b)
        return np.where((np.abs(laid - turn) < np.pi) | long_crosses, turn, turn - 2.0 * np.pi * one_way)
    towards, away = _share(short, side), _share(long, side)
    beside = _nearest(a, b)
    straight = (np.hypot(beside[:, 0], beside[:, 1]) > radius) & (_dot(beside, side) >= 0.0)
    other = ~straight & ~long_crosses & (short_crosses | (away > towards))
    # the shorter way does not touch, and its contact points have passed each other: the string goes round once more
    again = ~straight & ~other & ~short_crosses & (np.abs(turn) < alpha + beta)
    return turn + 2.0 * np.pi * one_way * (again.astype(np.float64) - other)


def _dot(p: Array, q: Array) -> Array:
    return p[:, 0] * q[:, 0] + p[:, 1] * q[:, 1]


def _cross(p: Array, q: Array) -> Array:
    return p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]


def _angle(p: Array, q: Array) -> Array:
    return np.arctan2(_cross(p, q), _dot(p, q))


def _share(p: Array, side: Array) -> Array:
    return _dot(p, side) / np.maximum(np.hypot(p[:, 0], p[:, 1]), 1e-300)


def _nearest(a: Array, b: Array) -> Array:
    """Return the points (T, 2) nearest to the axis of the straight segments from a to b, seen along the axis."""
    step = (b - a)[:, :2]
    square = _dot(step, step)
    place = np.clip(-_dot(a, step) / np.where(square > 0.0, square, 1.0), 0.0, 1.0)
    return a[:, :2] + place[:, None] * step


def _chord(radius: float, a: Array, b: Array, way: Array, alpha: Array, beta: Array) -> tuple[Array, Flags]:
    """Return the sum of the contact points (T, 2) of a way round, and whether its straight segments cross."""
    first = np.arctan2(a[:, 1], a[:, 0]) + way * alpha
    last = np.arctan2(b[:, 1], b[:, 0]) - way * beta
    p, q = (radius * np.stack([np.cos(x), np.sin(x)], axis=1) for x in (first, last))
    u, v, w = p - a[:, :2], q - b[:, :2], b[:, :2] - a[:, :2]
    with np.errstate(invalid="ignore", divide="ignore"):
        s, t = _cross(w, v) / _cross(u, v), _cross(w, u) / _cross(u, v)
    return p + q, (s >= 0.0) & (s <= 1.0) & (t >= 0.0) & (t <= 1.0)
