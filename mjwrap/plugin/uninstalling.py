"""Takes the plugin out of a compiled model, as far as that can be done without its MjSpec."""

from __future__ import annotations

import copy

import mujoco

from mjwrap.mjcf import marks
from mjwrap.model.takeover import Takeover
from mjwrap.plugin.announcing import renumber
from mjwrap.plugin.spec.tendons import restore_tendons


def without_plugin(model: mujoco.MjModel) -> mujoco.MjModel:
    """Return a copy of a model as it was before `install`, for a `MuscleSystem` or for MuJoCo's own muscles.

    Actuators have their forces again, tendons their routes and widths. The plugin's instance stays in the copy and does
    nothing; its numbers of plugin_state stay 0. Of MjSpec.to_xml's rounding, where the model comes from a saved XML,
    nothing can be undone.

    Args:
        model: a model from `install` or `load`, an MJB file or a saved XML of one, or any other, which is copied.
    """
    found = copy.copy(model)
    own = marks.own_instances(found)
    if not own:
        return found
    renumber(found)
    marks.zero_disabled_ranges(found)
    restore_tendons(found)
    marks.show_all_tendons(found)
    Takeover(found).release()
    for instance in own:
        marks.set_idle(found, instance)
    return found
