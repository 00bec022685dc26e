"""Wraps without a closed form: first guesses in half planes through A and B, polished by Newton's method.

A taut string between A and B that touches a surface runs near a plane through A and B. In a half plane that is bounded by the
line AB the surface has a section, and the shortest way over that section is the convex hull over its upper boundary:
a guess that is right to the sampling of the boundary, for any surface that has a height. Half planes all round AB
give guesses for every side; Newton's method makes paths of them, the certificate sorts out what no string would hold.

Around a torus the side is topological, as around a cylinder: the angle that the string sweeps about the middle of the tube.
Bounded convex surfaces have no such number: there the path keeps to the minimum that it is on.
"""

from __future__ import annotations

import math

import numpy as np
from numba import carray

from mjwrap.kernels import layout as lay
from mjwrap.kernels._jit import jit
from mjwrap.kernels.certify import minimal, swept
from mjwrap.kernels.clearance import bounding_radius, dip, tube_angle, tube_crossing
from mjwrap.kernels.frames import unit
from mjwrap.kernels.geodesics import geodesic
from mjwrap.kernels.newton import newton
from mjwrap.kernels.ruled import A_INSIDE, B_INSIDE, INSIDE, follow, set_free
from mjwrap.kernels.shape import height, into_frame, project, turn_into_frame
from mjwrap.kernels.stoermer import stack

KIND, DIM, SIZE, POS, ROT, HINT = lay.KIND, lay.DIM, lay.SIZE, lay.POS, lay.ROT, lay.HINT
S_MODE, S_SWEEP, S_P, S_T, S_ARC = lay.S_MODE, lay.S_SWEEP, lay.S_P, lay.S_T, lay.S_ARC
W_P, W_Q = lay.W_P, lay.W_Q
COLD, FREE, TOUCHED = lay.COLD, lay.FREE, lay.TOUCHED

DIRECTIONS = 12  # half planes around AB
COLUMNS = 14  # samples of a section's upper boundary
EVEN = 1e-4  # to which a section's boundary is found, in the surface's size
LIFTS = 3  # corrections where the way over a section meets more of it
BRIDGE = 0.1  # a string that stands off the surface so high, in its size, between two columns bridges a hollow
MARCH = 60  # steps to a section's boundary
LOCAL_TOL = 1e-5  # tangency error of a single wrap: all of them are polished together
LOCAL_STEPS = 15
DEPTH = 1e-10  # a segment that dips less below a surface, in its size, is clear of it
GAUSS, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(5)  # of an arc of an ellipse, for a guess
SAME_BRANCH = 1.0  # difference of swept angles [rad] that is no whole turn


@jit
def _climb(node, k, x, y, z, wx, wy, wz, start):
    """Return how far along w the surface is left, from a start inside it (x, y, z: the column's foot)."""
    lo = start
    step = 0.05 * node[k, SIZE]
    h = height(node, k, x + lo * wx, y + lo * wy, z + lo * wz)
    hi = lo
    for _ in range(MARCH):
        hi = lo + max(-h, step)
        h = height(node, k, x + hi * wx, y + hi * wy, z + hi * wz)
        if h >= 0.0:
            break
        lo = hi
        step *= 1.2
    low = height(node, k, x + lo * wx, y + lo * wy, z + lo * wz)
    for _ in range(8):  # regula falsi, the Illinois way
        if h <= EVEN * node[k, SIZE]:
            break
        middle = (lo * h - hi * low) / (h - low)
        g = height(node, k, x + middle * wx, y + middle * wy, z + middle * wz)
        if g >= 0.0:
            hi, h = middle, g
            low *= 0.5
        else:
            lo, low = middle, g
            h *= 0.5
    return hi


@jit
def _hull(count, size, first, step, top, chain):
    """Write the indices of the columns on the upper convex hull between (0, 0) and (size, 0) to chain; return how many."""
    m = 0
    for i in range(count + 1):
        x, y = first + i * step, 0.0
        if i < count:
            y = top[i]
            if y <= 0.0 or x <= 0.0 or x >= size:
                continue
        else:
            x = size
        while m > 0:
            j = int(chain[m - 1])
            jx, jy = first + j * step, top[j]
            ox, oy = 0.0, 0.0
            if m > 1:
                o = int(chain[m - 2])
                ox, oy = first + o * step, top[o]
            if (jx - ox) * (y - oy) - (jy - oy) * (x - ox) < 0.0:
                break
            m -= 1
        if i < count:
            chain[m] = i
            m += 1
    return m


