"""How a kernel is compiled for its callers: once for every set of types, and, where wished, apart from them.

numba compiles a function anew for every constant argument, and puts the machine code of all that it calls, directly or
not, into its own, optimised once more at every level. Kernels do without the first; the large ones do without the
second: their callers hold a call of a symbol, which is given an address where the callee is compiled or loaded. Those
that many scenes never need are compiled or loaded when they are first called.
"""

from __future__ import annotations

import _thread
import ctypes
import hashlib
import importlib
import threading
from functools import partial
from typing import Any

import llvmlite.binding as llvm
from llvmlite import ir
from numba.core import cgutils, sigutils, types, typing
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

INTERRUPT_DELAY = 0.05  # [s] by which an interrupt is passed on after a deferred compilation


class Kernel(Dispatcher):
    """A compiled function. Constants among its arguments count as values of their type."""

    def __init__(self, function: Any, options: dict[str, Any]) -> None:
        super().__init__(py_func=function, locals={}, targetoptions=options, pipeline_class=Compiler)

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Return how compiled code calls it with arguments of these types."""
        return super().get_call_template(
            tuple(map(types.unliteral, args)), {key: types.unliteral(kind) for key, kind in kws.items()}
        )

    def add_overload(self, cres: Any) -> None:
        """Enter a compiled or loaded version; what has to be loaded with it has to be with its callers, too."""
        cres.library._reload_init.update(cres.reload_init)
        super().add_overload(cres)


class Hidden(Kernel):
    """A compiled function that only compiled functions call: without the wrapper through which Python would."""

    def __call__(self, *args: Any) -> Any:
        """Say what to do instead."""
        raise TypeError(
            f"{self.py_func.__name__} can be called from compiled kernels only; use its `py_func`"
        )


class Apart(Kernel):
    """A compiled function whose code is not copied into its callers'."""

    def __init__(self, function: Any, options: dict[str, Any]) -> None:
        super().__init__(function, options)
        self._calls: dict[Any, object] = {}

    def get_overload(self, sig: Any) -> Any:
        """Return what stands for a version in compiled code: a call of its symbol."""
        args = tuple(sigutils.normalize_signature(sig)[0])
        if args not in self._calls:
            key = self._calls[args] = object()
            self.targetctx._defns[key].append(self._call(args), args)
        return self._calls[args]

    def _call(self, args: Any) -> Any:
        """Return what writes the call of a version, whose symbol gets its address here."""
        cres, symbol = self.overloads[args], _symbol(self, args)
        llvm.add_symbol(symbol, cres.library.get_pointer_to_function(cres.fndesc.llvm_func_name))

        def callee(context: Any, builder: Any) -> Any:
            kind = context.call_conv.get_function_type(cres.fndesc.restype, cres.fndesc.argtypes)
            return cgutils.get_or_insert_function(builder.module, kind, symbol)

        return _call(self, args, cres.fndesc.restype, cres.fndesc.argtypes, callee)

    def load(self, args: Any) -> None:
        """Give the symbol of a version its address: before machine code is loaded that calls it."""
        self.compile(args)
        self.get_overload(args)


class Deferred(Apart):
    """A compiled function that is compiled or loaded at its first call; what it returns has to be said for that."""

    def __init__(self, function: Any, options: dict[str, Any], returns: Any) -> None:
        super().__init__(function, options)
        self._returns = returns
        self._kept_alive: list[object] = []

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Return how compiled code calls it with arguments of these types, without compiling it."""
        signature, args = self._compiler.fold_argument_types(
            tuple(map(types.unliteral, args)), {key: types.unliteral(kind) for key, kind in kws.items()}
        )
        name = self.py_func.__name__
        found = [typing.signature(self._returns, *args)]
        template = typing.make_concrete_template(f"CallTemplate({name})", key=name, signatures=found)
        return template, signature, args, {}

    def _call(self, args: Any) -> Any:
        """Return what writes the call of a version: by its address once there is one, else after asking for it."""
        symbol, address = _symbol(self, args), ctypes.c_void_p()
        ask = ctypes.CFUNCTYPE(None)(partial(self._provide, args, address))
        self._kept_alive += [address, ask]
        llvm.add_symbol(f"{symbol}.address", ctypes.addressof(address))
        llvm.add_symbol(f"{symbol}.ask", ctypes.cast(ask, ctypes.c_void_p).value)
        callee = partial(_callee_by_address, symbol, self._returns, args)
        return _call(self, args, self._returns, args, callee)

    def _provide(self, args: Any, address: Any) -> None:
        """Compile or load a version and write its address down; an interrupt waits until that is done."""
        interrupted = False
        while address.value is None:
            try:
                self.compile(args)
                cres = self.overloads[args]
                if cres.fndesc.restype != self._returns:
                    raise TypeError(
                        f"{self.py_func.__name__} returns {cres.fndesc.restype}, not {self._returns}"
                    )
                address.value = cres.library.get_pointer_to_function(cres.fndesc.llvm_func_name)
            except KeyboardInterrupt:
                interrupted = True
        if interrupted:  # an exception raised in here would be lost: raise it once the caller has returned
            threading.Timer(INTERRUPT_DELAY, _thread.interrupt_main).start()

    def load(self, args: Any) -> None:
        """Define the symbols of a version: before machine code is loaded that calls it."""
        self.get_overload(args)


def _symbol(kernel: Any, args: Any) -> str:
    """Return the symbol of a version."""
    name = f"{kernel.py_func.__module__}.{kernel.py_func.__qualname__}"
    return f"{name}.{hashlib.sha256(str(args).encode()).hexdigest()[:16]}"


def _load(module: str, name: str, args: Any) -> None:
    """Define the symbols of a version of a kernel."""
    getattr(importlib.import_module(module), name).load(args)


def _call(kernel: Any, args: Any, returns: Any, kinds: Any, callee: Any) -> Any:
    """Return what writes the call of a version; `_load` goes with the machine code of the caller."""
    load = partial(_load, kernel.py_func.__module__, kernel.py_func.__qualname__, args)

    def write(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        context.active_code_library._reload_init.add(load)
        function = callee(context, builder)
        status, value = context.call_conv.call_function(builder, function, returns, kinds, arguments)
        with cgutils.if_unlikely(builder, status.is_error):
            context.call_conv.return_status_propagate(builder, status)
        return value

    write.signature = kinds  # pyright: ignore[reportFunctionMemberAccess]
    return write


def _callee_by_address(symbol: str, returns: Any, args: Any, context: Any, builder: Any) -> Any:
    """Return a function, written into the caller's module, that hands its arguments on to a version."""
    module, convention = builder.module, context.call_conv
    name, kind = f"{symbol}.deferred", convention.get_function_type(returns, args)
    if name in module.globals:
        return module.globals[name]
    function = ir.Function(module, kind, name)
    function.linkage = "internal"
    pointer = kind.as_pointer()
    address = ir.GlobalVariable(module, pointer, f"{symbol}.address")
    ask = cgutils.get_or_insert_function(module, ir.FunctionType(ir.VoidType(), ()), f"{symbol}.ask")
    inner = ir.IRBuilder(function.append_basic_block())
    for _ in range(2):
        found = inner.load(address)
        with inner.if_then(cgutils.is_not_null(inner, found), likely=True):
            inner.ret(inner.call(found, function.args))
        if _ == 0:
            inner.call(ask, ())
    convention.return_user_exc(inner, RuntimeError, (f"{symbol} cannot be compiled",))
    return function
