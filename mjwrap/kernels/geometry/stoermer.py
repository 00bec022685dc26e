"""Stoermer's rule, extrapolated, for y'' = f(y): order 16 from eight columns of 1 to 8 substeps, side by side in SIMD
lanes.

One large step of length H is done eight times over, with 1, 2, ..., 8 substeps; the errors have even powers of the
substep only, so that fixed weights on the eight results cancel all but H^17 (Hairer, Norsett, Wanner, Solving
Ordinary Differential Equations I, II.14). The columns are independent: they fill the lanes of the vector unit, which
makes a step of order 16 as long as eight evaluations of f. The result without the last column is of order 14; the
difference bounds the error. The surfaces write the rule out with their own f; lanes 0..3 are done after four rounds.
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
ROWS = 10  # of doubles that a step keeps for each lane
_N = np.arange(1.0, LANES + 1.0)


def _weights(n: Any) -> Any:
    """Return the weights of columns with n substeps that cancel the error's even powers (Aitken-Neville at zero)."""
    return np.array([np.prod([a * a / (a * a - b * b) for b in n if b != a]) for a in n])


INVERSE = 1.0 / _N  # of the number of substeps
INVERSE_SQUARE = 1.0 / (_N * _N)
WEIGHT = _weights(_N)
RATE_WEIGHT = WEIGHT * _N  # for the differences, which are 1/n of h times the rate
ERROR_WEIGHT = WEIGHT - np.append(_weights(_N[:-1]), 0.0)  # weights of the error estimate

TOLERANCE = 1e-11  # of the estimate: the error of a step is then below 1e-12, mostly 1e-14 (docs/accuracy.md)
SHRINK_EXPONENT = 1.0 / 15.0  # power by which a rejected step shrinks
MAX_STEPS = 200  # of one geodesic, rejected ones included


def _plain_stack() -> None:
    """Return what stands for a pointer where nothing is compiled: `_plain_carray` makes the memory."""


def _plain_carray(pointer: None, shape: tuple[int, ...]) -> Any:
    """Return an array of its own, which lives as long as it is used (uncompiled kernels)."""
    return np.empty(shape)


def _stack(typing_context: Any) -> Any:
    """Return a pointer to ROWS x LANES doubles on the caller's stack: no allocation, and nothing can alias them."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        kind = ir.ArrayType(ir.DoubleType(), ROWS * LANES)
        return builder.bitcast(cgutils.alloca_once(builder, kind), ir.DoubleType().as_pointer())

    return types.CPointer(types.float64)(), generate


def _carray() -> Any:
    """Return what makes an array of a pointer; numba's own makes one whose references are counted."""
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