@jit
def _over_section(k, node, ax, ay, az, ux, uy, uz, wx, wy, wz, size, first, step, top, chain):
    """Sample the section at COLUMNS columns and pull a string over it; return the number of the hull's columns."""
    for i in range(COLUMNS):
        x = first + i * step
        px, py, pz = ax + x * ux, ay + x * uy, az + x * uz
        top[i] = -1.0
        if 0.0 < x < size and height(node, k, px, py, pz) < 0.0:
            top[i] = _climb(node, k, px, py, pz, wx, wy, wz, 0.0)
    m = _hull(COLUMNS, size, first, step, top, chain)
    for _ in range(LIFTS):
        lifted = False
        j = 0
        for i in range(COLUMNS):
            x = first + i * step
            while j < m and chain[j] < i:
                j += 1
            if (j < m and chain[j] == i) or not 0.0 < x < size or m == 0:
                continue
            lx, ly, rx, ry = 0.0, 0.0, size, 0.0
            if j > 0:
                lx, ly = first + chain[j - 1] * step, top[int(chain[j - 1])]
            if j < m:
                rx, ry = first + chain[j] * step, top[int(chain[j])]
            y = ly + (ry - ly) * (x - lx) / (rx - lx)
            px, py, pz = ax + x * ux, ay + x * uy, az + x * uz
            if height(node, k, px + y * wx, py + y * wy, pz + y * wz) < -1e-6 * node[k, SIZE]:
                top[i] = _climb(node, k, px, py, pz, wx, wy, wz, y)
                lifted = True
        if not lifted:
            break
        m = _hull(COLUMNS, size, first, step, top, chain)
    return m


@jit
def _guess_on_ellipsoid(k, node, ax, ay, az, ux, uy, uz, wx, wy, wz, size):
    """Do what `_guess` does in closed form: in the image in which the ellipsoid is a sphere the section is a circle."""
    a, b, c = node[k, DIM], node[k, DIM + 1], node[k, DIM + 2]
    px, py, pz = ax / a, ay / b, az / c
    dx, dy, dz = size * ux / a, size * uy / b, size * uz / c
    vx, vy, vz = wx / a, wy / b, wz / c
    inverse = 1.0 / (dx * dx + dy * dy + dz * dz)
    along = (vx * dx + vy * dy + vz * dz) * inverse
    vx, vy, vz = unit(vx - along * dx, vy - along * dy, vz - along * dz)  # at right angles to AB in the plane
    scale = math.sqrt(inverse)
    dx, dy, dz = dx * scale, dy * scale, dz * scale
    x, y = -(px * dx + py * dy + pz * dz), -(px * vx + py * vy + pz * vz)  # the centre, seen from A
    square = 1.0 - max(px * px + py * py + pz * pz - x * x - y * y, 0.0)
    if square <= 0.0:
        return False
    radius, far = math.sqrt(square), 1.0 / scale  # of the circle; distance of A and B
    root_a = math.sqrt(max(x * x + y * y - square, 0.0))
    root_b = math.sqrt(max((far - x) ** 2 + y * y - square, 0.0))
    # directions of the normals at P and Q, as angles: tangents from A and B that pass over the circle
    start = math.atan2(-y, -x) - math.atan2(root_a, radius)
    stop = math.atan2(-y, far - x) + math.atan2(root_b, radius)
    arc = start - stop
    if arc > math.pi * 1.5:
        arc -= 2.0 * math.pi
    elif arc < -math.pi * 0.5:
        arc += 2.0 * math.pi
    arc = max(arc, 0.0)
    total = 0.0
    for i in range(GAUSS.shape[0]):
        g = start - 0.5 * arc * (1.0 + GAUSS[i])
        f, e = math.sin(g), -math.cos(g)
        total += GAUSS_WEIGHTS[i] * math.sqrt(
            (a * (f * dx + e * vx)) ** 2 + (b * (f * dy + e * vy)) ** 2 + (c * (f * dz + e * vz)) ** 2
        )
    x, y = x + radius * math.cos(start), y + radius * math.sin(start)
    tx, ty, tz = a * (x * dx + y * vx), b * (x * dy + y * vy), c * (x * dz + y * vz)
    _place(k, node, ax + tx, ay + ty, az + tz, tx, ty, tz, 0.5 * arc * radius * total)
    return True


