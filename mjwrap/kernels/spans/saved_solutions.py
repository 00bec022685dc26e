"""Copies of a span's saved solutions in scratch columns of their rows."""

from __future__ import annotations

import math

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import jit
from mjwrap.kernels.geometry.geodesics import geodesic

S_MODE = lay.S_MODE


@jit
def save_solutions(lo, hi, node, column):
    """Copy the saved solutions of lo..hi to the columns that begin at `column` (W_OLD, W_START or W_BEST)."""
    for k in range(lo, hi):
        for i in range(lay.STATE):
            node[k, column + i] = node[k, S_MODE + i]


@jit
def restore_solutions(lo, hi, ends, node, column):
    """Restore the saved solutions of lo..hi from the columns that begin at `column`, and evaluate their geodesics."""
    for k in range(lo, hi):
        for i in range(lay.STATE):
            node[k, S_MODE + i] = node[k, column + i]
        if node[k, S_MODE] == lay.TOUCHED:
            geodesic(k, node, ends[0], ends[1], ends[2])


@jit
def discard_invalid_solutions(lo, hi, node):
    """Make the saved solutions of lo..hi finite: a trial that failed may have left NaN in a row that is not touched.

    A free row loses the ends of its string, which then count as unknown; any other row becomes a cold start.
    """
    for k in range(lo, hi):
        total = 0.0
        for i in range(lay.STATE):
            total += node[k, S_MODE + i]
        if not math.isfinite(total):
            if node[k, S_MODE] != lay.FREE or not math.isfinite(node[k, lay.S_SWEEP]):
                node[k, S_MODE] = lay.COLD
                node[k, lay.S_SWEEP] = 0.0
            for i in range(2, lay.STATE):
                if not math.isfinite(node[k, S_MODE + i]):
                    node[k, S_MODE + i] = 0.0


@jit
def any_in_mode(lo, hi, node, mode):
    """Return whether a node of lo..hi is in the given mode: COLD, FREE or TOUCHED."""
    for k in range(lo, hi):
        if node[k, S_MODE] == mode:
            return True
    return False


@jit
def surface_end(k, hi, node):
    """Return the row behind the last row of row k's surface; a surface that may be touched twice has two rows."""
    k += 1
    while k < hi and node[k, lay.TOUCH] > 0.0:
        k += 1
    return k
