"""Remove, hide and restore tendons that only declare the route of a muscle.

MuJoCo would spend up to half of its step on them. A tendon without stops has no length, no Jacobian and no cost. If all
its actuators are disabled, their muscle curves need not be computed either; their activations still are. Tendons are
removed only in the model that `install` returns.

A tendon that stays would be shown together with the path that the plugin draws. So it is made invisibly thin, in the
MjSpec, so that models compiled from it later, alone or attached, do not show it either.

`mjwrap/mjcf/marks.py` describes the marks of these changes, with which the original model can be read from a copy.
"""

from __future__ import annotations

import mujoco
import numpy as np

from mjwrap.mjcf import MuscleDeclaration, marks
from mjwrap.muscles.laws import ActuatorForce
from mjwrap.plugin.spec.tendon_uses import is_needed, shown_tendons

_PULLS = int(mujoco.mjtTrn.mjTRN_TENDON)
_MUSCLE_DYNAMICS = int(mujoco.mjtDyn.mjDYN_MUSCLE)


def remove_unneeded_tendons(model: mujoco.MjModel, muscles: list[MuscleDeclaration]) -> None:
    """Remove the stops of tendons that only these muscles need, and the muscle curves of their actuators."""
    taken = {m.actuator: isinstance(m.parameters, ActuatorForce) for m in muscles if m.actuator >= 0}
    shown = shown_tendons(model, muscles)
    for tendon in {muscle.tendon for muscle in muscles if muscle.tendon >= 0}:
        if not marks.lacks_stops(model, tendon) and not is_needed(model, tendon, taken, shown):
            marks.remove_stops(model, tendon)
    for actuator in _muscles_without_stops(model):
        disabled = marks.has_disabled_range(model, actuator)
        if marks.has_curves(model, actuator) and model.actuator_forcelimited[actuator] and disabled:
            marks.remove_curves(model, actuator)


def left_out_tendons(model: mujoco.MjModel) -> set[int]:
    """Return the tendons whose stops were removed."""
    return {tendon for tendon in range(model.ntendon) if marks.lacks_stops(model, tendon)}


def restore_tendons(model: mujoco.MjModel) -> None:
    """Restore the stops of tendons and the curves of their actuators; disabled actuators stay disabled."""
    for actuator in _muscles_without_stops(model):
        if marks.lacks_curves(model, actuator):
            marks.restore_curves(model, actuator)
    for tendon in range(model.ntendon):
        if marks.lacks_stops(model, tendon):
            marks.restore_stops(model, tendon)


def _muscles_without_stops(model: mujoco.MjModel) -> list[int]:
    """Return the actuators with muscle dynamics on tendons without stops."""
    return [
        actuator
        for actuator in np.flatnonzero(model.actuator_trntype == _PULLS).tolist()
        if marks.lacks_stops(model, int(model.actuator_trnid[actuator, 0]))
        and model.actuator_dyntype[actuator] == _MUSCLE_DYNAMICS
    ]


def hide_tendons(spec: mujoco.MjSpec, muscles: list[MuscleDeclaration]) -> None:
    """Make the tendons of these muscles invisible; if a width is set later, MuJoCo and the plugin both use it."""
    taken = {muscle.tendon for muscle in muscles}
    for tendon in spec.tendons:
        if tendon.id in taken:
            marks.hide_tendon(tendon)


def show_tendon(spec: mujoco.MjSpec, actuator: str) -> None:
    """Restore the width, which `hide_tendons` has changed, of the tendon that an actuator pulls."""
    element = spec.actuator(actuator)
    tendon = spec.tendon(element.target) if element is not None else None
    if tendon is not None:
        marks.show_tendon(tendon)
