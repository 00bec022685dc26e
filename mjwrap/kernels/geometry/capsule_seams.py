"""Slides of a contact over a capsule's seams, where the curvature jumps ("Seams" in docs/derivation.md)."""

from __future__ import annotations

import math

from mjwrap.kernels.compilation.jit import jit

# a contact that slides over a capsule's seam gets at least this share of the radius behind it
BEHIND_SEAM = 1e-9
MAX_BEHIND = 0.5  # largest slide behind a seam in one step, in radii
LEAST_SLOPE = 0.05  # along a direction that rises less, the curvature jumps little


@jit
def slide_over_seam(radius, half, z, along, aside, slide, share, bend, slope):
    """Return the slide of a point of a capsule at height z that does what the given one would without a seam [m].

    along: rise along the axis per slide; aside: rise by another part of the same step [m]; share: how much of the step
    is taken; slope: rate at which the error to be removed changes with the slide, of which `bend` is the normal
    curvature [1/m]. Behind the first seam on the way the curvature is another one, and the rest of the slide is as much
    longer or shorter.
    """
    rise = share * (slide * along + aside)
    if abs(along) < LEAST_SLOPE or rise == 0.0:
        return slide
    way = 1.0 if rise > 0.0 else -1.0
    seam = -half if way * z < -half else half
    gap = seam - way * z
    if gap < 0.0 or gap >= way * rise:
        return slide
    cut = (way * gap / share - aside) / along
    if cut * slide <= 0.0:  # another part of the step leads over the seam
        return slide
    # from the cap onto the shaft, or the other way round
    behind = 1.0 / radius
    if abs(z) > half or (abs(z) == half and way * z < 0.0):
        behind = (1.0 - along * along) / radius
    behind += slope - bend
    most = MAX_BEHIND * radius / share
    rest = abs(slide - cut)
    rest = min(rest * max(slope, 0.0) / behind, most) if behind * most > rest * max(slope, 0.0) else most
    return cut + math.copysign(max(rest, BEHIND_SEAM * radius / share), slide)


@jit
def way_over_shaft(radius, half, z, along, bend, deviation):
    """Return the signed way along a helix on a capsule's shaft to just behind a seam [m], as `way_to_seam`."""
    if abs(z) > half or abs(along) < LEAST_SLOPE or deviation == 0.0:
        return 0.0
    way = math.copysign(1.0, deviation)
    rise = way * along
    left = (half - z) / rise if rise > 0.0 else (-half - z) / rise
    if left * bend >= abs(deviation):
        return 0.0
    return way * (left + BEHIND_SEAM * radius)
