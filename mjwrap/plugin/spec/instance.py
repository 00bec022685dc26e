"""Adds the plugin's instance to an MjSpec, and keeps the bodies awake that its muscles pull."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.mjcf.marks import PLUGIN_INSTANCE
from mjwrap.plugin.mujoco_c.registration import PLUGIN_NAME
from mjwrap.plugin.spec.configuration import spec_instances


def add_instance(spec: mujoco.MjSpec, texts: dict[str, str]) -> None:
    """Add the instance with its configuration, or give the one that is there its new configuration.

    MuJoCo's `attach` keeps only instances that an element names, so a body does: the first one without a plugin.
    """
    for element in spec_instances(spec):
        if element.name == PLUGIN_INSTANCE:
            element.config = texts
            return
    spec.activate_plugin(PLUGIN_NAME)
    spec.add_plugin(name=PLUGIN_INSTANCE, plugin_name=PLUGIN_NAME, active=True).config = texts
    for body in spec.bodies[1:]:
        if not body.plugin.active:
            body.plugin.name, body.plugin.plugin_name, body.plugin.active = PLUGIN_INSTANCE, PLUGIN_NAME, True
            return


def prevent_sleep(spec: mujoco.MjSpec, model: mujoco.MjModel, bodies: NDArray[np.int64]) -> None:
    """Let no tree sleep that a muscle pulls, unless its sleep policy is given: as MuJoCo does for its own actuators."""
    trees = {int(tree) for tree in model.body_treeid[bodies] if tree >= 0}
    for element in spec.bodies[1:]:
        tree, above = (int(model.body_treeid[b]) for b in (element.id, element.parent.id))
        if tree in trees and tree != above and element.sleep == mujoco.mjtSleepPolicy.mjSLEEP_AUTO:
            element.sleep = mujoco.mjtSleepPolicy.mjSLEEP_NEVER
