"""Which muscles of an installed model the plugin has left to MuJoCo."""

from __future__ import annotations

import copy

import mujoco

from mjwrap.mjcf import read_declarations
from mjwrap.model.takeover import Takeover
from mjwrap.plugin.readout import instances
from mjwrap.plugin.register import TRANSMISSION, claim_of, hush_to_silence
from mjwrap.plugin.spec.placeholders import restore_placeholders


def native(model: mujoco.MjModel) -> dict[str, str]:
    """Return the actuators of an installed model that keep MuJoCo's own path, by name, each with the reason.

    Muscles, and in transmission mode all actuators on spatial tendons. `StateError` where there is no plugin.
    """
    claims = [claim_of(model._address, instance) for instance in instances(model)]
    twin = copy.copy(model)
    hush_to_silence(twin)
    restore_placeholders(twin)
    found: dict[str, str] = {}
    with Takeover(twin).suspended():
        for mode in sorted({claim.mode for claim in claims}):
            found |= read_declarations(twin, transmission=mode == TRANSMISSION).native
    taken = {name for claim in claims for name in claim.muscles}
    return {name: reason for name, reason in found.items() if name not in taken}
