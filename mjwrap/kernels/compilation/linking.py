"""How compiled kernels call each other: one version for each set of types, linked by symbols where the kernel is large.

numba compiles a function anew for every constant argument. It also copies the machine code of everything that a
function calls, directly or not, into the function's own, and optimises it again at every level. Kernels are never
compiled anew for a constant argument. The code of a large kernel (`NotInlined`) is not copied: its callers contain a
call of a symbol, whose address is set where the kernel is compiled or loaded. A large kernel that many scenes never
need (`Deferred`) is compiled or loaded when it is first called.
"""

from __future__ import annotations

import _thread
import ctypes
import hashlib
import importlib
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from functools import partial
from types import FunctionType
from typing import Any

import llvmlite.binding as llvm
from llvmlite import ir
from numba.core import cgutils, event, sigutils, types
from numba.core.caching import NullCache
from numba.core.compiler_lock import global_compiler_lock
from numba.core.registry import CPUDispatcher
from numba.core.typing import templates

from mjwrap.kernels.compilation.pipeline import KernelCompiler, faster

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

SIGNAL_DELAY = 0.05  # [s] after which a signal is delivered that came during a deferred compilation
SIGNALS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]


class Kernel(Dispatcher):
    """A compiled function for compiled callers. A constant argument counts as any value of its type.

    Called from Python, it compiles a copy of the function with the wrapper that this needs.
    """

    _WRAPPED = False

    def __init__(self, function: Any, options: dict[str, Any]) -> None:
        options = options | {"no_cpython_wrapper": not self._WRAPPED}
        super().__init__(py_func=function, locals={}, targetoptions=options, pipeline_class=KernelCompiler)
        self._wrapped: Any = None
        self.kept: Callable[[], Any] = nullcontext  # inside it, caching is enabled

    def __call__(self, *args: Any) -> Any:
        """Call from Python."""
        if self._wrapped is None:
            self._wrapped = self._copy()
        return self._wrapped(*args)

    def _copy(self) -> Any:
        """Return a kernel of the same function that Python can call; its machine code is kept beside this kernel's."""
        function, suffix = self.py_func, "_from_python"
        copy = FunctionType(
            function.__code__,
            function.__globals__,
            function.__name__ + suffix,
            function.__defaults__,
            function.__closure__,
        )
        copy.__qualname__, copy.__module__ = function.__qualname__ + suffix, function.__module__
        wrapped = FromPython(copy, self.targetoptions)
        if not isinstance(self._cache, NullCache):
            with self.kept():
                wrapped.enable_caching()
        return wrapped

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Return how compiled code calls it with arguments of these types."""
        return super().get_call_template(
            tuple(map(types.unliteral, args)), {key: types.unliteral(kind) for key, kind in kws.items()}
        )

    def add_overload(self, cres: Any) -> None:
        """Add a compiled or loaded version; its callers load what it needs loaded."""
        cres.library._reload_init.update(cres.reload_init)
        super().add_overload(cres)

    def compile(self, sig: Any) -> Any:
        """Compile or load a version, as numba does but for its clocks, which cost a tenth of the time."""
        args = tuple(sigutils.normalize_signature(sig)[0])
        with global_compiler_lock, faster(), self._compiling_counter:
            if args not in self.overloads:
                found = self._cache.load_overload(sig, self.targetctx)
                if found is None:
                    found = self._compiled(sig, args)
                else:
                    self._cache_hits[sig] += 1
                    self.targetctx.insert_user_function(found.entry_point, found.fndesc, [found.library])
                    self.add_overload(found)
            return self.overloads[args].entry_point

    def _compiled(self, sig: Any, args: Any) -> Any:
        """Compile and store a version."""
        self._cache_misses[sig] += 1
        with event.trigger_event(
            "numba:compile", data={"dispatcher": self, "args": args, "return_type": None}
        ):
            found = self._compiler.compile(args, None)
            self.add_overload(found)
        self._cache.save_overload(sig, found)
        return found


class FromPython(Kernel):
    """A compiled function for Python and compiled callers alike."""

    _WRAPPED = True
    __call__ = Dispatcher.__call__


class NotInlined(Kernel):
    """A compiled function whose code is not copied into its callers."""

    def __init__(self, function: Any, options: dict[str, Any]) -> None:
        super().__init__(function, options)
        self._calls: dict[Any, object] = {}

    def get_overload(self, sig: Any) -> Any:
        """Return what stands in compiled code for this version: a call of its symbol."""
        args = tuple(sigutils.normalize_signature(sig)[0])
        if args not in self._calls:
            key = self._calls[args] = object()
            self.targetctx._defns[key].append(self._call(args), args)
        return self._calls[args]

    def _call(self, args: Any) -> Any:
        """Return the function that generates a call of a version; set the address of its symbol."""
        cres, symbol = self.overloads[args], _symbol(self, args)
        llvm.add_symbol(symbol, cres.library.get_pointer_to_function(cres.fndesc.llvm_func_name))

        def callee(context: Any, builder: Any) -> Any:
            kind = context.call_conv.get_function_type(cres.fndesc.restype, cres.fndesc.argtypes)
            return cgutils.get_or_insert_function(builder.module, kind, symbol)

        return _call(self, args, cres.fndesc.restype, cres.fndesc.argtypes, callee)

    def load(self, args: Any) -> None:
        """Set the address of a version's symbol; runs before machine code that calls the symbol is loaded."""
        self.compile(args)
        self.get_overload(args)


