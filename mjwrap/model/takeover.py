"""Disable the native actuators whose muscles mjwrap drives, and enable them again.

A disabled actuator keeps control, activation dynamics, gain and bias; its force is limited to zero by
`actuator_forcerange`, which MuJoCo reads at every step. Its original limits are stored in the model itself
(`mjwrap/mjcf/marks.py`), so that a copy of the model has them too.
"""

from __future__ import annotations

import weakref
from collections.abc import Iterator
from contextlib import contextmanager

import mujoco

from mjwrap.mjcf import marks

_RELEASES: dict[int, int] = {}  # number of releases of each existing model, by its id


class Takeover:
    """The disabled actuators of one model, also those that another takeover has disabled."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self._model = model
        if id(model) not in _RELEASES:
            weakref.finalize(model, _RELEASES.pop, id(model), None)
        self._seen = _RELEASES.setdefault(id(model), 0)
        self._limits = marks.disabled_actuators(model)

    def disable(self, actuators: list[int]) -> None:
        """Limit the actuators' forces to zero; store their limits, unless they are already disabled."""
        for actuator in actuators:
            if actuator not in self._limits:
                self._limits[actuator] = marks.force_limits(self._model, actuator)
            marks.disable_force(self._model, actuator, self._limits[actuator])

    def was_released(self) -> bool:
        """Return whether the model was released, by this or another takeover, since this one was made."""
        return _RELEASES[id(self._model)] != self._seen

    def release(self) -> None:
        """Restore the original limits of the actuators that are still disabled."""
        for actuator, limits in self._limits.items():
            if marks.is_disabled(self._model, actuator):
                marks.enable_force(self._model, actuator, limits)
        self._limits.clear()
        _RELEASES[id(self._model)] += 1

    @contextmanager
    def original_limits(self) -> Iterator[None]:
        """Restore the original limits inside a with block, so that declarations can be read."""
        for actuator, limits in self._limits.items():
            marks.enable_force(self._model, actuator, limits)
        try:
            yield
        finally:
            for actuator, limits in self._limits.items():
                marks.disable_force(self._model, actuator, limits)
