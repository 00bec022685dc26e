"""Constants of the motion: energy of the conservative elbow, momentum of bodies that only a string joins."""

from __future__ import annotations

from itertools import pairwise

import mujoco
import numpy as np
import pytest
from mjcf_reading import Vector

import mjwrap as mw
from benchmarks.robustness import energy

each_case = pytest.mark.parametrize(
    ("integrator", "timestep"), [(i, h) for i in energy.INTEGRATORS for h in energy.TIMESTEPS]
)


@each_case
@pytest.mark.parametrize("swing", energy.SWINGS)
def test_the_elbow_keeps_its_energy_as_well_as_its_native_twin(
    swing: str, integrator: str, timestep: float
) -> None:
    """Equal drifts, but for rounding: states differ by 1e-14, so energies of 50 J by 1e-13 J (ROUNDING is 1e-12 J)."""
    drift = energy.measure(swing, integrator, timestep, seconds=2.0)
    assert (drift.highest > 0.99) == (swing == "liftoff")
    assert drift.mjwrap == pytest.approx(drift.native, rel=1e-6, abs=energy.ROUNDING)
    assert drift.kept


def test_energy_drift_falls_with_the_order_of_the_integrator() -> None:
    """Euler is of first order. RK4's energy error is h^5 on a smooth motion, of which rounding leaves 4 and 8 ms."""
    euler = [energy.measure("smooth", "Euler", h, seconds=2.0).mjwrap for h in energy.TIMESTEPS]
    for fine, coarse in pairwise(euler):
        assert coarse / fine == pytest.approx(2.0, abs=0.05)
    fine, coarse = (energy.measure("smooth", "RK4", h, seconds=2.0).mjwrap for h in (4e-3, 8e-3))
    assert 16.0 < coarse / fine < 40.0
    assert coarse < 1e-4 * euler[0]


STRING = """<mujoco><option gravity="0 0 0" timestep="0.002" integrator="{integrator}"/><worldbody>
  <body name="a" pos="-0.15 -0.01 0.02" quat="1 0.2 -0.1 0.3"><freejoint/>
    <inertial pos="0 0 0" mass="0.7" diaginertia="0.002 0.003 0.004"/><site name="a" pos="0.02 -0.01 0.01"/></body>
  <body name="b" pos="0 0.005 0" quat="0.8 0.1 0.1 0.4"><freejoint/>
    <inertial pos="0 0 0" mass="1.3" diaginertia="0.003 0.003 0.004"/>
    <geom name="b" type="cylinder" size="0.03 0.1" contype="0" conaffinity="0" mass="0" quat="1 0.1 0.05 -0.4"/>
    <site name="above_b" pos="0.02 0.03 0"/></body>
  <body name="c" pos="0.1 0 0.01"><freejoint/>
    <inertial pos="0 0 0" mass="1.1" diaginertia="0.004 0.003 0.004"/>
    <geom name="c" type="sphere" size="0.03" contype="0" conaffinity="0" mass="0"/></body>
  <body name="d" pos="0.25 -0.02 0"><freejoint/>
    <inertial pos="0 0 0" mass="0.9" diaginertia="0.002 0.003 0.004"/><site name="d"/></body></worldbody>
  <custom><numeric name="mjwrap_optimal_force" data="2"/><tuple name="mjwrap_string">
    <element objtype="site" objname="a"/> <element objtype="geom" objname="b"/>
    <element objtype="site" objname="above_b" prm="1"/> <element objtype="geom" objname="c"/>
    <element objtype="site" objname="d"/> <element objtype="numeric" objname="mjwrap_optimal_force"/></tuple></custom>
</mujoco>"""


def momentum(model: mujoco.MjModel, data: mujoco.MjData) -> tuple[Vector, Vector]:
    """Linear [kg m/s] and angular momentum about the world origin [kg m^2/s] of all bodies."""
    mujoco.mj_forward(model, data)
    linear, angular = np.zeros(3), np.zeros(3)
    for body in range(1, model.nbody):
        twist = np.zeros(6)
        mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_BODY, body, twist, 0)
        axes = data.ximat[body].reshape(3, 3)
        push = model.body_mass[body] * twist[3:]
        linear += push
        angular += np.cross(data.xipos[body], push) + axes @ (model.body_inertia[body] * (axes.T @ twist[:3]))
    return linear, angular


def run_string(integrator: str, timestep: float) -> tuple[float, float, float]:
    """Largest error of linear and angular momentum, and of energy, over 0.08 s of four floating bodies."""
    model = mujoco.MjModel.from_xml_string(STRING.format(integrator=integrator))
    model.opt.timestep = timestep
    model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    data, muscles = mujoco.MjData(model), mw.MuscleSystem(model)
    data.qvel[:] = 0.1 * np.random.default_rng(3).normal(size=model.nv)
    muscles.excitation[:] = 1.0
    first, worst, contacts = None, np.zeros(3), set()
    while data.time < 0.08 - 0.5 * timestep:
        muscles.step(data)
        muscles.forward(data)
        linear, angular = momentum(model, data)
        total = float(data.energy.sum() + 2.0 * muscles.length[0])
        if first is None:
            first = (linear, angular, total)
        errors = (np.abs(linear - first[0]).max(), np.abs(angular - first[1]).max(), abs(total - first[2]))
        worst = np.maximum(worst, errors)
        contacts.add(len(muscles.contact_points(0)))
    assert contacts == {2}
    assert not muscles.failures.any()
    return float(worst[0]), float(worst[1]), float(worst[2])


@pytest.mark.parametrize(("integrator", "order"), [("Euler", 1), ("RK4", 2)])
def test_floating_bodies_keep_momentum_and_energy_under_a_string(integrator: str, order: int) -> None:
    """Wrapped bodies get their reaction: linear momentum is kept to rounding, the rest to the integrator's order.

    MuJoCo's RK4 is of second order for rotating free bodies, force or no force: it sums stages in one tangent space.
    """
    coarse, fine = run_string(integrator, 8e-3), run_string(integrator, 4e-3)
    assert max(coarse[0], fine[0]) < 1e-14
    for quantity in (1, 2):
        assert np.log2(coarse[quantity] / fine[quantity]) > order - 0.1
