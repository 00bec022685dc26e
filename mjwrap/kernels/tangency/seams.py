"""Contacts at seams of a surface, where its curvature jumps: a capsule's, between the shaft and the caps.

Newton's method takes the curvature at a contact for that of the whole step. Over a seam this is wrong: along the axis a
shaft is straight, so that on it no slide of the contact changes the surface's normal, while on a cap behind it a small
one does. So a contact that slides over a seam takes the rest of its way with the curvature there, and one that belongs
behind a seam is moved there before the step. "Seams" in docs/derivation.md.
"""

from __future__ import annotations

from numba.core import types

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import deferred, jit
from mjwrap.kernels.geometry.dispatch import has_seams, slide_past_seam, way_to_seam
from mjwrap.kernels.geometry.geodesics import move_start_along
from mjwrap.kernels.tangency.path_error import path_error_jacobian_at_P, path_error_jacobian_at_Q

S_MODE, S_ARC, TOUCHED, SIZE = lay.S_MODE, lay.S_ARC, lay.TOUCHED, lay.SIZE
W_P, W_Q, W_TP, W_TQ, W_BP, W_BQ = lay.W_P, lay.W_Q, lay.W_TP, lay.W_TQ, lay.W_BP, lay.W_BQ
W_KP, W_KQ, W_JAC, W_CP, W_CQ, W_Y = lay.W_KP, lay.W_KQ, lay.W_JAC, lay.W_CP, lay.W_CQ, lay.W_Y


@jit
def any_seams(lo, hi, node):
    """Return whether any touched row of lo..hi has a surface with seams."""
    for k in range(lo, hi):
        if node[k, S_MODE] == TOUCHED and has_seams(k, node):
            return True
    return False


@deferred(types.none)
def step_over_seams(lo, hi, share, ends, node):
    """Change the slides in W_Y, the Newton step, of contacts that get over a seam in a share of it.

    They remove the same part of the path error with the curvature behind the seam. The step's other parts stay.
    """
    for k in range(lo, hi):
        if node[k, S_MODE] != TOUCHED or not has_seams(k, node):
            continue
        slide, sigma = node[k, W_Y], node[k, W_Y] + node[k, W_Y + 3]
        y = node[k, W_JAC] * node[k, W_Y + 1] + node[k, W_JAC + 2] * node[k, W_Y + 2]
        slope, _, _, _, _ = path_error_jacobian_at_P(k, node)
        slide = slide_past_seam(
            k, node, ends, W_P, W_TP, W_BP, slide, node[k, W_Y + 1], share, node[k, W_KP], slope
        )
        if node[k, lay.W_END_ON_SURFACE] == 0.0:
            slope, _, _, _, _ = path_error_jacobian_at_Q(k, node)
            sigma = slide_past_seam(k, node, ends, W_Q, W_TQ, W_BQ, sigma, y, share, node[k, W_KQ], slope)
        node[k, W_Y] = slide
        node[k, W_Y + 3] = sigma - slide


@deferred(types.boolean)
def move_to_seams(lo, hi, ends, node, least):
    """Move contacts that belong behind a seam there, along their geodesics; return whether any was moved.

    A contact belongs there where the geodesic up to the seam turns by less than the angle by which the straight segment
    leaves the surface or enters it, e·n_P or e'·n_Q, while the Newton step in W_Y slides it by more than `least`, in
    the surface's size: it looks for that angle along the shaft. The rows are to be evaluated again.
    """
    moved = False
    for k in range(lo, hi):
        if node[k, S_MODE] != TOUCHED or not has_seams(k, node):
            continue
        first, last = 0.0, 0.0
        slide, sigma = node[k, W_Y], node[k, W_Y] + node[k, W_Y + 3]
        if abs(slide) >= least * node[k, SIZE]:
            first = way_to_seam(k, node, ends, W_P, W_TP, node[k, W_KP], -node[k, W_CP + 1])
        if abs(sigma) >= least * node[k, SIZE] and node[k, lay.W_END_ON_SURFACE] == 0.0:
            last = way_to_seam(k, node, ends, W_Q, W_TQ, node[k, W_KQ], -node[k, W_CQ + 1])
        if (first == 0.0 and last == 0.0) or node[k, S_ARC] + last - first <= 0.0:
            continue
        node[k, S_ARC] += last
        move_start_along(k, node, ends, first)
        moved = True
    return moved
