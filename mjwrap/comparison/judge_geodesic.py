"""Judge whether given paths over one cylinder or sphere are true geodesics, from their geometry alone, for many poses.

The code uses neither mjwrap's solver nor MuJoCo's wrapping. A path from a to b is either straight, or runs straight to
p, along the surface to q, and straight to b. It is the path of a string if it touches the surface tangentially, follows
a geodesic between p and q, never passes below the surface, and is a local minimum of length. All points are (T, 3) in
the surface's frame [m]; the axis of a cylinder is z.
"""

from __future__ import annotations

import enum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mjwrap.kernels.layout import AS_WRITTEN

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
Ints = NDArray[np.int64]

ANGLE = 1e-9  # [rad] largest corner; both programs compute contact points in closed form or to 1e-10
INSIDE_TOLERANCE = 2e-6  # [rad] the same for MuJoCo's corner inside a geom, which it finds to 1e-6 rad
SAME_TURN = (
    1e-3  # [rad] two paths between the same points are on the same branch if their turns differ by less
)
OPPOSITE = 1e-6  # [rad] largest angle from opposite, at which rounding may choose the plane of a path
DEPTH = 1e-12  # [radii] largest depth of a straight segment below a surface, for rounding errors


class Fault(enum.IntEnum):
    """The reason why a path is not that of a string."""

    NONE = 0
    NON_FINITE = 1
    INSIDE = 2
    ENDPOINT_INSIDE = 3
    THROUGH = 4
    OFF_SURFACE = 5
    CORNER = 6
    NOT_GEODESIC = 7
    LONG_WAY = 8
    WRONG_LENGTH = 9
    BESIDE = 10
    UNEVEN = 11

    @property
    def words(self) -> str:
        """The fault in one clause; {} stands for its measure."""
        return _WORDS[self]


_WORDS = {
    Fault.NONE: "a true geodesic",
    Fault.NON_FINITE: "it is not finite",
    Fault.INSIDE: "it runs inside the surface, with one contact point and a corner of {:.2g} rad",
    Fault.ENDPOINT_INSIDE: "an end point lies {:.2g} m inside the surface, where no geodesic path exists",
    Fault.THROUGH: "it passes straight through the surface, {:.2g} m deep",
    Fault.OFF_SURFACE: "its contact points lie {:.2g} m off the surface",
    Fault.CORNER: "it meets the surface with a corner of {:.2g} rad",
    Fault.NOT_GEODESIC: "its part on the surface differs from the geodesic by {:.2g} m",
    Fault.LONG_WAY: "it takes the long way round the sphere ({:.2g} rad about its centre), which is not a minimum",
    Fault.BESIDE: "it should be held inside, but passes {:.2g} m beside the surface",
    Fault.UNEVEN: "held inside, it meets and leaves the surface at angles {:.2g} rad apart, so it is not the shortest",
    Fault.WRONG_LENGTH: "its length differs by {:.2g} m from its own segments and arcs",
}


class Judgement(NamedTuple):
    """The judgement of paths: fault (T,) and its measure (T,); arc (T,) on the surface [m]; turn (T,): the branch.

    turn is the angle [rad] by which the path goes round a cylinder's axis, counter-clockwise positive; on a sphere it
    is zero. Two paths between the same points are on the same branch if their turns are equal; else the turns differ by
    full turns. middle (T, 3): the vector from the centre or axis to the middle of the arc, or to the nearest point of a
    straight path.
    """

    fault: Ints
    measure: Array
    arc: Array
    turn: Array
    middle: Array


def _norm(v: Array) -> Array:
    return np.sqrt(np.einsum("ij,ij->i", v, v))


def _dot(u: Array, v: Array) -> Array:
    return np.einsum("ij,ij->i", u, v)


def _radial(v: Array, cylinder: bool) -> Array:
    """Return the part of v perpendicular to the axis, or v itself for a sphere."""
    return v * np.array([1.0, 1.0, 0.0]) if cylinder else v