@jit
def _guess(k, node, ax, ay, az, ux, uy, uz, wx, wy, wz, size, deepest):
    """Write a first guess for the string over the section with the half plane towards w; return whether there is one.

    u: unit vector from A to B, `size` apart; deepest: distance from A at which AB is lowest.
    """
    if node[k, KIND] == lay.ELLIPSOID:
        return _guess_on_ellipsoid(k, node, ax, ay, az, ux, uy, uz, wx, wy, wz, size)
    memory = carray(stack(), (80,))
    top, chain = memory[0:COLUMNS], memory[COLUMNS : 2 * COLUMNS]
    lo, hi = 0.0, size
    reach = bounding_radius(node, k)
    if reach < math.inf:
        centre = -(ax * ux + ay * uy + az * uz)
        lo, hi = max(lo, centre - reach), min(hi, centre + reach)
    m = 0
    first, step = 0.0, 0.0
    for _ in range(2):
        if not hi > lo:
            return False
        step = (hi - lo) / (COLUMNS - 2)
        first = deepest - step * math.ceil((deepest - lo) / step)  # one column stands at the deepest point
        m = _over_section(k, node, ax, ay, az, ux, uy, uz, wx, wy, wz, size, first, step, top, chain)
        if m == 0:
            return False
        lo, hi = first + (chain[0] - 1) * step, first + (chain[m - 1] + 1) * step
        deepest = first + chain[0] * step
    start, stop = 0, m  # the part of the hull that lies on the surface: a string bridges a hollow
    for j in range(1, m):
        i, o = int(chain[j]), int(chain[j - 1])
        x, y = first + 0.5 * (i + o) * step, 0.5 * (top[i] + top[o])
        px, py, pz = ax + x * ux + y * wx, ay + x * uy + y * wy, az + x * uz + y * wz
        if i - o > 2 and height(node, k, px, py, pz) > BRIDGE * node[k, SIZE]:
            if node[k, lay.TWIN] == 0.0:
                stop = j
                break
            start = j
    arc = 0.0
    for j in range(start + 1, stop):
        i, o = int(chain[j]), int(chain[j - 1])
        arc += math.hypot((i - o) * step, top[i] - top[o])
    x, y = first + chain[start] * step, top[int(chain[start])]
    _place(
        k, node, ax + x * ux + y * wx, ay + x * uy + y * wy, az + x * uz + y * wz,
        x * ux + y * wx, x * uy + y * wy, x * uz + y * wz, arc,
    )  # fmt: skip
    return True


@jit
def _place(k, node, x, y, z, tx, ty, tz, arc):
    """Start obstacle k's geodesic at the surface point next to (x, y, z), along t as far as it is tangent."""
    x, y, z, nx, ny, nz = project(node, k, x, y, z)
    along = tx * nx + ty * ny + tz * nz
    tx, ty, tz = tx - along * nx, ty - along * ny, tz - along * nz
    size = math.sqrt(tx * tx + ty * ty + tz * tz)
    if size < 1e-12 * node[k, SIZE]:
        tx, ty, tz = across(nx, ny, nz)
        size = 1.0
    node[k, S_MODE] = TOUCHED
    node[k, S_P] = x
    node[k, S_P + 1] = y
    node[k, S_P + 2] = z
    node[k, S_T] = tx / size
    node[k, S_T + 1] = ty / size
    node[k, S_T + 2] = tz / size
    node[k, S_ARC] = arc


@jit
def across(x, y, z):
    """Return a unit vector at right angles to a unit vector."""
    if abs(x) <= abs(y) and abs(x) <= abs(z):
        x, y, z = 0.0, z, -y
    elif abs(y) <= abs(z):
        x, y, z = -z, 0.0, x
    else:
        x, y, z = y, -x, 0.0
    size = math.sqrt(x * x + y * y + z * z)
    return x / size, y / size, z / size


@jit
def _polish(k, ends, node):
    """Run Newton's method on obstacle k alone; return whether a string would hold there, and its length."""
    error, _, _ = newton(k, k + 1, ends, node, LOCAL_TOL, LOCAL_STEPS, -1.0)
    node[k, lay.W_FRESH] = error * error
    if not (error <= LOCAL_TOL and node[k, S_ARC] >= 0.0 and minimal(k, k + 1, node)):
        return False, 0.0
    return True, node[k, lay.W_L] + node[k, S_ARC] + node[k, lay.W_LQ]


