"""How long compilation takes and how much is compiled, and how it is kept out of the measured time of a run."""

from __future__ import annotations

import contextlib
import time
from typing import Any

import mujoco
from numba.core import event

from mjwrap.errors import MjwrapError
from mjwrap.runs.engine import Engine, PluginEngine


class CompileClock(event.Listener):
    """What numba does inside a with block: `compiled`, a number of functions, in `seconds` of wall time."""

    def __init__(self) -> None:
        self.compiled, self.seconds = 0, 0.0
        self._depth, self._started = 0, 0.0

    def __enter__(self) -> CompileClock:
        event.register("numba:compile", self)
        return self

    def __exit__(self, *_: object) -> None:
        event.unregister("numba:compile", self)

    def on_start(self, event: Any) -> None:
        """Begin to count; a compilation within another one is counted once."""
        if self._depth == 0:
            self._started = time.perf_counter()
        self._depth += 1
        self.compiled += 1

    def on_end(self, event: Any) -> None:
        """Add the time of the outermost compilation."""
        self._depth -= 1
        if self._depth == 0:
            self.seconds += time.perf_counter() - self._started


def rehearse(engine: Engine) -> None:
    """Take one step with a copy of the data, so that kernels are compiled or loaded before time is measured.

    Errors are left to the run, whose first step raises them again.
    """
    copy = mujoco.MjData(engine.model)
    mujoco.mj_copyData(copy, engine.model, engine.data)
    with contextlib.suppress(MjwrapError):
        if isinstance(engine, PluginEngine):
            mujoco.mj_step(engine.model, copy)
        else:
            engine.muscles.step(copy)
