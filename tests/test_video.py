"""Films show the muscles at simulation time; where one cannot be made, an error says why before the run."""

from __future__ import annotations

import copy
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import mujoco
import numpy as np
import pytest
from test_plugin import SCENES, moving, spec_of
from test_recording_failures import room_for

import mjwrap as mw
from mjwrap.video import offscreen

Image = pytest.importorskip("PIL.Image", reason="GIFs need Pillow")
SIZE: dict[str, Any] = {"width": 64, "height": 48}
CORD = """
<mujoco>
  <visual><headlight ambient="1 1 1" diffuse="0 0 0" specular="0 0 0"/></visual>
  <worldbody>
    <camera name="front" pos="0 -1 0" xyaxes="1 0 0 0 0 1" fovy="45"/>
    <site name="a" pos="-0.2 0 0.1" rgba="0 0 0 0"/>
    <body pos="0.2 0 -0.1">
      <joint type="slide" axis="1 0 0"/><geom size="0.001" rgba="0 0 0 0"/><site name="b" rgba="0 0 0 0"/>
    </body>
  </worldbody>
  <tendon><spatial name="cord" rgba="1 0 0 1" width="0.01"><site site="a"/><site site="b"/></spatial></tendon>
  <actuator><muscle name="cord" tendon="cord" force="10" lengthrange="0.1 0.6"/></actuator>
</mujoco>
"""


@pytest.fixture(scope="module", autouse=True)
def opengl() -> None:
    try:
        offscreen.Offscreen(mujoco.MjModel.from_xml_string("<mujoco/>"), 8, 8).close()
    except mw.RecordingError as error:
        pytest.skip(str(error))


def picture(data: mujoco.MjData, size: int = 201, option: mujoco.MjvOption | None = None) -> Any:
    camera = mujoco.MjvCamera()
    camera.type, camera.fixedcamid = int(mujoco.mjtCamera.mjCAMERA_FIXED), 0
    canvas = offscreen.Offscreen(data.model, size, size)
    try:
        return canvas.picture(data, camera, option or mujoco.MjvOption()).astype(int)
    finally:
        canvas.close()


def pixel(point: Any, size: int) -> tuple[int, int]:
    """Row and column that a camera at (0, -1, 0), looking along y with 45 degrees, shows a point at."""
    focal = 0.5 * size / np.tan(np.deg2rad(22.5))
    return round(size / 2 - focal * point[2] / (1 + point[1])), round(
        size / 2 + focal * point[0] / (1 + point[1])
    )


def red(colour: Any) -> bool:
    return bool(colour[0] > 150 and colour[1] < 80 and colour[2] < 80)


def test_a_muscle_is_seen_where_it_runs() -> None:
    data = mujoco.MjData(mw.install(spec_of(CORD)))
    mujoco.mj_forward(data.model, data)
    seen, hidden = picture(data), mujoco.MjvOption()
    hidden.flags[int(mujoco.mjtVisFlag.mjVIS_TENDON)] = 0
    unseen = picture(data, option=hidden)
    for share in np.linspace(0.05, 0.95, 7):
        point = (1 - share) * data.site("a").xpos + share * data.site("b").xpos
        assert red(seen[pixel(point, 201)])
        assert not red(unseen[pixel(point, 201)])
        assert not red(seen[pixel(point + np.array([0, 0, 0.03]), 201)])


def test_a_kept_tendon_is_not_seen_beside_its_muscle() -> None:
    """A wrap that MuJoCo leads another way: with actuators shown too, not a pixel differs from the model without it."""
    camera = '<camera name="front" pos="0.1 -0.6 0.1" xyaxes="1 0 0 0 0 1"/>'
    xml = SCENES["arm"].replace("<worldbody>", "<worldbody>" + camera)
    option = mujoco.MjvOption()
    option.flags[int(mujoco.mjtVisFlag.mjVIS_ACTUATOR)] = 1
    pictures = []
    for keep in (True, False):
        data = moving(mw.install(spec_of(xml), keep_tendons=keep))
        mujoco.mj_forward(data.model, data)
        pictures.append(picture(data, 300, option))
    np.testing.assert_array_equal(*pictures)
    native = moving(spec_of(xml).compile())
    mujoco.mj_forward(native.model, native)
    assert (picture(native, 300, option) != pictures[0]).any()


