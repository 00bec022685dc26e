"""The state of the engine plugin's muscles after jumps, copies, inverse dynamics and sleep."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import pytest
from native_twins import INTEGRATORS, PUSH, excite
from newer_mujoco import needs_kept_states
from test_plugin import SCENES, moving, spec_of, state_of

from mjwrap.plugin import excitations, install, read

SCHEMES = [INTEGRATORS["mjINT_EULER"], INTEGRATORS["mjINT_RK4"], INTEGRATORS["mjINT_IMPLICITFAST"]]


def run(data: mujoco.MjData, steps: int) -> None:
    for _ in range(steps):
        excite(data)
        mujoco.mj_step(data.model, data)


def everything(data: mujoco.MjData, kind: mujoco.mjtState) -> np.ndarray[Any, Any]:
    out = np.empty(mujoco.mj_stateSize(data.model, kind))
    mujoco.mj_getState(data.model, data, out, kind)
    return out


@pytest.mark.parametrize("scene", SCENES)
def test_a_jump_to_a_keyframe_is_a_fresh_start(scene: str) -> None:
    """Nothing of the run before is left: neither branch nor activation nor force."""
    spec = spec_of(SCENES[scene])
    plain = spec_of(SCENES[scene]).compile()
    pose = plain.qpos0 + np.linspace(0.3, 0.1, plain.nq)
    spec.add_key(name="bent", qpos=pose, qvel=np.full(plain.nv, 0.2), act=np.full(plain.na, 0.25))
    model = install(spec)
    used, fresh = moving(model), mujoco.MjData(model)
    run(used, 60)
    mujoco.mj_forward(model, used)
    for data in (used, fresh):
        mujoco.mj_resetDataKeyframe(model, data, 0)
        run(data, 40)
    np.testing.assert_array_equal(state_of(used), state_of(fresh))
    np.testing.assert_array_equal(read(used).failures, read(fresh).failures)


@pytest.mark.parametrize("integrator", SCHEMES)
@pytest.mark.parametrize("scene", SCENES)
def test_looking_changes_nothing(scene: str, integrator: int) -> None:
    """Between steps: mj_forward, mj_inverse, saving and restoring the whole state; somebody pushes all along."""
    model = install(spec_of(SCENES[scene]))
    model.opt.integrator = int(integrator)
    looked, alone = moving(model), moving(model)
    kind = mujoco.mjtState.mjSTATE_INTEGRATION
    for data in (looked, alone):
        data.xfrc_applied[1] = PUSH
    for k in range(40):
        for _ in range(k % 3):
            mujoco.mj_forward(model, looked)
        if k % 4 == 1:
            mujoco.mj_inverse(model, looked)
        if k % 5 == 2:
            saved, other = everything(looked, kind), mujoco.MjData(model)
            run(looked, 3)
            mujoco.mj_setState(model, other, saved, kind)
            looked = other
        run(looked, 2)
        run(alone, 2)
        np.testing.assert_array_equal(state_of(looked), state_of(alone))
        np.testing.assert_array_equal(looked.xfrc_applied[1], PUSH)


def test_inverse_dynamics_see_the_muscles_once() -> None:
    """What mj_inverse asks for is what pulls: everybody's wrenches and the native actuators, to rounding."""
    model = install(spec_of(SCENES["arm"]))
    data = moving(model)
    run(data, 100)
    data.xfrc_applied[2] = PUSH
    mujoco.mj_forward(model, data)
    applied = data.xfrc_applied.copy()
    assert np.abs(applied[2] - PUSH).max() > 1.0
    for _ in range(2):
        mujoco.mj_inverse(model, data)
        np.testing.assert_array_equal(data.xfrc_applied, applied)
        given = data.qfrc_actuator.copy()
        for body in range(model.nbody):
            force, torque, point = applied[body, :3], applied[body, 3:], data.xipos[body]
            mujoco.mj_applyFT(model, data, force, torque, point, body, given)
        np.testing.assert_allclose(data.qfrc_inverse, given, rtol=0.0, atol=1e-12 * np.abs(given).max())