def nearest(a: Array, b: Array, cylinder: bool) -> Array:
    """Return the vectors (T, 3) from the axis or centre to the nearest points of the straight segments ab [m]."""
    start, step = _radial(a, cylinder), _radial(b - a, cylinder)
    square = _dot(step, step)
    place = np.clip(-_dot(start, step) / np.where(square > 0.0, square, 1.0), 0.0, 1.0)
    return start + place[:, None] * step


def lifted(a: Array, cylinder: bool, radius: float) -> Array:
    """Return the points with those that lie a little inside moved onto the surface."""
    radial = _radial(a, cylinder)
    far = _norm(radial)
    low = (far < radius) & (far >= (1.0 - AS_WRITTEN) * radius)
    share = np.where(low, radius / np.where(low, far, 1.0) - 1.0, 0.0)
    return a + share[:, None] * radial


def opposite(a: Array, b: Array) -> Flags:
    """Return whether a and b (T, 3) are opposite to each other, seen from a sphere's centre.

    There all ways round the sphere are equally long, and the nearest one to either side is another one.
    """
    return (_norm(np.cross(a, b)) <= OPPOSITE * _norm(a) * _norm(b)) & (_dot(a, b) < 0.0)


def judge(cylinder: bool, radius: float, a: Array, b: Array, touched: Flags, p: Array, q: Array) -> Judgement:
    """Judge paths from a to b (T, 3) over one surface; p, q (T, 3) are used where `touched` (T,) is true.

    An end as little inside as a number written with six digits may put it lies on the surface (`layout.AS_WRITTEN`).
    """
    a, b = lifted(a, cylinder, radius), lifted(b, cylinder, radius)
    with np.errstate(invalid="ignore", divide="ignore"):
        straight = _judge_straight(cylinder, radius, a, b)
        wrapped = _judge_wrapped(cylinder, radius, a, b, p, q)
        parts = (np.where(touched, w, s) for w, s in zip(wrapped[:4], straight[:4], strict=True))
        fault, measure, arc, turn = parts
        middle = np.where(touched[:, None], wrapped[4], straight[4])
        inside = radius - np.minimum(_norm(_radial(a, cylinder)), _norm(_radial(b, cylinder)))
        for here, name, size in (
            ((inside > DEPTH * radius) & (fault != Fault.INSIDE), Fault.ENDPOINT_INSIDE, inside),
            (
                ~np.isfinite(a + b + np.where(touched[:, None], p + q, 0.0)).all(axis=1),
                Fault.NON_FINITE,
                inside,
            ),
        ):
            fault, measure = np.where(here, name, fault), np.where(here, size, measure)
    return Judgement(fault.astype(np.int64), measure, arc, turn, middle)


def judge_held(
    cylinder: bool,
    radius: float,
    a: Array,
    b: Array,
    touched: Flags,
    p: Array,
    q: Array,
    angle: float = ANGLE,
) -> Judgement:
    """Judge paths that are held inside: the shortest paths from a to b that meet the solid; p = q where `touched`.

    angle [rad]: largest difference of the angles at the corner. Such a path is straight through the solid, or has one
    corner on it where both segments, which are outside, make the same angle with the normal. The problem is convex, so
    this is sufficient.
    """
    zeros = np.zeros(len(a))
    with np.errstate(invalid="ignore", divide="ignore"):
        middle = nearest(a, b, cylinder)
        beside = _norm(middle) - radius
        n = _radial(p, cylinder) / _norm(_radial(p, cylinder))[:, None]
        near, far = _norm(p - a), _norm(b - p)
        e, f = (p - a) / near[:, None], (b - p) / far[:, None]
        corner = e - f
        uneven = _norm(corner - _dot(corner, n)[:, None] * n)
        uneven = np.maximum(uneven, np.maximum(_dot(e, n), -_dot(f, n)))
        rounding = 1e-15 * np.maximum(_norm(a), _norm(b)) / np.minimum(near, far)
        off = np.maximum(np.abs(_norm(_radial(p, cylinder)) - radius), _norm(p - q))
        fault, measure = zeros, zeros
        for here, name, size in (  # the last fault that applies is reported
            (~touched & (beside > DEPTH * radius), Fault.BESIDE, beside),
            (touched & (uneven > angle + 10.0 * rounding), Fault.UNEVEN, uneven),
            (touched & (off > ANGLE * radius), Fault.OFF_SURFACE, off),
            (
                ~np.isfinite(a + b + np.where(touched[:, None], p + q, 0.0)).all(axis=1),
                Fault.NON_FINITE,
                zeros,
            ),
        ):
            fault, measure = np.where(here, name, fault), np.where(here, size, measure)
    return Judgement(
        fault.astype(np.int64), measure, zeros, zeros, np.where(touched[:, None], radius * n, middle)
    )


