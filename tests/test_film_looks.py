"""The look of films: background, colours, via points, surfaces, legend, shadows."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from cli_runs import ELBOW, ROOT, run_here
from test_plugin import spec_of
from test_video import CORD, opengl  # noqa: F401  (skips where nothing can be drawn)

import mjwrap as mw
from mjwrap.plugin import Muscles
from mjwrap.video.background import NAMED
from mjwrap.video.muscle_looks import PALETTE, MuscleLooks

pytest.importorskip("PIL.Image", reason="legends need Pillow")
SIZE: dict[str, Any] = {"width": 160, "height": 120}
LIGHT = np.rint(255 * np.array(NAMED["light"])).astype(int)


def frame(
    data: mujoco.MjData,
    folder: Path,
    *,
    size: tuple[int, int] = (160, 120),
    camera: str | None = None,
    **look: Any,
) -> Any:
    """One frame as it is before a file's compression."""
    video = mw.Video(
        data.model, folder / "film.gif", width=size[0], height=size[1], camera=camera or "muscles", **look
    )
    with video:
        video.log(data)
        return video._picture(data, video._camera).astype(int)  # type: ignore[arg-type]


def forward(model: mujoco.MjModel) -> mujoco.MjData:
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return data


@pytest.fixture(scope="module")
def elbow() -> mujoco.MjData:
    return forward(mw.load(ELBOW))


def share(picture: Any, color: Any, tolerance: int = 3) -> float:
    """The share of pixels that have a colour."""
    return float((np.abs(picture - np.asarray(color)).max(axis=-1) <= tolerance).mean())


def near(picture: Any, color: Any) -> int:
    """The number of pixels that have a hue, however bright."""
    hue = picture / np.maximum(picture.max(axis=-1, keepdims=True), 1)
    return int((np.abs(hue - np.asarray(color) / max(color)).max(axis=-1) < 0.08).sum())


SKY = '<asset><texture type="skybox" builtin="flat" rgb1="0 .4 0" width="8" height="8"/></asset><worldbody>'


@pytest.mark.parametrize("sky", [True, False])
@pytest.mark.parametrize(
    ("background", "color"),
    [("light", LIGHT), ("dark", np.rint(255 * np.array(NAMED["dark"]))), ("#4080c0", (0x40, 0x80, 0xC0))],
)
def test_the_background_has_one_colour_whatever_the_sky_and_the_lights_are(
    tmp_path: Path, sky: bool, background: str, color: Any
) -> None:
    """Also in the first frame, and through a camera of the model."""
    xml = CORD.replace("<worldbody>", SKY) if sky else CORD
    lit = xml.replace("<worldbody>", '<worldbody><light pos="0 -1 1" diffuse="1 1 1"/>')
    for text, camera in ((xml, "front"), (lit, "muscles")):
        data = forward(mw.install(spec_of(text)))
        with mw.Video(data.model, tmp_path / "f.gif", camera=camera, background=background, **SIZE) as video:
            eye = video._camera
            video.log(data)
            kept = video._writer._pictures[0].convert("RGB")  # type: ignore[union-attr]
            picture = video._picture(data, video._camera or eye)  # type: ignore[arg-type]
        assert share(picture.astype(int), color) > 0.8
        corners = np.asarray(kept, dtype=int)[[0, 0, -1, -1], [0, -1, 0, -1]]
        assert np.abs(corners - np.asarray(color)).max() <= 6  # a GIF has 256 colours


def test_the_models_own_background_stays_on_request(tmp_path: Path) -> None:
    data = forward(mw.install(spec_of(CORD.replace("<worldbody>", SKY))))
    assert share(frame(data, tmp_path, background="model"), (0, 102, 0)) > 0.8


def test_a_room_and_the_texture_of_a_floor_give_way_to_the_background(tmp_path: Path) -> None:
    room = """<worldbody>
      <geom name="wall" type="mesh" mesh="wall" pos="0 3 0" rgba="1 0 0 1"/>
      <geom name="floor" type="plane" size="3 3 .1" pos="0 0 -.5" rgba=".9 0 0 1"/>"""
    mesh = '<asset><mesh name="wall" vertex="-5 0 -5 5 0 -5 5 0 5 -5 0 5 0 1 0"/></asset>'
    text = CORD.replace("<worldbody>", mesh + room).replace('rgba="1 0 0 1" width', 'rgba="0 0 1 1" width')
    data = forward(mw.install(spec_of(text)))
    for background, reddish in (("model", True), ("light", False)):
        picture = frame(data, tmp_path, camera="front", background=background)
        red = (picture[..., 0] > 60) & (picture[..., 1] < 0.5 * picture[..., 0])
        assert (red.mean() > 0.5) == reddish


