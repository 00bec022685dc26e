"""A recording holds what was logged, exactly."""

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import mjwrap as mw

pytest.importorskip("rerun", reason="recordings need the rerun-sdk package")

from made_up_runs import MEASURED, ROOT, XML, Muscles, moving, read, recorder, simulate, static

from mjwrap.recording import read_summary
from mjwrap.recording.columns import activation_colors


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(XML)


@pytest.mark.parametrize("flush_every", [7, 100, 1000])
def test_scalars_are_those_logged_to_the_last_bit(
    model: mujoco.MjModel, tmp_path: Path, flush_every: int
) -> None:
    log, _ = simulate(model, tmp_path / "run.rrd", flush_every=flush_every)
    content = read(tmp_path / "run.rrd")
    times = [round(s.time * 1e9) for s in log]
    for i, name in enumerate(["BIC", r"my\ muscle\/2"]):
        for quantity in MEASURED:
            expected = [[float(getattr(s, quantity)[i])] for s in log]
            rows = moving(content[f"/{quantity}/{name}"]["Scalars:scalars"])
            assert rows == list(zip(times, expected, strict=True))
        power = [[-s.tension[i] * s.velocity[i]] for s in log]
        assert [value for _, value in moving(content[f"/power/{name}"]["Scalars:scalars"])] == power


@pytest.mark.parametrize("flush_every", [7, 1000])
def test_curves_at_a_rate_are_those_of_the_first_state_of_each_period(
    model: mujoco.MjModel, tmp_path: Path, flush_every: int
) -> None:
    log, _ = simulate(model, tmp_path / "run.rrd", flush_every=flush_every, rate=100.0, path_rate=25.0)
    content = read(tmp_path / "run.rrd")
    due = log[::5]  # 2 ms apart
    expected = [(round(s.time * 1e9), [s.tension[0]]) for s in due]
    assert moving(content["/tension/BIC"]["Scalars:scalars"]) == expected
    strips = moving(content["/world/muscles/BIC/path"]["LineStrips3D:strips"])
    assert [t for t, _ in strips] == [round(s.time * 1e9) for s in log[::20]]


def test_group_curves_are_sums_over_the_group(model: mujoco.MjModel, tmp_path: Path) -> None:
    log, _ = simulate(model, tmp_path / "run.rrd", groups={"both": "*"}, flush_every=7)
    content = read(tmp_path / "run.rrd")

    def rows(quantity: str) -> list[float]:
        return [value for _, (value,) in moving(content[f"/groups/{quantity}/both"]["Scalars:scalars"])]

    # sums of two numbers, so to the bit but for the mean's division
    assert rows("tension") == [s.tension[0] + s.tension[1] for s in log]
    assert rows("without_path") == [float(np.count_nonzero(s.status)) for s in log]
    np.testing.assert_allclose(rows("activation"), [s.activation.mean() for s in log], rtol=1e-15)
    np.testing.assert_allclose(rows("power"), [-s.tension @ s.velocity for s in log], rtol=1e-13, atol=1e-15)


@pytest.mark.parametrize("flush_every", [7, 1000])
def test_every_change_of_a_status_is_said_once(
    model: mujoco.MjModel, tmp_path: Path, flush_every: int
) -> None:
    log, _ = simulate(model, tmp_path / "run.rrd", steps=30, flush_every=flush_every)
    lines = moving(read(tmp_path / "run.rrd")["/solver"]["TextLog:text"])
    before, expected = np.zeros(2), []
    for s in log:
        expected += [
            (round(s.time * 1e9), [f"{('BIC', 'my muscle/2')[i]}: {mw.Status(s.status[i]).message}"])
            for i in np.flatnonzero(s.status != before)
        ]
        before = s.status
    assert lines == expected


