"""Motions of bodies that carry surfaces of every shape: momentum and energy are kept, and lengths never jump."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
from test_energy import momentum

import mjwrap as mw

# In the place of body b: type and size of the geom, and the numeric that gives it another shape.
SHAPES = {
    "ellipsoid": ("ellipsoid", "0.03 0.035 0.06", ""),
    "capsule": ("capsule", "0.03 0.05", ""),
    "cone": ("sphere", "0.001", "cone_size:0.033 0.027 0.08"),
    "elliptic cylinder": ("sphere", "0.001", "elliptic_cylinder_size:0.03 0.035"),
    "torus, outside": ("sphere", "0.001", "torus_size:0.03 0.014"),
    "torus, through the hole": ("sphere", "0.001", "torus_size:0.06 0.03"),
}
FORCE = 2.0  # [N]
STRAP = Path(__file__).resolve().parents[1] / "docs" / "_figures" / "strap.xml"


def string(shape: str) -> mujoco.MjModel:
    """Four floating bodies, joined by nothing but a string over b and c."""
    kind, size, numeric = SHAPES[shape]
    key, _, data = numeric.partition(":")
    place, turn, hint = "0 -0.017 0.003", "1 0.05 0.05 -0.4", "0 0.03 0"
    if "torus" in shape:  # the ring's axis lies along the string, its centre below it, or above for the hole
        turn, hint = "1 0.05 1 0.05", "0 0.015 0"
        place = "0 0.047 0" if "hole" in shape else "0 -0.051 0"
    made = f'<numeric name="mjwrap_{key}" data="{data}"/>' if key else ""
    named = f'<element objtype="numeric" objname="mjwrap_{key}"/>' if key else ""
    return mujoco.MjModel.from_xml_string(f"""
<mujoco><option gravity="0 0 0"><flag energy="enable"/></option><worldbody>
  <body name="a" pos="-0.15 -0.02 -0.01" quat="1 0.2 -0.1 0.3"><freejoint/>
    <inertial pos="0 0 0" mass="0.7" diaginertia="0.002 0.003 0.004"/><site name="a" pos="0.02 -0.01 0.01"/></body>
  <body name="b" pos="0 0.005 0"><freejoint/>
    <inertial pos="0 0 0" mass="1.3" diaginertia="0.003 0.003 0.004"/>
    <geom name="b" type="{kind}" size="{size}" contype="0" conaffinity="0" mass="0" pos="{place}" quat="{turn}"/>
    <site name="above_b" pos="{hint}"/></body>
  <body name="c" pos="0.1 -0.012 0.003"><freejoint/>
    <inertial pos="0 0 0" mass="1.1" diaginertia="0.004 0.003 0.004"/>
    <geom name="c" type="sphere" size="0.03" contype="0" conaffinity="0" mass="0"/></body>
  <body name="d" pos="0.25 -0.04 0"><freejoint/>
    <inertial pos="0 0 0" mass="0.9" diaginertia="0.002 0.003 0.004"/><site name="d"/></body></worldbody>
  <custom><numeric name="mjwrap_optimal_force" data="{FORCE}"/>{made}<tuple name="mjwrap_string">
    <element objtype="site" objname="a"/> <element objtype="geom" objname="b"/>{named}
    <element objtype="site" objname="above_b" prm="1"/> <element objtype="geom" objname="c"/>
    <element objtype="site" objname="d"/> <element objtype="numeric" objname="mjwrap_optimal_force"/></tuple></custom>
