"""How compiled kernels call each other: one version for each set of types, linked by symbols where the kernel is large.

numba compiles a function anew for every constant argument. It also copies the machine code of everything that a
function calls, directly or not, into the function's own, and optimises it again at every level. Kernels are never
compiled anew for a constant argument. The code of a large kernel (`NotInlined`) is not copied: its callers contain a
call of a symbol, whose address is set where the kernel is compiled or loaded.
"""

from __future__ import annotations

import hashlib
import importlib
from functools import partial
from typing import Any

import llvmlite.binding as llvm
from llvmlite import ir
from numba.core import cgutils, sigutils, types
from numba.core.compiler import Compiler
from numba.core.registry import CPUDispatcher

Dispatcher: Any = CPUDispatcher
OPTIONS: dict[str, Any] = {
    "nopython": True,
    "boundscheck": None,  # by NUMBA_BOUNDSCHECK
    "nogil": True,
    "error_model": "numpy",
    "fastmath": {"contract"},
    "no_cfunc_wrapper": True,
    "_nrt": False,  # no counting of references on every array handed on; no new arrays either
}


class Kernel(Dispatcher):
    """A compiled function. A constant argument counts as any value of its type."""

    def __init__(self, function: Any, options: dict[str, Any]) -> None:
        super().__init__(py_func=function, locals={}, targetoptions=options, pipeline_class=Compiler)

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Return how compiled code calls it with arguments of these types."""
        return super().get_call_template(
            tuple(map(types.unliteral, args)), {key: types.unliteral(kind) for key, kind in kws.items()}
        )

    def add_overload(self, cres: Any) -> None:
        """Add a compiled or loaded version; its callers load what it needs loaded."""
        cres.library._reload_init.update(cres.reload_init)
        super().add_overload(cres)


class Hidden(Kernel):
    """A compiled function for compiled callers only: without the wrapper through which Python calls."""

    def __call__(self, *args: Any) -> Any:
        """Raise an error that says what to do instead."""
        raise TypeError(
            f"{self.py_func.__name__} can be called from compiled kernels only; use its `py_func`"
        )


class NotInlined(Kernel):
    """A compiled function whose code is not copied into its callers."""

    def __init__(self, function: Any, options: dict[str, Any]) -> None:
        super().__init__(function, options)
        self._calls: dict[Any, object] = {}

    def get_overload(self, sig: Any) -> Any:
        """Return what stands in compiled code for this version: a call of its symbol."""
        args = tuple(sigutils.normalize_signature(sig)[0])
        if args not in self._calls:
            cres, key = self.overloads[args], object()
            name = f"{self.py_func.__module__}.{self.py_func.__qualname__}"
            symbol = f"{name}.{hashlib.sha256(str(args).encode()).hexdigest()[:16]}"
            llvm.add_symbol(symbol, cres.library.get_pointer_to_function(cres.fndesc.llvm_func_name))
            load = partial(_load, self.py_func.__module__, self.py_func.__qualname__, args)
            self.targetctx._defns[key].append(_call(cres.fndesc, symbol, load), args)
            self._calls[args] = key
        return self._calls[args]


def _load(module: str, name: str, args: Any) -> None:
    """Set the address of a version's symbol; runs before machine code that calls the symbol is loaded."""
    kernel = getattr(importlib.import_module(module), name)
    kernel.compile(args)
    kernel.get_overload(args)


def _call(fndesc: Any, symbol: str, load: Any) -> Any:
    """Return the function that generates a call by symbol; `load` is stored with the machine code of the caller."""

    def write(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        context.active_code_library._reload_init.add(load)
        convention = context.call_conv
        kind: ir.FunctionType = convention.get_function_type(fndesc.restype, fndesc.argtypes)
        function = cgutils.get_or_insert_function(builder.module, kind, symbol)
        status, value = convention.call_function(
            builder, function, fndesc.restype, fndesc.argtypes, arguments
        )
        with cgutils.if_unlikely(builder, status.is_error):
            convention.return_status_propagate(builder, status)
        return value

    write.signature = fndesc.argtypes  # pyright: ignore[reportFunctionMemberAccess]
    return write