@pytest.mark.parametrize("flush_every", [7, 1000])
def test_paths_are_those_of_the_displayed_frames(
    model: mujoco.MjModel, tmp_path: Path, flush_every: int
) -> None:
    log, _ = simulate(model, tmp_path / "run.rrd", flush_every=flush_every, path_rate=60.0, force_scale=0.25)
    content = read(tmp_path / "run.rrd")
    # the first state at or after each sixtieth of a second: 0, 16.7, 33.3 … ms
    frames = [log[step] for step in [0, 9, 17, 25, 34, 42, 50, 59, 67, 75, 84, 92]]
    times = [round(s.time * 1e9) for s in frames]
    for i, name in enumerate(["BIC", r"my\ muscle\/2"]):
        path, contacts = content[f"/world/muscles/{name}/path"], content[f"/world/muscles/{name}/contacts"]
        strips = moving(path["LineStrips3D:strips"])
        assert [t for t, _ in strips] == times
        for state, (_, strip) in zip(frames, strips, strict=True):
            expected = [state.points[i].astype(np.float32).tolist()] if len(state.points[i]) else []
            assert strip == expected
        colors = [color for _, (color,) in moving(path["LineStrips3D:colors"])]
        assert colors == activation_colors([s.activation[i] for s in frames]).tolist()
        touches = moving(contacts["Points3D:positions"])
        assert [t for t, _ in touches] == times
        assert [value for _, value in touches] == [
            s.contacts[i].reshape(-1, 3).astype(np.float32).tolist() for s in frames
        ]
        arrows = content[f"/world/forces/{name}"]
        for component, part, size in (("Arrows3D:origins", 0, 1.0), ("Arrows3D:vectors", 1, 0.25)):
            rows = moving(arrows[component])
            assert [t for t, _ in rows] == times
            assert [value for _, value in rows] == [
                (size * s.arrows[i][:, part]).astype(np.float32).tolist() for s in frames
            ]
    arms = moving(content["/moment_arm/hinge"]["Scalars:scalars"])
    assert arms == [(t, s.arms.tolist()) for t, s in zip(times, frames, strict=True)]
    assert static(content, "/moment_arm/hinge", "SeriesLines:names") == ["BIC", "my muscle/2"]
    assert moving(content[r"/world/muscles/my\ muscle\/2/path"]["LineStrips3D:strips"])[0] == (0, [])


def test_a_path_rate_above_the_step_rate_takes_every_state(model: mujoco.MjModel, tmp_path: Path) -> None:
    simulate(model, tmp_path / "run.rrd", steps=20, path_rate=1e4)
    assert len(moving(read(tmp_path / "run.rrd")["/world/muscles/BIC/path"]["LineStrips3D:strips"])) == 20


def test_bodies_move_as_in_the_model(model: mujoco.MjModel, tmp_path: Path) -> None:
    log, _ = simulate(model, tmp_path / "run.rrd", path_rate=1e4)
    content = read(tmp_path / "run.rrd")
    for name, body in [("arm", model.body("arm").id), (r"body\#3", 3)]:
        poses = content[f"/world/bodies/{name}"]
        positions = [value for _, (value,) in poses["Transform3D:translation"]]
        quaternions = [value for _, (value,) in poses["Transform3D:quaternion"]]
        assert positions == [s.xpos[body].astype(np.float32).tolist() for s in log]
        assert quaternions == [s.xquat[body][[1, 2, 3, 0]].astype(np.float32).tolist() for s in log]
    fixed = model.body("fixed").id
    (where,) = static(content, "/world/bodies/fixed", "Transform3D:translation")
    assert where == log[0].xpos[fixed].astype(np.float32).tolist()
    assert "/world/bodies/world" not in content  # the world's own geoms need no transform


def test_every_geom_has_its_shape(model: mujoco.MjModel, tmp_path: Path) -> None:
    simulate(model, tmp_path / "run.rrd", steps=1)
    content = read(tmp_path / "run.rrd")

    def shape(geom: str, component: str, body: str = "arm") -> Any:
        return static(content, f"/world/bodies/{body}/geoms/{geom}", component)

    single = np.float32
    assert shape("drum", "Cylinders3D:lengths") == [
        single(0.24)
    ]  # the geom's half length, though it wraps as infinite
    assert shape("drum", "Cylinders3D:radii") == [single(0.05)]
    assert shape("ball", "Ellipsoids3D:half_sizes") == [[single(0.03)] * 3]
    assert shape("egg", "Ellipsoids3D:half_sizes") == [[single(0.03), single(0.04), single(0.05)]]
    assert shape("pill", "Capsules3D:lengths") == [single(0.2)]
    assert shape("pill", "Capsules3D:translations") == [[0, 0, single(-0.1)]]
    assert shape("box", "Boxes3D:half_sizes", "fixed") == [[single(0.1), single(0.02), single(0.03)]]
    assert shape("floor", "Boxes3D:half_sizes", "world")[0][0] == single(model.stat.extent)
    wedge = rf"geom\#{model.ngeom - 2}"
    vertices = shape(wedge, "Mesh3D:vertex_positions")
    np.testing.assert_array_equal(vertices, model.mesh_vert)
    triangles = shape(wedge, "Mesh3D:triangle_indices")
    np.testing.assert_array_equal(triangles, model.mesh_face)
    top = np.array(shape("hill", "Mesh3D:vertex_positions", "world"))
    np.testing.assert_allclose(top[:, 2].max(), 0.2, rtol=1e-6)  # float32
    np.testing.assert_allclose(top.max(axis=0)[:2] - top.min(axis=0)[:2], [0.8, 0.6], rtol=1e-6)
    for name in ("drum", "box", "hill"):
        geom = model.geom(name)
        body = model.body(model.geom_bodyid[geom.id]).name
        assert shape(name, "Transform3D:translation", body) == [geom.pos.astype(single).tolist()]
        assert shape(name, "Transform3D:quaternion", body) == [
            geom.quat[[1, 2, 3, 0]].astype(single).tolist()
        ]