</mujoco>""")


def drift(
    model: mujoco.MjModel, integrator: str, timestep: float, seconds: float
) -> tuple[float, float, float]:
    """Largest errors of linear and angular momentum, and of energy, under a string of constant tension."""
    model.opt.integrator = int(getattr(mujoco.mjtIntegrator, f"mjINT_{integrator}"))
    model.opt.timestep = timestep
    data, muscles = mujoco.MjData(model), mw.MuscleSystem(model)
    data.qvel[:] = 0.1 * np.random.default_rng(3).normal(size=model.nv)
    muscles.excitation[:] = 1.0
    kept, contacts = [], set()
    for _ in range(round(seconds / timestep)):
        muscles.step(data)
        muscles.forward(data)
        linear, angular = momentum(model, data)
        kept.append([*linear, *angular, data.energy.sum() + FORCE * muscles.length[0]])
        contacts.add(len(muscles.contact_points(0)))
    assert not muscles.failures.any()
    assert len(contacts) == 1
    assert min(contacts) >= 2
    change = np.abs(np.array(kept) - kept[0]).max(axis=0)
    return float(change[:3].max()), float(change[3:6].max()), float(change[6])


@pytest.mark.parametrize("shape", SHAPES)
def test_floating_bodies_keep_momentum_and_energy(shape: str) -> None:
    """Linear momentum to rounding. Euler's errors halve with the step; RK4's, of higher order, are a thousandth.

    How fast RK4's fall cannot be told here: below 1e-9 terms of second order (rotating bodies) and of fourth cancel.
    """
    model = string(shape)
    coarse, fine = (drift(model, "EULER", h, 0.08) for h in (8e-3, 4e-3))
    better = drift(model, "RK4", 8e-3, 0.08)
    assert max(coarse[0], fine[0], better[0]) < 1e-14
    for quantity in (1, 2):
        assert np.log2(coarse[quantity] / fine[quantity]) == pytest.approx(1.0, abs=0.1)
        assert better[quantity] < 1e-3 * coarse[quantity]


def strap() -> mujoco.MjModel:
    """A muscle over an ellipsoid, through a ring, over a tapered and an elliptic cylinder, on hinges without losses."""
    model = mujoco.MjModel.from_xml_path(str(STRAP))
    model.dof_damping[:] = 0.0
    model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    return model


def swing(model: mujoco.MjModel, timestep: float, seconds: float) -> tuple[float, set[int]]:
    """Largest error of energy of the strap's swing under constant tension (RK4), and its numbers of contacts."""
    model.opt.integrator, model.opt.timestep = int(mujoco.mjtIntegrator.mjINT_RK4), timestep
    data, muscles = mujoco.MjData(model), mw.MuscleSystem(model)
    data.qpos[:] = 0.5, 0.7
    muscles.excitation[:] = 1.0
    force = float(model.numeric("mjwrap_strap_optimal_force").data[0])
    energy, contacts = [], set()
    for _ in range(round(seconds / timestep)):
        muscles.step(data)
        muscles.forward(data)
        mujoco.mj_forward(model, data)
        energy.append(data.energy.sum() + force * muscles.length[0])
        contacts.add(len(muscles.contact_points(0)))
    assert not muscles.failures.any()
    return float(np.ptp(energy)), contacts


def test_a_strap_over_four_surfaces_keeps_its_energy() -> None:
    """RK4 on hinges is of fourth order while no contact comes or goes."""
    model = strap()
    (coarse, before), (fine, after) = swing(model, 2e-3, 0.06), swing(model, 1e-3, 0.06)
    assert before == after
    assert len(before) == 1
    assert min(before) >= 3
    assert np.log2(coarse / fine) > 3.9


def test_lengths_do_not_jump_while_contacts_come_and_go() -> None:
    """A slow swing of both joints: steps of length are those of its speed, and speeds change little by step."""
    model = strap()
    data, muscles = mujoco.MjData(model), mw.MuscleSystem(model)
    lengths, speeds, contacts = [], [], set()
    count = 4000
    phase = np.linspace(0, 2 * np.pi, count)
    for angle in phase:
        data.qpos[:] = 0.1 + 0.5 * np.cos(angle), 0.2 + 0.6 * np.cos(angle + 0.7)
        data.qvel[:] = -0.5 * np.sin(angle), -0.6 * np.sin(angle + 0.7)
        muscles.forward(data)
        assert not muscles.status.any()
        lengths.append(muscles.length[0])
        speeds.append(muscles.velocity[0])
        contacts.add(len(muscles.contact_points(0)))
    assert len(contacts) > 1
    step = phase[1] - phase[0]
    # the trapezoidal rule, whose error is step^3 / 12 times the second derivative of a speed of about 0.1 m/rad
    assert np.diff(lengths) == pytest.approx(0.5 * step * (np.array(speeds[1:]) + speeds[:-1]), abs=1e-8)
    assert np.abs(np.diff(speeds)).max() < 1e-3
