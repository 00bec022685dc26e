"""Extrapolated Stoermer rule for y'' = f(y): order 16 from eight columns of 1 to 8 substeps, one in each SIMD lane.

A step of length H is computed eight times, with 1, 2, ..., 8 substeps. The errors contain only even powers of the
substep, so that fixed weights on the eight results cancel all terms up to H^16 (Hairer, Norsett and Wanner 1993,
Solving Ordinary Differential Equations I, II.14). The columns are independent and fill the lanes of the vector unit, so
that a step takes the time of eight evaluations of f. Without the last column the result is of order 14; the difference
estimates the error. Each surface writes out the rule with its own f; lanes 0..3 are complete after four rounds.
"""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from mjwrap.kernels.compilation.jit import config, inlined
from mjwrap.kernels.compilation.self_test import is_plain

LANES = 8
ROWS = 10  # numbers that a step keeps for each lane
_N = np.arange(1.0, LANES + 1.0)


def _weights(n: Any) -> Any:
    """Return the weights of columns with n substeps that cancel the error's even powers (Aitken-Neville at zero)."""
    return np.array([np.prod([a * a / (a * a - b * b) for b in n if b != a]) for a in n])


INVERSE = 1.0 / _N  # reciprocal of the number of substeps
INVERSE_SQUARE = 1.0 / (_N * _N)
WEIGHT = _weights(_N)
RATE_WEIGHT = WEIGHT * _N  # weights of the last differences, which are h y' / n
ERROR_WEIGHT = WEIGHT - np.append(_weights(_N[:-1]), 0.0)  # weights of the error estimate

# largest error estimate; the error of a step is then below 1e-12, mostly 1e-14 (docs/accuracy.md)
TOLERANCE = 1e-11
SHRINK_EXPONENT = 1.0 / 15.0  # power of TOLERANCE over the estimate by which a rejected step is shortened
MAX_STEPS = 200  # most steps of one geodesic, with the rejected ones


def _plain_stack() -> None:
    """Return nothing, in place of a pointer, in kernels that are not compiled: `_plain_carray` makes the memory."""


def _plain_carray(pointer: None, shape: tuple[int, ...]) -> Any:
    """Return a new array; for kernels that are not compiled."""
    return np.empty(shape)


def _stack(typing_context: Any) -> Any:
    """Return a pointer to ROWS x LANES doubles on the caller's stack, without allocation and aliases."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        kind = ir.ArrayType(ir.DoubleType(), ROWS * LANES)
        return builder.bitcast(cgutils.alloca_once(builder, kind), ir.DoubleType().as_pointer())

    return types.CPointer(types.float64)(), generate


def _carray() -> Any:
    """Return the function that makes an array from a pointer, without counting references as numba's own does."""
    if config.DISABLE_JIT:
        return _plain_carray
    if is_plain():
        return getattr(numba, "carray")  # noqa: B009
    from numba.np.arrayobj import get_cfarray_intrinsic

    return get_cfarray_intrinsic("C", None)


stack: Any = _plain_stack if config.DISABLE_JIT else intrinsic(_stack)
carray: Any = _carray()


@inlined
def combine(v, row, weight):
    """Return the weighted sum over the lanes of a row of v."""
    return (
        (v[row, 0] * weight[0] + v[row, 1] * weight[1]) + (v[row, 2] * weight[2] + v[row, 3] * weight[3])
    ) + ((v[row, 4] * weight[4] + v[row, 5] * weight[5]) + (v[row, 6] * weight[6] + v[row, 7] * weight[7]))
