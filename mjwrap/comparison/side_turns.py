"""The way round a cylinder that a side site means to MuJoCo 3 and to MuJoCo 4, for many poses, from the rules alone.

The code uses neither mjwrap's solver nor MuJoCo's wrapping. All points are (T, 3) in the cylinder's frame [m], its axis
is z. Ways are given by their turn: the angle by which they go round the axis, counter-clockwise positive [rad].
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mjwrap.comparison.judge_geodesic import nearest
from mjwrap.mjcf.side_rules import MUJOCO_4

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]


def turn_by_rule(rule: int, radius: float, a: Array, b: Array, side: Array) -> Array:
    """Return the turn (T,) of a string from a to b with a side site by the rule of MuJoCo 3 or 4."""
    turn = _angle(a, b)
    one_way = np.where(turn >= 0.0, 1.0, -1.0)
    with np.errstate(invalid="ignore"):
        alpha, beta = (np.arccos(np.minimum(radius / np.hypot(x[:, 0], x[:, 1]), 1.0)) for x in (a, b))
    short, short_crosses = _chord(radius, a, b, one_way, alpha, beta)
    long, long_crosses = _chord(radius, a, b, -one_way, alpha, beta)
    if rule == MUJOCO_4:
        laid = _angle(a, side) + _angle(side, b)
        return np.where((np.abs(laid - turn) < np.pi) | long_crosses, turn, turn - 2.0 * np.pi * one_way)
    towards, away = _share(short, side), _share(long, side)
    beside = nearest(a, b, True)
    straight = (np.hypot(beside[:, 0], beside[:, 1]) > radius) & (_flat(beside, side) >= 0.0)
    other = ~straight & ~long_crosses & (short_crosses | (away > towards))
    again = ~straight & ~other & ~short_crosses & (np.abs(turn) < alpha + beta)
    return turn + 2.0 * np.pi * one_way * (again.astype(np.float64) - other)


def _flat(p: Array, q: Array) -> Array:
    return p[:, 0] * q[:, 0] + p[:, 1] * q[:, 1]


def _cross(p: Array, q: Array) -> Array:
    return p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]


def _angle(p: Array, q: Array) -> Array:
    return np.arctan2(_cross(p, q), _flat(p, q))


def _share(p: Array, side: Array) -> Array:
    return _flat(p, side) / np.maximum(np.hypot(p[:, 0], p[:, 1]), 1e-300)


def _chord(radius: float, a: Array, b: Array, way: Array, alpha: Array, beta: Array) -> tuple[Array, Flags]:
    """Return the sum of the contact points (T, 2) of a way round, and whether its straight segments cross."""
    first = np.arctan2(a[:, 1], a[:, 0]) + way * alpha
    last = np.arctan2(b[:, 1], b[:, 0]) - way * beta
    p, q = (radius * np.stack([np.cos(x), np.sin(x)], axis=1) for x in (first, last))
    u, v, w = p - a[:, :2], q - b[:, :2], b[:, :2] - a[:, :2]
    with np.errstate(invalid="ignore", divide="ignore"):
        s, t = _cross(w, v) / _cross(u, v), _cross(w, u) / _cross(u, v)
    return p + q, (s >= 0.0) & (s <= 1.0) & (t >= 0.0) & (t <= 1.0)
