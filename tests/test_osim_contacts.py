"""Contacts of OpenSim as MuJoCo has them."""

import dataclasses

import mujoco
import numpy as np
import pytest
from osim_mechanics import written
from osim_scenes import chain, frame

from mjwrap.osim.description.bodies import (
    Axis,
    Frame,
)
from mjwrap.osim.description.forces import ContactShape, HuntCrossley
from mjwrap.osim.description.functions import constant, linear


@pytest.mark.parametrize("friction", [0.0, 0.3, 0.8])
def test_a_ball_comes_to_rest_as_deep_as_hertz_force_says(friction):
    radius, stiffness = 0.5, 1e4
    parameters = {"stiffness": stiffness, "dissipation": 0.75, "dynamic_friction": friction}
    osim = chain(count=1)
    slide = dataclasses.replace(
        osim.joints[0],
        rotations=tuple(Axis(axis, (), constant(0.0)) for axis in np.eye(3)),
        translations=(
            Axis(np.array([1.0, 0.0, 0.0]), (), constant(0.0)),
            Axis(np.array([0.0, 1.0, 0.0]), ("j0",), linear(1.0)),
            Axis(np.array([0.0, 0.0, 1.0]), (), constant(0.0)),
        ),
    )
    floor = Frame("ground", np.zeros(3), np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]))
    shapes = (
        ContactShape("floor", "ContactHalfSpace", floor),
        ContactShape("ball", "ContactSphere", frame("b0"), (radius,)),
    )
    force = HuntCrossley("contact", "HuntCrossleyForce", ("floor", "ball"), parameters)
    compiled = written(dataclasses.replace(osim, joints=(slide,), contacts=shapes, forces=(force,))).compile()
    data = mujoco.MjData(compiled)
    data.qpos[:] = radius
    for _ in range(6000):
        mujoco.mj_step(compiled, data)
    # Two equal materials: 4/3 k sqrt(R k x) x with k half of stiffness^(2/3).
    half = 0.5 * stiffness ** (2.0 / 3.0)
    depth = (9.81 / (4.0 / 3.0 * half**1.5 * radius**0.5)) ** (2.0 / 3.0)
    assert radius - data.qpos[0] == pytest.approx(depth, rel=0.02)
