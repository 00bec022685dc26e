"""Initial guesses for wraps without a closed form, each in a half plane that is bounded by the line AB.

The half plane cuts the surface in a section, and the shortest way over the section is the upper convex hull of its
boundary. Sampling the boundary needs only the height over the surface. The section of an ellipsoid is an ellipse, whose
tangents have a closed form. Everything in the frame S of the obstacle. "Wraps without a closed form" in
docs/derivation.md.
"""

from __future__ import annotations

import math

import numpy as np

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import jit, no_inline
from mjwrap.kernels.geometry.dispatch import bounding_radius, height, project
from mjwrap.kernels.geometry.stoermer import carray, stack
from mjwrap.kernels.geometry.traits import ellipse_sections
from mjwrap.kernels.geometry.vectors import unit

KIND, DIM, SIZE = lay.KIND, lay.DIM, lay.SIZE
S_MODE, S_P, S_T, S_ARC = lay.S_MODE, lay.S_P, lay.S_T, lay.S_ARC

# Lengths are shares of the surface's size.
COLUMNS = 14  # number of samples of a section's upper boundary
BOUNDARY_TOL = 1e-4  # accuracy to which a section's boundary is found
# largest number of times that the hull is corrected where it runs through the section
MAX_HULL_CORRECTIONS = 3
HOLLOW_HEIGHT = 0.1  # the hull bridges a hollow if it runs higher above the surface between two columns
SAMPLES = 24  # points along a half plane at which a section is looked for that AB does not enter
AT_A = 1e-4  # a section that begins nearer to A than this begins at A
MAX_BOUNDARY_STEPS = 60  # largest number of steps outwards to a section's boundary
GAUSS, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(5)  # quadrature of an ellipse's arc


@jit
def _boundary_height(node, k, x, y, z, wx, wy, wz, start):
    """Return the distance from (x, y, z) along w at which a column leaves the surface; start: a distance inside it."""
    # march outwards by the depth, or by `step` where that is more
    lo = start
    step = 0.05 * node[k, SIZE]
    h = height(node, k, x + lo * wx, y + lo * wy, z + lo * wz)
    hi = lo
    for _ in range(MAX_BOUNDARY_STEPS):
        hi = lo + max(-h, step)
        h = height(node, k, x + hi * wx, y + hi * wy, z + hi * wz)
        if h >= 0.0:
            break
        lo = hi
        step *= 1.2
    low = height(node, k, x + lo * wx, y + lo * wy, z + lo * wz)
    for _ in range(8):  # the Illinois method (modified regula falsi)
        if h <= BOUNDARY_TOL * node[k, SIZE]:
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
def _upper_hull(count, size, first, step, top, chain):
    """Write to chain the indices of the columns on the upper convex hull with (0, 0) and (size, 0); return how many."""
    m = 0
    for i in range(count + 1):
        x, y = first + i * step, 0.0
        if i < count:
            y = top[i]
            if y <= 0.0 or x <= 0.0 or x >= size:
                continue
        else:
            x = size
        # Andrew's monotone chain: remove the last corner while the hull does not bend downwards there
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
def _hull_over_section(k, node, ax, ay, az, ux, uy, uz, wx, wy, wz, size, lift, first, step, top, chain):
    """Sample the section at COLUMNS columns and find its upper convex hull; return how many columns are on it.

    A column begins `lift` above AB.
    """
    for i in range(COLUMNS):
        x = first + i * step
        px, py, pz = ax + x * ux, ay + x * uy, az + x * uz
        top[i] = -1.0
        if 0.0 < x < size and height(node, k, px + lift * wx, py + lift * wy, pz + lift * wz) < 0.0:
            top[i] = _boundary_height(node, k, px, py, pz, wx, wy, wz, lift)
    m = _upper_hull(COLUMNS, size, first, step, top, chain)
    # above a column that ends below the hull there may be more of the surface: search its boundary from the hull on
    for _ in range(MAX_HULL_CORRECTIONS):
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
                top[i] = _boundary_height(node, k, px, py, pz, wx, wy, wz, y)
                lifted = True
        if not lifted:
            break
        m = _upper_hull(COLUMNS, size, first, step, top, chain)
    return m


@jit
def _guess_on_ellipsoid(k, node, ax, ay, az, ux, uy, uz, wx, wy, wz, size):
    """Write the guess of `guess_in_half_plane` for an ellipsoid, in closed form.

    In the affine image in which the ellipsoid is the unit sphere, the section is a circle and tangents are tangents.
    """
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
    # a small negative arc means that the string is clear of the circle, not that it goes nearly once round it
    arc = start - stop
    if arc > math.pi * 1.5:
        arc -= 2.0 * math.pi
    elif arc < -math.pi * 0.5:
        arc += 2.0 * math.pi
    arc = max(arc, 0.0)
    # the arc's length on the ellipsoid, where it is an ellipse: Gauss' rule over the angle
    total = 0.0
    for i in range(GAUSS.shape[0]):
        g = start - 0.5 * arc * (1.0 + GAUSS[i])
        f, e = math.sin(g), -math.cos(g)
        total += GAUSS_WEIGHTS[i] * math.sqrt(
            (a * (f * dx + e * vx)) ** 2 + (b * (f * dy + e * vy)) ** 2 + (c * (f * dz + e * vz)) ** 2
        )
    x, y = x + radius * math.cos(start), y + radius * math.sin(start)
    px, py, pz = ax + a * (x * dx + y * vx), ay + b * (x * dy + y * vy), az + c * (x * dz + y * vz)
    x, y = math.sin(start), -math.cos(start)  # tangent there, and so is its image on the ellipsoid
    tx, ty, tz = a * (x * dx + y * vx), b * (x * dy + y * vy), c * (x * dz + y * vz)
    place_contact(k, node, px, py, pz, tx, ty, tz, 0.5 * arc * radius * total)
    return True


