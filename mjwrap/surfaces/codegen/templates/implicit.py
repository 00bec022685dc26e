"""Geodesics on a surface given as phi(x, y, z) = 0, negative inside: the fixed part of a generated module.

All numbers are in the surface's own frame [m]. `value(x, y, z)` returns phi and its gradient, `second(x, y, z)` the
gradient and the second derivatives (xx, yy, zz, xy, xz, yz); both are generated from the user's functions.
"""

import math

from mjwrap.surfaces.codegen.stubs import (
    BOX_X,
    BOX_Y,
    BOX_Z,
    FLOOR,
    SAMPLES,
    SIZE,
    geodesic_entry,
    height_entry,
    inner,
    project_entry,
    second,
    step,
    value,
)

# ------------------------------------------------------------------------------------- generated modules begin here

FIRST_STEP = 1.0  # in lengths over which the gradient changes by its own size
TOLERANCE = 5e-12  # largest error estimate of a step: the error is then below 1e-12
AIM = 2e-12  # error estimate for which the next step is chosen
ORDER = 1.0 / 15.0  # power of the estimate by which the step changes
NOISE = 2e-11  # a smaller estimate that does not decrease with the step is rounding of the function itself
SHORTEST_STEP = 1e-5  # smallest step relative to SIZE; it is accepted with any estimate
MAX_STEPS = 500
MAX_PROJECTIONS = 40


@inner
def field(x, y, z, tx, ty, tz):
    """Return t' = -kappa n of a geodesic and the Gaussian curvature, of the level set through (x, y, z)."""
    gx, gy, gz, hxx, hyy, hzz, hxy, hxz, hyz = second(x, y, z)
    ux = hxx * tx + hxy * ty + hxz * tz
    uy = hxy * tx + hyy * ty + hyz * tz
    uz = hxz * tx + hyz * ty + hzz * tz
    over = 1.0 / (gx * gx + gy * gy + gz * gz)
    bend = (tx * ux + ty * uy + tz * uz) * over
    cxx = hyy * hzz - hyz * hyz  # cofactors of the Hessian
    cyy = hxx * hzz - hxz * hxz
    czz = hxx * hyy - hxy * hxy
    cxy = hxz * hyz - hxy * hzz
    cxz = hxy * hyz - hxz * hyy
    cyz = hxy * hxz - hyz * hxx
    vx = cxx * gx + cxy * gy + cxz * gz
    vy = cxy * gx + cyy * gy + cyz * gz
    vz = cxz * gx + cyz * gy + czz * gz
    curvature = (gx * vx + gy * vy + gz * vz) * over * over
    return -bend * gx, -bend * gy, -bend * gz, curvature


@inner
def shape(x, y, z, tx, ty, tz):
    """Return the unit normal; kappa, tau, beta for the tangent t; and the relative rate of the gradient [1/m]."""
    gx, gy, gz, hxx, hyy, hzz, hxy, hxz, hyz = second(x, y, z)
    over = 1.0 / math.sqrt(gx * gx + gy * gy + gz * gz)
    nx, ny, nz = gx * over, gy * over, gz * over
    bx, by, bz = ty * nz - tz * ny, tz * nx - tx * nz, tx * ny - ty * nx
    ux = hxx * tx + hxy * ty + hxz * tz
    uy = hxy * tx + hyy * ty + hyz * tz
    uz = hxz * tx + hyz * ty + hzz * tz
    vx = hxx * bx + hxy * by + hxz * bz
    vy = hxy * bx + hyy * by + hyz * bz
    vz = hxz * bx + hyz * by + hzz * bz
    kappa = (tx * ux + ty * uy + tz * uz) * over
    tau = (bx * ux + by * uy + bz * uz) * over
    beta = (bx * vx + by * vy + bz * vz) * over
    square = hxx * hxx + hyy * hyy + hzz * hzz + 2.0 * (hxy * hxy + hxz * hxz + hyz * hyz)
    return nx, ny, nz, kappa, tau, beta, math.sqrt(square) * over


@inner
def onto(x, y, z):
    """Return the point of the surface that Newton's method finds along the gradient, and whether it finds one."""
    for _ in range(MAX_PROJECTIONS):
        phi, gx, gy, gz = value(x, y, z)
        gg = gx * gx + gy * gy + gz * gz
        away = abs(phi) / math.sqrt(gg)
        if not away < 1e6 * SIZE:
            break
        share = phi / gg
        x, y, z = x - share * gx, y - share * gy, z - share * gz
        if away <= 1e-8 * SIZE:  # converges quadratically
            return x, y, z, True
    return x, y, z, False


