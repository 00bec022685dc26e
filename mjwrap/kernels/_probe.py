"""Four small kernels that show whether numba links and keeps functions as `_kernel.py` takes it to."""

from __future__ import annotations

import pickle
from typing import Any

from numba.core import types
from numba.core.compiler import CompileResult
from numba.core.serialize import dumps

from mjwrap.kernels import _kernel


def _multiply(x, n):
    return n * x


def _shift(x):
    return x + 1.0


def _halve(x):
    return 0.5 * x


def _combine(x):
    return multiply(x, 2) + multiply(x, 3) + shift(x) + halve(2.0 * x)


# Names of the module, under which `_kernel.py` looks them up.
multiply = _kernel.Apart(_multiply, _kernel.OPTIONS)
shift = _kernel.Hidden(_shift, _kernel.OPTIONS | {"no_cpython_wrapper": True})
halve = _kernel.Deferred(_halve, _kernel.OPTIONS, types.float64)
combine = _kernel.Kernel(_combine, _kernel.OPTIONS)
_multiply.__qualname__ = "multiply"
_halve.__qualname__ = "halve"


def passes() -> bool:
    """Return whether calls by a symbol, constants as arguments and machine code from a file do what they should."""
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
