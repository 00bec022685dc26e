"""Kernels that are compiled at their first call: when, once, by which thread, and what happens where that fails."""

from __future__ import annotations

import signal
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import pytest
from fresh_starts import run
from numba.core import types

from mjwrap.kernels.compilation import self_test
from mjwrap.kernels.compilation.cache_folders import config

if config.DISABLE_JIT or self_test.is_plain():
    pytest.skip("kernels are not compiled, or by numba.njit alone", allow_module_level=True)

from mjwrap.kernels.compilation import linking

OPTIONS = linking.OPTIONS


def make(returns=types.float64, kind=linking.Deferred):
    """Return a deferred kernel and one that calls it where its argument is positive."""

    def called(x, n):
        return n * x

    called.__qualname__ = f"called-{len(MADE)}"  # its symbols are its own
    deferred = kind(called, OPTIONS, returns)
    MADE.append(deferred)

    def caller(x):
        if x > 0.0:
            return deferred(x, 2)
        return 0.0

    return deferred, linking.Kernel(caller, OPTIONS)


MADE: list[object] = []


def test_it_is_compiled_at_its_first_call_and_once() -> None:
    deferred, caller = make()
    assert caller(-1.0) == 0.0
    assert not deferred.overloads
    assert [caller(float(x)) for x in (1, 2, 3)] == [2.0, 4.0, 6.0]
    assert len(deferred.overloads) == 1


def test_python_calls_it_as_any_other() -> None:
    deferred, caller = make()
    assert deferred(1.5, 2) == 3.0
    assert caller(1.5) == 3.0


def test_several_threads_may_be_the_first() -> None:
    deferred, caller = make()
    caller(-1.0)
    gate = threading.Barrier(8)

    def call(x: int) -> float:
        gate.wait()
        return caller(float(x))

    with ThreadPoolExecutor(8) as pool:
        assert list(pool.map(call, range(1, 9))) == [2.0 * x for x in range(1, 9)]
    assert len(deferred.overloads) == 1


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("returns", [types.int64, types.UniTuple(types.float64, 2), types.none])
def test_a_wrong_type_of_what_it_returns_is_an_error(returns) -> None:
    def called(x):
        return 2.0 * x

    called.__qualname__ = f"wrong-{returns}"
    deferred = linking.Deferred(called, OPTIONS, returns)
    MADE.append(deferred)

    def caller(x):
        deferred(x)
        return x

    kernel = linking.Kernel(caller, OPTIONS)
    with pytest.raises(RuntimeError, match="cannot be compiled"):
        kernel(1.0)


def test_an_interrupt_waits_until_the_machine_code_is_there() -> None:
    class Interrupted(linking.Deferred):
        first = True

        def compile(self, sig):
            if self.first:
                self.first = False
                signal.raise_signal(signal.SIGINT)
            return super().compile(sig)

    before = signal.getsignal(signal.SIGINT)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        deferred, caller = make(kind=Interrupted)
        with pytest.raises(KeyboardInterrupt):
            assert caller(1.0) == 2.0
            time.sleep(5.0)  # ends when the interrupt comes
        assert len(deferred.overloads) == 1
        assert caller(1.0) == 2.0
    finally:
        signal.signal(signal.SIGINT, before)


# One path, with what it compiled: a cylinder needs nothing of tori, nor of ends inside.
SCENE = """
import json
import mjwrap as mw
from mjwrap.kernels.geometry import quadric, torus
from mjwrap.kernels.spans import end_inside
row = [mw.Obstacle({surface}, hint=(0.0, 0.03, 0.0))]
path = mw.solve_path((0.1, 0.01, 0.0), {insertion}, row)
print(json.dumps({{"numbers": [path.length, *(len(kernel.overloads)
    for kernel in (quadric.quadric, torus.torus, end_inside.substitute_path))], "folder": "."}}))
"""


@pytest.mark.slow
@pytest.mark.parametrize("again", [False, True])
def test_a_scene_compiles_or_loads_what_it_needs(
    again: bool, tmp_path_factory: pytest.TempPathFactory
) -> None:
    home = tmp_path_factory.getbasetemp() / "deferred"
    plain = run(SCENE.format(surface="mw.Cylinder(0.03)", insertion="(-0.2, 0.0, 0.02)"), home)
    inside = run(
        SCENE.format(surface="mw.Ellipsoid((0.03, 0.04, 0.05))", insertion="(-0.01, 0.01, 0.02)"), home
    )
    assert plain.numbers[1:] == [0, 0, 0]
    assert inside.numbers[1:] == [1, 0, 1]
    assert plain.told == [] if again else len(plain.told) == 1
