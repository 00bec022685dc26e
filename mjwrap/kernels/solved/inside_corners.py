"""Sliding of the corner of a string that is held inside, as bodies move (`wraps/held_inside.py`, `hessian.py`).

With e, e' the unit vectors of the segments that meet at P, e - e' = -2 c n. If P is displaced by x = x1 t1 + x2 t2 on a
surface with curvatures k1, k2, the second variation of the length is that of

    |u + x|^2 / 2 L + |u' - x|^2 / 2 L' + c (k1 x1^2 + k2 x2^2) - 2 c w.(x x n)

with only the components perpendicular to e and e', u and u' the differences of the material velocities over the two
segments, and w the surface's angular velocity. The points before and behind the corner are fixed, so that x is the only
unknown: a 2 x 2 system.
"""

from __future__ import annotations

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import jit
from mjwrap.kernels.solved.path_points import (
    D_BEND,
    D_C,
    D_E,
    D_FIELD,
    D_L,
    D_NP,
    D_P,
    D_PIVOT,
    D_R,
    D_SLIDE,
    D_SLOT,
    D_T1,
    D_T2,
    D_U,
    dot,
)
from mjwrap.kernels.wraps.held_inside import normal

D_DEPTH = D_R  # cosine c of the angle of both segments with the normal
D_H11, D_H12, D_H22 = D_FIELD, D_PIVOT, D_C  # stiffness against sliding [1/m]
SHORTEST = 1e-150  # [m]


@jit
def list_corner(k, node, i, points):
    """Write normal, sliding directions and curvatures of the corner of node k, whose P is in row i of `points`."""
    nx, ny, nz = normal(k, points[i, D_P], points[i, D_P + 1], points[i, D_P + 2], node)
    # t1 around the axis: axis x n; on a sphere, whose curvatures are equal, any axis that is not parallel to n
    cylinder = node[k, lay.INSIDE] == lay.ABOUT_AXIS
    x, y, z = node[k, lay.ROT + 2], node[k, lay.ROT + 5], node[k, lay.ROT + 8]
    if not cylinder:
        x, y, z = 0.0, 0.0, 0.0
        if abs(nx) <= abs(ny) and abs(nx) <= abs(nz):
            x = 1.0
        elif abs(ny) <= abs(nz):
            y = 1.0
        else:
            z = 1.0
    tx, ty, tz = y * nz - z * ny, z * nx - x * nz, x * ny - y * nx
    over = 1.0 / (tx * tx + ty * ty + tz * tz) ** 0.5
    tx, ty, tz = tx * over, ty * over, tz * over
    points[i, D_NP], points[i, D_NP + 1], points[i, D_NP + 2] = nx, ny, nz
    points[i, D_T1], points[i, D_T1 + 1], points[i, D_T1 + 2] = tx, ty, tz
    points[i, D_T2] = ny * tz - nz * ty
    points[i, D_T2 + 1] = nz * tx - nx * tz
    points[i, D_T2 + 2] = nx * ty - ny * tx
    points[i, D_BEND] = 1.0 / node[k, lay.DIM]
    points[i, D_BEND + 1] = 0.0 if cylinder else points[i, D_BEND]


@jit
def stiffen_corner(i, points):
    """Write the stiffness against sliding of the corner at point i; return its determinant over (1/L + 1/L')^2."""
    # half the second variation, in x1 and x2: (1 - (e·t1)²)/L + (1 - (e'·t1)²)/L' + 2 c k1, and so on
    over, next_over = 1.0 / max(points[i, D_L], SHORTEST), 1.0 / max(points[i + 1, D_L], SHORTEST)
    c = 0.5 * (dot(points, i, D_NP, i + 1, D_E) - dot(points, i, D_NP, i, D_E))
    e1, e2 = dot(points, i, D_T1, i, D_E), dot(points, i, D_T2, i, D_E)
    g1, g2 = dot(points, i, D_T1, i + 1, D_E), dot(points, i, D_T2, i + 1, D_E)
    points[i, D_DEPTH] = c
    points[i, D_H11] = (1.0 - e1 * e1) * over + (1.0 - g1 * g1) * next_over + 2.0 * c * points[i, D_BEND]
    points[i, D_H12] = -e1 * e2 * over - g1 * g2 * next_over
    points[i, D_H22] = (1.0 - e2 * e2) * over + (1.0 - g2 * g2) * next_over + 2.0 * c * points[i, D_BEND + 1]
    return (points[i, D_H11] * points[i, D_H22] - points[i, D_H12] * points[i, D_H12]) / (
        over + next_over
    ) ** 2


@jit
def _driving_slope(i, direction, twist, points):
    """Return the right-hand side for sliding along one direction at the corner of point i."""
    near = dot(points, i, D_U, i, direction) - dot(points, i, D_U, i, D_E) * dot(points, i, direction, i, D_E)
    j = i + 1
    far = dot(points, j, D_U, i, direction) - dot(points, j, D_U, j, D_E) * dot(points, i, direction, j, D_E)
    # w·(t x n): rotation of the surface
    d, n, k = direction, D_NP, int(points[i, D_SLOT])
    turn = (
        twist[k, 3] * (points[i, d + 1] * points[i, n + 2] - points[i, d + 2] * points[i, n + 1])
        + twist[k, 4] * (points[i, d + 2] * points[i, n] - points[i, d] * points[i, n + 2])
        + twist[k, 5] * (points[i, d] * points[i, n + 1] - points[i, d + 1] * points[i, n])
    )
    return far / points[j, D_L] - near / points[i, D_L] + 2.0 * points[i, D_DEPTH] * turn


@jit
def slide_corner(i, twist, points):
    """Write the slide of the corner at point i as the poses move; D_U of both segments must be known."""
    a, b = _driving_slope(i, D_T1, twist, points), _driving_slope(i, D_T2, twist, points)
    over = 1.0 / (points[i, D_H11] * points[i, D_H22] - points[i, D_H12] * points[i, D_H12])
    x, y = (
        (a * points[i, D_H22] - b * points[i, D_H12]) * over,
        (b * points[i, D_H11] - a * points[i, D_H12]) * over,
    )
    for c in range(3):
        points[i, D_SLIDE + c] = x * points[i, D_T1 + c] + y * points[i, D_T2 + c]


@jit
def turn_corner(i, points, out):
    """Add to out[slot of point i] the moment of the slide of its corner: slide x (e - e')."""
    k, j = int(points[i, D_SLOT]), i + 1
    x, y, z = points[i, D_SLIDE], points[i, D_SLIDE + 1], points[i, D_SLIDE + 2]
    ex, ey, ez = (
        points[i, D_E] - points[j, D_E],
        points[i, D_E + 1] - points[j, D_E + 1],
        points[i, D_E + 2] - points[j, D_E + 2],
    )
    out[k, 3] += y * ez - z * ey
    out[k, 4] += z * ex - x * ez
    out[k, 5] += x * ey - y * ex
