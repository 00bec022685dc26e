"""MuJoCo's control callback, borrowed for the length of a step."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import mujoco


@contextmanager
def control_callback(act: Callable[[mujoco.MjData], None], retreat: Callable[[], None]) -> Iterator[None]:
    """Run `act` in MuJoCo's control callback for the length of a with block.

    A callback that is there already, a Python function or a C function pointer, runs first, after `retreat` has taken
    out of the data what `act` put in at the stage before.
    """
    before: Any = mujoco.get_mjcb_control()
    compiled = hasattr(before, "argtypes")

    def callback(model: mujoco.MjModel, data: mujoco.MjData) -> None:
        if before is not None:
            retreat()
            if compiled:
                before(model._address, data._address)
            else:
                before(model, data)
        act(data)

    mujoco.set_mjcb_control(callback)
    try:
        yield
    finally:
        mujoco.set_mjcb_control(before)