# ------------------------------------------------------------------------------------------------------ films


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return mw.install(
        spec_of(CORD)
    )  # without lights that cast shadows, which take long without a graphics card


def _duration(film: Any, number: int) -> float:
    film.seek(number)
    return film.info["duration"] / 1000


def shown(path: Path) -> list[float]:
    """How long a film shows each of its pictures [s]."""
    if path.suffix == ".gif":
        with Image.open(path) as film:
            return [_duration(film, i) for i in range(film.n_frames)]
    av = pytest.importorskip("av", reason="MP4s need PyAV")
    with av.open(str(path)) as film:
        stream = film.streams.video[0]
        ends = [frame.time for frame in film.decode(stream)] + [float(stream.duration * stream.time_base)]
    return list(np.diff(ends))


@pytest.mark.parametrize("suffix", [".gif", ".mp4"])
@pytest.mark.parametrize(
    ("timestep", "fps", "speed"), [(0.002, 30.0, 1.0), (0.002, 24.0, 0.25), (0.03, 40.0, 1.0)]
)
def test_a_film_runs_at_simulation_time(
    model: mujoco.MjModel, tmp_path: Path, suffix: str, timestep: float, fps: float, speed: float
) -> None:
    """0.3 s, steps longer than a frame among them; every picture stands until the next one is due."""
    if suffix == ".mp4":
        pytest.importorskip("av", reason="MP4s need PyAV")
    model = copy.copy(model)
    model.opt.timestep = timestep
    data, path = mujoco.MjData(model), tmp_path / f"run{suffix}"
    data.qvel[:], times = 0.3, []
    with mw.Video(model, path, fps=fps, speed=speed, **SIZE) as video:
        while data.time < 0.3 - 1e-9:
            mujoco.mj_step(model, data)
            video.log(data)
            times.append(data.time)
        assert not path.exists()
    due = np.unique(np.floor((np.array(times) - times[0]) * fps / speed + 1e-6))
    expected = np.append(np.diff(due), 1.0) / fps
    tick = 0.01 if suffix == ".gif" else 1e-4
    assert shown(path) == pytest.approx(expected, abs=tick)
    assert sum(shown(path)) == pytest.approx(expected.sum(), abs=tick)
    assert list(tmp_path.iterdir()) == [path]


def test_a_camera_and_an_option_are_followed(tmp_path: Path) -> None:
    data = mujoco.MjData(mw.install(spec_of(CORD)))
    mujoco.mj_forward(data.model, data)
    hidden = mujoco.MjvOption()
    hidden.flags[int(mujoco.mjtVisFlag.mjVIS_TENDON)] = 0
    colours = {}
    for name, option in (("seen", None), ("hidden", hidden)):
        with mw.Video(
            data.model, tmp_path / f"{name}.gif", width=101, height=101, camera="front", option=option
        ) as video:
            video.log(data)
        with Image.open(tmp_path / f"{name}.gif") as film:
            colours[name] = red(np.asarray(film.convert("RGB"))[pixel((0.0, 0.0, 0.0), 101)])
    assert colours == {"seen": True, "hidden": False}


def test_a_camera_on_the_muscles_sees_all_of_the_cord_and_no_room_around_it(tmp_path: Path) -> None:
    far = CORD.replace("<worldbody>", '<statistic extent="50"/><worldbody>')  # MuJoCo's own shows a speck
    data = mujoco.MjData(mw.install(spec_of(far)))
    mujoco.mj_forward(data.model, data)
    with mw.Video(data.model, tmp_path / "run.gif", width=101, height=101, camera="muscles") as video:
        video.log(data)
    with Image.open(tmp_path / "run.gif") as film:
        pixels = np.asarray(film.convert("RGB")).astype(int)
    seen = np.argwhere((pixels[..., 0] > 150) & (pixels[..., 1] < 80))
    low, high = seen.min(axis=0), seen.max(axis=0)
    assert low.min() > 0
    assert high.max() < 100
    assert (high - low).max() > 50


# -------------------------------------------------------------------------------------------------- failures


