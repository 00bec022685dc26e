"""A recording holds what was logged, exactly; a full disk, an error or Ctrl-C leaves no half of one."""

import collections
import contextlib
import os
import signal
import socket
import subprocess
import sys
import time
import urllib.request
import warnings
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import mujoco
import numpy as np
import pytest

import mjwrap as mw

pytest.importorskip("rerun", reason="recordings need the rerun-sdk package")

from rerun.chunk import RrdReader

from mjwrap.recording import read_summary
from mjwrap.recording.columns import activation_colors

ROOT = Path(__file__).resolve().parent.parent
QUANTITIES = ("length", "velocity", "tension", "activation")
XML = """
<mujoco model="bench">
  <asset>
    <mesh name="wedge" vertex="0 0 0  .1 0 0  0 .1 0  0 0 .1"/>
    <hfield name="hill" nrow="3" ncol="4" size=".4 .3 .2 .1" elevation="0 0 0 0  0 1 1 0  0 0 0 0"/>
    <material name="brick" rgba=".8 .2 .1 1"/>
  </asset>
  <worldbody>
    <geom name="floor" type="plane" size="0 0 1"/>
    <geom name="hill" type="hfield" hfield="hill" pos="2 0 0"/>
    <site name="origin" pos=".2 0 .3"/>
    <site name="my muscle/2 start" pos=".2 .1 .3"/>
    <body name="fixed" pos="0 0 .5" euler="0 30 0">
      <geom name="box" type="box" size=".1 .02 .03" material="brick"/>
      <geom name="shell" type="box" size=".1 .02 .03" group="3"/>
    </body>
    <body name="arm" pos="0 .5 .5">
      <joint name="hinge" axis="0 1 0"/>
      <geom name="drum" type="cylinder" size=".05 .12" rgba=".5 .6 .7 1" euler="90 0 0"/>
      <geom name="ball" type="sphere" size=".03"/>
      <geom name="egg" type="ellipsoid" size=".03 .04 .05"/>
      <geom name="pill" type="capsule" size=".02 .1"/>
      <geom type="mesh" mesh="wedge"/>
      <site name="via" pos="0 .1 0"/>
      <site name="insertion" pos="-.2 0 0"/>
    </body>
    <body mocap="true" pos="1 0 0"><geom size=".01"/></body>
  </worldbody>
</mujoco>
"""


