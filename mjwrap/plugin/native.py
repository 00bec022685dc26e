"""Which muscles of an installed model the plugin has left to MuJoCo."""

from __future__ import annotations

import copy

import mujoco

from mjwrap.mjcf import read_declarations
from mjwrap.plugin.placeholders import restore_placeholders
from mjwrap.plugin.register import hush_to_silence
from mjwrap.takeover import Takeover


def native(model: mujoco.MjModel) -> dict[str, str]:
    """Return the muscle actuators of a model that mjwrap cannot take over, by name, each with the reason.

    They pull along their own tendons, as without the plugin. The same as `MuscleSystem.native` before `install`.
    """
    twin = copy.copy(model)
    hush_to_silence(twin)
    restore_placeholders(twin)
    with Takeover(twin).suspended():
        return read_declarations(twin).native
