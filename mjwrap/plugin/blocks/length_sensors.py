"""Find the sensors of lengths, which MuJoCo stores before it calls the plugin."""

from __future__ import annotations

from collections.abc import Mapping

import mujoco
import numpy as np

from mjwrap.plugin.spec.tendon_uses import is_measured_late


def length_sensors(
    model: mujoco.MjModel, by_output: Mapping[int, int], by_tendon: Mapping[int, int]
) -> list[tuple[int, int, int, float]]:
    """Return the sensors of lengths: index in sensordata, row, whether it is an actuator's, and cutoff [m].

    by_output, by_tendon: the rows of outputs of actuators, and of tendons. Sensors with a delay or an interval are left
    out.
    """
    kinds = mujoco.mjtSensor
    found: list[tuple[int, int, int, float]] = []
    for i in range(model.nsensor):
        kind, item = int(model.sensor_type[i]), int(model.sensor_objid[i])
        row = None
        if kind == int(kinds.mjSENS_ACTUATORPOS):
            row = by_output.get(int(model.actuator_outadr[item]))
        elif kind == int(kinds.mjSENS_TENDONPOS):
            row = by_tendon.get(item)
        if row is None or is_measured_late(model, i):
            continue
        cutoff = float(model.sensor_cutoff[i])
        limit = cutoff if cutoff > 0.0 else np.inf
        found.append((int(model.sensor_adr[i]), row, int(kind == int(kinds.mjSENS_ACTUATORPOS)), limit))
    return found
