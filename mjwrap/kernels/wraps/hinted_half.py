"""Where the hint of a surface without a closed form asks a string to pass, and whether a contact or a segment does."""

from __future__ import annotations

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import jit
from mjwrap.kernels.geometry.dispatch import height, project
from mjwrap.kernels.geometry.projection import turn_into_frame
from mjwrap.kernels.geometry.traits import hollow
from mjwrap.kernels.wraps.sides import middle_of_contact, on_allowed_half

HINT, S_P = lay.HINT, lay.S_P
W_P, W_Q = lay.W_P, lay.W_Q


@jit
def _is_towards(k, node, fx, fy, fz, wx, wy, wz):
    """Return whether the contact of the last evaluation lies in the direction w from the point F, in S."""
    x, y, z = (
        node[k, W_Q] - node[k, W_P],
        node[k, W_Q + 1] - node[k, W_P + 1],
        node[k, W_Q + 2] - node[k, W_P + 2],
    )
    x, y, z = turn_into_frame(node, k, x, y, z)
    # half way from P to Q
    x, y, z = node[k, S_P] + 0.5 * x - fx, node[k, S_P + 1] + 0.5 * y - fy, node[k, S_P + 2] + 0.5 * z - fz
    return x * wx + y * wy + z * wz >= 0.0


@jit
def is_there(k, ends, node, held, fx, fy, fz, wx, wy, wz):
    """Return whether the contact of the last evaluation lies where row k's hint asks.

    held: on the half that a side allows at every pose, else in the direction w from the point F, in S.
    """
    if held:
        x, y, z = middle_of_contact(k, ends, node)
        return on_allowed_half(k, node, x, y, z)
    return hollow(k, node) or _is_towards(k, node, fx, fy, fz, wx, wy, wz)


@jit
def hint_outside(k, node):
    """Return row k's hint, or the surface point nearest to it where it lies inside the surface."""
    x, y, z = node[k, HINT + 1], node[k, HINT + 2], node[k, HINT + 3]
    if height(node, k, x, y, z) < 0.0:
        x, y, z, _, _, _ = project(node, k, x, y, z)
    return x, y, z


@jit
def hint_is_behind(k, node, share, ax, ay, az, dx, dy, dz):
    """Return whether the hint lies behind row k's surface, seen from the lowest point F of the segment A + share d.

    It is beyond the tangent plane of the surface at the point nearest to F, and the surface between F and the hint.
    """
    x, y, z = node[k, HINT + 1], node[k, HINT + 2], node[k, HINT + 3]
    fx, fy, fz = ax + share * dx, ay + share * dy, az + share * dz
    px, py, pz, nx, ny, nz = project(node, k, fx, fy, fz)
    if nx * (x - px) + ny * (y - py) + nz * (z - pz) >= 0.0:
        return False
    _, _, _, nx, ny, nz = project(node, k, x, y, z)
    return nx * (x - fx) + ny * (y - fy) + nz * (z - fz) > 0.0


@jit
def straight_is_refused(k, node, held, share, ax, ay, az, dx, dy, dz):
    """Return whether the straight segment A + d, which is clear, passes row k's surface where its hint does not ask.

    held: the hint is a side that holds at every pose. share: of the segment's lowest point.
    """
    if held:
        return not on_allowed_half(k, node, ax + share * dx, ay + share * dy, az + share * dz)
    return hint_is_behind(k, node, share, ax, ay, az, dx, dy, dz)
