"""Four small kernels that show whether numba links and stores functions in the way that `linking.py` relies on."""

from __future__ import annotations

import pickle
from typing import Any

from numba.core import types
from numba.core.compiler import CompileResult
from numba.core.serialize import dumps

from mjwrap.kernels.compilation import linking


def _multiply(x, n):
    return n * x


def _shift(x):
    return x + 1.0


def _halve(x):
    return 0.5 * x


def _combine(x):
    return multiply(x, 2) + multiply(x, 3) + shift(x) + halve(2.0 * x)


# `linking.py` looks them up by these names.
multiply = linking.NotInlined(_multiply, linking.OPTIONS)
shift = linking.Kernel(_shift, linking.OPTIONS)
halve = linking.Deferred(_halve, linking.OPTIONS, types.float64)
combine = linking.FromPython(_combine, linking.OPTIONS)
_multiply.__qualname__ = "multiply"
_halve.__qualname__ = "halve"


def passes() -> bool:
    """Return whether calls by symbol, deferred compilation, constant arguments and stored machine code work."""
    combine.compile((types.float64,))
    if halve.overloads or combine(1.5) != 11.5 or len(multiply.overloads) != 1 or len(halve.overloads) != 1:
        return False
    (compiled,) = combine.overloads.values()
    loads = {load.args[1] for load in compiled.library._reload_init}
    kept: Any = pickle.loads(dumps(compiled._reduce()))
    loaded = CompileResult._rebuild(combine.targetctx, *kept)
    return (
        loads == {"multiply", "halve"}
        and loaded.entry_point(1.5) == 11.5
        and loaded.signature.args == (types.float64,)
    )
