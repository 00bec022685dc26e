"""Disables native actuators whose muscles mjwrap pulls, and gives them back.

A disabled actuator keeps control, activation dynamics, gain and bias; its force is clamped to zero through
`actuator_forcerange`, which MuJoCo reads at every step. The limits that it had stand in the model itself
(`mjwrap/mjcf/marks.py`): so a copy of such a model knows them too.
"""

from __future__ import annotations

import weakref
from collections.abc import Iterator
from contextlib import contextmanager

import mujoco

from mjwrap.mjcf import marks

_RELEASES: dict[int, int] = {}  # how often each living model was released, by its id


class Takeover:
    """The disabled actuators of one model, whoever disabled them."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self._model = model
        if id(model) not in _RELEASES:
            weakref.finalize(model, _RELEASES.pop, id(model), None)
        self._seen = _RELEASES.setdefault(id(model), 0)
        self._limits = marks.disabled_actuators(model)

    def disable(self, actuators: list[int]) -> None:
        """Clamp the actuators' forces to zero, and keep their limits unless they are disabled already."""
        for actuator in actuators:
            if actuator not in self._limits:
                self._limits[actuator] = marks.force_limits(self._model, actuator)
            marks.disable_force(self._model, actuator, self._limits[actuator])

    def was_released(self) -> bool:
        """Return whether the model was released, by this or another takeover, since this one began."""
        return _RELEASES[id(self._model)] != self._seen

    def release(self) -> None:
        """Give the actuators that are disabled still their original limits back."""
        for actuator, limits in self._limits.items():
            if marks.is_disabled(self._model, actuator):
                marks.enable_force(self._model, actuator, limits)
        self._limits.clear()
        _RELEASES[id(self._model)] += 1

    @contextmanager
    def original_limits(self) -> Iterator[None]:
        """Show the original limits for the length of a with block, so that declarations are read as written."""
        for actuator, limits in self._limits.items():
            marks.enable_force(self._model, actuator, limits)
        try:
            yield
        finally:
            for actuator, limits in self._limits.items():
                marks.disable_force(self._model, actuator, limits)
