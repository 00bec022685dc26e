"""Add the plugin's instance to an MjSpec, and keep the bodies awake that its muscles pull."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.mjcf.marks import PLUGIN_INSTANCE
from mjwrap.plugin.mujoco_c.registration import PLUGIN_NAME
from mjwrap.plugin.spec.configuration import spec_instances


def add_instance(spec: mujoco.MjSpec, texts: dict[str, str]) -> None:
    """Add the instance with its configuration, or change the configuration of the existing instance.

    MuJoCo's `attach` keeps only instances that an element refers to; the first body without a plugin does so.
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
    """Prevent trees that a muscle pulls from sleeping, unless they have a policy, as MuJoCo does for its actuators."""
    trees = {int(tree) for tree in model.body_treeid[bodies] if tree >= 0}
    for element in spec.bodies[1:]:
        tree, above = (int(model.body_treeid[b]) for b in (element.id, element.parent.id))
        if tree in trees and tree != above and element.sleep == mujoco.mjtSleepPolicy.mjSLEEP_AUTO:
            element.sleep = mujoco.mjtSleepPolicy.mjSLEEP_NEVER
