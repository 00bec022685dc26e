"""Set MuJoCo's control callback during a step.

MuJoCo has one control callback per process. Threads that step at the same time share it: it finds its step by the
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
    """A step in progress; act: adds the muscles' forces; remove_forces: removes them before another callback runs."""

    act: Callable[[], None]
    remove_forces: Callable[[], None]


_LOCK = threading.Lock()
_STEPS: dict[int, _Step] = {}
_before: Any = None


def _dispatch(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Call the user's controller, a Python function, then the step to which `data` belongs."""
    step = _STEPS.get(data._address)
    if step is not None:
        step.remove_forces()
    _before(model, data)
    if step is not None:
        step.act()


@ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)
def _dispatch_addresses(model: int, data: int) -> None:
    """Do the same if the user has no controller, or one in C.

    MuJoCo calls this for every model of the process, also for models that another thread is compiling. Its Python
    bindings do not know these, so the function works with addresses.
    """
    step = _STEPS.get(data)
    if _before is not None:
        if step is not None:
            step.remove_forces()
        _before(model, data)
    if step is not None:
        step.act()


@contextmanager
def control_callback(
    data: mujoco.MjData, act: Callable[[], None], remove_forces: Callable[[], None]
) -> Iterator[None]:
    """Run `act` in MuJoCo's control callback for `data` during a with block.

    A callback that was set before, a Python function or a C function pointer, runs first. Before it, `remove_forces`
    removes from the data what `act` added at the previous stage.
    """
    global _before
    address = data._address
    with _LOCK:
        if not _STEPS:
            _before = mujoco.get_mjcb_control()
            native = _before is None or hasattr(_before, "argtypes")  # a C function pointer
            mujoco.set_mjcb_control(_dispatch_addresses if native else _dispatch)
        _STEPS[address] = _Step(act, remove_forces)
    try:
        yield
    finally:
        with _LOCK:
            del _STEPS[address]
            if not _STEPS:
                mujoco.set_mjcb_control(_before)
                _before = None
