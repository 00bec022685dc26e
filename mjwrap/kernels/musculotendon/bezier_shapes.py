"""Corners of the four curves of Millard et al. 2013 (doi 10.1115/1.4023390) from the parameters that OpenSim has.

The parameters of each function are those of OpenSim's curve of that name, in its order; `millard_numbers.py` has their
defaults.
"""

from __future__ import annotations

from mjwrap.kernels.musculotendon import bezier


def active(
    shortest: float,
    transition: float,
    longest: float,
    shallow: float,
    least: float,
) -> bezier.Array:
    """Return the corners of ActiveForceLengthCurve: one at optimal fibre length, `least` at both ends and beyond.

    shortest, transition, longest [l_o]: ends of the steep and of the shallow ascending limb, end of the curve; shallow:
    slope of the shallow limb.
    """
    x0, x1, x2, x3 = shortest, transition, 1.0, longest
    wide = 0.05 * x2  # half the plateau
    y1 = 1.0 - shallow * (x2 - wide - x1)
    rise = 1.25 * y1 / (x1 - x0)
    low, high = x0 + 0.5 * (x1 - x0), x1 + 0.5 * (x2 - wide - x1)
    y_high = y1 + 0.5 * (1.0 - y1)
    fall, middle = -1.0 / ((x3 - wide) - (x2 + wide)), 0.5 * (x2 + wide + x3)
    ends = [
        (x0, least, 0.0, low, 0.5 * y1, rise),
        (low, 0.5 * y1, rise, high, y_high, shallow),
        (high, y_high, shallow, x2, 1.0, 0.0),
        (x2, 1.0, 0.0, middle, 0.5, fall),
        (middle, 0.5, fall, x3, least, 0.0),
    ]
    return bezier.corners(ends, [1.0] * 5)


def velocity(
    at_least: float,
    near_least: float,
    isometric: float,
    at_most: float,
    near_most: float,
    most: float,
    concentric_curviness: float,
    eccentric_curviness: float,
) -> bezier.Array:
    """Return the corners of ForceVelocityCurve, from -1 to 1 [v_max l_o]: zero at -1, one at rest, `most` at 1.

    The other parameters are slopes at -1, at -0.9, at rest, at 1 and at 0.9, and how sharp the corners are.
    """
    short = 0.5 * near_least * 0.1 + 0.5 * at_least * 0.1
    long = most - 0.5 * near_most * 0.1 - 0.5 * at_most * 0.1
    ends = [
        (-1.0, 0.0, at_least, -0.9, short, near_least),
        (-0.9, short, near_least, 0.0, 1.0, isometric),
        (0.0, 1.0, isometric, 0.9, long, near_most),
        (0.9, long, near_most, 1.0, most, at_most),
    ]
    concentric, eccentric = concentric_curviness, eccentric_curviness
    return bezier.corners(ends, [concentric, concentric, eccentric, eccentric])


def passive(
    zero: float,
    strain: float,
    low: float,
    high: float,
    curviness: float,
) -> bezier.Array:
    """Return the corners of FiberForceLengthCurve: zero up to the strain `zero`, one at `strain`.

    low, high: stiffness after the first corner, and at `strain`.
    """
    toe = min(0.1 / high, 0.1 * (strain - zero))
    start = 1.0 + zero
    y = low * 0.5 * toe
    ends = [(start, 0.0, 0.0, start + toe, y, low), (start + toe, y, low, 1.0 + strain, 1.0, high)]
    return bezier.corners(ends, [curviness, curviness])


def tendon(strain: float, stiffness: float, toe: float, curviness: float) -> bezier.Array:
    """Return the corners of TendonForceLengthCurve: zero without strain, one at `strain`, straight above force `toe`.

    stiffness: of the straight part.
    """
    x_toe = 1.0 + strain + (toe - 1.0) / stiffness
    x_middle = 1.0 + strain + (0.5 * toe - 1.0) / stiffness
    x_start = 1.0 + (x_toe - 1.0) / 10.0
    slope = 0.5 * toe / (x_middle - x_start)
    x = x_start + 0.5 * (x_middle - x_start)
    y = slope * (x - x_start)
    ends = [(1.0, 0.0, 0.0, x, y, slope), (x, y, slope, x_toe, toe, stiffness)]
    return bezier.corners(ends, [curviness, curviness])
