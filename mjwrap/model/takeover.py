"""Keeping native actuators from pulling what mjwrap pulls.

A silenced actuator keeps control, activation dynamics, gain and bias; its force is clamped to zero through
`actuator_forcerange`, which MuJoCo reads at every step. The limits it had before stand in the last of its gain and
bias parameters, which no actuator that mjwrap takes over uses: so a copy of a silenced model knows them too.
"""

from __future__ import annotations

import weakref
from collections.abc import Iterator
from contextlib import contextmanager
from typing import NamedTuple

import mujoco
import numpy as np


class _Limits(NamedTuple):
    """Force limits of an actuator [N]; without limits, low and high are MuJoCo's largest number."""

    limited: bool
    low: float
    high: float


_RELEASES: dict[int, int] = {}  # how often each living model was released, by its id
_UNLIMITED = _Limits(False, -mujoco.mjMAXVAL, mujoco.mjMAXVAL)


class Takeover:
    """The actuators of one model that are silenced, whoever did it."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self._model = model
        if id(model) not in _RELEASES:
            weakref.finalize(model, _RELEASES.pop, id(model), None)
        self._seen = _RELEASES.setdefault(id(model), 0)
        marks = zip(model.actuator_gainprm[:, -1], model.actuator_biasprm[:, -1], strict=True)
        self._limits = {
            actuator: _Limits(high < mujoco.mjMAXVAL, low, high)
            for actuator, (low, high) in enumerate((float(a), float(b)) for a, b in marks)
            if low < high and self._is_silent(actuator)
        }

    def _is_silent(self, actuator: int) -> bool:
        return (
            bool(self._model.actuator_forcelimited[actuator])
            and not self._model.actuator_forcerange[actuator].any()
        )

    def _silence(self, actuator: int, limits: _Limits) -> None:
        model = self._model
        model.actuator_gainprm[actuator, -1], model.actuator_biasprm[actuator, -1] = limits[1:]
        model.actuator_forcelimited[actuator], model.actuator_forcerange[actuator] = 1, 0.0

    def _restore(self, actuator: int, limits: _Limits) -> None:
        model = self._model
        model.actuator_gainprm[actuator, -1] = model.actuator_biasprm[actuator, -1] = 0.0
        model.actuator_forcelimited[actuator] = limits.limited
        model.actuator_forcerange[actuator] = limits[1:] if limits.limited else 0.0

    def silence(self, actuators: list[int]) -> None:
        """Clamp the actuators' forces to zero, and keep their limits unless they are silenced already."""
        for actuator in actuators:
            if actuator not in self._limits:
                low, high = np.asarray(self._model.actuator_forcerange[actuator]).tolist()
                limited = bool(self._model.actuator_forcelimited[actuator])
                self._limits[actuator] = _Limits(True, low, high) if limited else _UNLIMITED
            self._silence(actuator, self._limits[actuator])

    def lost(self) -> bool:
        """Return whether the model was released, by this or another takeover, since this one began."""
        return _RELEASES[id(self._model)] != self._seen

    def release(self) -> None:
        """Restore the original limits of those that are silenced still."""
        for actuator, limits in self._limits.items():
            if self._is_silent(actuator):
                self._restore(actuator, limits)
        self._limits.clear()
        _RELEASES[id(self._model)] += 1

    @contextmanager
    def suspended(self) -> Iterator[None]:
        """Show the original limits for the length of a with block, so that declarations are read as written."""
        for actuator, limits in self._limits.items():
            self._restore(actuator, limits)
        try:
            yield
        finally:
            for actuator, limits in self._limits.items():
                self._silence(actuator, limits)