def _judge_straight(cylinder: bool, radius: float, a: Array, b: Array) -> tuple[Array, ...]:
    middle = nearest(a, b, cylinder)
    depth = radius - _norm(middle)
    fault = np.where(depth > DEPTH * radius, Fault.THROUGH, Fault.NONE)
    turn = np.zeros(len(a))
    if cylinder:
        cross, dot = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1]
        turn = np.arctan2(cross, dot)
    return fault.astype(np.float64), depth, np.zeros(len(a)), turn, middle


def _judge_wrapped(
    cylinder: bool, radius: float, a: Array, b: Array, p: Array, q: Array
) -> tuple[Array, ...]:
    # Start at the end with the longer straight segment, whose direction is the more accurate.
    back = (_norm(p - a) < _norm(b - q))[:, None]
    a, b, p, q = np.where(back, b, a), np.where(back, a, b), np.where(back, q, p), np.where(back, p, q)
    in_length, out_length = _norm(p - a), _norm(b - q)
    n = _radial(p, cylinder) / _norm(_radial(p, cylinder))[:, None]
    e = (p - a) / in_length[:, None]
    corner = np.abs(_dot(e, n))
    t = e - _dot(e, n)[:, None] * n
    t /= _norm(t)[:, None]
    arc, angle, end, t_end = (_walk_cylinder if cylinder else _walk_sphere)(radius, p, n, t, q)
    miss = _norm(end - q)
    reach = 1e-15 * np.maximum(_norm(a), _norm(b)) / np.maximum(out_length, 1e-300)
    out = np.where(
        out_length > 0.0, _norm((b - q) - out_length[:, None] * t_end) / np.maximum(out_length, 1e-300), 0.0
    )
    off = np.maximum(
        np.abs(_norm(_radial(p, cylinder)) - radius), np.abs(_norm(_radial(q, cylinder)) - radius)
    )
    straight_turn = np.where(
        out_length > 0.0, _norm(e - (b - q) / np.maximum(out_length, 1e-300)[:, None]), 0.0
    )
    reach_a, reach_b = _norm(_radial(p - a, cylinder)), _norm(_radial(b - q, cylinder))
    swept = np.arctan(reach_a / radius) + np.abs(angle) + np.arctan(reach_b / radius)

    fault, measure = np.zeros(len(a)), np.zeros(len(a))
    for here, name, size in (  # the last fault that applies is reported
        (np.full(len(a), not cylinder) & (swept > np.pi + ANGLE), Fault.LONG_WAY, swept),
        (out > ANGLE + 10.0 * reach, Fault.CORNER, out),
        (miss > ANGLE * radius, Fault.NOT_GEODESIC, miss),
        (corner > ANGLE + 10.0 * reach, Fault.CORNER, corner),
        (off > ANGLE * radius, Fault.OFF_SURFACE, off),
        ((_norm(p - q) < ANGLE * radius) & (straight_turn > 1e-6), Fault.INSIDE, straight_turn),
    ):
        fault, measure = np.where(here, name, fault), np.where(here, size, measure)
    turn = np.where(np.signbit(angle) ^ back[:, 0], -swept, swept) if cylinder else np.zeros(len(a))
    half = 0.5 * angle[:, None]
    round_p = np.stack([-n[:, 1], n[:, 0], np.zeros(len(a))], axis=1) if cylinder else t
    return fault, measure, arc, turn, radius * (np.cos(half) * n + np.sin(half) * round_p)