@jit
def _clamped(k, node, ends, column):
    """Return an end of the string, moved onto the surface where it lies inside, in S and relative to the base."""
    x, y, z = node[k, POS] - ends[0], node[k, POS + 1] - ends[1], node[k, POS + 2] - ends[2]
    px, py, pz = turn_into_frame(node, k, ends[column] - x, ends[column + 1] - y, ends[column + 2] - z)
    if height(node, k, px, py, pz) >= (INSIDE - 1.0) * node[k, SIZE]:
        return False, px, py, pz, ends[column], ends[column + 1], ends[column + 2]
    px, py, pz, _, _, _ = project(node, k, px, py, pz)
    return (
        True, px, py, pz,
        x + node[k, ROT] * px + node[k, ROT + 1] * py + node[k, ROT + 2] * pz,
        y + node[k, ROT + 3] * px + node[k, ROT + 4] * py + node[k, ROT + 5] * pz,
        z + node[k, ROT + 6] * px + node[k, ROT + 7] * py + node[k, ROT + 8] * pz,
    )  # fmt: skip


@jit
def _straight_sweep(k, node, ax, ay, az, bx, by, bz):
    """Return the angle that the straight segment sweeps about the middle of a torus' tube [rad]."""
    major = node[k, DIM]
    turns = tube_crossing(major, ax, ay, az, bx, by, bz)
    return tube_angle(major, bx, by, bz) - tube_angle(major, ax, ay, az) + 2.0 * math.pi * turns


@jit
def _on_branch(k, node, known, before):
    """Return whether the path of the last evaluation goes round the tube as it did before."""
    if not known:
        return True
    angle = swept(k, node)
    return abs(angle - follow(angle, before)) < SAME_BRANCH


@jit
def _caught(k, ends, node, mode, x, y, z, dx, dy, dz):
    """Return whether a string that is free now hangs on the surface, because that was pulled through it since.

    S_P and S_T hold the surface point next to a free string (x, y, z: its lowest point), and the normal there. Where the
    normal has turned by more than a right angle the surface has changed sides: if a string can hold on the side
    on which it was, it does. Long surfaces catch it, round ones slip through.
    """
    px, py, pz, nx, ny, nz = project(node, k, x, y, z)
    if mode == FREE and nx * node[k, S_T] + ny * node[k, S_T + 1] + nz * node[k, S_T + 2] < 0.0:
        _place(k, node, node[k, S_P], node[k, S_P + 1], node[k, S_P + 2], dx, dy, dz, 0.0)
        good, _ = _polish(k, ends, node)
        if good:
            node[k, S_SWEEP] = 0.0
            return True
    node[k, S_P] = px
    node[k, S_P + 1] = py
    node[k, S_P + 2] = pz
    node[k, S_T] = nx
    node[k, S_T + 1] = ny
    node[k, S_T + 2] = nz
    return False


