"""Disable the actuators of an MjSpec whose muscles act by wrenches, and enable them again."""

from __future__ import annotations

import mujoco

from mjwrap.mjcf import MuscleDeclaration, marks
from mjwrap.muscles.laws import ActuatorForce


def disable_actuators(spec: mujoco.MjSpec, model: mujoco.MjModel, muscles: list[MuscleDeclaration]) -> None:
    """Limit the forces of these muscles' actuators to zero, unless the actuators pull along mjwrap's paths.

    model: compiled from the spec; gives the original force limits.
    """
    elements = {element.id: element for element in spec.actuators}
    for muscle in muscles:
        if muscle.actuator >= 0 and not isinstance(muscle.parameters, ActuatorForce):
            limits = marks.force_limits(model, muscle.actuator)
            marks.disable_element(elements[muscle.actuator], limits)


def enable_actuator(spec: mujoco.MjSpec, name: str) -> None:
    """Restore the force limits of an actuator that `disable_actuators` has disabled."""
    element = spec.actuator(name)
    if element is not None:
        marks.enable_element(element)