@inner
def nearest_sample(x, y, z):
    """Return the nearest of the sample points that were found when the module was made."""
    best, found = math.inf, 0
    for i in range(SAMPLES.shape[0]):
        dx, dy, dz = SAMPLES[i, 0] - x, SAMPLES[i, 1] - y, SAMPLES[i, 2] - z
        square = dx * dx + dy * dy + dz * dz
        if square < best:
            best, found = square, i
    return onto(SAMPLES[found, 0], SAMPLES[found, 1], SAMPLES[found, 2])


@inner
def nearest(x, y, z):
    """Return the point of the surface nearest to (x, y, z), and the outward normal there.

    Newton's method in the tangent plane: half the square of the distance d n has the second derivative I + d W.
    """
    px, py, pz, good = onto(x, y, z)
    if not good:
        px, py, pz, good = nearest_sample(x, y, z)
    for _ in range(MAX_PROJECTIONS):
        _, nx, ny, nz = value(px, py, pz)
        over = 1.0 / math.sqrt(nx * nx + ny * ny + nz * nz)
        nx, ny, nz = nx * over, ny * over, nz * over
        dx, dy, dz = x - px, y - py, z - pz
        square = dx * dx + dy * dy + dz * dz
        along = dx * nx + dy * ny + dz * nz
        dx, dy, dz = dx - along * nx, dy - along * ny, dz - along * nz
        off = math.sqrt(dx * dx + dy * dy + dz * dz)
        if not off > 1e-13 * SIZE:
            break
        dx, dy, dz = dx / off, dy / off, dz / off
        nx, ny, nz, kappa, tau, beta, _ = shape(px, py, pz, dx, dy, dz)
        m00, m01, m11 = 1.0 + along * kappa, along * tau, 1.0 + along * beta
        determinant = m00 * m11 - m01 * m01
        if m00 > 0.0 and determinant > 0.01 * m00 * m00:
            ahead, aside = off * m11 / determinant, -off * m01 / determinant
        else:  # beyond a centre of curvature
            ahead, aside = off / (1.0 + abs(along) * (abs(kappa) + abs(tau) + abs(beta))), 0.0
        share = min(1.0, SIZE / math.sqrt(ahead * ahead + aside * aside))
        bx, by, bz = dy * nz - dz * ny, dz * nx - dx * nz, dx * ny - dy * nx
        moved = False
        for _ in range(10):
            u, v = share * ahead, share * aside
            qx, qy, qz, good = onto(px + u * dx + v * bx, py + u * dy + v * by, pz + u * dz + v * bz)
            far = (x - qx) ** 2 + (y - qy) ** 2 + (z - qz) ** 2
            # close to the end a step shortens the distance by less than its rounding
            if good and (far < square or off < 1e-6 * SIZE):
                px, py, pz, moved = qx, qy, qz, True
                break
            share *= 0.5
        if not moved:
            break
    _, nx, ny, nz = value(px, py, pz)
    over = 1.0 / math.sqrt(nx * nx + ny * ny + nz * nz)
    return px, py, pz, nx * over, ny * over, nz * over


@inner
def outside_box(x, y, z):
    """Return 1.0 if a point lies outside the box in which the surface was checked, else 0.0."""
    return 1.0 if abs(x) > BOX_X or abs(y) > BOX_Y or abs(z) > BOX_Z else 0.0


@inner
def tangent(x, y, z, tx, ty, tz):
    """Return a direction made tangent and unit at a point of the surface."""
    _, nx, ny, nz = value(x, y, z)
    share = (tx * nx + ty * ny + tz * nz) / (nx * nx + ny * ny + nz * nz)
    tx, ty, tz = tx - share * nx, ty - share * ny, tz - share * nz
    over = 1.0 / math.sqrt(tx * tx + ty * ty + tz * tz)
    return tx * over, ty * over, tz * over


