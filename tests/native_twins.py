"""A model driven by mjwrap beside its native twin, where MuJoCo's own tendons and muscles pull."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
from mjcf_reading import MODELS

import mjwrap as mw

ELBOW = MODELS / "elbow" / "elbow.xml"
INTEGRATORS = mujoco.mjtIntegrator.__members__
EXPLICIT = [INTEGRATORS["mjINT_EULER"], INTEGRATORS["mjINT_RK4"]]
PUSH = np.array([0.3, -1.5, 2.5, 0.05, -0.02, 0.04])  # somebody else's force [N] and torque [N m]


def native_spec(path: Path = ELBOW) -> mujoco.MjSpec:
    """The model without its mjwrap tuples: its muscle actuators are MuJoCo's, and declarations as they stand."""
    spec = mujoco.MjSpec.from_file(str(path))
    for element in list(spec.tuples):
        spec.delete(element)
    return spec


def native_model(path: Path = ELBOW) -> mujoco.MjModel:
    """The compiled `native_spec`."""
    return native_spec(path).compile()


def start(model: mujoco.MjModel) -> mujoco.MjData:
    data = mujoco.MjData(model)
    data.qpos[0], data.qvel[0] = 1.0, 0.5
    return data


def excite(data: mujoco.MjData) -> None:
    data.ctrl[:] = 0.5 + 0.5 * np.sin(20 * data.time + np.arange(len(data.ctrl)))


def pair(
    integrator: int, timestep: float = 2e-3, path: Path = ELBOW
) -> tuple[mujoco.MjData, mw.MuscleSystem, mujoco.MjData]:
    """Data driven by mjwrap, its muscles, and data of the native twin."""
    ours, native = native_model(path), native_model(path)
    for model in (ours, native):
        model.opt.integrator, model.opt.timestep = int(integrator), timestep
    return start(ours), mw.MuscleSystem(ours), start(native)
