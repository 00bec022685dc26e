"""Sets MuJoCo's control callback for the length of a step.

The callback belongs to the whole process, so several threads that step at the same time share one: it finds the step
that it belongs to by the address of the data. The last step to end gives the callback back to whoever had it before.
"""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import mujoco


class _Step(NamedTuple):
    """A step in progress: what puts its forces in, and what takes them out before others look."""

    act: Callable[[], None]
    remove_forces: Callable[[], None]


_LOCK = threading.Lock()
_STEPS: dict[int, _Step] = {}
_before: Any = None


def _dispatch(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Call a controller written in Python, then the step that `data` belongs to."""
    step = _STEPS.get(data._address)
    if step is not None:
        step.remove_forces()
    _before(model, data)
    if step is not None:
        step.act()


@ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)
def _dispatch_addresses(model: int, data: int) -> None:
    """Do the same where no controller in Python is there.

    MuJoCo calls this for every model of the process, those that another thread is compiling among them, which its
    Python bindings do not know: addresses serve all of them.
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
    """Run `act` in MuJoCo's control callback for `data`, for the length of a with block.

    A callback that is there already, a Python function or a C function pointer, runs first, after `retreat` has taken
    out of the data what `act` put in at the stage before.
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