@inner
def middle_kappa(h, x, y, z, tx, ty, tz, x1, y1, z1, tx1, ty1, tz1):
    """Return the normal curvature half way along a step, on the cubic through both of its ends."""
    mx = 0.5 * (x + x1) + 0.125 * h * (tx - tx1)
    my = 0.5 * (y + y1) + 0.125 * h * (ty - ty1)
    mz = 0.5 * (z + z1) + 0.125 * h * (tz - tz1)
    ux, uy, uz = 1.5 * (x1 - x) / h, 1.5 * (y1 - y) / h, 1.5 * (z1 - z) / h
    ux, uy, uz = ux - 0.25 * (tx + tx1), uy - 0.25 * (ty + ty1), uz - 0.25 * (tz + tz1)
    mx, my, mz, _ = onto(mx, my, mz)
    ux, uy, uz = tangent(mx, my, mz, ux, uy, uz)
    _, _, _, kappa, _, _, _ = shape(mx, my, mz, ux, uy, uz)
    return kappa


@geodesic_entry
def geodesic(start, out):
    """Follow a geodesic from start = (P, t, s); fill out (31), see `mjwrap/kernels/geometry/user_surface.py`."""
    x, y, z = start[0], start[1], start[2]
    s = start[6]
    tx, ty, tz = tangent(x, y, z, start[3], start[4], start[5])
    nx, ny, nz, kappa, tau, beta, rate = shape(x, y, z, tx, ty, tz)
    out[0], out[1], out[2] = x, y, z
    out[6], out[7], out[8] = tx, ty, tz
    out[12], out[13], out[14] = nx, ny, nz
    out[18], out[19], out[20] = kappa, tau, beta
    a, da, r, dr = 1.0, 0.0, 0.0, 1.0
    kappa_min, r_min, left = kappa, 1.0, outside_box(x, y, z)
    rest, longest = s, FIRST_STEP / rate
    before = math.inf  # error estimate of a step that was repeated
    for _ in range(MAX_STEPS):
        if not abs(rest) > 0.0:
            break
        h = rest if abs(rest) <= longest else rest / math.ceil(abs(rest) / longest)
        doubt, x1, tx1, y1, ty1, z1, tz1, a1, da1, r1, dr1 = step(
            x, tx, y, ty, z, tz, a, da, r, dr, h, 1.0, 1.0, 1.0
        )
        longest = 0.2 * abs(h)
        if doubt < math.inf:
            longest = abs(h) * min(max((AIM / (doubt + 1e-16)) ** ORDER, 0.2), 3.0)
        if not doubt <= TOLERANCE:
            noise = doubt < NOISE and doubt > 0.5 * before
            before = doubt
            longest = min(longest, 0.5 * abs(h))
            if abs(h) > SHORTEST_STEP * SIZE and not noise:
                continue
            if math.isnan(doubt):
                break
        before = math.inf
        rest = 0.0 if h == rest else rest - h
        if rest == 0.0:  # the last step ends on the surface to the last digit
            x1, y1, z1, _ = onto(x1, y1, z1)
            tx1, ty1, tz1 = tangent(x1, y1, z1, tx1, ty1, tz1)
        kappa_min = min(kappa_min, middle_kappa(h, x, y, z, tx, ty, tz, x1, y1, z1, tx1, ty1, tz1))
        x, y, z, tx, ty, tz = x1, y1, z1, tx1, ty1, tz1
        a, da, r, dr = a1, da1, r1, dr1
        nx, ny, nz, kappa, tau, beta, rate = shape(x, y, z, tx, ty, tz)
        kappa_min = min(kappa_min, kappa)
        r_min = min(r_min, r / (s - rest))
        left = max(left, outside_box(x, y, z))
    if rest != 0.0:
        x = math.nan  # more turns than a muscle can have, or no surface there
    out[3], out[4], out[5] = x, y, z
    out[9], out[10], out[11] = tx, ty, tz
    out[15], out[16], out[17] = nx, ny, nz
    out[21], out[22], out[23] = kappa, tau, beta
    out[24], out[25], out[26], out[27] = a, da, r, dr
    out[28], out[29], out[30] = kappa_min, r_min, left


@project_entry
def project(x, y, z, out):
    """Fill out (6) with the nearest point of the surface to (x, y, z) and the outward normal there."""
    out[0], out[1], out[2], out[3], out[4], out[5] = nearest(x, y, z)


@height_entry
def height(x, y, z):
    """Return the distance from the surface, to first order near it, negative inside."""
    phi, gx, gy, gz = value(x, y, z)
    steepness = math.sqrt(gx * gx + gy * gy + gz * gz)
    return phi / (steepness if steepness > FLOOR else FLOOR)  # also if the gradient is zero
