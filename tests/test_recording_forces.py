"""Forces and moment arms in a recording obey mechanics, and the engine plugin's runs are recorded alike."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

import mjwrap as mw

pytest.importorskip("rerun", reason="recordings need the rerun-sdk package")

from made_up_runs import ROOT, moving, read, static
from test_force_laws import PULLEY

from mjwrap import plugin
from mjwrap.plugin import Muscles

ELBOW = str(ROOT / "models/elbow/elbow.xml")
SCALE = 1e-3  # m/N
STEPS = 40


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_path(ELBOW)


def test_arrows_are_the_forces_on_bodies_and_cancel(model: mujoco.MjModel, tmp_path: Path) -> None:
    muscles, data = mw.MuscleSystem(model), mujoco.MjData(model)
    forces: dict[str, list[list[np.ndarray]]] = {name: [] for name in muscles.names}
    with mw.Recorder(model, muscles, tmp_path / "run.rrd", path_rate=1e4, force_scale=SCALE) as record:
        for step in range(STEPS):
            data.ctrl[:] = 0.5 + 0.5 * np.sin(step + np.arange(model.nu))
            muscles.step(data)
            record.log(data)
            for i, name in enumerate(muscles.names):
                forces[name].append([force for _, _, force in muscles.forces(i)])
    content = read(tmp_path / "run.rrd")
    for name in muscles.names:
        rows, path = content[f"/world/forces/{name}"], content[f"/world/muscles/{name}/path"]
        vectors = [np.array(value) for _, value in moving(rows["Arrows3D:vectors"])]
        origins = [np.array(value) for _, value in moving(rows["Arrows3D:origins"])]
        strips = [np.array(value[0]) for _, value in moving(path["LineStrips3D:strips"])]
        for found, tails, strip, each in zip(vectors, origins, strips, forces[name], strict=True):
            # at both ends of a straight segment, and so twice where it ends on a surface
            expected = [each[0], *(a + b for a, b in zip(each[1:-1:2], each[2:-1:2], strict=True)), each[-1]]
            size = SCALE * float(np.linalg.norm(each[0]))
            np.testing.assert_allclose(found, SCALE * np.array(expected), rtol=0, atol=3e-7 * size + 1e-12)
            np.testing.assert_allclose(found.sum(axis=0), 0.0, atol=3e-6 * size + 1e-12)  # 32-bit
            np.testing.assert_array_equal(tails[[0, -1]], strip[[0, -1]])


def test_joints_are_where_the_data_says_at_its_own_time(model: mujoco.MjModel, tmp_path: Path) -> None:
    """After a step the data is one step further than the results."""
    muscles, data = mw.MuscleSystem(model), mujoco.MjData(model)
    seen = []
    with mw.Recorder(model, muscles, tmp_path / "run.rrd", path_rate=1e4) as record:
        for _ in range(STEPS):
            data.ctrl[:] = 0.4
            muscles.step(data)
            record.log(data)
            seen.append((data.time, *data.qpos))
    content = read(tmp_path / "run.rrd")
    assert model.nq == 1
    curve = moving(content[f"/joint/{model.joint(0).name}"]["Scalars:scalars"])
    times = np.array([nanoseconds for nanoseconds, _ in curve], dtype=float)
    np.testing.assert_allclose(1e-9 * times, [time for time, _ in seen], rtol=0, atol=1e-9)
    assert [angle for _, (angle,) in curve] == [angle for _, angle in seen]


def test_a_pulley_parts_a_path_into_strips(tmp_path: Path) -> None:
    """Each strip has its route's length, no line joins them, and their weighted sum is the muscle's length."""
    model = mujoco.MjModel.from_xml_string(PULLEY)
    muscles, data = mw.MuscleSystem(model), mujoco.MjData(model)
    sites = [data.site(name).xpos for name in "abbdcd"]
    with mw.Recorder(model, muscles, tmp_path / "run.rrd", path_rate=1e4, spacing=2e-4) as record:
        for _ in range(20):
            muscles.step(data)
            record.log(data)
            mujoco.mj_kinematics(model, data)
    strips = moving(read(tmp_path / "run.rrd")["/world/muscles/m/path"]["LineStrips3D:strips"])
    assert len(strips) == 20
    for _, found in strips:
        assert len(found) == 3
    muscles.forward(data)
    history = muscles.history(2)
    for frame in range(2):
        history.put_frame(frame, muscles.poses(data), 2e-4)
    points, sizes, counts = history.polylines(2)
    assert counts.tolist() == [[3, 3]]
    parts = np.split(points.astype(float), np.cumsum(sizes)[:-1])
    for frame in (parts[:3], parts[3:]):
        ends = [part[i] for part in frame for i in (0, -1)]
        np.testing.assert_allclose(ends, sites, rtol=0, atol=1e-7)
        lengths = [np.linalg.norm(np.diff(part, axis=0), axis=1).sum() for part in frame]
        # chords of 0.2 mm over a radius of 3 cm are shorter by 2e-6 of their arc; 32-bit ends of some hundred of them
        assert lengths @ np.array([1, 1 / 2, 1 / 3]) == pytest.approx(muscles.length[0], rel=1e-5)


def test_moment_arms_are_what_a_joint_does_to_the_length(model: mujoco.MjModel, tmp_path: Path) -> None:
    """Against central differences of the recorded lengths, 0.2 mrad apart: error of second order, 1e-8 h² l''' ."""
    muscles, data = mw.MuscleSystem(model), mujoco.MjData(model)
    step = 1e-4
    with mw.Recorder(model, muscles, tmp_path / "run.rrd", path_rate=1e4) as record:
        for k, angle in enumerate(a + s for a in np.linspace(0.2, 2.0, 25) for s in (-step, 0.0, step)):
            data.time, data.qpos[0] = 0.002 * k, angle
            muscles.forward(data)
            record.log(data)
    content = read(tmp_path / "run.rrd")
    (joint,) = [path for path in content if path.startswith("/moment_arm/")]
    names = list(static(content, joint, "SeriesLines:names"))
    arms = np.array([value for _, value in moving(content[joint]["Scalars:scalars"])])
    assert names == [name for name in muscles.names if name in names]
    for k, name in enumerate(names):
        length = np.array([value[0] for _, value in moving(content[f"/length/{name}"]["Scalars:scalars"])])
        slope = (length[2::3] - length[0::3]) / (2 * step)
        np.testing.assert_allclose(arms[1::3, k], -slope, rtol=0, atol=2e-8)
    assert np.abs(arms).max() > 0.01


@pytest.mark.parametrize("integrator", ["EULER", "RK4", "IMPLICITFAST"])
def test_a_run_of_the_plugin_is_recorded_as_that_of_a_muscle_system(tmp_path: Path, integrator: str) -> None:
    spec = mujoco.MjSpec.from_file(ELBOW)
    spec.option.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator}")
    native = spec.compile()
    installed = mw.install(spec)
    system, one, two = mw.MuscleSystem(native), mujoco.MjData(native), mujoco.MjData(installed)
    muscles = Muscles(two)
    paths = tmp_path / "system.rrd", tmp_path / "plugin.rrd"
    with mw.Recorder(native, system, paths[0]) as first, mw.Recorder(installed, muscles, paths[1]) as second:
        for step in range(STEPS):
            one.ctrl[:] = two.ctrl[:] = 0.5 + 0.5 * np.sin(step + np.arange(native.nu))
            system.step(one)
            first.log(one)
            mujoco.mj_step(installed, two)
            second.log(two)
    expected, found = read(paths[0]), read(paths[1])
    assert found.keys() == expected.keys()
    for entity in expected.keys() - {"/__properties", "/__properties/RecordingInfo"}:
        for component, rows in expected[entity].items():
            assert found[entity][component] == rows, (entity, component)


def test_the_plugins_muscles_say_when_their_numbers_are_not_of_this_state() -> None:
    model = mw.load(ELBOW)
    data = mujoco.MjData(model)
    muscles = Muscles(data)
    for spoil in (lambda: None, lambda: mujoco.mj_resetData(model, data), lambda: setattr(data, "time", 7.0)):
        spoil()
        with pytest.raises(mw.StateError, match="not been evaluated at its present state"):
            _ = muscles.time
        mujoco.mj_forward(model, data)
        assert muscles.time == data.time
        mujoco.mj_step(model, data)
        assert muscles.time == data.time - model.opt.timestep
    with pytest.raises(mw.StateError, match="belong to another MjData"):
        muscles.poses(mujoco.MjData(model))
    plain = mujoco.MjModel.from_xml_path(ELBOW)
    with pytest.raises(mw.StateError, match="does not contain the engine plugin"):
        Muscles(mujoco.MjData(plain))


def test_several_instances_are_one_list_of_muscles() -> None:
    """Two installed elbows in one model: each the other's twin, whatever place it has in the list."""
    spec = mujoco.MjSpec()
    for k in range(2):
        arm = mujoco.MjSpec.from_file(ELBOW)
        mw.install(arm)
        spec.attach(arm, prefix=f"{k}_", frame=spec.worldbody.add_frame(pos=[k, 0, 0]))
    model = spec.compile()
    data = mujoco.MjData(model)
    data.ctrl[:] = 0.3
    mujoco.mj_step(model, data, 20)
    muscles = Muscles(data)
    half = muscles.n // 2
    assert [name[2:] for name in muscles.names[:half]] == [name[2:] for name in muscles.names[half:]]
    # the second stands a metre aside, which costs a few roundings of 1 m
    np.testing.assert_allclose(muscles.length[half:], muscles.length[:half], rtol=0, atol=1e-14)
    every = np.arange(muscles.n)
    history = muscles.history(1, np.tile(every, model.nv), np.repeat(np.arange(model.nv), muscles.n))
    history.put_state(0)
    history.put_frame(0, muscles.poses(data), None)
    tails, vectors, counts = history.arrows(1, SCALE)
    for points, sizes in (history.polylines(1)[:2], history.contacts(1), (tails, counts)):
        first = int(sizes[: len(sizes) // 2].sum())
        np.testing.assert_array_equal(sizes[: len(sizes) // 2], sizes[len(sizes) // 2 :])
        np.testing.assert_allclose(points[first:] - [1, 0, 0], points[:first], rtol=0, atol=3e-7)  # 32-bit
    np.testing.assert_allclose(vectors[len(vectors) // 2 :], vectors[: len(vectors) // 2], rtol=0, atol=1e-12)
    arms = history.moment_arms(1)[0].reshape(model.nv, muscles.n)
    np.testing.assert_allclose(arms[0][:half], arms[1][half:], rtol=0, atol=1e-13)
    assert not arms[0][half:].any()
    assert not arms[1][:half].any()


NATIVE = """
<mujoco>
  <worldbody>
    <site name="from" pos="0 0 .3"/>
    <body>
      <joint name="hinge" axis="0 1 0" damping=".5"/>
      <geom name="drum" type="cylinder" size=".03 .1" euler="90 0 0"/>
      <geom type="capsule" fromto="0 0 0 .3 0 0" size=".01"/>
      <site name="to" pos=".2 0 .01"/>
    </body>
  </worldbody>
  <tendon>
    <spatial name="string"><site site="from"/><geom geom="drum"/><site site="to"/></spatial>
  </tendon>
  <actuator><muscle name="muscle" tendon="string" force="100" lengthrange=".2 .5"/></actuator>
</mujoco>
"""


def test_forces_of_muscles_that_mujoco_pulls_are_its_own() -> None:
    model = mw.install(mujoco.MjSpec.from_string(NATIVE), mode="transmission")
    data = mujoco.MjData(model)
    muscles = Muscles(data)
    history = muscles.history(1)
    for _ in range(20):
        data.ctrl[:] = 0.4
        mujoco.mj_step(model, data)
    assert plugin.read(data).transmitted.all()
    for name in ("length", "velocity", "tension", "activation"):
        np.testing.assert_array_equal(getattr(muscles, name), getattr(plugin.read(data), name))
    history.put_state(0)
    history.put_frame(0, muscles.poses(data), None)
    _, vectors, counts = history.arrows(1, 1.0)
    first = np.concatenate([[0], np.cumsum(counts)[:-1]])
    norms = np.linalg.norm(vectors[first].astype(float), axis=1)
    np.testing.assert_allclose(norms, muscles.tension, rtol=3e-7)  # 32-bit
    assert muscles.tension.min() > 1.0
    assert muscles.time == data.time - model.opt.timestep