def joined(points: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    return np.concatenate(points), np.cumsum([0] + [len(each) for each in points])


class Muscles:
    """MuscleSystem's face over made-up numbers: everything differs in every row, so that mixing any two shows."""

    def __init__(self, model: mujoco.MjModel, names: tuple[str, ...] = ("BIC", "my muscle/2")) -> None:
        self.n, self.names = len(names), list(names)
        sites = {name: model.site(name).id for name in ("origin", "via", "insertion")}
        drum = model.geom("drum").id
        self.declarations = [
            SimpleNamespace(
                name=name,
                origin_site=sites["origin"] if i == 0 else model.site("my muscle/2 start").id,
                insertion_site=sites["insertion"],
                via_sites=[sites["via"]] if i == 0 else [],
                geoms=[drum] if i == 0 else [],
            )
            for i, name in enumerate(names)
        ]
        self.time = 0.0
        self.row = -1

    def forward(self, data: mujoco.MjData) -> None:
        self.time, self.row = data.time, self.row + 1
        rng = np.random.default_rng(self.row)
        self.length, self.velocity, self.tension = rng.normal(size=(3, self.n))
        self.activation = rng.uniform(size=self.n)

    def poses(self, data: mujoco.MjData) -> mujoco.MjData:
        return data

    def polylines(self, spacing: float | None = None) -> tuple[np.ndarray, np.ndarray]:
        return joined([self.points(i) for i in range(self.n)])

    def contacts(self) -> tuple[np.ndarray, np.ndarray]:
        return joined([self.contact_points(i).reshape(-1, 3) for i in range(self.n)])

    def points(self, i: int) -> np.ndarray:
        count = 2 + (self.row + i) % 3
        if i == 1 and self.row == 0:
            count = 0  # no path found yet
        return np.random.default_rng([self.row, i]).normal(size=(count, 3))

    def contact_points(self, i: int) -> np.ndarray:
        return np.random.default_rng([self.row, i, 1]).normal(size=((self.row + i) % 2, 2, 3))


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(XML)


def simulate(
    model: mujoco.MjModel, path: Path, steps: int = 100, **options: Any
) -> tuple[list[SimpleNamespace], Muscles]:
    """Record `steps` states and return what each of them was."""
    muscles = Muscles(model)
    log: list[SimpleNamespace] = []
    with recorder(model, muscles, path, **options) as record:
        for data in states(model, muscles, steps):
            record.log(data)
            log.append(
                SimpleNamespace(
                    time=data.time,
                    xpos=data.xpos.copy(),
                    xquat=data.xquat.copy(),
                    points=[muscles.points(i) for i in range(muscles.n)],
                    contacts=[muscles.contact_points(i) for i in range(muscles.n)],
                    **{name: getattr(muscles, name).copy() for name in QUANTITIES},
                )
            )
    return log, muscles


def recorder(model: mujoco.MjModel, muscles: Any, path: Path, **options: Any) -> mw.Recorder:
    """A Recorder that takes `Muscles` for a MuscleSystem."""
    return mw.Recorder(model, muscles, path, **options)


def states(model: mujoco.MjModel, muscles: Muscles, steps: int) -> Iterator[mujoco.MjData]:
    """`steps` states of the model, 2 ms apart, with joint and mocap body on the move."""
    data = mujoco.MjData(model)
    for step in range(steps):
        data.time = 0.002 * step
        data.qpos[0] = 0.03 * step
        data.mocap_pos[0, 2] = 0.01 * step
        mujoco.mj_kinematics(model, data)
        muscles.forward(data)
        yield data


def read(path: Path) -> dict[str, dict[str, list[tuple[int | None, Any]]]]:
    """Everything in a recording: entity, component -> rows (time [ns], None where static; value) by time."""
    content: dict[str, dict[str, list[tuple[int | None, Any]]]] = {}
    for chunk in RrdReader(path).store().stream():
        columns = chunk.to_record_batch()
        times: list[int | None] = [None] * chunk.num_rows
        if not chunk.is_static:
            times = columns.column("sim_time").cast("int64").to_pylist()
        for name in columns.schema.names:
            if name not in ("sim_time", "rerun.controls.RowId"):
                rows = content.setdefault(chunk.entity_path, {}).setdefault(name, [])
                rows.extend(zip(times, columns.column(name).to_pylist(), strict=True))
    for components in content.values():
        for rows in components.values():
            rows.sort(key=lambda row: row[0] or 0)
    return content


def moving(rows: list[tuple[int | None, Any]]) -> list[tuple[int | None, Any]]:
    return [row for row in rows if row[0] is not None]


def static(content: dict[str, dict[str, list[tuple[int | None, Any]]]], entity: str, component: str) -> Any:
    ((time_, value),) = content[entity][component]
    assert time_ is None
    return value


# --- what a recording holds


@pytest.mark.parametrize("flush_every", [7, 100, 1000])
def test_scalars_are_those_logged_to_the_last_bit(
    model: mujoco.MjModel, tmp_path: Path, flush_every: int
) -> None:
    log, _ = simulate(model, tmp_path / "run.rrd", flush_every=flush_every)
    content = read(tmp_path / "run.rrd")
    for quantity in QUANTITIES:
        for i, name in enumerate(["BIC", r"my\ muscle\/2"]):
            expected = [(round(s.time * 1e9), [getattr(s, quantity)[i]]) for s in log]
            assert moving(content[f"/{quantity}/{name}"]["Scalars:scalars"]) == expected


@pytest.mark.parametrize("flush_every", [7, 1000])
def test_paths_are_those_of_the_displayed_frames(
    model: mujoco.MjModel, tmp_path: Path, flush_every: int
) -> None:
    log, _ = simulate(model, tmp_path / "run.rrd", flush_every=flush_every, path_rate=60.0)
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


@pytest.mark.parametrize("count", [2, 20])
def test_the_layout_shows_the_model_and_every_muscle(
    model: mujoco.MjModel, tmp_path: Path, count: int
) -> None:
    names = tuple(f"m{i}" for i in range(count))
    muscles = Muscles(model, names)
    with recorder(model, muscles, tmp_path / "run.rrd") as record:
        for data in states(model, muscles, 3):
            record.log(data)
    reader = RrdReader(tmp_path / "run.rrd")
    (layout,) = reader.blueprints()
    shown: list[str] = []
    kinds: list[str] = []
    for chunk in reader.stream(store=layout):
        columns = chunk.to_record_batch()
        for name, found in [("ViewContents:query", shown), ("ViewBlueprint:class_identifier", kinds)]:
            if name in columns.schema.names:
                found += [word for row in columns.column(name).to_pylist() for word in row]
    for quantity in QUANTITIES:
        curves = [line for line in shown if line.startswith(f"+ /{quantity}/")]
        assert sorted(curves) == sorted(f"+ /{quantity}/{name}" for name in names)  # each once, none lost
    assert kinds.count("3D") == 1
    assert kinds.count("TimeSeries") == 4 * -(-count // 8)  # pages of eight


def test_the_summary_tells_what_is_there(model: mujoco.MjModel, tmp_path: Path) -> None:
    simulate(model, tmp_path / "run.rrd", steps=30)
    summary = read_summary(tmp_path / "run.rrd")
    assert (summary.model, summary.muscles) == ("bench", ("BIC", "my muscle/2"))
    assert (summary.states, summary.start, summary.end) == (30, 0.0, 0.058)
    assert "/length/BIC" in summary.entities


def test_a_recording_without_a_state_is_whole(model: mujoco.MjModel, tmp_path: Path) -> None:
    recorder(model, Muscles(model), tmp_path / "run.rrd").close()
    assert read_summary(tmp_path / "run.rrd").states == 0


LAGGING = pytest.mark.xfail(
    not hasattr(mw.MuscleSystem, "poses"),
    reason="MuscleSystem does not tell whose poses its results belong to",
)


@pytest.mark.parametrize(
    "evaluate", [pytest.param("forward", marks=LAGGING), pytest.param("apply", marks=LAGGING), "step"]
)
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


# --- what goes wrong


@pytest.mark.parametrize(
    ("place", "message"),
    [
        ("missing/run.rrd", "there is no folder .*missing.*exists as far as"),
        ("run.txt", r"must end in \.rrd.*run\.rrd"),
        ("folder.rrd", "is a folder"),
        ("file/run.rrd", "is not a folder"),
        ("device.rrd", "a device or a pipe"),
    ],
)
def test_a_bad_path_is_an_error_before_the_run(
    model: mujoco.MjModel, tmp_path: Path, place: str, message: str
) -> None:
    (tmp_path / "folder.rrd").mkdir()
    (tmp_path / "file").touch()
    (tmp_path / "device.rrd").symlink_to("/dev/full")
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(mw.RecordingError, match=message) as caught:
        recorder(model, Muscles(model), tmp_path / place)
    assert str(tmp_path / place) in str(caught.value)
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="permissions do not bind this user")
def test_a_folder_without_permission_is_an_error_before_the_run(
    model: mujoco.MjModel, tmp_path: Path
) -> None:
    tmp_path.chmod(0o500)
    try:
        with pytest.raises(mw.RecordingError, match="permission denied"):
            recorder(model, Muscles(model), tmp_path / "run.rrd")
    finally:
        tmp_path.chmod(0o700)


@pytest.mark.parametrize(
    "option", [{"path_rate": 0}, {"path_rate": np.nan}, {"flush_every": 0}, {"spacing": -1}]
)
def test_a_bad_option_is_an_error(model: mujoco.MjModel, tmp_path: Path, option: dict[str, float]) -> None:
    with pytest.raises(mw.RecordingError, match=f"{next(iter(option))} must be"):
        recorder(model, Muscles(model), tmp_path / "run.rrd", **option)
    assert list(tmp_path.iterdir()) == []


def test_rerun_switched_off_is_an_error(
    model: mujoco.MjModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RERUN", "off")
    with pytest.raises(mw.RecordingError, match="RERUN=on"):
        recorder(model, Muscles(model), tmp_path / "run.rrd")
    assert list(tmp_path.iterdir()) == []


@contextlib.contextmanager
def room_for(size: int) -> Iterator[None]:
    """Let no file of this process grow beyond `size` bytes: what a full disk is to a writer."""
    resource = pytest.importorskip("resource", reason="needs POSIX resource limits")
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)


@pytest.mark.parametrize(
    "flush_every", [50, 10**6]
)  # the disk is full at a flush of log, or not before close
def test_a_full_disk_is_an_error_and_leaves_nothing_half_written(
    model: mujoco.MjModel, tmp_path: Path, flush_every: int
) -> None:
    path = tmp_path / "run.rrd"
    simulate(model, path, steps=3)
    old = path.read_bytes()
    with room_for(len(old) + 50_000), pytest.raises(mw.RecordingError, match="file too large") as caught:
        simulate(model, path, steps=20_000 if flush_every < 1000 else 3000, flush_every=flush_every)
    assert str(path) in str(caught.value)
    assert list(tmp_path.iterdir()) == [path]
    assert path.read_bytes() == old


def test_a_disk_too_full_for_the_last_bytes_is_an_error(model: mujoco.MjModel, tmp_path: Path) -> None:
    """The table of contents is written when the file is closed, where rerun itself reports nothing."""
    simulate(model, tmp_path / "whole.rrd")
    size = (tmp_path / "whole.rrd").stat().st_size
    with room_for(size - 2000), pytest.raises(mw.RecordingError, match="file too large"):
        simulate(model, tmp_path / "run.rrd")
    assert list(tmp_path.iterdir()) == [tmp_path / "whole.rrd"]


def test_a_refused_rename_is_an_error(model: mujoco.MjModel, tmp_path: Path) -> None:
    """Somebody made a folder of that name during the run."""
    record = recorder(model, Muscles(model), tmp_path / "run.rrd")
    (tmp_path / "run.rrd").mkdir()
    with pytest.raises(mw.RecordingError, match="is a directory"):
        record.close()
    assert list(tmp_path.iterdir()) == [tmp_path / "run.rrd"]


def test_after_a_failure_no_more_is_logged(model: mujoco.MjModel, tmp_path: Path) -> None:
    muscles = Muscles(model)
    data = next(states(model, muscles, 1))
    record = recorder(model, muscles, tmp_path / "run.rrd", flush_every=1)
    with room_for(1000), pytest.raises(mw.RecordingError, match="too large"):
        collections.deque((record.log(data) for _ in range(1000)), maxlen=0)
    with pytest.raises(mw.RecordingError, match="failed before"):
        record.log(data)
    record.close()  # nothing left to do, nothing to complain of twice
    assert list(tmp_path.iterdir()) == []


def test_an_error_in_the_run_leaves_an_older_recording_as_it_was(
    model: mujoco.MjModel, tmp_path: Path
) -> None:
    path = tmp_path / "run.rrd"
    simulate(model, path, steps=3)
    old = path.read_bytes()
    muscles = Muscles(model)

    def run() -> None:
        with recorder(model, muscles, path, flush_every=5) as record:
            for step, data in enumerate(states(model, muscles, 40)):
                record.log(data)
                if step == 30:
                    raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        run()
    assert list(tmp_path.iterdir()) == [path]
    assert path.read_bytes() == old


def test_until_it_is_closed_an_older_recording_stays(model: mujoco.MjModel, tmp_path: Path) -> None:
    path = tmp_path / "run.rrd"
    simulate(model, path, steps=3)
    muscles = Muscles(model)
    with recorder(model, muscles, path, flush_every=5) as record:
        for data in states(model, muscles, 40):
            record.log(data)
        assert read_summary(path).states == 3
    assert read_summary(path).states == 40
    assert list(tmp_path.iterdir()) == [path]


def test_ctrl_c_leaves_a_recording_of_what_was_logged(model: mujoco.MjModel, tmp_path: Path) -> None:
    muscles = Muscles(model)

    def run() -> None:
        with recorder(model, muscles, tmp_path / "run.rrd", flush_every=7) as record:
            for step, data in enumerate(states(model, muscles, 40)):
                record.log(data)
                if step == 24:
                    os.kill(os.getpid(), signal.SIGINT)
                    time.sleep(1)  # the signal arrives in here

    with pytest.raises(KeyboardInterrupt):
        run()
    summary = read_summary(tmp_path / "run.rrd")
    assert (summary.states, summary.end) == (25, 0.048)


def test_ctrl_c_during_a_flush_neither_loses_nor_repeats_a_row(
    model: mujoco.MjModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from mjwrap.recording.stream import Stream

    send = Stream.send

    def interrupted(self: Stream, batches: list[Any]) -> None:
        os.kill(os.getpid(), signal.SIGINT)
        send(self, batches)

    muscles = Muscles(model)
    handler = signal.getsignal(signal.SIGINT)

    def run() -> None:
        with recorder(model, muscles, tmp_path / "run.rrd", flush_every=7) as record:
            for step, data in enumerate(states(model, muscles, 40)):
                monkeypatch.setattr(Stream, "send", interrupted if step == 13 else send)
                record.log(data)

    with pytest.raises(KeyboardInterrupt):
        run()
    times = [t for t, _ in moving(read(tmp_path / "run.rrd")["/length/BIC"]["Scalars:scalars"])]
    assert times == [2_000_000 * step for step in range(14)]
    assert signal.getsignal(signal.SIGINT) is handler


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
def test_a_process_forked_during_the_run_does_not_hold_up_the_end(
    model: mujoco.MjModel, tmp_path: Path
) -> None:
    code = f"""
import os, signal, sys, time
sys.path[:0] = [{str(ROOT)!r}, {str(ROOT / "tests")!r}]
import mujoco, test_recording as t
model = mujoco.MjModel.from_xml_string(t.XML)
muscles = t.Muscles(model)
with t.recorder(model, muscles, t.Path({str(tmp_path / "run.rrd")!r})) as record:
    for data in t.states(model, muscles, 40):
        record.log(data)
    child = os.fork()
    if child == 0:
        time.sleep(60)
        os._exit(0)
print(t.read_summary({str(tmp_path / "run.rrd")!r}).states)
os.kill(child, signal.SIGKILL)
"""
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=30
    )
    assert done.stdout == "40\n"


def test_a_closed_recorder_takes_no_more(model: mujoco.MjModel, tmp_path: Path) -> None:
    muscles = Muscles(model)
    data = next(states(model, muscles, 1))
    record = recorder(model, muscles, tmp_path / "run.rrd")
    record.log(data)
    record.close()
    record.close()
    with pytest.raises(mw.RecordingError, match=r"cannot log to '.*run\.rrd': it is closed"):
        record.log(data)


@pytest.mark.parametrize("later", [0.001, np.nan])
def test_time_goes_forward(model: mujoco.MjModel, tmp_path: Path, later: float) -> None:
    muscles = Muscles(model)
    data = next(states(model, muscles, 1))
    with recorder(model, muscles, tmp_path / "run.rrd") as record:
        muscles.time = 0.5
        record.log(data)
        muscles.time = later
        with pytest.raises(mw.RecordingError, match="after a reset"):
            record.log(data)
    assert read_summary(tmp_path / "run.rrd").states == 1


def test_a_forgotten_recorder_is_reported(model: mujoco.MjModel, tmp_path: Path) -> None:
    record = recorder(model, Muscles(model), tmp_path / "run.rrd")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        del record
    assert [w.category for w in caught] == [RuntimeWarning]
    assert "never closed" in str(caught[0].message)
    assert list(tmp_path.iterdir()) == []


# --- scripts/replay.py


def replay(*arguments: object) -> "subprocess.CompletedProcess[str]":
    command = [sys.executable, str(ROOT / "scripts" / "replay.py"), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)


def test_replay_prints_what_a_recording_holds(model: mujoco.MjModel, tmp_path: Path) -> None:
    simulate(model, tmp_path / "run.rrd", steps=30)
    done = replay(tmp_path / "run.rrd", "--info")
    assert (done.returncode, done.stderr) == (0, "")
    assert "0 s to 0.058 s, 30 states" in done.stdout
    assert "2: BIC, my muscle/2" in done.stdout
    assert "/world/muscles/BIC/path" in done.stdout


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        ("missing", "there is no recording"),
        ("empty", "not a complete recording"),
        ("text", "not a complete recording"),
        ("cut", "not a complete recording"),
        ("no end", "cut short"),
        ("scratched", "not a complete recording"),
    ],
)
def test_replay_refuses_a_damaged_file_in_one_line(
    model: mujoco.MjModel, tmp_path: Path, damage: str, message: str
) -> None:
    path = tmp_path / "run.rrd"
    simulate(model, path, steps=3000)
    whole = path.read_bytes()
    middle = len(whole) // 2
    damaged = {
        "empty": b"",
        "text": b"<mujoco/>\n" * 100,
        "cut": whole[:middle],
        "no end": whole[:-20],
        "scratched": whole[: middle // 2] + bytes(middle) + whole[middle // 2 + middle :],
    }
    path.unlink() if damage == "missing" else path.write_bytes(damaged[damage])
    done = replay(path, "--info")
    assert done.returncode == 2
    assert done.stdout == ""
    assert message in done.stderr
    assert str(path) in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_replay_serves_to_a_browser(model: mujoco.MjModel, tmp_path: Path) -> None:
    simulate(model, tmp_path / "run.rrd", steps=3)
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
        taken = replay(tmp_path / "run.rrd", "--serve", "--port", port)
    assert taken.returncode == 2
    assert f"cannot serve at port {port}" in taken.stderr

    command = [sys.executable, str(ROOT / "scripts" / "replay.py"), str(tmp_path / "run.rrd"), "--serve"]
    with subprocess.Popen([*command, "--port", str(port)], stdout=subprocess.PIPE, text=True) as server:
        try:
            assert server.stdout is not None
            address = server.stdout.readline().split()[-1]
            assert address.startswith(f"http://127.0.0.1:{port}?url=")
            page = b""
            deadline = time.monotonic() + 30
            while not page and time.monotonic() < deadline:
                with contextlib.suppress(OSError):
                    page = urllib.request.urlopen(address, timeout=5).read()
            assert b"<html" in page
        finally:
            server.send_signal(signal.SIGINT)
            assert server.wait(timeout=20) == 0
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        probe.bind(("127.0.0.1", port))  # nobody is left there