@jit
def wrap_searched(k, ends, node, search):
    """Wrap the string from A to B over obstacle k; `ends` as for `solve_span`. Returns A_INSIDE and B_INSIDE summed.

    Without `search` a contact that Newton's method does not find again stays where it was.
    """
    in_a, ax, ay, az, qx, qy, qz = _clamped(k, node, ends, 3)
    in_b, bx, by, bz, rx, ry, rz = _clamped(k, node, ends, 6)
    inside = (A_INSIDE if in_a else 0) + (B_INSIDE if in_b else 0)
    ends = (ends[0], ends[1], ends[2], qx, qy, qz, rx, ry, rz)
    mode, before = node[k, S_MODE], node[k, S_SWEEP]
    winds = node[k, KIND] == lay.TORUS and node[k, lay.TWIN] == 0.0
    branch = winds and mode != COLD
    if mode == TOUCHED:
        for i in range(lay.STATE):
            node[k, lay.W_LAST + i] = node[k, S_MODE + i]
        good, _ = _polish(k, ends, node)
        if good and _on_branch(k, node, branch, before):
            node[k, S_SWEEP] = swept(k, node) if winds else 0.0
            return inside
    dx, dy, dz = bx - ax, by - ay, bz - az
    size = math.sqrt(dx * dx + dy * dy + dz * dz)
    low, share = dip(node, k, ax, ay, az, bx, by, bz)
    straight = _straight_sweep(k, node, ax, ay, az, bx, by, bz) if winds else 0.0
    hooked = branch and abs(straight - follow(straight, before)) > SAME_BRANCH
    hinted = mode == COLD and node[k, HINT] > 0.0
    if low >= -DEPTH * node[k, SIZE] and not hooked:
        if hinted and node[k, KIND] >= lay.TORUS and node[k, KIND] != lay.CAPSULE:
            _place(k, node, node[k, HINT + 1], node[k, HINT + 2], node[k, HINT + 3], dx, dy, dz, 0.0)
            good, _ = _polish(k, ends, node)
            if good:
                node[k, S_SWEEP] = swept(k, node) if winds else 0.0
                return inside
        keeps = node[k, KIND] == lay.ELLIPSOID or node[k, KIND] == lay.CAPSULE
        if keeps and _caught(k, ends, node, mode, ax + share * dx, ay + share * dy, az + share * dz, dx, dy, dz):
            return inside
        set_free(node, k, straight)
        return inside
    if mode == TOUCHED and not search:
        for i in range(lay.STATE):
            node[k, S_MODE + i] = node[k, lay.W_LAST + i]
        geodesic(k, node, ends[0], ends[1], ends[2])
        return inside
    _search(k, ends, node, ax, ay, az, dx, dy, dz, size, share, hinted, mode == COLD, branch, before)
    return inside


@jit
def _search(k, ends, node, ax, ay, az, dx, dy, dz, size, share, hinted, cold, branch, before):
    """Try half planes all round AB, the likeliest first; leave the best path, or the first guess where none holds."""
    ux, uy, uz = dx / size, dy / size, dz / size
    fx, fy, fz = ax + share * dx, ay + share * dy, az + share * dz
    if hinted:
        wx, wy, wz = node[k, HINT + 1] - fx, node[k, HINT + 2] - fy, node[k, HINT + 3] - fz
    else:
        _, _, _, wx, wy, wz = project(node, k, fx, fy, fz)
    along = wx * ux + wy * uy + wz * uz
    wx, wy, wz = wx - along * ux, wy - along * uy, wz - along * uz
    length = math.sqrt(wx * wx + wy * wy + wz * wz)
    if length <= 1e-9 * node[k, SIZE] or not math.isfinite(length):
        wx, wy, wz = across(ux, uy, uz)
    else:
        wx, wy, wz = wx / length, wy / length, wz / length
    vx, vy, vz = uy * wz - uz * wy, uz * wx - ux * wz, ux * wy - uy * wx
    winds = node[k, KIND] == lay.TORUS and node[k, lay.TWIN] == 0.0
    found, best, fresh = False, 0.0, -1
    guessed = False
    j = 0
    memory = carray(stack(), (80,))
    for j in range(DIRECTIONS):
        turn = (j + 1) // 2 * (2.0 * math.pi / DIRECTIONS)
        c, s = math.cos(turn), math.sin(turn) if j % 2 == 1 else -math.sin(turn)
        if not _guess(
            k, node, ax, ay, az, ux, uy, uz, c * wx + s * vx, c * wy + s * vy, c * wz + s * vz, size, share * size
        ):
            continue
        if not guessed:
            guessed = True
            for i in range(lay.STATE):
                memory[lay.STATE + i] = node[k, S_MODE + i]
        good, total = _polish(k, ends, node)
        if not good or not _on_branch(k, node, branch, before) or (found and total >= best * (1.0 - 1e-12)):
            continue
        found, best, fresh = True, total, j
        node[k, S_SWEEP] = swept(k, node) if winds else 0.0
        for i in range(lay.STATE):
            memory[i] = node[k, S_MODE + i]
        if hinted or not cold:
            break
    node[k, S_MODE] = TOUCHED
    if found and fresh == j:
        return
    node[k, lay.W_FRESH] = -1.0
    if found or guessed:
        start = 0 if found else lay.STATE
        for i in range(lay.STATE):
            node[k, S_MODE + i] = memory[start + i]
    else:
        _place(k, node, fx, fy, fz, ux, uy, uz, 0.0)
    geodesic(k, node, ends[0], ends[1], ends[2])
