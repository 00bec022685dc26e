"""How the corner of a string that is held inside slides when bodies move (`inside.py`, `derivatives.py`).

With e, e' the segments that meet at P, e - e' = -2 c n. Where P is displaced by x = x1 t1 + x2 t2 on a surface with
curvatures k1, k2 the length's second variation is that of

    |u + x|^2 / 2 L + |u' - x|^2 / 2 L' + c (k1 x1^2 + k2 x2^2) - 2 c w.(x x n)

(only components across e and e' count), u, u' the differences of the material velocities over the two segments and w
the surface's angular velocity. The corner stands between fixed stops, so that x is all that is free: 2 x 2.
"""

from __future__ import annotations

from mjwrap.kernels import layout as lay
from mjwrap.kernels._jit import jit
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
def list_corner(k, node, i, stop):
    """Write normal, directions of sliding and curvatures at the corner of node k, whose P stands in stop i."""
    nx, ny, nz = normal(k, stop[i, D_P], stop[i, D_P + 1], stop[i, D_P + 2], node)
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
    stop[i, D_NP], stop[i, D_NP + 1], stop[i, D_NP + 2] = nx, ny, nz
    stop[i, D_T1], stop[i, D_T1 + 1], stop[i, D_T1 + 2] = tx, ty, tz
    stop[i, D_T2] = ny * tz - nz * ty
    stop[i, D_T2 + 1] = nz * tx - nx * tz
    stop[i, D_T2 + 2] = nx * ty - ny * tx
    stop[i, D_BEND] = 1.0 / node[k, lay.DIM]
    stop[i, D_BEND + 1] = 0.0 if cylinder else stop[i, D_BEND]


@jit
def stiffen_corner(i, stop):
    """Write the stiffness against sliding of the corner at stop i; return its determinant over that of its segments."""
    over, next_over = 1.0 / max(stop[i, D_L], SHORTEST), 1.0 / max(stop[i + 1, D_L], SHORTEST)
    c = 0.5 * (dot(stop, i, D_NP, i + 1, D_E) - dot(stop, i, D_NP, i, D_E))
    e1, e2 = dot(stop, i, D_T1, i, D_E), dot(stop, i, D_T2, i, D_E)
    g1, g2 = dot(stop, i, D_T1, i + 1, D_E), dot(stop, i, D_T2, i + 1, D_E)
    stop[i, D_DEPTH] = c
    stop[i, D_H11] = (1.0 - e1 * e1) * over + (1.0 - g1 * g1) * next_over + 2.0 * c * stop[i, D_BEND]
    stop[i, D_H12] = -e1 * e2 * over - g1 * g2 * next_over
    stop[i, D_H22] = (1.0 - e2 * e2) * over + (1.0 - g2 * g2) * next_over + 2.0 * c * stop[i, D_BEND + 1]
    return (stop[i, D_H11] * stop[i, D_H22] - stop[i, D_H12] * stop[i, D_H12]) / (over + next_over) ** 2


@jit
def _slope(i, direction, twist, stop):
    """Return what drives the corner at stop i along one of its directions."""
    near = dot(stop, i, D_U, i, direction) - dot(stop, i, D_U, i, D_E) * dot(stop, i, direction, i, D_E)
    j = i + 1
    far = dot(stop, j, D_U, i, direction) - dot(stop, j, D_U, j, D_E) * dot(stop, i, direction, j, D_E)
    d, n, k = direction, D_NP, int(stop[i, D_SLOT])
    turn = (
        twist[k, 3] * (stop[i, d + 1] * stop[i, n + 2] - stop[i, d + 2] * stop[i, n + 1])
        + twist[k, 4] * (stop[i, d + 2] * stop[i, n] - stop[i, d] * stop[i, n + 2])
        + twist[k, 5] * (stop[i, d] * stop[i, n + 1] - stop[i, d + 1] * stop[i, n])
    )
    return far / stop[j, D_L] - near / stop[i, D_L] + 2.0 * stop[i, D_DEPTH] * turn


@jit
def slide_corner(i, twist, stop):
    """Write how the corner at stop i slides as the poses move; D_U of both segments is known."""
    a, b = _slope(i, D_T1, twist, stop), _slope(i, D_T2, twist, stop)
    over = 1.0 / (stop[i, D_H11] * stop[i, D_H22] - stop[i, D_H12] * stop[i, D_H12])
    x, y = (a * stop[i, D_H22] - b * stop[i, D_H12]) * over, (b * stop[i, D_H11] - a * stop[i, D_H12]) * over
    for c in range(3):
        stop[i, D_SLIDE + c] = x * stop[i, D_T1 + c] + y * stop[i, D_T2 + c]


@jit
def turn_corner(i, stop, out):
    """Add to out[slot of stop i] the moment that its corner's slide makes: slide x (e - e')."""
    k, j = int(stop[i, D_SLOT]), i + 1
    x, y, z = stop[i, D_SLIDE], stop[i, D_SLIDE + 1], stop[i, D_SLIDE + 2]
    ex, ey, ez = (
        stop[i, D_E] - stop[j, D_E],
        stop[i, D_E + 1] - stop[j, D_E + 1],
        stop[i, D_E + 2] - stop[j, D_E + 2],
    )
    out[k, 3] += y * ez - z * ey
    out[k, 4] += z * ex - x * ez
    out[k, 5] += x * ey - y * ex
