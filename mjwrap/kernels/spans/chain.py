"""Chains and motions: the spans between via points solved one after another, for one pose or for many.

A chain runs from its origin over obstacles and via points to its insertion. Via points divide it into spans, which do
not depend on each other.
"""

from __future__ import annotations

import math

import numpy as np

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import allocating, from_python, jit
from mjwrap.kernels.geometry.dispatch import is_surface_kind
from mjwrap.kernels.geometry.geodesics import displace
from mjwrap.kernels.spans.cold_start import path_length
from mjwrap.kernels.spans.end_inside import has_valid_length
from mjwrap.kernels.spans.saved_solutions import discard_invalid_solutions
from mjwrap.kernels.spans.span_solver import solve_span
from mjwrap.kernels.tangency.certify import is_local_minimum
from mjwrap.kernels.tangency.tangency_error import evaluate
from mjwrap.kernels.wraps.held_inside import solve_held_inside

KIND, POS, ROT = lay.KIND, lay.POS, lay.ROT
S_MODE, S_ARC = lay.S_MODE, lay.S_ARC
I_LENGTH, I_STATUS, I_ERROR = lay.I_LENGTH, lay.I_STATUS, lay.I_ERROR
I_ITERATIONS, I_EVALUATIONS = lay.I_ITERATIONS, lay.I_EVALUATIONS


@from_python
def solve_chain(lo, hi, ox, oy, oz, ix, iy, iz, node, tol, direct, info, row):
    """Find the path from (ox, oy, oz) to (ix, iy, iz) over nodes lo..hi; results go to info[row].

    Points in the world frame [m]. The rows hold the last evaluation relative to the first point. Never raises and never
    leaves NaN in `info`. Where no path is found the status says why. The length is then that of the substitute path
    where there is one (`end_inside.has_valid_length`), else that of the last iterate. For a span whose last iterate is
    not finite it is the straight distance; a span whose ends are not finite (NON_FINITE) is not counted.
    """
    total, square = 0.0, 0.0
    status, iterations, evaluations = lay.CONVERGED, 0, 0
    ax, ay, az = 0.0, 0.0, 0.0
    # the span start..k runs from A to B, both relative to the chain's origin
    start = lo
    strange = False  # whether the span has a surface of an unknown kind
    for k in range(lo, hi + 1):
        if k < hi and node[k, KIND] != lay.VIA:
            strange = strange or not is_surface_kind(node[k, KIND])
            continue
        if k < hi:
            bx, by, bz = node[k, POS] - ox, node[k, POS + 1] - oy, node[k, POS + 2] - oz
        else:
            bx, by, bz = ix - ox, iy - oy, iz - oz
        straight = math.sqrt((bx - ax) ** 2 + (by - ay) ** 2 + (bz - az) ** 2)
        if not math.isfinite(straight):
            status = lay.NON_FINITE
        elif start == k:
            total += straight
        elif strange:
            status = lay.UNKNOWN_SURFACE
            total += straight
            strange = False
        else:
            ends = (ox, oy, oz, ax, ay, az, bx, by, bz)
            if node[start, lay.INSIDE] > 0.0:
                code, part, error, i = solve_held_inside(start, ends, node, tol)
                e = i
            else:
                code, part, error, i, e = solve_span(start, k, ends, node, tol, direct)
            discard_invalid_solutions(start, k, node)
            if not math.isfinite(part):
                part, code = straight, lay.NOT_CONVERGED
            if not math.isfinite(error):
                error = 1e300
            # the first failure is reported; any other one replaces ENDPOINT_INSIDE, which may have a length
            if status == lay.CONVERGED or (status == lay.ENDPOINT_INSIDE and code != lay.CONVERGED):
                status = code
            total += part
            square += error * error
            iterations += i
            evaluations += e
        ax, ay, az = bx, by, bz
        start = k + 1
    info[row, I_LENGTH] = total
    info[row, I_STATUS] = status
    info[row, I_ERROR] = min(math.sqrt(square), 1e300)
    info[row, I_ITERATIONS] = iterations
    info[row, I_EVALUATIONS] = evaluations


@from_python
def evaluate_chain(lo, hi, ox, oy, oz, ix, iy, iz, node, info, row):
    """Evaluate the path that the rows hold, without changing it; length and tangency error go to info[row].

    The status is CONVERGED, or NOT_MINIMAL where a string would slip off; the caller checks the tangency error.
    """
    total, square = 0.0, 0.0
    status = lay.CONVERGED
    ax, ay, az = 0.0, 0.0, 0.0
    start = lo
    for k in range(lo, hi + 1):
        if k < hi and node[k, KIND] != lay.VIA:
            continue
        bx, by, bz = ix - ox, iy - oy, iz - oz
        if k < hi:
            bx, by, bz = node[k, POS] - ox, node[k, POS + 1] - oy, node[k, POS + 2] - oz
        ends = (ox, oy, oz, ax, ay, az, bx, by, bz)
        square += evaluate(start, k, ends, node)
        if not is_local_minimum(start, k, node):
            status = lay.NOT_MINIMAL
        total += path_length(start, k, ends, node)
        ax, ay, az = bx, by, bz
        start = k + 1
    info[row, I_LENGTH] = total
    info[row, I_ERROR] = math.sqrt(square)
    info[row, I_STATUS] = status