def _once_round(angle: Array) -> Array:
    """Return the angle in [0, 2π); an angle just below zero by rounding becomes zero."""
    angle = np.mod(angle, 2.0 * np.pi)
    return np.where(angle > 2.0 * np.pi - 1e-9, 0.0, angle)


def _walk_sphere(radius: float, p: Array, n: Array, t: Array, q: Array) -> tuple[Array, Array, Array, Array]:
    """Follow the great circle from p along t to its point nearest to q; return arc, angle, end, and tangent there."""
    angle = _once_round(np.arctan2(_dot(q, t), _dot(q, n)))
    cos, sin = np.cos(angle)[:, None], np.sin(angle)[:, None]
    return radius * angle, angle, radius * (cos * n + sin * t), cos * t - sin * n


def _walk_cylinder(
    radius: float, p: Array, n: Array, t: Array, q: Array
) -> tuple[Array, Array, Array, Array]:
    """Follow the helix from p along t to the angle of q; return arc, angle (signed), end, and tangent there."""
    round_p = np.stack([-n[:, 1], n[:, 0], np.zeros(len(p))], axis=1)  # unit, counter-clockwise about z
    along = _dot(t, round_p)
    sense = np.where(along >= 0.0, 1.0, -1.0)
    angle = _once_round(sense * (np.arctan2(q[:, 1], q[:, 0]) - np.arctan2(p[:, 1], p[:, 0])))
    level = np.abs(along) < 1e-12  # parallel to the axis: a straight line on the surface
    arc = np.where(level, np.abs(q[:, 2] - p[:, 2]), radius * angle / np.where(level, 1.0, np.abs(along)))
    cos, sin = np.cos(sense * angle), np.sin(sense * angle)
    turned = np.stack([cos * n[:, 0] - sin * n[:, 1], sin * n[:, 0] + cos * n[:, 1]], axis=1)
    end = np.column_stack([radius * turned, p[:, 2] + arc * t[:, 2]])
    t_end = np.column_stack([-along * turned[:, 1], along * turned[:, 0], t[:, 2]])
    return arc, np.copysign(angle, sense), end, t_end


def closed_form_length(cylinder: bool, radius: float, a: Array, b: Array, side: int = 1) -> Array:
    """Return the length (T,) of the shortest string from a to b that passes the axis on the given side [m].

    side: +1 with the axis to the left of the path's direction, -1 to the right; a sphere has only one minimum. nan if
    an end point lies inside. Tangents and arc are in closed form (obstacle-set method, Garner & Pandy 2000).
    """
    ra, rb = _norm(_radial(a, cylinder)), _norm(_radial(b, cylinder))
    with np.errstate(invalid="ignore"):
        if cylinder:
            between = np.mod(
                side * (np.arctan2(b[:, 1], b[:, 0]) - np.arctan2(a[:, 1], a[:, 0])), 2.0 * np.pi
            )
        else:
            between = np.arctan2(_norm(np.cross(a, b)), _dot(a, b))
        arc = between - np.arccos(radius / ra) - np.arccos(radius / rb)
        plane = np.sqrt(ra**2 - radius**2) + np.sqrt(rb**2 - radius**2) + radius * arc
        height = b[:, 2] - a[:, 2] if cylinder else 0.0
        wrapped = np.hypot(plane, height)
    return np.where(arc < 0.0, _norm(b - a), wrapped)