def test_muscles_of_one_look_are_told_apart_and_named(elbow: mujoco.MjData, tmp_path: Path) -> None:
    size = (640, 480)
    apart = frame(elbow, tmp_path, size=size, legend=False)
    alike = frame(elbow, tmp_path, size=size, legend=False, colors="model")
    for i in range(7):
        assert near(apart, PALETTE[i]) > 30
        if i:
            assert near(alike, PALETTE[i]) < near(apart, PALETTE[i])
    named = frame(elbow, tmp_path, size=size)
    changed = (named != apart).any(axis=-1)
    rows, columns = np.nonzero(changed)
    assert 0 < len(rows) < 0.12 * changed.size
    assert rows.min() == 0 or rows.max() == size[1] - 1  # in a corner
    assert columns.min() == 0 or columns.max() == size[0] - 1
    small: dict[str, Any] = {"size": (64, 48)}  # no space for one that nobody asked for
    np.testing.assert_array_equal(
        frame(elbow, tmp_path, **small), frame(elbow, tmp_path, **small, legend=False)
    )
    assert (frame(elbow, tmp_path, **small) != frame(elbow, tmp_path, **small, legend=True)).any()


def test_a_model_that_tells_its_muscles_apart_keeps_its_colours(tmp_path: Path) -> None:
    text = CORD.replace(
        "</tendon>",
        '<spatial name="other" rgba="0 0 1 1" width="0.01"><site site="b"/><site site="a"/></spatial></tendon>',
    )
    text = text.replace(
        "</actuator>", '<muscle name="other" tendon="other" force="10" lengthrange="0.1 0.6"/></actuator>'
    )
    data = forward(mw.install(spec_of(text)))
    np.testing.assert_array_equal(frame(data, tmp_path), frame(data, tmp_path, colors="model", legend=False))
    assert (frame(data, tmp_path) != frame(data, tmp_path, colors="muscle", legend=False)).any()


@pytest.mark.parametrize("count", [1, 2])
def test_a_path_without_a_tendon_has_a_colour_and_a_name_where_it_can_be_told(
    count: int, tmp_path: Path
) -> None:
    """The tendons beside it keep theirs. A scene does not say which of several such paths a piece belongs to."""
    ties = "".join(
        f'<numeric name="tie{i}_optimal_force" data="1"/><tuple name="mjwrap_tie{i}">'
        '<element objtype="site" objname="a"/><element objtype="site" objname="c"/>'
        f'<element objtype="numeric" objname="tie{i}_optimal_force"/></tuple>'
        for i in range(count)
    )
    text = CORD.replace('rgba="1 0 0 1" width="0.01"', 'width="0.02"')
    text = text.replace(
        '<body pos="0.2 0 -0.1">', '<body pos="0.2 0 -0.1"><site name="c" pos="-.4 0 0" rgba="0 0 0 0"/>'
    )
    data = forward(mw.install(spec_of(text.replace("</mujoco>", f"<custom>{ties}</custom></mujoco>"))))
    looks = MuscleLooks(data, None, None, dark=False)
    names = [name for name, *_ in looks.legend()]
    assert names == (["cord", "tie0"] if count == 1 else ["cord"])
    seen = frame(data, tmp_path, size=(320, 240), legend=False)
    colors = dict(zip(list(Muscles(data).names), PALETTE, strict=False))
    assert near(seen, colors["cord"]) > 20
    assert (near(seen, colors["tie0"]) > 20) == (count == 1)


def test_activation_colours_a_path(tmp_path: Path) -> None:
    data = forward(mw.install(spec_of(CORD)))
    pictures = []
    for activation in (0.0, 1.0):
        data.act[:] = activation
        mujoco.mj_forward(data.model, data)
        pictures.append(frame(data, tmp_path, camera="front", colors="activation", legend=False))
    cord = np.abs(pictures[0] - LIGHT).max(axis=-1) > 60
    assert cord.any()
    blue, red = (picture[cord].mean(axis=0) for picture in pictures)
    assert blue[2] > 2 * blue[0]
    assert red[0] > 2 * red[2]