def test_wrapping_surfaces_are_translucent_and_materials_count(model: mujoco.MjModel, tmp_path: Path) -> None:
    simulate(model, tmp_path / "run.rrd", steps=1)
    content = read(tmp_path / "run.rrd")
    (drum,) = static(content, "/world/bodies/arm/geoms/drum", "Cylinders3D:colors")
    (pill,) = static(content, "/world/bodies/arm/geoms/pill", "Capsules3D:colors")
    (box,) = static(content, "/world/bodies/fixed/geoms/box", "Boxes3D:colors")
    assert drum & 0xFF < 0x80
    assert pill & 0xFF == 0xFF
    assert box == 0xCC331AFF  # the material's .8 .2 .1


def test_attachments_lie_in_their_bodies(model: mujoco.MjModel, tmp_path: Path) -> None:
    simulate(model, tmp_path / "run.rrd", steps=1)
    content = read(tmp_path / "run.rrd")
    both = [model.site(name).pos.astype(np.float32).tolist() for name in ("origin", "my muscle/2 start")]
    assert static(content, "/world/bodies/world/origins", "Points3D:positions") == both
    assert static(content, "/world/bodies/world/origins", "Points3D:labels") == ["BIC", "my muscle/2"]
    assert static(content, "/world/bodies/arm/insertions", "Points3D:labels") == ["BIC, my muscle/2"]
    assert static(content, "/world/bodies/arm/via_points", "Points3D:labels") == ["BIC"]


def test_activation_goes_from_blue_to_red() -> None:
    colors = activation_colors([-1.0, 0.0, 0.5, 1.0, 2.0])
    red, blue, alpha = colors >> 24, colors >> 8 & 0xFF, colors & 0xFF
    assert colors[0] == colors[1]
    assert colors[3] == colors[4]
    assert np.all(np.diff(red[1:4].astype(int)) > 0)
    assert np.all(np.diff(blue[1:4].astype(int)) < 0)
    assert blue[0] > 200 > 100 > red[0]
    assert red[-1] > 200 > 100 > blue[-1]
    assert np.all(alpha == 0xFF)


def test_the_summary_tells_what_is_there(model: mujoco.MjModel, tmp_path: Path) -> None:
    simulate(model, tmp_path / "run.rrd", steps=30)
    summary = read_summary(tmp_path / "run.rrd")
    assert (summary.model, summary.muscles) == ("bench", ("BIC", "my muscle/2"))
    assert (summary.states, summary.start, summary.end) == (30, 0.0, 0.058)
    assert "/length/BIC" in summary.entities


def test_a_recording_without_a_state_is_whole(model: mujoco.MjModel, tmp_path: Path) -> None:
    recorder(model, Muscles(model), tmp_path / "run.rrd").close()
    assert read_summary(tmp_path / "run.rrd").states == 0


@pytest.mark.parametrize("evaluate", ["forward", "apply", "step"])
def test_bodies_paths_and_time_belong_to_one_state(tmp_path: Path, evaluate: str) -> None:
    """The real thing: MjData may lag behind the muscles, or the muscles behind MjData's clock."""
    elbow = mujoco.MjModel.from_xml_path(str(ROOT / "models/elbow/elbow.xml"))
    muscles, data = mw.MuscleSystem(elbow), mujoco.MjData(elbow)
    with mw.Recorder(elbow, muscles, tmp_path / "run.rrd", path_rate=1e4) as record:
        for step in range(5):
            if evaluate == "step":
                muscles.step(data)
            else:
                data.time, data.qpos[:] = 0.002 * step, 0.1 * step
                getattr(muscles, evaluate)(data)
            record.log(data)
    content = read(tmp_path / "run.rrd")
    times = [2_000_000 * step for step in range(5)]
    for muscle in muscles.declarations:
        strips = moving(content[f"/world/muscles/{muscle.name}/path"]["LineStrips3D:strips"])
        assert [t for t, _ in strips] == times
        for site, end in [(muscle.origin_site, 0), (muscle.insertion_site, -1)]:
            body = elbow.body(elbow.site_bodyid[site]).name
            positions, turns = np.zeros((5, 3)), np.tile([1.0, 0, 0, 0], (5, 1))
            if body != "world":
                pose = content[f"/world/bodies/{body}"]
                positions[:] = [value[0] for _, value in pose["Transform3D:translation"]]
                turns[:] = np.roll([value[0] for _, value in pose["Transform3D:quaternion"]], 1, axis=-1)
            expected = np.empty(3)
            for (_, (strip,)), position, turn in zip(strips, positions, turns, strict=True):
                mujoco.mju_rotVecQuat(expected, elbow.site_pos[site], turn)
                # float32 of coordinates below 1 m
                np.testing.assert_allclose(strip[end], position + expected, rtol=0, atol=5e-7)
