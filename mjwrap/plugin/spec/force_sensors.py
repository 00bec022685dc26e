"""Find the muscles whose forces cannot be shown as those of MuJoCo's own actuators."""

from __future__ import annotations

import mujoco
import numpy as np

from mjwrap.mjcf import MuscleDeclaration
from mjwrap.muscles.laws import ActuatorForce
from mjwrap.plugin.spec.tendon_uses import FORCE_SENSORS, pulled_by


def hidden_forces(
    model: mujoco.MjModel, muscles: list[MuscleDeclaration], left_out: set[int]
) -> dict[str, str]:
    """Return the muscles that act by wrenches and whose actuators show no force, by name, with the reason.

    MuJoCo's sensors of force and torque add every actuator's force along its tendon to what the wrenches already do,
    unless the tendon is left out; the limit of a tendon scales what it takes for a force of its own. left_out: tendons
    that the running model leaves out.
    """
    felt = bool(np.isin(model.sensor_type, FORCE_SENSORS).any())
    found: dict[str, str] = {}
    for muscle in muscles:
        tendon = pulled_by(model, muscle.actuator)
        if tendon < 0 or isinstance(muscle.parameters, ActuatorForce):
            continue
        if model.tendon_actfrclimited[tendon]:
            found[muscle.name] = "its tendon limits the forces of its actuators (actuatorfrcrange)"
        elif felt and tendon not in left_out:
            found[muscle.name] = (
                "the model has sensors of force or torque, which would feel it twice, because MuJoCo keeps its tendon"
            )
    return found


def hidden_forces_message(hidden: dict[str, str]) -> str:
    """Return the warning of `install` for muscles whose forces are not shown."""
    listed = "; ".join(f"'{name}': {reason}" for name, reason in hidden.items())
    return (
        f"actuator_force and the sensors that read it show zero for {listed}. mjwrap.plugin.read(data).tension has the "
        f"tensions"
    )