@from_python
def set_rotation(node, k, w, x, y, z):
    """Write R_WS of the quaternion (w, x, y, z), normalised first, to row k."""
    scale = 2.0 / (w * w + x * x + y * y + z * z)
    xx, yy, zz = scale * x * x, scale * y * y, scale * z * z
    xy, xz, yz = scale * x * y, scale * x * z, scale * y * z
    wx, wy, wz = scale * w * x, scale * w * y, scale * w * z
    node[k, ROT] = 1.0 - yy - zz
    node[k, ROT + 1] = xy - wz
    node[k, ROT + 2] = xz + wy
    node[k, ROT + 3] = xy + wz
    node[k, ROT + 4] = 1.0 - xx - zz
    node[k, ROT + 5] = yz - wx
    node[k, ROT + 6] = xz - wy
    node[k, ROT + 7] = yz + wx
    node[k, ROT + 8] = 1.0 - xx - yy


@jit
def extrapolate(node, before):
    """Extrapolate the solutions of the last two poses linearly where both touch; copy the last one to `before`.

    P, t and s change as they did from the last pose but one to the last; P and t are put back onto the surface.
    """
    for k in range(node.shape[0]):
        both = node[k, S_MODE] == lay.TOUCHED and before[k, 0] == lay.TOUCHED and node[k, lay.INSIDE] == 0.0
        for i in range(lay.STATE):
            last = node[k, S_MODE + i]
            if both and i > 1:
                node[k, S_MODE + i] = 2.0 * last - before[k, i]
            before[k, i] = last
        if both:
            # a displacement by nothing projects P to the surface and t to its tangent plane
            displace(k, 0.0, 0.0, 0.0, 0.0, node)
            # about to lift off: a negative extrapolated arc is not a start
            if not node[k, S_ARC] > 0.0:
                for i in range(lay.STATE):
                    node[k, S_MODE + i] = before[k, i]


@jit
def _was_restarted(node):
    """Return whether a span of the last solve needed another start than the one that it was given."""
    for k in range(node.shape[0]):
        if node[k, KIND] != lay.VIA and node[k, lay.W_RESTARTS] > 0.0:
            return True
    return False


@jit
def _return_to_previous_pose(node, before):
    """Restore the solution of the pose before."""
    for k in range(node.shape[0]):
        for i in range(lay.STATE):
            node[k, S_MODE + i] = before[k, i]


@jit
def _return_to_last_path(node, before, cold):
    """Restore the solution of the pose before, or make the next start a cold one; what is LOST stays so."""
    for k in range(node.shape[0]):
        if node[k, S_MODE] == lay.LOST:
            continue
        for i in range(lay.STATE):
            node[k, S_MODE + i] = before[k, i]
        if cold:
            node[k, S_MODE] = lay.COLD


@allocating
def solve_motion(origin, insertion, pos, quat, node, warm, tol, info):
    """Solve every pose of a motion: origin, insertion (T, 3), pos (T, n, 3), quat (T, n, 4); results in info (T, INFO).

    warm: each pose starts from the linear extrapolation of the two poses before; else each pose is a cold start.
    """
    n = node.shape[0]
    before = np.empty((n, lay.STATE))
    for k in range(n):
        before[k, 0] = lay.COLD
    for j in range(pos.shape[0]):
        for k in range(n):
            for i in range(3):
                node[k, POS + i] = pos[j, k, i]
            set_rotation(node, k, quat[j, k, 0], quat[j, k, 1], quat[j, k, 2], quat[j, k, 3])
            if not warm:
                node[k, S_MODE] = lay.COLD
        if warm:
            extrapolate(node, before)
        x, y, z = origin[j, 0], origin[j, 1], origin[j, 2]
        u, v, w = insertion[j, 0], insertion[j, 1], insertion[j, 2]
        solve_chain(0, n, x, y, z, u, v, w, node, tol, False, info, j)
        # the extrapolation may have led to another path: solve once more from the pose before
        if warm and j > 0 and _was_restarted(node):
            _return_to_previous_pose(node, before)
            solve_chain(0, n, x, y, z, u, v, w, node, tol, False, info, j)
        if warm and not has_valid_length(info[j, I_STATUS], info[j, I_ERROR]):
            # the next pose starts from the last one that was solved, or cold if an end was inside a surface
            _return_to_last_path(node, before, info[j, I_STATUS] == lay.ENDPOINT_INSIDE)
