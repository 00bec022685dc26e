"""Geodesics on a surface given as r(u, v): the fixed part of a generated module.

All numbers are in the surface's own frame [m]. `chart(u, v)` returns r, r_u, r_v, r_uu, r_uv, r_vv, three numbers each;
it is generated from the user's functions.
"""

import math

from mjwrap.surfaces.codegen.stubs import (
    PERIODIC_U,
    PERIODIC_V,
    SAMPLES,
    SIGN,
    SIZE,
    STRIDE_U,
    STRIDE_V,
    U_HIGH,
    U_LOW,
    V_HIGH,
    V_LOW,
    chart,
    geodesic_entry,
    height_entry,
    inner,
    project_entry,
    step,
)

# ------------------------------------------------------------------------------------- generated modules begin here

FIRST_STEP = 1.0  # in radii of curvature
TOLERANCE = 5e-12  # largest error estimate of a step: the error is then below 1e-12
AIM = 2e-12  # error estimate for which the next step is chosen
ORDER = 1.0 / 15.0  # power of the estimate by which the step changes
NOISE = 2e-11  # a smaller estimate that does not decrease with the step is rounding of the function itself
SHORTEST_STEP = 1e-5  # smallest step relative to SIZE; it is accepted with any estimate
MAX_STEPS = 500
MAX_ITERATIONS = 60


@inner
def field(u, v, du, dv):
    """Return u'', v'' of a geodesic and the Gaussian curvature.

    r_u u'' + r_v v'' cancels the tangential part of r_uu u'^2 + 2 r_uv u'v' + r_vv v'^2: this is the geodesic equation
    without explicit Christoffel symbols.
    """
    _, _, _, xu, yu, zu, xv, yv, zv, xuu, yuu, zuu, xuv, yuv, zuv, xvv, yvv, zvv = chart(u, v)
    uu, uv, vv = du * du, 2.0 * du * dv, dv * dv
    ax = xuu * uu + xuv * uv + xvv * vv
    ay = yuu * uu + yuv * uv + yvv * vv
    az = zuu * uu + zuv * uv + zvv * vv
    e = xu * xu + yu * yu + zu * zu
    f = xu * xv + yu * yv + zu * zv
    g = xv * xv + yv * yv + zv * zv
    over = 1.0 / (e * g - f * f)
    au = xu * ax + yu * ay + zu * az
    av = xv * ax + yv * ay + zv * az
    cx, cy, cz = yu * zv - zu * yv, zu * xv - xu * zv, xu * yv - yu * xv
    l = xuu * cx + yuu * cy + zuu * cz
    m = xuv * cx + yuv * cy + zuv * cz
    n = xvv * cx + yvv * cy + zvv * cz
    return (f * av - g * au) * over, (f * au - e * av) * over, (l * n - m * m) * over * over


@inner
def normal(xu, yu, zu, xv, yv, zv):
    """Return the outward unit normal."""
    nx, ny, nz = yu * zv - zu * yv, zu * xv - xu * zv, xu * yv - yu * xv
    over = SIGN / math.sqrt(nx * nx + ny * ny + nz * nz)
    return nx * over, ny * over, nz * over


@inner
def shape(u, v, du, dv):
    """Return r, t, n (3 each) and kappa, tau, beta for the tangent t = r_u u' + r_v v', made unit; |r_u|, |r_v|."""
    x, y, z, xu, yu, zu, xv, yv, zv, xuu, yuu, zuu, xuv, yuv, zuv, xvv, yvv, zvv = chart(u, v)
    tx, ty, tz = xu * du + xv * dv, yu * du + yv * dv, zu * du + zv * dv
    over = 1.0 / math.sqrt(tx * tx + ty * ty + tz * tz)
    tx, ty, tz, du, dv = tx * over, ty * over, tz * over, du * over, dv * over
    nx, ny, nz = normal(xu, yu, zu, xv, yv, zv)
    bx, by, bz = ty * nz - tz * ny, tz * nx - tx * nz, tx * ny - ty * nx
    bu, bv = rates(bx, by, bz, xu, yu, zu, xv, yv, zv)
    l = -(xuu * nx + yuu * ny + zuu * nz)  # with the outward normal a sphere has W = I / R
    m = -(xuv * nx + yuv * ny + zuv * nz)
    n = -(xvv * nx + yvv * ny + zvv * nz)
    length_u, length_v = math.sqrt(xu * xu + yu * yu + zu * zu), math.sqrt(xv * xv + yv * yv + zv * zv)
    kappa = l * du * du + 2.0 * m * du * dv + n * dv * dv
    tau = l * du * bu + m * (du * bv + dv * bu) + n * dv * bv
    beta = l * bu * bu + 2.0 * m * bu * bv + n * bv * bv
    return x, y, z, tx, ty, tz, nx, ny, nz, kappa, tau, beta, length_u, length_v