@jit
def height_of_section(k, node, x, y, z, wx, wy, wz, most):
    """Return how far from (x, y, z), at most, the direction w is deepest inside surface k; -1 if it stays outside."""
    best, lowest = -1.0, 0.0
    for i in range(1, SAMPLES + 1):
        lift = most * i / SAMPLES
        h = height(node, k, x + lift * wx, y + lift * wy, z + lift * wz)
        if h < lowest:
            best, lowest = lift, h
    return best


@no_inline
def guess_in_half_plane(k, node, ax, ay, az, ux, uy, uz, wx, wy, wz, size, deepest, lift):
    """Write an initial guess for the string over the section in the half plane towards w; return whether there is one.

    u: unit vector from A to B, `size` apart; deepest: distance from A at which AB is lowest. lift: 0 if AB enters the
    surface there, else the height above AB at which w does.
    """
    if ellipse_sections(k, node):
        return _guess_on_ellipsoid(k, node, ax, ay, az, ux, uy, uz, wx, wy, wz, size)
    memory = carray(stack(), (80,))
    top, chain = memory[0:COLUMNS], memory[COLUMNS : 2 * COLUMNS]
    # first the columns cover the whole section, then, closer together, the hull alone
    lo, hi = 0.0, size
    bound = bounding_radius(node, k)
    if bound < math.inf:
        centre = -(ax * ux + ay * uy + az * uz)
        lo, hi = max(lo, centre - bound), min(hi, centre + bound)
    m = 0
    first, step = 0.0, 0.0
    for _ in range(2):
        if not hi > lo:
            return False
        step = (hi - lo) / (COLUMNS - 2)
        first = deepest - step * math.ceil((deepest - lo) / step)  # one column stands at the deepest point
        m = _hull_over_section(
            k, node, ax, ay, az, ux, uy, uz, wx, wy, wz, size, lift, first, step, top, chain
        )
        if m == 0:
            return False
        lo, hi = first + (chain[0] - 1) * step, first + (chain[m - 1] + 1) * step
        deepest = first + chain[0] * step
    # the part of the hull up to the first hollow that a string bridges; for a second contact, behind the last one
    start, stop = 0, m
    for j in range(1, m):
        i, o = int(chain[j]), int(chain[j - 1])
        x, y = first + 0.5 * (i + o) * step, 0.5 * (top[i] + top[o])
        px, py, pz = ax + x * ux + y * wx, ay + x * uy + y * wy, az + x * uz + y * wz
        if i - o > 2 and height(node, k, px, py, pz) > HOLLOW_HEIGHT * node[k, SIZE]:
            if node[k, lay.TOUCH] == 0.0:
                stop = j
                break
            start = j
    # the first contact is the hull's first column, s the hull's length, t the direction of A's tangent
    arc = 0.0
    for j in range(start + 1, stop):
        i, o = int(chain[j]), int(chain[j - 1])
        arc += math.hypot((i - o) * step, top[i] - top[o])
    x, y = first + chain[start] * step, top[int(chain[start])]
    p, q = x, y
    if math.hypot(x, y) < AT_A * node[k, SIZE]:  # A is on the surface: take the direction of the next piece
        p, q = size, 0.0
        if start + 1 < m:
            p, q = first + chain[start + 1] * step - x, top[int(chain[start + 1])] - y
    place_contact(
        k, node, ax + x * ux + y * wx, ay + x * uy + y * wy, az + x * uz + y * wz,
        p * ux + q * wx, p * uy + q * wy, p * uz + q * wz, arc,
    )  # fmt: skip
    return True


@jit
def place_contact(k, node, x, y, z, tx, ty, tz, arc):
    """Start obstacle k's geodesic at the surface point next to (x, y, z), along t as far as it is tangent."""
    x, y, z, nx, ny, nz = project(node, k, x, y, z)
    along = tx * nx + ty * ny + tz * nz
    tx, ty, tz = tx - along * nx, ty - along * ny, tz - along * nz
    size = math.sqrt(tx * tx + ty * ty + tz * tz)
    if size < 1e-12 * node[k, SIZE]:
        tx, ty, tz = perpendicular(nx, ny, nz)
        size = 1.0
    node[k, S_MODE] = lay.TOUCHED
    node[k, S_P] = x
    node[k, S_P + 1] = y
    node[k, S_P + 2] = z
    node[k, S_T] = tx / size
    node[k, S_T + 1] = ty / size
    node[k, S_T + 2] = tz / size
    node[k, S_ARC] = arc


@jit
def place_contact_on_tube(k, node, x, y, z, tx, ty, tz, angle):
    """Start at the given angle round a torus' tube, where it is nearest to the point (x, y, z)."""
    major, minor = node[k, DIM], node[k, DIM + 1]
    rho = max(math.sqrt(x * x + y * y), 1e-12 * major)
    scale = (major + minor * math.cos(angle)) / rho
    place_contact(k, node, scale * x, scale * y, minor * math.sin(angle), tx, ty, tz, 0.0)


@jit
def perpendicular(x, y, z):
    """Return a unit vector perpendicular to a unit vector."""
    if abs(x) <= abs(y) and abs(x) <= abs(z):
        x, y, z = 0.0, z, -y
    elif abs(y) <= abs(z):
        x, y, z = -z, 0.0, x
    else:
        x, y, z = y, -x, 0.0
    size = math.sqrt(x * x + y * y + z * z)
    return x / size, y / size, z / size
