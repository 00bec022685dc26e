"""Properties of the surface of a row, read from the row's column TRAITS.

They come from the class of the surface (`mjwrap/surfaces/surface.py`), never from the kind; only `sided` comes from the
obstacle.
"""

from __future__ import annotations

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import jit

TRAITS = lay.TRAITS


@jit
def closed_form(k, node):
    """Return whether the wrap of row k's surface between two points has a closed form."""
    return int(node[k, TRAITS]) & lay.CLOSED_FORM != 0


@jit
def branched(k, node):
    """Return whether the side on which a string passes the surface is topological, and S_SWEEP holds it."""
    return int(node[k, TRAITS]) & lay.BRANCHED != 0


@jit
def hollow(k, node):
    """Return whether a straight segment that is tangent to the surface may enter it elsewhere."""
    return int(node[k, TRAITS]) & lay.HOLLOW != 0


@jit
def one_sided(k, node):
    """Return whether there is at most one stable wrap of the surface between any two points."""
    return int(node[k, TRAITS]) & lay.ONE_SIDED != 0


@jit
def random_starts(k, node):
    """Return whether a cold start may try hints at random places around the surface."""
    return int(node[k, TRAITS]) & lay.RANDOM_STARTS != 0


@jit
def ellipse_sections(k, node):
    """Return whether the surface is an ellipsoid with semi-axes DIM, so that its plane sections are ellipses."""
    return int(node[k, TRAITS]) & lay.ELLIPSE_SECTIONS != 0


@jit
def sided(k, node):
    """Return whether row k's hint is a side that holds at every pose, not only at a cold start."""
    return int(node[k, TRAITS]) & lay.SIDED != 0
