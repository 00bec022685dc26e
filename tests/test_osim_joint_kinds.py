"""All kinds of joints, and forces on their coordinates, in one model of our own: equal to OpenSim's."""

import json

import mujoco
import numpy as np
import pytest
from osim_mechanics import mass_matrix, pose, reduction, written
from osim_models import FROZEN

from mjwrap.osim.reading.model import read_osim

MASSES = json.loads((FROZEN / "joint_kinds_mass.json").read_text())["models"]["joint_kinds.osim"]
FORCES = json.loads((FROZEN / "joint_kinds_forces.json").read_text())


@pytest.fixture(scope="module")
def found():
    return written(read_osim(FROZEN / "joint_kinds.osim"))


@pytest.fixture
def model(found):
    model = found.compile()
    model.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_LIMIT
    return model


def test_poses_and_mass_matrices(found, model):
    data = mujoco.MjData(model)
    direction = np.array(MASSES["direction"])
    for each in MASSES["poses"]:
        pose(found, model, data, dict(zip(MASSES["coordinates"], each["values"], strict=True)))
        for body, frozen in zip(MASSES["bodies"], each["bodies"], strict=True):
            now = np.concatenate([data.body(body).xpos, data.body(body).xmat])
            np.testing.assert_allclose(now, frozen, rtol=0.0, atol=1e-13)
        spread = reduction(found, model, data, MASSES["coordinates"])
        product = spread.T @ (mass_matrix(model, data) @ (spread @ direction))
        frozen = np.array(each["mass_times_direction"])
        # The frame between the two halves of the scapula's joint has 1e-12 of the model's mass.
        np.testing.assert_allclose(product, frozen, rtol=0.0, atol=1e-11 * np.abs(frozen).max())


@pytest.mark.parametrize("force", list(FORCES["forces"]))
def test_forces_on_coordinates(found, model, force):
    for tendon in range(model.ntendon):
        if not model.tendon(tendon).name.startswith(force):
            model.tendon_stiffness[tendon] = model.tendon_damping[tendon] = 0.0
    data = mujoco.MjData(model)
    names = FORCES["coordinates"]
    for (values, rates), wanted in zip(FORCES["states"], FORCES["forces"][force], strict=True):
        pose(found, model, data, dict(zip(names, values, strict=True)))
        spread = reduction(found, model, data, names)
        data.qvel[:] = spread @ rates
        data.ctrl[:] = 0.0
        for actuator in range(model.nu):
            if model.actuator(actuator).name == force:
                data.ctrl[actuator] = FORCES["control"]
        mujoco.mj_forward(model, data)
        now = spread.T @ (data.qfrc_actuator + data.qfrc_passive)
        np.testing.assert_allclose(now, wanted, rtol=0.0, atol=1e-9 * max(1.0, np.abs(wanted).max()))