def test_via_points_are_marked(tmp_path: Path) -> None:
    via = CORD.replace(
        '<body pos="0.2', '<site name="v" pos="0 0 0.1" rgba="0 0 0 0"/><body pos="0.2'
    ).replace('<site site="a"/>', '<site site="a"/><site site="v"/>')
    data = forward(mw.install(spec_of(via)))
    picture = frame(data, tmp_path, size=(201, 201), camera="front", legend=False)
    row = round(100.5 - 100.5 / np.tan(np.deg2rad(22.5)) * 0.1)
    assert picture[row, 100].max() < 60  # dark, where the red cord has its corner
    hidden = mujoco.MjvOption()
    hidden.flags[int(mujoco.mjtVisFlag.mjVIS_TENDON)] = 0
    bare = frame(data, tmp_path, size=(201, 201), camera="front", legend=False, option=hidden)
    assert bare[row, 100].min() > 200


def test_surfaces_are_shown_and_hidden_on_request(tmp_path: Path) -> None:
    """Also one whose geom is of a hidden group."""
    text = CORD.replace("<worldbody>", '<worldbody><geom name="ball" size=".05" group="4" rgba="0 0 1 1"/>')
    data = forward(
        mw.install(spec_of(text.replace('<site site="a"/>', '<site site="a"/><geom geom="ball"/>')))
    )
    shown, usual, hidden = (
        frame(data, tmp_path, camera="front", surfaces=surfaces) for surfaces in (True, None, False)
    )
    np.testing.assert_array_equal(usual, hidden)  # its group is not shown
    assert 0.005 < (np.abs(shown - usual).max(axis=-1) > 10).mean() < 0.2
    reds = [((p[..., 0] > 120) & (p[..., 1] < 110)).sum() for p in (shown, usual)]
    assert reds[0] > 0.5 * reds[1] > 50  # the muscle remains in sight


def test_surfaces_that_no_geom_looks_like_are_shown_where_they_are(tmp_path: Path) -> None:
    """A torus, a cone and an elliptic cylinder: their sizes are numerics, their geoms are specks."""
    data = mujoco.MjData(mw.load(ROOT / "docs" / "_figures" / "strap.xml"))
    data.qpos[:] = 0.5, 0.7
    mujoco.mj_forward(data.model, data)
    size = (320, 240)
    shown, usual = (frame(data, tmp_path, size=size, surfaces=surfaces) for surfaces in (True, None))
    changed = np.abs(shown - usual).max(axis=-1) > 10
    assert 0.01 < changed.mean() < 0.3
    with mw.Video(data.model, tmp_path / "f.gif", surfaces=True, camera="muscles", **SIZE) as video:
        video.log(data)
        scene = video._canvas._scene
        corners = np.array(
            [g.pos for g in scene.geoms[: scene.ngeom] if g.type == int(mujoco.mjtGeom.mjGEOM_TRIANGLE)]
        )
    assert len(corners) > 500
    muscles = Muscles(data)
    bounds = [
        np.linalg.norm(corners - data.geom_xpos[geom], axis=1).min()
        for muscle in muscles.declarations
        for geom, surface in zip(muscle.geoms, muscle.surfaces, strict=True)
        if isinstance(surface, (mw.Torus, mw.Cone, mw.EllipticCylinder))
    ]
    assert len(bounds) == 3
    assert max(bounds) < 0.1  # each has triangles around its geom


def test_hidden_surfaces_leave_the_bodies(elbow: mujoco.MjData, tmp_path: Path) -> None:
    usual, bare = (frame(elbow, tmp_path, surfaces=surfaces, legend=False) for surfaces in (None, False))
    changed = (usual != bare).any(axis=-1).mean()
    assert 0.001 < changed < 0.1


def test_shadows_are_drawn_on_request_only(elbow: mujoco.MjData, tmp_path: Path) -> None:
    for shadows in (False, True):
        with mw.Video(elbow.model, tmp_path / "f.gif", shadows=shadows, **SIZE) as video:
            video.log(elbow)
            flags = video._canvas._scene.flags
            assert bool(flags[int(mujoco.mjtRndFlag.mjRND_SHADOW)]) == shadows
            assert not flags[int(mujoco.mjtRndFlag.mjRND_REFLECTION)]