@inner
def rates(tx, ty, tz, xu, yu, zu, xv, yv, zv):
    """Return the rates u', v' of a point that moves along the surface with the velocity t."""
    e = xu * xu + yu * yu + zu * zu
    f = xu * xv + yu * yv + zu * zv
    g = xv * xv + yv * yv + zv * zv
    p, q = xu * tx + yu * ty + zu * tz, xv * tx + yv * ty + zv * tz
    over = 1.0 / (e * g - f * f)
    return (g * p - f * q) * over, (e * q - f * p) * over


@inner
def within(w, low, high, periodic):
    """Return a coordinate limited to one width around its range, if the range is not periodic."""
    width = high - low
    return w if periodic else min(max(w, low - width), high + width)


@inner
def nearest(x, y, z):
    """Return u and v of the point of the surface nearest to (x, y, z).

    Newton's method for half the squared distance, from the nearest sample; Gauss-Newton if that is not convex.
    """
    best, found = math.inf, 0
    for i in range(SAMPLES.shape[0]):
        dx, dy, dz = SAMPLES[i, 2] - x, SAMPLES[i, 3] - y, SAMPLES[i, 4] - z
        square = dx * dx + dy * dy + dz * dz
        if square < best:
            best, found = square, i
    u, v = SAMPLES[found, 0], SAMPLES[found, 1]
    best = math.inf
    su, sv = 0.0, 0.0
    for _ in range(MAX_ITERATIONS):
        p, q = within(u + su, U_LOW, U_HIGH, PERIODIC_U), within(v + sv, V_LOW, V_HIGH, PERIODIC_V)
        rx, ry, rz, xu, yu, zu, xv, yv, zv, xuu, yuu, zuu, xuv, yuv, zuv, xvv, yvv, zvv = chart(p, q)
        dx, dy, dz = rx - x, ry - y, rz - z
        square = dx * dx + dy * dy + dz * dz
        # close to the end a step shortens the distance by less than its rounding
        if not square < best and (abs(su) > 1e-6 * STRIDE_U or abs(sv) > 1e-6 * STRIDE_V):
            su, sv = 0.5 * su, 0.5 * sv
            continue
        u, v, best = p, q, square
        e = xu * xu + yu * yu + zu * zu
        f = xu * xv + yu * yv + zu * zv
        g = xv * xv + yv * yv + zv * zv
        gu, gv = xu * dx + yu * dy + zu * dz, xv * dx + yv * dy + zv * dz
        huu = e + xuu * dx + yuu * dy + zuu * dz
        huv = f + xuv * dx + yuv * dy + zuv * dz
        hvv = g + xvv * dx + yvv * dy + zvv * dz
        determinant = huu * hvv - huv * huv
        if not (huu > 0.0 and determinant > 0.01 * (e * g - f * f)):
            huu, huv, hvv = e, f, g
            determinant = e * g - f * f
        over = 1.0 / determinant
        su, sv = (huv * gv - hvv * gu) * over, (huv * gu - huu * gv) * over
        size = max(abs(su) / STRIDE_U, abs(sv) / STRIDE_V)
        if not size > 1e-8:  # converges quadratically
            u, v = u + su, v + sv
            break
        if size > 1.0:
            su, sv = su / size, sv / size
    return u, v


