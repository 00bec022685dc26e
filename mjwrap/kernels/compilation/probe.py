"""Three small kernels that show whether numba links and stores functions in the way that `linking.py` relies on."""

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


def _combine(x):
    return multiply(x, 2) + multiply(x, 3) + shift(x)


# `linking.py` looks them up by these names.
multiply = linking.NotInlined(_multiply, linking.OPTIONS)
shift = linking.Hidden(_shift, linking.OPTIONS | {"no_cpython_wrapper": True})
combine = linking.Kernel(_combine, linking.OPTIONS)
_multiply.__qualname__ = "multiply"


def passes() -> bool:
    """Return whether calls by symbol, constant arguments and stored machine code work as expected."""
    if combine(1.5) != 10.0 or len(multiply.overloads) != 1:
        return False
    (compiled,) = combine.overloads.values()
    loads = [load for load in compiled.library._reload_init if load.args[1] == "multiply"]
    kept: Any = pickle.loads(dumps(compiled._reduce()))
    loaded = CompileResult._rebuild(combine.targetctx, *kept)
    return bool(loads) and loaded.entry_point(1.5) == 10.0 and loaded.signature.args == (types.float64,)
