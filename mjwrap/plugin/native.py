"""List the muscles of an installed model that stay with MuJoCo, with the reasons."""

from __future__ import annotations

import mujoco

from mjwrap.mjcf import read_declarations
from mjwrap.muscles.laws import ActuatorForce
from mjwrap.plugin.readout import instances
from mjwrap.plugin.spec.configuration import TRANSMISSION, configuration_at
from mjwrap.plugin.uninstalling import without_plugin

NO_MUSCLE = "it is not a muscle; mode 'transmission' drives it along mjwrap's path"


def native(model: mujoco.MjModel) -> dict[str, str]:
    """Return the actuators of an installed model that keep MuJoCo's own path, by name, with the reason.

    These are muscles and other actuators on spatial tendons, which only mode "transmission" drives. Raises `StateError`
    if the model has no plugin.
    """
    configurations = [configuration_at(model._address, instance) for instance in instances(model)]
    before = without_plugin(model)
    found: dict[str, str] = {}
    for mode in sorted({each.mode for each in configurations}):
        found |= read_declarations(before, transmission=mode == TRANSMISSION).native
    cables = read_declarations(before, cables=True).muscles
    found |= {cable.name: NO_MUSCLE for cable in cables if isinstance(cable.parameters, ActuatorForce)}
    taken = {name for each in configurations for name in each.muscles}
    return {name: reason for name, reason in found.items() if name not in taken}
