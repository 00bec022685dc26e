"""Cables that pushed during a run, as no string can: mostly a sign of the gear that is not meant."""

from __future__ import annotations

import mujoco
import numpy as np

from mjwrap.system import MuscleSystem, pulls_as_cable

LEAST = 1e-3  # a push that counts, as a share of the largest force of the cables


class Pushes:
    """The largest push of each cable at the states that `look` is called at [N]."""

    def __init__(self, muscles: MuscleSystem) -> None:
        model = muscles.model
        cables = [m for m in muscles.declarations if pulls_as_cable(model, m)]
        self._names = [m.name for m in cables]
        self._actuators = np.array([m.actuator for m in cables], dtype=np.int64)
        self._gear = model.actuator_gear[self._actuators, 0].copy()
        self._low = np.zeros(len(cables))
        self._largest = 0.0

    def look(self, data: mujoco.MjData) -> None:
        """Read the forces of the last step."""
        if self._names:
            tension = -self._gear * data.actuator_force[self._actuators]
            self._low = np.minimum(self._low, tension)
            self._largest = max(self._largest, float(np.abs(tension).max()))

    def found(self) -> dict[str, float]:
        """Return the largest push [N] of the cables that pushed, by name."""
        least = LEAST * self._largest
        return {name: -low for name, low in zip(self._names, self._low.tolist(), strict=True) if -low > least}

    def told(self) -> str:
        """Return a sentence about the cables that pushed, else ""."""
        found = self.found()
        if not found:
            return ""
        shown = ", ".join(f"{name} with up to {force:.3g} N" for name, force in found.items())
        return (
            f"cables that pushed, as a string cannot: {shown}; a cable pulls where its actuator's force is negative: "
            f"give it a negative gear or gain, or forcerange with 0 as its upper end"
        )
