"""How kernels are compiled: for compiled callers, for Python, faster than by numba alone, counted, in two processes."""

from __future__ import annotations

import gc
import io
import operator
import sys
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numba import typeof
from numba.core import types
from numba.core.registry import cpu_target

from mjwrap.kernels.compilation import self_test
from mjwrap.kernels.compilation.cache_folders import config

if config.DISABLE_JIT or self_test.is_plain():
    pytest.skip("kernels are not compiled, or by numba.njit alone", allow_module_level=True)

import mjwrap as mw
from mjwrap.cli.common import meanwhile
from mjwrap.kernels.compilation import linking, pipeline, progress
from mjwrap.muscles import bench
from mjwrap.paths import sweep


def double(x):
    return 2.0 * x


def test_a_kernel_for_compiled_callers_can_be_called_from_python_too() -> None:
    inner = linking.Kernel(double, linking.OPTIONS)

    def outer(x):
        return inner(x) + 1.0

    kernel = linking.FromPython(outer, linking.OPTIONS)
    assert kernel(3.0) == 7.0
    (compiled,) = inner.overloads.values()
    assert "cpython" not in "".join(f.name for f in compiled.library.get_defined_functions())
    assert inner(3.0) == 6.0
    assert len(inner.overloads) == 1  # Python calls a copy
    assert inner(4.0) == 8.0


def test_what_python_calls_has_its_wrapper_at_once() -> None:
    kernel = linking.FromPython(double, linking.OPTIONS)
    assert kernel(3.0) == 6.0
    assert len(kernel.overloads) == 1
    assert kernel._wrapped is None


@pytest.mark.parametrize("fails", [False, True])
def test_numba_and_the_garbage_collector_are_as_before_afterwards(fails: bool) -> None:
    before = types.functions.BaseFunction.get_call_type
    assert gc.isenabled()

    def compile_something() -> None:
        with pipeline.faster(), pipeline.faster():
            assert types.functions.BaseFunction.get_call_type is not before
            assert not gc.isenabled()
            if fails:
                raise RuntimeError

    if fails:
        with pytest.raises(RuntimeError):
            compile_something()
    else:
        compile_something()
    assert types.functions.BaseFunction.get_call_type is before
    assert gc.isenabled()


def test_a_collector_that_was_off_stays_off() -> None:
    gc.disable()
    try:
        with pipeline.faster():
            pass
        assert not gc.isenabled()
    finally:
        gc.enable()


NUMBERS = (types.float64, types.int64, types.int32, types.boolean, types.literal(2), types.literal(-1))


@pytest.mark.parametrize(
    "symbol", ["add", "sub", "mul", "truediv", "floordiv", "pow", "lt", "eq", "and_", "lshift"]
)
def test_remembered_definitions_are_numbas(symbol: str) -> None:
    context: Any = cpu_target.typing_context
    context.refresh()
    function = context.resolve_value_type(getattr(operator, symbol))

    def signature(args, resolve):
        try:
            return resolve(function, context, args, {})
        except Exception as error:
            return type(error)

    numba = types.functions.BaseFunction.get_call_type
    for args in [(a, b) for a in NUMBERS for b in NUMBERS]:
        expected = signature(args, numba)
        assert signature(args, pipeline._call_type) == expected
        again = signature(args, pipeline._call_type)
        assert again == expected
        if not isinstance(expected, type):
            key = function.get_impl_key(again)
            signature(args, numba)
            assert function.get_impl_key(again) == key


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def compilations(count: int, module: str = "mjwrap.kernels.x") -> str:
    """Return what a watcher prints at nested compilations."""
    watcher = progress.Progress()
    event = SimpleNamespace(data={"dispatcher": SimpleNamespace(py_func=SimpleNamespace(__module__=module))})
    for _ in range(count):
        watcher.on_start(event)
    for _ in range(count):
        watcher.on_end(event)
    assert watcher.depth == 0
    assert watcher.count == (count if module.startswith("mjwrap.kernels.") else 0)
    return sys.stderr.getvalue()  # pyright: ignore[reportAttributeAccessIssue]