@inner
def outside_range(u, v):
    """Return 1.0 if a point lies beyond a range that is not periodic, else 0.0."""
    beyond = not PERIODIC_U and not U_LOW <= u <= U_HIGH
    return 1.0 if beyond or (not PERIODIC_V and not V_LOW <= v <= V_HIGH) else 0.0


@inner
def middle_kappa(h, u, v, du, dv, u1, v1, du1, dv1):
    """Return the normal curvature half way along a step, on the cubic through both of its ends."""
    mu, mv = 0.5 * (u + u1) + 0.125 * h * (du - du1), 0.5 * (v + v1) + 0.125 * h * (dv - dv1)
    wu, wv = 1.5 * (u1 - u) / h - 0.25 * (du + du1), 1.5 * (v1 - v) / h - 0.25 * (dv + dv1)
    _, _, _, _, _, _, _, _, _, kappa, _, _, _, _ = shape(mu, mv, wu, wv)
    return kappa


@geodesic_entry
def geodesic(start, out):
    """Follow a geodesic from start = (P, t, s); fill out (31), see `mjwrap/kernels/geometry/user_surface.py`."""
    s = start[6]
    u, v = nearest(start[0], start[1], start[2])
    _, _, _, xu, yu, zu, xv, yv, zv, _, _, _, _, _, _, _, _, _ = chart(u, v)
    du, dv = rates(start[3], start[4], start[5], xu, yu, zu, xv, yv, zv)
    tx, ty, tz = xu * du + xv * dv, yu * du + yv * dv, zu * du + zv * dv
    over = 1.0 / math.sqrt(tx * tx + ty * ty + tz * tz)
    du, dv = du * over, dv * over
    x, y, z, tx, ty, tz, nx, ny, nz, kappa, tau, beta, length_u, length_v = shape(u, v, du, dv)
    out[0], out[1], out[2] = x, y, z
    out[6], out[7], out[8] = tx, ty, tz
    out[12], out[13], out[14] = nx, ny, nz
    out[18], out[19], out[20] = kappa, tau, beta
    a, da, r, dr = 1.0, 0.0, 0.0, 1.0
    kappa_min, r_min, left = kappa, 1.0, outside_range(u, v)
    rest, longest = s, FIRST_STEP / (math.sqrt(kappa * kappa + 2.0 * tau * tau + beta * beta) + 0.01 / SIZE)
    before = math.inf  # error estimate of a step that was repeated
    for _ in range(MAX_STEPS):
        if not abs(rest) > 0.0:
            break
        h = rest if abs(rest) <= longest else rest / math.ceil(abs(rest) / longest)
        doubt, u1, du1, v1, dv1, a1, da1, r1, dr1 = step(u, du, v, dv, a, da, r, dr, h, length_u, length_v)
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
        kappa_min = min(kappa_min, middle_kappa(h, u, v, du, dv, u1, v1, du1, dv1))
        u, v, du, dv = u1, v1, du1, dv1
        a, da, r, dr = a1, da1, r1, dr1
        x, y, z, tx, ty, tz, nx, ny, nz, kappa, tau, beta, length_u, length_v = shape(u, v, du, dv)
        kappa_min = min(kappa_min, kappa)
        r_min = min(r_min, r / (s - rest))
        left = max(left, outside_range(u, v))
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
    u, v = nearest(x, y, z)
    rx, ry, rz, xu, yu, zu, xv, yv, zv, _, _, _, _, _, _, _, _, _ = chart(u, v)
    nx, ny, nz = normal(xu, yu, zu, xv, yv, zv)
    out[0], out[1], out[2], out[3], out[4], out[5] = rx, ry, rz, nx, ny, nz


@height_entry
def height(x, y, z):
    """Return the distance from the surface along the normal of its nearest point, negative inside."""
    u, v = nearest(x, y, z)
    rx, ry, rz, xu, yu, zu, xv, yv, zv, _, _, _, _, _, _, _, _, _ = chart(u, v)
    nx, ny, nz = normal(xu, yu, zu, xv, yv, zv)
    return (x - rx) * nx + (y - ry) * ny + (z - rz) * nz
