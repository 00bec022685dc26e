"""Velocities of the contact points of a solved path, and rates of its arc lengths, as bodies move.

A contact point moves with its body, slides along t as the rows e.n = 0 of the tangency conditions demand, and shifts
along b; `hessian.py` computes the shifts ("Stiffness and sliding contacts" in docs/derivation.md).
"""

from __future__ import annotations

from mjwrap.kernels.compilation.jit import from_python, jit
from mjwrap.kernels.solved.hessian import FLAT, NO_FAULT, sideways_shifts
from mjwrap.kernels.solved.path_points import (
    CORNER,
    D_BP,
    D_BQ,
    D_E,
    D_KP,
    D_KQ,
    D_NP,
    D_NQ,
    D_P,
    D_Q,
    D_RATE,
    D_ROW,
    D_SLIDE,
    D_SLOT,
    D_TOUCHED,
    D_X,
    D_Y,
    FIXED,
    angular_velocity_along,
    dot,
)  # fmt: skip

FLATTEST = 1e-12  # smallest normal curvature at a contact, divided by the reciprocal of the surface's size


@from_python
def contact_rates(count, twist, size, points, out):
    """Write velocity of P (3), of Q (3) and rate of s of every touched node to out (nodes, 7); return (fault, slot).

    The velocities are those of the geometric points, motion with the body plus sliding; world frame [m/s]. size
    (nodes,): sizes of the surfaces [m], relative to which a curvature counts as zero (FLAT).
    """
    sideways_shifts(count, twist, points)
    for i in range(1, count):
        if points[i, D_TOUCHED] == FIXED:
            continue
        k = int(points[i, D_ROW])
        if points[i, D_TOUCHED] == CORNER:
            for column in (0, 3):
                _body_velocity(i, D_P, twist, points, out, column)
                for c in range(3):
                    out[k, column + c] += points[i, D_SLIDE + c]
            out[k, 6] = 0.0
            continue
        # rows e·n = 0:  ė·n - ω·b + κ slide + τ shift = 0, at P and at Q
        least = FLATTEST / size[k]
        if not (abs(points[i, D_KP]) > least and abs(points[i, D_KQ]) > least):
            return FLAT, int(points[i, D_SLOT])
        slide = dot(points, i, D_RATE, i, D_NP) - angular_velocity_along(i, D_BP, twist, points)
        slide = -(slide + points[i, D_KP + 1] * points[i, D_X]) / points[i, D_KP]
        _contact_velocity(i, D_P, i, slide, points[i, D_X], D_BP, twist, points, out, 0)
        slide_q = dot(points, i + 1, D_RATE, i, D_NQ) - angular_velocity_along(i, D_BQ, twist, points)
        slide_q = -(slide_q + points[i, D_KQ + 1] * points[i, D_Y]) / points[i, D_KQ]
        _contact_velocity(i, D_Q, i + 1, slide_q, points[i, D_Y], D_BQ, twist, points, out, 3)
        out[k, 6] = slide_q - slide
    return NO_FAULT, 0


@jit
def _body_velocity(i, arm, twist, points, out, column):
    """Write the velocity of the material point at `arm` from the pose's origin, on the body of point i."""
    k = int(points[i, D_SLOT])
    x, y, z = points[i, arm], points[i, arm + 1], points[i, arm + 2]
    row = int(points[i, D_ROW])
    out[row, column] = twist[k, 0] + twist[k, 4] * z - twist[k, 5] * y
    out[row, column + 1] = twist[k, 1] + twist[k, 5] * x - twist[k, 3] * z
    out[row, column + 2] = twist[k, 2] + twist[k, 3] * y - twist[k, 4] * x


@jit
def _contact_velocity(i, arm, j, slide, sideways, binormal, twist, points, out, column):
    """Write the velocity of a contact point of point i: body, slide along e of point j, and shift along b."""
    row = int(points[i, D_ROW])
    _body_velocity(i, arm, twist, points, out, column)
    for c in range(3):
        out[row, column + c] += slide * points[j, D_E + c] + sideways * points[i, binormal + c]