@needs_kept_states
def test_a_run_goes_on_after_the_spec_is_compiled_again() -> None:
    spec = spec_of(SCENES["elastic arm"])
    model = install(spec, keep_tendons=True)  # as the spec compiles
    reference, data = moving(model), moving(model)
    run(data, 50)
    run(reference, 100)
    spec.worldbody.add_site(name="another", pos=[0.0, 0.0, 1.0])
    model, data = spec.recompile(model, data)
    run(data, 50)
    np.testing.assert_array_equal(data.qpos, reference.qpos)
    np.testing.assert_array_equal(data.plugin_state, reference.plugin_state)


# ---------------------------------------------------------------------------------------------------- sleep

SLEEPY = """
<mujoco>
  <option timestep="0.002" sleep_tolerance="1e-3"><flag sleep="enable"/></option>
  <worldbody>
    <site name="origin" pos="-0.01 0 0.6"/>
    <site name="side" pos="-0.05 0 0.5"/>
    <geom name="drum" type="cylinder" size="0.025 0.04" pos="0 0 .5" zaxis="0 1 0" contype="0" conaffinity="0"/>
    <body name="arm" pos="0 0 .5" sleep="{policy}">
      <joint axis="0 1 0" damping="2" stiffness="1"/>
      <geom type="capsule" fromto="0.05 0 0 0.25 0 0" size="0.015" mass="1.2" contype="0" conaffinity="0"/>
      <body name="hand" pos="0.25 0 0"><joint axis="0 1 0" damping="0.1" stiffness="1"/><geom size="0.02"/></body>
      <site name="insertion" pos="0.1 0 -0.025"/>
    </body>
    <body name="other" pos="1 0 0">
      <joint axis="0 1 0" damping="2" stiffness="1"/><geom size="0.02" pos="0.1 0 0"/>
    </body>
  </worldbody>
  <custom>
    <numeric name="mjwrap_m_optimal_force" data="100"/>
    <tuple name="mjwrap_m">
      <element objtype="site" objname="origin"/><element objtype="geom" objname="drum"/>
      <element objtype="site" objname="side" prm="1"/><element objtype="site" objname="insertion"/>
      <element objtype="numeric" objname="mjwrap_m_optimal_force"/>
    </tuple>
  </custom>
</mujoco>
"""


@pytest.mark.parametrize("policy", ["auto", "allowed"])
def test_trees_that_muscles_pull_sleep_as_those_of_actuators_do(policy: str) -> None:
    """Never, even where the muscle has no actuator; where the file allows it, while nothing pulls."""
    model = install(spec_of(SLEEPY.format(policy=policy)))
    data = mujoco.MjData(model)
    (excitation,) = excitations(data).values()
    mujoco.mj_step(model, data, nstep=8000)
    arm, other = data.tree_asleep
    assert other >= 0
    assert (arm >= 0) == (policy == "allowed")
    before = data.qpos[0]
    excitation[:] = 0.2
    mujoco.mj_step(model, data, nstep=2000)
    assert (abs(data.qpos[0] - before) > 0.1) == (
        policy == "auto"
    )  # no control wakes a tree, a native one neither


def test_a_muscle_that_pulls_keeps_its_tree_awake() -> None:
    model = install(spec_of(SLEEPY.format(policy="allowed")))
    data = mujoco.MjData(model)
    (excitation,) = excitations(data).values()
    excitation[:] = 0.2
    mujoco.mj_step(model, data, nstep=8000)
    assert data.tree_asleep[0] < 0 <= data.tree_asleep[1]
    before = data.qpos[0]
    excitation[:] = 0.6
    mujoco.mj_step(model, data, nstep=2000)
    assert abs(data.qpos[0] - before) > 0.1