def test_a_count_moves_on_a_terminal_and_is_gone_at_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stderr", Terminal())
    monkeypatch.setattr(progress, "_OFTEN", 0.0)
    first, _, counts = compilations(3).partition("\n")
    assert first.startswith("mjwrap: compiling its kernels")
    shown = counts.split(progress._CLEARED)
    assert [text.split(",")[0] for text in shown] == [
        "",
        "mjwrap: kernels compiled so far: 1",
        "mjwrap: kernels compiled so far: 2",
        "",
    ]


def test_a_file_gets_a_line_now_and_then(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stderr", io.StringIO())
    assert len(compilations(3).splitlines()) == 1
    monkeypatch.setattr(progress, "_SELDOM", 0.0)
    monkeypatch.setattr(sys, "stderr", io.StringIO())
    assert len(compilations(3).splitlines()) == 3


@pytest.mark.parametrize("module", ["numpy.linalg", "mjwrap_surface_1", "mjwrap.surfaces.x"])
def test_functions_of_others_are_not_counted(module: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stderr", io.StringIO())
    assert compilations(2, module) == ""


def test_another_process_says_how_much_it_compiled() -> None:
    meanwhile.laws()  # kept now
    assert meanwhile.OtherProcess("mjwrap.cli.common.meanwhile:laws").compiled() == 0


def test_a_process_that_fails_is_no_error_here() -> None:
    assert meanwhile.OtherProcess("mjwrap.nowhere:nothing").compiled() is None


def test_another_process_ends_when_it_is_stopped() -> None:
    other = meanwhile.OtherProcess("mjwrap.cli.common.meanwhile:laws")
    other.stop()
    assert other.compiled() is None


def test_no_process_is_started_where_the_laws_are_compiled() -> None:
    meanwhile.laws()
    assert meanwhile.start_laws() is None


def test_all_deferred_kernels_that_may_be_called_can_be_compiled_in_advance() -> None:
    def inner(x):
        return 2.0 * x

    inner.__qualname__ = "in-advance"
    deferred = linking.Deferred(inner, linking.OPTIONS, types.float64)

    def outer(x):
        return deferred(x) if x > 0.0 else 0.0

    kernel = linking.FromPython(outer, linking.OPTIONS)
    assert deferred.compile_called() == 0  # nobody calls it yet
    assert kernel(-1.0) == 0.0
    assert (deferred.compile_called(), deferred.compile_called()) == (1, 0)
    assert kernel(1.0) == 2.0


@pytest.mark.parametrize("number", [1, 2, 3])
def test_a_sweep_over_any_number_of_obstacles_needs_what_warmup_compiles(
    number: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A kernel is compiled anew for each layout of its arrays, so that they all have the same one."""
    seen: list[list[Any]] = []
    monkeypatch.setattr(
        sweep.chain,
        "solve_motion",
        lambda *given: seen.append([typeof(a) for a in given if hasattr(a, "shape")]),
    )
    row = [mw.Obstacle(mw.Sphere(0.01)) for _ in range(number)]
    places, turns = np.zeros((4, number, 3)), np.tile([1.0, 0.0, 0.0, 0.0], (4, number, 1))
    mw.solve_sweep((0.1, 0.0, 0.0), (-0.1, 0.0, 0.0), row, places, turns)
    mw.solve_sweep(np.zeros((4, 3)) + 0.1, (-0.1, 0.0, 0.0), row, places[:, ::-1], turns[:, ::-1])
    assert all(array.layout == "C" for given in seen for array in given)
    assert len(seen) == 2
    assert seen[0] == seen[1]


def test_a_single_muscle_needs_what_warmup_compiles(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[list[Any]] = []
    monkeypatch.setattr(bench.kernels, "simulate", lambda *given: seen.append([typeof(a) for a in given[1:]]))
    law, time = mw.DeGrooteFregly2016(500.0, 0.1, 0.2, tendon="elastic"), np.linspace(0.0, 0.1, 5)
    meanwhile.laws()
    mw.simulate_muscle(
        law, time, np.linspace(0.3, 0.31, 5), excitation=np.linspace(0.1, 0.9, 5), velocity=np.zeros(5)
    )
    time.flags.writeable = False
    mw.simulate_muscle(law, time, 0.3, excitation=0.5)
    assert len(seen) == 3
    assert seen[0] == seen[1] == seen[2]