class Deferred(NotInlined):
    """A function that is compiled or loaded at its first call; callers need the types that it returns before that."""

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
        found = [templates.signature(self._returns, *args)]
        template = templates.make_concrete_template(f"CallTemplate({name})", key=name, signatures=found)
        return template, signature, args, {}

    def _call(self, args: Any) -> Any:
        """Return the function that generates a call by address; the address is asked for at the first call."""
        symbol, address = _symbol(self, args), ctypes.c_void_p()
        ask = ctypes.CFUNCTYPE(None)(partial(self._provide, args, address))
        self._kept_alive += [address, ask]
        llvm.add_symbol(f"{symbol}.address", ctypes.addressof(address))
        llvm.add_symbol(f"{symbol}.ask", ctypes.cast(ask, ctypes.c_void_p).value)
        callee = partial(_callee_by_address, symbol, self._returns, args)
        return _call(self, args, self._returns, args, callee)

    def _provide(self, args: Any, address: Any) -> None:
        """Compile or load a version and store its address; signals wait until this is done."""
        with _signals_held():
            self.compile(args)
            cres = self.overloads[args]
            if cres.fndesc.restype != self._returns:
                raise TypeError(f"{self.py_func.__name__} returns {cres.fndesc.restype}, not {self._returns}")
            address.value = cres.library.get_pointer_to_function(cres.fndesc.llvm_func_name)

    def load(self, args: Any) -> None:
        """Define the symbols of a version; runs before machine code that calls them is loaded."""
        self.get_overload(args)

    def compile_called(self) -> int:
        """Compile or load the versions that kernels loaded so far may call; return how many are new."""
        before = len(self.overloads)
        for args in list(self._calls):
            self.compile(args)
        return len(self.overloads) - before


@contextmanager
def _signals_held() -> Iterator[None]:
    """Deliver signals that have a handler in Python some time after a with block, not inside it.

    The block runs inside a call from compiled code, and calls LLVM, which calls Python: an exception that a handler
    raises in there would be lost, and would end the process if LLVM waited for a result.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    handlers = {number: signal.getsignal(number) for number in SIGNALS}
    held: list[int] = []
    for number in (number for number, handler in handlers.items() if callable(handler)):
        signal.signal(number, lambda received, _: held.append(received))
    try:
        yield
    finally:
        for number, handler in handlers.items():
            if callable(handler):
                signal.signal(number, handler)
        for number in dict.fromkeys(held):
            threading.Timer(SIGNAL_DELAY, _thread.interrupt_main, [number]).start()


def _symbol(kernel: Any, args: Any) -> str:
    """Return the symbol of a version."""
    name = f"{kernel.py_func.__module__}.{kernel.py_func.__qualname__}"
    return f"{name}.{hashlib.sha256(str(args).encode()).hexdigest()[:16]}"


def _load(module: str, name: str, args: Any) -> None:
    """Define the symbols of a version of a kernel."""
    getattr(importlib.import_module(module), name).load(args)


def _call(kernel: Any, args: Any, returns: Any, kinds: Any, callee: Any) -> Any:
    """Return the function that generates a call of a version; `_load` is stored with the machine code of the caller."""
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
    """Return a function, added to the caller's module, that calls a version with its own arguments."""
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
