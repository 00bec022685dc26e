"""Passive motions of imported OpenSim models: OpenSim's, and the energy that they conserve."""

import json

import mujoco
import numpy as np
import pytest
from osim_mechanics import mechanics, pose, reduction, switch
from osim_models import FROZEN

import mjwrap as mw

MOTIONS = json.loads((FROZEN / "passive_motion.json").read_text())["models"]


class Run:
    """A passive motion, with pieces switched at every step."""

    def __init__(self, name: str, timestep: float) -> None:
        self.found = mechanics(name)
        self.model = model = self.found.compile()
        mw.osim.restore_inertias(model)
        model.opt.timestep = timestep
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_LIMIT | mujoco.mjtDisableBit.mjDSBL_SPRING
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_DAMPER
        model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
        model.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
        model.eq_solref[:, 0] = 2.0 * timestep
        self.data = mujoco.MjData(model)
        self.coupling_error = 0.0

    def start(self, start: dict[str, tuple[float, float]]) -> None:
        """Set values and speeds of coordinates, and all that follows them."""
        drivers = self.found.skeleton.drivers
        names = [name for name in drivers.coordinates if name not in drivers.couplers]
        pose(self.found, self.model, self.data, {name: start[name][0] for name in names})
        spread = reduction(self.found, self.model, self.data, names)
        self.data.qvel[:] = spread @ [start[name][1] for name in names]
        mujoco.mj_forward(self.model, self.data)

    def step(self, until: float) -> None:
        """Step to a time, and note the largest error of a coupling's or constraint's position."""
        while self.data.time < until - 0.5 * self.model.opt.timestep:
            switch(self.model, self.data)
            mujoco.mj_step(self.model, self.data)
            error = np.abs(self.data.efc_pos[: self.data.ne]).max(initial=0.0)
            self.coupling_error = max(self.coupling_error, float(error))

    def energy(self) -> float:
        """Return kinetic and potential energy [J]."""
        switch(self.model, self.data)
        mujoco.mj_forward(self.model, self.data)
        return float(self.data.energy.sum())


def largest_difference(name: str, timestep: float) -> tuple[float, float]:
    """Return the largest difference of a coordinate from OpenSim's [rad or m], and the error of the couplings."""
    record, run = MOTIONS[f"{name}.osim"], Run(name, timestep)
    run.start(record["start"])
    worst = 0.0
    for time, values in zip(record["times"], record["values"], strict=True):
        run.step(time)
        for coordinate, value in values.items():
            joint = mujoco.mj_name2id(run.model, mujoco.mjtObj.mjOBJ_JOINT, coordinate)
            if joint >= 0:
                worst = max(worst, abs(float(run.data.qpos[run.model.jnt_qposadr[joint]]) - value))
    return worst, run.coupling_error


CASES = [
    ("arm26", 1e-3, 1e-8),  # linear joints only
    ("gait10dof18musc", 1e-3, 5e-5),
    ("gait10dof18musc", 2e-4, 2e-6),
    ("gait2392_millard", 1e-3, 5e-5),
    ("PathOnConstrainedBodyMomentArmTest", 1e-3, 2e-6),
    ("knee_patella_ligament", 1e-3, 2e-6),
    ("CoupledCoordinatesMPPsMomentArmTest", 1e-3, 2e-6),
    ("ThoracoscapularShoulderModel", 2e-4, 1e-4),  # through a gimbal lock, with a closed loop
]


@pytest.mark.parametrize(("name", "timestep", "allowed"), CASES)
def test_passive_motion_is_opensims(name, timestep, allowed):
    difference, coupling_error = largest_difference(name, timestep)
    assert difference < allowed
    assert coupling_error < 5e-6


@pytest.mark.parametrize("name", ["Rajagopal2015_right_leg_9musc", "leg6dof9musc"])
def test_models_with_coupled_rotations_conserve_energy(name):
    # OpenSim itself loses 0.14 J in this motion of the first.
    run = Run(name, 1e-3)
    rng = np.random.default_rng(1)
    start = {}
    for coordinate, value in run.found.skeleton.drivers.values.items():
        start[coordinate] = value + rng.uniform(-0.2, 0.2), rng.uniform(-2.0, 2.0)
        if run.found.skeleton.drivers.coordinates[coordinate].locked:
            start[coordinate] = value, 0.0
    start["knee_angle_r"] = -0.5, -3.0
    run.start(start)
    before = run.energy()
    worst = 0.0
    for time in np.arange(0.01, 0.2001, 0.01):
        run.step(float(time))
        worst = max(worst, abs(run.energy() - before))
    assert worst < 1e-4
