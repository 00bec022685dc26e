"""Shared parts of generated modules: memory and weights for eight columns, and sines that fill vector lanes."""

from __future__ import annotations

import ctypes
from typing import Any

from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic

from mjwrap.kernels.compilation.jit import config
from mjwrap.kernels.geometry.stoermer import ERROR_WEIGHT, INVERSE, LANES, WEIGHT
from mjwrap.surfaces.codegen.compiled import inner

__all__ = ["ERROR_WEIGHT", "HALF", "LANES", "WEIGHT", "combine", "cosine", "sine", "stack"]

HALF = 0.5 * INVERSE  # substeps of each column, as shares of a step
_ROOM = 21 * LANES  # doubles: the ten numbers of a geodesic twice for each column, and its substep


def _memory() -> Any:
    return ctypes.cast((ctypes.c_double * _ROOM)(), ctypes.POINTER(ctypes.c_double))


def _memory_on_stack(typing_context: Any) -> Any:
    """Return a pointer to memory for all columns on the caller's stack."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        memory = cgutils.alloca_once(builder, ir.ArrayType(ir.DoubleType(), _ROOM))
        return builder.bitcast(memory, ir.DoubleType().as_pointer())

    return types.CPointer(types.float64)(), generate


stack: Any = _memory if config.DISABLE_JIT else intrinsic(_memory_on_stack)


@inner
def combine(v: Any, row: int, weight: Any) -> float:
    """Return the weighted sum over the columns of a row."""
    i = LANES * row
    return ((v[i] * weight[0] + v[i + 1] * weight[1]) + (v[i + 2] * weight[2] + v[i + 3] * weight[3])) + (
        (v[i + 4] * weight[4] + v[i + 5] * weight[5]) + (v[i + 6] * weight[6] + v[i + 7] * weight[7])
    )


# ------------------------------------------------------------------------------------- sine and cosine
# The C library's functions are calls, which prevent vectorised loops. Reduction by pi/2 in three parts and the
# polynomials of fdlibm (Sun Microsystems 1993, k_sin.c, k_cos.c): exact to an ulp or two for |x| < 1e6.

_ROUND = 6755399441055744.0  # 1.5 * 2^52: added and taken off again, it rounds to a whole number
_PER_TURN = 0.6366197723675814  # 2 / pi
_PI_1, _PI_2, _PI_3 = 1.5707963267341256, 6.077100506303966e-11, 2.0222662487959506e-21  # their sum is pi / 2


@inner
def _quadrant(x: float) -> tuple[float, float]:
    """Return the nearest multiple of pi/2 to x, and the remainder."""
    n = (x * _PER_TURN + _ROUND) - _ROUND
    return n, ((x - n * _PI_1) - n * _PI_2) - n * _PI_3


@inner
def _turned(n: float, r: float) -> float:
    """Return sin(n pi/2 + r) for |r| <= pi/4, without a branch."""
    z = r * r
    s = -2.50507602534068634195e-08 + z * 1.58969099521155010221e-10
    s = -1.98412698298579493134e-04 + z * (2.75573137070700676789e-06 + z * s)
    s = r + r * z * (-1.66666666666666324348e-01 + z * (8.33333333332248946124e-03 + z * s))
    c = 2.08757232129817482790e-09 + z * -1.13596475577881948265e-11
    c = 2.48015872894767294178e-05 + z * (-2.75573143513906633035e-07 + z * c)
    c = 1.0 - (0.5 * z - z * z * (4.16666666666666019037e-02 + z * (-1.38888888888741095749e-03 + z * c)))
    half = ((0.5 * n - 0.25) + _ROUND) - _ROUND  # n / 2, rounded down
    quarter = ((0.5 * half - 0.25) + _ROUND) - _ROUND
    return (1.0 - 2.0 * (half - 2.0 * quarter)) * (c if n - 2.0 * half > 0.5 else s)


@inner
def sine(x: float) -> float:
    """Return sin(x)."""
    n, r = _quadrant(x)
    return _turned(n, r)


@inner
def cosine(x: float) -> float:
    """Return cos(x)."""
    n, r = _quadrant(x)
    return _turned(n + 1.0, r)
