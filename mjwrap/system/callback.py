"""Set MuJoCo's control callback, or that of passive forces, during a step.

MuJoCo has one callback of each kind per process. Threads that step at the same time share it: it finds its step by the
address of the data. When the last step has ended, the callback that was set before is set again.
"""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import mujoco


class _Step(NamedTuple):
    """A step in progress; act: called at every stage; remove_forces: called before another callback runs."""

    act: Callable[[], None]
    remove_forces: Callable[[], None]


class _Hook:
    """A callback of MuJoCo's, by the functions that get and set it, and the steps that use it now."""

    def __init__(self, get: Callable[[], Any], put: Callable[[Any], None]) -> None:
        self._get, self._put = get, put
        self._lock = threading.Lock()
        self._steps: dict[int, _Step] = {}
        self._before: Any = None
        # MuJoCo calls this for every model of the process, also for models that another thread is compiling. Its Python
        # bindings do not know these, so the function works with addresses.
        self._by_address = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)(self._dispatch_addresses)

    def _dispatch(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Call the user's callback, a Python function, then the step to which `data` belongs."""
        step = self._steps.get(data._address)
        if step is not None:
            step.remove_forces()
        self._before(model, data)
        if step is not None:
            step.act()

    def _dispatch_addresses(self, model: int, data: int) -> None:
        """Do the same if the user has no callback, or one in C."""
        step = self._steps.get(data)
        if self._before is not None:
            if step is not None:
                step.remove_forces()
            self._before(model, data)
        if step is not None:
            step.act()

    @contextmanager
    def used(
        self, data: mujoco.MjData, act: Callable[[], None], remove_forces: Callable[[], None]
    ) -> Iterator[None]:
        address = data._address
        with self._lock:
            if not self._steps:
                self._before = self._get()
                native = self._before is None or hasattr(self._before, "argtypes")  # a C function pointer
                self._put(self._by_address if native else self._dispatch)
            self._steps[address] = _Step(act, remove_forces)
        try:
            yield
        finally:
            with self._lock:
                del self._steps[address]
                if not self._steps:
                    self._put(self._before)
                    self._before = None


_CONTROL = _Hook(mujoco.get_mjcb_control, mujoco.set_mjcb_control)
_PASSIVE = _Hook(mujoco.get_mjcb_passive, mujoco.set_mjcb_passive)


def _nothing() -> None:
    pass


@contextmanager
def control_callback(
    data: mujoco.MjData, act: Callable[[], None], remove_forces: Callable[[], None] = _nothing
) -> Iterator[None]:
    """Run `act` in MuJoCo's control callback for `data` during a with block.

    A callback that was set before, a Python function or a C function pointer, runs first. Before it, `remove_forces`
    removes from the data what `act` added at the previous stage.
    """
    with _CONTROL.used(data, act, remove_forces):
        yield


@contextmanager
def passive_callback(data: mujoco.MjData, act: Callable[[], None]) -> Iterator[None]:
    """Run `act` in MuJoCo's callback for passive forces for `data` during a with block, after one set before."""
    with _PASSIVE.used(data, act, _nothing):
        yield
