"""Keeping native actuators from pulling what mjwrap pulls.

A silenced actuator keeps control, activation dynamics, gain and bias; its force is clamped to zero through
`actuator_forcerange`, a field that MuJoCo reads at every step. The original limits are remembered per model.
"""

from __future__ import annotations

import weakref
from collections.abc import Iterator
from contextlib import contextmanager

import mujoco
import numpy as np

_Limits = tuple[int, float, float]
_ORIGINAL: dict[int, dict[int, _Limits]] = {}


class Takeover:
    """The actuators of one model that are silenced, with their original force limits."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self._model = model
        key = id(model)
        if key not in _ORIGINAL:
            _ORIGINAL[key] = {}
            weakref.finalize(model, _ORIGINAL.pop, key, None)
        self._limits = _ORIGINAL[key]

    def _write(self, actuator: int, limits: _Limits) -> None:
        self._model.actuator_forcelimited[actuator] = limits[0]
        self._model.actuator_forcerange[actuator] = limits[1:]

    def silence(self, actuators: list[int]) -> None:
        """Clamp the actuators' forces to zero; remember their limits unless they are silenced already."""
        for actuator in actuators:
            if actuator not in self._limits:
                low, high = np.asarray(self._model.actuator_forcerange[actuator]).tolist()
                self._limits[actuator] = (int(self._model.actuator_forcelimited[actuator]), low, high)
            self._write(actuator, (1, 0.0, 0.0))

    def release(self) -> None:
        """Restore the original limits."""
        for actuator, limits in self._limits.items():
            self._write(actuator, limits)
        self._limits.clear()

    @contextmanager
    def suspended(self) -> Iterator[None]:
        """Show the original limits for the length of a with block, so that declarations are read as written."""
        for actuator, limits in self._limits.items():
            self._write(actuator, limits)
        try:
            yield
        finally:
            for actuator in self._limits:
                self._write(actuator, (1, 0.0, 0.0))
