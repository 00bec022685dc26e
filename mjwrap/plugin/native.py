"""List the muscles of an installed model that stay with MuJoCo, with the reasons."""

from __future__ import annotations

import mujoco

from mjwrap.mjcf import read_declarations
from mjwrap.plugin.readout import instances
from mjwrap.plugin.spec.configuration import TRANSMISSION, configuration_at
from mjwrap.plugin.uninstalling import without_plugin


def native(model: mujoco.MjModel) -> dict[str, str]:
    """Return the actuators of an installed model that keep MuJoCo's own path, by name, with the reason.

    These are muscles and, in mode "transmission", all actuators on spatial tendons. Raises `StateError` if the model
    has no plugin.
    """
    configurations = [configuration_at(model._address, instance) for instance in instances(model)]
    before = without_plugin(model)
    found: dict[str, str] = {}
    for mode in sorted({each.mode for each in configurations}):
        found |= read_declarations(before, transmission=mode == TRANSMISSION).native
    taken = {name for each in configurations for name in each.muscles}
    return {name: reason for name, reason in found.items() if name not in taken}
