"""Find cables whose actuator can only push, and models whose actuators are switched off."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np

from mjwrap.checking.mistakes.finding import Mistake, PossibleMistake, muscle_of
from mjwrap.checking.mistakes.pose import Posed
from mjwrap.system import pulls_as_cable

_FIXED, _NO_BIAS = int(mujoco.mjtGain.mjGAIN_FIXED), int(mujoco.mjtBias.mjBIAS_NONE)
_DISABLED = int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)


def actuator_mistakes(posed: Posed) -> Iterator[PossibleMistake]:
    """Yield a finding for every cable that can only push, and one for a model without actuation."""
    model = posed.model
    if int(model.opt.disableflags) & _DISABLED and posed.muscles.n:
        yield PossibleMistake(
            Mistake.ACTUATION,
            "model",
            "switches all actuators off, so that controls do nothing",
            'leave out <flag actuation="disable"/>, or add the forces yourself',
        )
    for muscle in posed.muscles.declarations:
        if not pulls_as_cable(model, muscle):
            continue
        i = muscle.actuator
        low, high = _tensions(model, i)
        if high <= 0.0 and low < 0.0:
            gear = float(model.actuator_gear[i, 0])
            yield PossibleMistake(
                Mistake.PUSHES,
                muscle_of(model, muscle),
                f"can only push, as a string cannot: its controls give tensions from {low:.3g} to {high + 0.0:.3g} N",
                f'a cable pulls where its actuator\'s force is negative: write gear="{-gear:g}"',
            )


def _tensions(model: mujoco.MjModel, actuator: int) -> tuple[float, float]:
    """Return the least and the largest tension [N] that a motor's controls give; -inf, inf for other actuators."""
    kinds = int(model.actuator_gaintype[actuator]), int(model.actuator_biastype[actuator])
    first = int(model.actuator_ctrladr[actuator])
    if kinds != (_FIXED, _NO_BIAS) or not np.ravel(model.actuator_ctrllimited)[first]:
        return -np.inf, np.inf
    forces = float(model.actuator_gainprm[actuator, 0]) * model.actuator_ctrlrange[first]
    if model.actuator_forcelimited[actuator]:
        forces = np.clip(forces, *model.actuator_forcerange[actuator])
    tensions = -float(model.actuator_gear[actuator, 0]) * forces
    return float(tensions.min()), float(tensions.max())