@pytest.mark.parametrize(
    ("name", "options", "message"),
    [
        ("run.avi", {}, r"must end in \.mp4 or \.gif.*run\.mp4"),
        ("none/run.gif", {"fps": 60.0}, "at most 50 frames"),
        ("run.gif", {"fps": 60.0}, "at most 50 frames a second, not 60"),
        ("run.gif", {"fps": 0.0}, "fps must be a positive number"),
        ("run.gif", {"speed": -1.0}, "speed must be a positive number"),
        ("run.gif", {"width": 0}, "width must be a number of pixels"),
        ("run.gif", {"camera": "top"}, "no camera 'top'; cameras: front, muscles"),
        ("run.gif", {"camera": 3}, "no camera 3; cameras: front"),
        ("run.mp4", {"width": 65}, "must be even, not 65 and 48"),
    ],
)
def test_a_film_that_cannot_be_made_is_refused_before_the_run(
    model: mujoco.MjModel, tmp_path: Path, name: str, options: dict[str, Any], message: str
) -> None:
    with pytest.raises(mw.RecordingError, match=message):
        mw.Video(model, tmp_path / name, **(SIZE | options))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("module", "suffix", "hint"), [("av", ".mp4", "pip install 'mjwrap"), ("PIL.Image", ".gif", "pillow")]
)
def test_a_missing_library_is_named(
    model: mujoco.MjModel,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    module: str,
    suffix: str,
    hint: str,
) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(mw.RecordingError, match=f"cannot write {suffix}.*{hint}"):
        mw.Video(model, tmp_path / f"run{suffix}", **SIZE)
    assert not list(tmp_path.iterdir())


def test_without_opengl_every_backend_says_why(
    model: mujoco.MjModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(width: int, height: int) -> None:
        raise ValueError("no such device")

    monkeypatch.setitem(sys.modules, "broken_gl", SimpleNamespace(GLContext=broken))
    monkeypatch.setitem(sys.modules, "disabled_gl", SimpleNamespace())
    monkeypatch.setattr(
        offscreen,
        "_backends",
        lambda: [("a", "broken_gl"), ("b", "disabled_gl"), ("c", "no_module_of_this_name")],
    )
    pattern = r"no OpenGL works here \(a: no such device; b: switched off; c: No module named.*MUJOCO_GL=egl"
    with pytest.raises(mw.RecordingError, match=pattern):
        mw.Video(model, tmp_path / "run.gif", **SIZE)
    assert not list(tmp_path.iterdir())


def test_an_error_leaves_nothing_and_ctrl_c_a_film(model: mujoco.MjModel, tmp_path: Path) -> None:
    data, path = mujoco.MjData(model), tmp_path / "run.gif"
    path.write_bytes(b"an older film")
    for error in (ZeroDivisionError, KeyboardInterrupt):
        with pytest.raises(error), mw.Video(model, path, **SIZE) as video:
            video.log(data)
            raise error
        assert (path.read_bytes() == b"an older film") == (error is ZeroDivisionError)
    assert len(shown(path)) == 1
    assert list(tmp_path.iterdir()) == [path]


def test_a_film_is_one_run(model: mujoco.MjModel, tmp_path: Path) -> None:
    data, path = mujoco.MjData(model), tmp_path / "run.gif"
    with mw.Video(model, path, **SIZE) as video:
        data.time = 1.0
        video.log(data)
        data.time = 0.5
        with pytest.raises(mw.RecordingError, match="time goes forward"):
            video.log(data)
        with pytest.raises(mw.RecordingError, match="another model"):
            video.log(mujoco.MjData(spec_of(SCENES["arm"]).compile()))
    with pytest.raises(mw.RecordingError, match="it is closed"):
        video.log(data)
    with pytest.raises(mw.RecordingError, match="nothing was logged"), mw.Video(model, path, **SIZE):
        pass
    with pytest.warns(RuntimeWarning, match="never closed"):
        mw.Video(model, tmp_path / "forgotten.gif", **SIZE)
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("suffix", [".gif", ".mp4"])
def test_a_full_disk_is_an_error(model: mujoco.MjModel, tmp_path: Path, suffix: str) -> None:
    if suffix == ".mp4":
        pytest.importorskip("av", reason="MP4s need PyAV")
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    with (
        room_for(100),
        pytest.raises(mw.RecordingError, match=r"no file was written|file was removed"),
        mw.Video(model, tmp_path / f"run{suffix}", **SIZE) as video,
    ):
        video.log(data)
    assert not list(tmp_path.iterdir())
