"""Stubs of the names that a generated module defines before its template, for readers and type checkers.

They are never run: a generated module has the real definitions in their place.
"""

from __future__ import annotations

from typing import Any

import numpy as np

SIZE = 1.0  # about the smallest radius of curvature [m]
REACH = 1.0  # radius of a sphere about the origin that contains the surface, or infinite [m]
SAMPLES = np.zeros((1, 5))  # points of the surface (n, 3); in a chart (n, 5), u and v before them

# ------------------------------------------------------------------------------------------------ implicit
BOX_X, BOX_Y, BOX_Z = 1.0, 1.0, 1.0  # half widths of the box in which the surface was checked [m]
FLOOR = 1.0  # smaller gradients occur only far from the surface


def value(x: float, y: float, z: float) -> tuple[float, ...]:
    """Return phi and its gradient (3)."""
    raise NotImplementedError


def second(x: float, y: float, z: float) -> tuple[float, ...]:
    """Return the gradient of phi (3) and its second derivatives xx, yy, zz, xy, xz, yz."""
    raise NotImplementedError


# ---------------------------------------------------------------------------------------------- parametric
U_LOW, U_HIGH, V_LOW, V_HIGH = 0.0, 1.0, 0.0, 1.0  # ranges
PERIODIC_U, PERIODIC_V = False, False
STRIDE_U, STRIDE_V = 1.0, 1.0  # longest steps of a search
SIGN = 1.0  # of the outward normal along r_u x r_v


def chart(u: float, v: float) -> tuple[float, ...]:
    """Return r, r_u, r_v, r_uu, r_uv, r_vv (3 each)."""
    raise NotImplementedError


# --------------------------------------------------------------------------------------------------- both
def inner(function: Any) -> Any:
    """Compile a function for the module itself; see `compiled.py`, also for the three below."""
    return function


geodesic_entry = project_entry = height_entry = inner


def step(*state: Any) -> tuple[float, ...]:
    """Return the state after one step of the integrator; see `extrapolation.py`."""
    raise NotImplementedError