@pytest.mark.parametrize(
    ("look", "message"),
    [
        (
            {"background": "blue"},
            "background must be one of light, dark, model, or a colour '#RRGGBB', not 'blue'",
        ),
        ({"colors": "rainbow"}, "colors must be one of muscle, activation, model, not 'rainbow'"),
        ({"surfaces": "all"}, "surfaces must be True, False or None"),
    ],
)
def test_a_look_that_does_not_exist_is_refused(
    elbow: mujoco.MjData, tmp_path: Path, look: dict[str, Any], message: str
) -> None:
    with pytest.raises(mw.RecordingError, match=message):
        mw.Video(elbow.model, tmp_path / "f.gif", **SIZE, **look)
    assert not list(tmp_path.iterdir())


def test_the_command_passes_the_look_on(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = str(ROOT / "models" / "five_surfaces" / "five_surfaces.xml")
    options = ["--duration", 0.02, "--video", tmp_path / "f.gif", "--video-size", "64x48"]
    ran = run_here(
        "run", capsys, model, *options, "--background", "#ff0000", "--no-surfaces", "--colors", "activation"
    )
    assert ran.code == 0, ran.err
    from PIL import Image

    with Image.open(tmp_path / "f.gif") as film:
        assert share(np.asarray(film.convert("RGB"), dtype=int), (255, 0, 0), 6) > 0.7
    for option in (
        ["--surfaces"],
        ["--no-legend"],
        ["--background", "dark"],
        ["--colors", "muscle"],
        ["--shadows"],
    ):
        ran = run_here("run", capsys, model, "--duration", 0.02, *option)
        assert ran.code == 2
        assert "needs a film: add --video" in ran.err


@pytest.mark.parametrize("camera", [None, "muscles"])
@pytest.mark.parametrize("gravity", ["0 -9.81 0", "0 0 -9.81", "9.81 0 0", "0 0 0"])
def test_up_is_against_gravity(gravity: str, camera: str | None, tmp_path: Path) -> None:
    """A rod along gravity stands upright in the film, its red end above its blue one."""
    up = -np.array([float(x) for x in gravity.split()])
    up = up / np.linalg.norm(up) if up.any() else np.array([0.0, 0.0, 1.0])
    ends = [" ".join(f"{x:g}" for x in share * up) for share in (-0.5, 0.0, 0.5)]
    rods = "".join(
        f'<geom type="capsule" fromto="{a} {b}" size="0.03" rgba="{rgba}" contype="0" conaffinity="0"/>'
        for a, b, rgba in ((ends[0], ends[1], "0 0 1 1"), (ends[1], ends[2], "1 0 0 1"))
    )
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option gravity="{gravity}"/><worldbody>{rods}</worldbody></mujoco>'
    )
    with mw.Video(model, tmp_path / "film.gif", width=80, height=80, camera=camera) as video:
        data = forward(model)
        video.log(data)
        seen = video._picture(data, video._camera).astype(int)  # type: ignore[arg-type]
    red = np.argwhere((seen[..., 0] > 100) & (seen[..., 2] < 60)).mean(axis=0)
    blue = np.argwhere((seen[..., 2] > 100) & (seen[..., 0] < 60)).mean(axis=0)
    assert blue[0] - red[0] > 10
    assert abs(blue[1] - red[1]) < 3


def test_a_model_without_lights_is_not_dark(tmp_path: Path) -> None:
    """The side of a white box that faces the camera; a model with a light of its own keeps its brightness."""
    box = '<geom type="box" size="1 1 1"/><camera name="front" pos="0 -5 0" xyaxes="1 0 0 0 0 1"/>'
    shown = {}
    for name, light in (("without", ""), ("with", '<light pos="0 9 0" dir="0 1 0"/>')):
        model = mujoco.MjModel.from_xml_string(
            f'<mujoco><default><geom rgba="1 1 1 1"/></default><worldbody>{box}{light}</worldbody></mujoco>'
        )
        seen = frame(forward(model), tmp_path, camera="front")
        shown[name] = seen[60, 80].mean()
    assert shown["without"] > 210
    assert shown["with"] < 200
