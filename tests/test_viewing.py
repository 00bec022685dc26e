"""The plugin draws into a scene what MuscleSystem computes, according to the viewer's options.

`mjv_updateScene` fills a scene without any OpenGL; one test renders, where that works.
"""

from __future__ import annotations

import copy
import ctypes
from typing import Any

import mujoco
import numpy as np
import pytest
from declared_models import ARM, HILL, MUSCLE, PULLEYS, ROW, declared
from native_twins import INTEGRATORS
from test_plugin import SCENES, moving, spec_of, state_of
from test_plugin_offsets import without

import mjwrap as mw
from mjwrap.errors import VersionError
from mjwrap.plugin import install
from mjwrap.plugin.callbacks import block as bk
from mjwrap.plugin.mujoco_c import offsets, visualisation
from mjwrap.plugin.mujoco_c.library import library
from mjwrap.plugin.readout import block_address

VIS, CAT, OBJ, GEOM = mujoco.mjtVisFlag, mujoco.mjtCatBit, mujoco.mjtObj, mujoco.mjtGeom
EPS = 2e-7  # of a number in single precision
CHORDS = (
    0.1**2 / 24
)  # by how much of its length an arc is longer than chords that turn by 0.1 rad each, or less
PULLED = ARM.format(tendon=PULLEYS, actuator=MUSCLE, custom="", option="")
FREE = ARM.format(tendon="", actuator="", custom=declared(ROW, HILL), option="")
DRAWN = {name: SCENES[name] for name in ("elbow", "arm", "elastic arm")} | {"pulleys": PULLED, "free": FREE}


def scene_of(
    data: mujoco.MjData, option: mujoco.MjvOption | None = None, maxgeom: int = 2000
) -> mujoco.MjvScene:
    scene = mujoco.MjvScene(data.model, maxgeom)
    mujoco.mjv_updateScene(
        data.model, data, option or mujoco.MjvOption(), None, mujoco.MjvCamera(), int(CAT.mjCAT_ALL), scene
    )
    return scene


def shown(scene: mujoco.MjvScene, kind: int, *objects: int) -> list[mujoco.MjvGeom]:
    """The geoms of one kind that stand for such objects: MuJoCo's own stand for geoms, sites and bodies."""
    every = [scene.geoms[i] for i in range(scene.ngeom)]
    return [g for g in every if g.type == kind and g.objtype in (objects or (int(OBJ.mjOBJ_TENDON),))]


def lines(scene: mujoco.MjvScene, *objects: int) -> list[mujoco.MjvGeom]:
    return shown(scene, int(GEOM.mjGEOM_CAPSULE), *objects)


def ends(geom: mujoco.MjvGeom) -> np.ndarray[Any, Any]:
    along = np.asarray(geom.mat)[:, 2] * geom.size[2]
    return np.array([geom.pos - along, geom.pos + along])


def evaluated(xml: str, seed: int = 0) -> tuple[mujoco.MjData, mw.MuscleSystem]:
    """The model with the plugin at some state, and the same state as MuscleSystem sees it."""
    data, twin = moving(install(spec_of(xml)), seed), moving(spec_of(xml).compile(), seed)
    muscles = mw.MuscleSystem(twin.model)
    for state in (data, twin):
        state.ctrl[:] = np.linspace(0.2, 0.9, state.model.nu)
        state.act[:] = 0.7
    mujoco.mj_forward(data.model, data)
    muscles.forward(twin)
    return data, muscles


def with_option(**flags: int) -> mujoco.MjvOption:
    option = mujoco.MjvOption()
    for name, value in flags.items():
        option.flags[int(getattr(VIS, name))] = value
    return option


# --------------------------------------------------------------------------------------------- where it draws


@pytest.mark.parametrize("xml", DRAWN.values(), ids=DRAWN.keys())
def test_paths_and_contacts_are_where_muscle_system_finds_them(xml: str) -> None:
    """Every end of a capsule is a point of a path and every point is one; routes over pulleys are not joined."""
    data, muscles = evaluated(xml)
    scene, kinds = scene_of(data), (int(OBJ.mjOBJ_TENDON), int(OBJ.mjOBJ_UNKNOWN))
    drawn = np.array([ends(g) for g in lines(scene, *kinds)])
    points = muscles.polylines()[0]
    points = points[~np.isnan(points[:, 0])]
    scale = EPS * np.abs(points).max()
    for found, expected in ((drawn.reshape(-1, 3), points), (points, drawn.reshape(-1, 3))):
        gaps = np.linalg.norm(found[:, None] - expected[None], axis=2).min(axis=1)
        assert gaps.max() < 4 * scale
    routes = [len(declared_muscle.routes) for declared_muscle in muscles.declarations]
    assert len(drawn) == len(points) - sum(routes)
    if max(routes) == 1:
        length = np.linalg.norm(drawn[:, 1] - drawn[:, 0], axis=1).sum()
        assert -1e-6 < 1.0 - length / muscles.length.sum() < CHORDS
    beads = np.array([g.pos for g in shown(scene, int(GEOM.mjGEOM_SPHERE), *kinds)])
    np.testing.assert_allclose(beads, muscles.contacts()[0], rtol=0.0, atol=4 * scale)
    assert len(beads) >= 2


def test_capsules_are_those_of_mujoco() -> None:
    """Straight muscles in all directions, both poles among them, beside mjv_connector and mjv_initGeom."""
    rng = np.random.default_rng(5)
    ways = [*rng.normal(size=(50, 3)), [0, 0, 1], [0, 0, -1], [1e-9, 0, -1], [1e-12, 1e-12, 1], [0, 1, 0]]
    body, tendon, actuator = "", "", ""
    for i, way in enumerate(np.array(ways)):
        x, y, z = 0.1 * way
        body += f'<site name="a{i}" pos="{0.01 * i} 0 0"/><site name="b{i}" pos="{0.01 * i + x} {y} {z}"/>'
        tendon += f'<spatial name="t{i}"><site site="a{i}"/><site site="b{i}"/></spatial>'
        actuator += f'<muscle name="m{i}" tendon="t{i}" force="10" lengthrange="0.1 0.2"/>'
    data = mujoco.MjData(
        install(
            spec_of(
                f"<mujoco><worldbody>{body}<body><freejoint/><geom size='0.1'/></body></worldbody>"
                f"<tendon>{tendon}</tendon><actuator>{actuator}</actuator></mujoco>"
            )
        )
    )
    mujoco.mj_forward(data.model, data)
    drawn = lines(scene_of(data))
    assert len(drawn) == len(ways)
    for i, geom in enumerate(drawn):
        expected = mujoco.MjvGeom()
        mujoco.mjv_initGeom(
            expected, int(GEOM.mjGEOM_NONE), np.zeros(3), np.zeros(3), np.zeros(9), np.zeros(4, np.float32)
        )
        places = (data.site(f"{end}{i}").xpos for end in "ab")
        mujoco.mjv_connector(expected, int(GEOM.mjGEOM_CAPSULE), 0.003, *places)  # the default width
        for name in ("size", "pos", "mat"):
            np.testing.assert_allclose(getattr(geom, name), getattr(expected, name), rtol=EPS, atol=EPS)
        assert (geom.objid, geom.category, geom.label) == (i, int(CAT.mjCAT_DYNAMIC), "")
        for name in ("dataid", "matid", "texid", "emission", "specular", "shininess", "reflectance"):
            assert getattr(geom, name) == getattr(expected, name)


# ----------------------------------------------------------------------------------------------- what it shows


def test_options_choose_what_is_drawn() -> None:
    data, _ = evaluated(SCENES["elbow"])
    model, tendon, actuator = data.model, int(OBJ.mjOBJ_TENDON), int(OBJ.mjOBJ_ACTUATOR)
    drawn = lines(scene_of(data))
    assert {g.objid for g in drawn} == set(range(model.ntendon))
    assert not lines(scene_of(data, with_option(mjVIS_TENDON=0)), tendon, actuator)
    both = scene_of(data, with_option(mjVIS_ACTUATOR=1))
    wide = lines(both, actuator)
    assert len(wide) == len(drawn) == len(lines(both))
    for thin, thick in zip(drawn, wide, strict=True):
        assert thick.size[0] == pytest.approx(thin.size[0] * model.vis.map.actuatortendon)
        assert thick.category == int(CAT.mjCAT_DECOR)
        np.testing.assert_array_equal(thin.pos, thick.pos)
    model.tendon_group[2], model.actuator_group[3] = 4, 4
    again = scene_of(data, with_option(mjVIS_ACTUATOR=1))
    assert {g.objid for g in lines(again)} == set(range(model.ntendon)) - {2}
    assert {g.objid for g in lines(again, actuator)} == set(range(model.nu)) - {3}
    option = mujoco.MjvOption()
    option.tendongroup[4] = 1
    assert len(lines(scene_of(data, option))) == len(drawn)


def test_actuators_of_a_hidden_group_or_switched_off_are_not_drawn() -> None:
    spec = spec_of(SCENES["elbow"])
    spec.actuators[1].group, spec.actuators[2].group = 9, 1
    model = install(spec)
    data, option = mujoco.MjData(model), with_option(mjVIS_ACTUATOR=1)
    model.opt.disableactuator = 1 << 1
    mujoco.mj_forward(model, data)
    option.actuatorgroup[5] = 0  # MuJoCo clips groups to 0 to 5 where it draws
    ids = {g.objid for g in lines(scene_of(data, option), int(OBJ.mjOBJ_ACTUATOR))}
    assert ids == set(range(model.nu)) - {1, 2}
    assert len({g.objid for g in lines(scene_of(data, option))}) == model.ntendon


def test_colours_are_those_of_a_native_muscle() -> None:
    """MuJoCo's own tendon and actuator beside ours, but for the default grey, which shows the activation."""
    material = '<asset><material name="silk" rgba="0.1 0.2 0.9 0.5" emission="0.3" shininess="0.9"/></asset>'
    plain = SCENES["arm"].replace("<worldbody>", material + "<worldbody>")
    tendon, actuator = int(OBJ.mjOBJ_TENDON), int(OBJ.mjOBJ_ACTUATOR)
    for given in ("", 'rgba="0.1 0.9 0.3 0.8"', 'material="silk"', 'material="silk" rgba="0.3 0.3 0.3 0.3"'):
        xml = plain.replace('<spatial name="extensor"', f'<spatial name="extensor" width="0.005" {given}')
        data, _ = evaluated(xml)
        native = moving(spec_of(xml).compile())
        native.ctrl[:], native.act[:] = data.ctrl, data.act
        mujoco.mj_forward(native.model, native)
        for transparent, by_activation in ((0, 0), (1, 0), (0, 1)):
            option = with_option(
                mjVIS_ACTUATOR=1, mjVIS_ACTIVATION=by_activation, mjVIS_TRANSPARENT=transparent
            )
            ours, theirs = scene_of(data, option), scene_of(native, option)
            for kind in (tendon, actuator) if given else (actuator,):
                expected = lines(theirs, kind)[0]
                for geom in lines(ours, kind):
                    for name in ("rgba", "emission", "specular", "shininess", "reflectance", "category"):
                        np.testing.assert_allclose(getattr(geom, name), getattr(expected, name), rtol=1e-6)
                    assert geom.size[0] == expected.size[0]
            if not given:
                acting = lines(scene_of(data, with_option(mjVIS_ACTUATOR=1, mjVIS_ACTIVATION=1)), actuator)[0]
                shade = data.model.vis.map.alpha if transparent else 1.0
                expected_rgba = acting.rgba * [1, 1, 1, shade]
                np.testing.assert_allclose(lines(ours, tendon)[0].rgba, expected_rgba, rtol=1e-6)


@pytest.mark.parametrize("control", [-1.3, -0.2, 0.0, 0.4, 5.0])
@pytest.mark.parametrize("limits", ["", "-2 1", "0.2 3", "-3 -0.1"])
def test_any_actuator_that_pulls_along_a_path_has_its_native_colour(control: float, limits: str) -> None:
    """In transmission mode a motor pulls too, whose control may be negative; here it keeps to its limits."""
    limited = f'ctrllimited="true" ctrlrange="{limits}"' if limits else ""
    motor = f'<motor name="extensor" tendon="extensor" {limited}/>'
    spec, twin = spec_of(SCENES["arm"].replace(MUSCLE, motor)), spec_of(SCENES["arm"].replace(MUSCLE, motor))
    datas = moving(install(spec, mode="transmission")), moving(twin.compile())
    option = with_option(mjVIS_ACTUATOR=1, mjVIS_TENDON=0)
    colours = []
    for data in datas:
        low, high = (float(x) for x in (limits or "-inf inf").split())
        data.ctrl[:] = min(max(control, low), high)
        mujoco.mj_forward(data.model, data)
        found = [g for g in lines(scene_of(data, option), int(OBJ.mjOBJ_ACTUATOR)) if g.size[0] > 1e-6]
        colours.append(found[0].rgba)
    np.testing.assert_allclose(*colours, rtol=0.0, atol=EPS)


def test_labels_are_muscle_names() -> None:
    data, muscles = evaluated(SCENES["elbow"])
    option = with_option(mjVIS_ACTUATOR=1)
    for label, kind in (("TENDON", OBJ.mjOBJ_TENDON), ("ACTUATOR", OBJ.mjOBJ_ACTUATOR)):
        option.label = int(getattr(mujoco.mjtLabel, f"mjLABEL_{label}"))
        found = [g.label for g in lines(scene_of(data, option), int(kind))]
        assert [text for text in found if text] == muscles.names


def test_kept_tendons_are_drawn_once() -> None:
    """MuJoCo's own geoms for them are too thin to be seen; their spec, compiled again, keeps them so."""
    spec = spec_of(SCENES["arm"])
    width = float(spec.compile().tendon_width[0])
    kept = install(spec, keep_tendons=True)
    parent = mujoco.MjSpec()
    parent.attach(spec_of(spec.to_xml()), prefix="left_", frame=parent.worldbody.add_frame())
    for model in (kept, spec.compile(), install(spec), parent.compile()):
        data = moving(model)
        mujoco.mj_forward(model, data)
        drawn = lines(scene_of(data))
        seen = [g for g in drawn if g.size[0] > 1e-6]
        assert all(g.size[0] == pytest.approx(width, rel=1e-5) for g in seen)
        assert len(seen) >= 5
        assert (len(drawn) > len(seen)) == (model.tendon_num[0] > 0)
    kept.tendon_width[0] = width
    data = mujoco.MjData(kept)
    mujoco.mj_forward(kept, data)
    assert min(g.size[0] for g in lines(scene_of(data))) >= 0.5 * np.float32(width)


def test_a_tendon_that_stays_native_is_seen_again() -> None:
    """A motor pulls along mjwrap's path in transmission mode only; a muscle does in both."""
    both = (
        SCENES["arm"]
        .replace(MUSCLE, MUSCLE + '<motor name="winch" tendon="line"/>')
        .replace(
            "</tendon>",
            '<spatial name="line"><site site="origin"/><site site="insertion"/></spatial></tendon>',
        )
    )
    spec = spec_of(both)
    for mode in ("transmission", "wrench", "transmission", "wrench"):
        data = moving(install(spec, mode=mode))
        mujoco.mj_forward(data.model, data)
        seen = [g.objid for g in lines(scene_of(data)) if g.size[0] > 1e-6]
        assert seen.count(1) == 1
        assert seen.count(0) > 5


def test_every_instance_and_model_draws_its_own_muscles() -> None:
    """Two arms in one model, of which one hangs lower, and another model in between."""
    parent, alone = mujoco.MjSpec(), mujoco.MjData(install(spec_of(SCENES["arm"])))
    for prefix, height in (("left_", 0.0), ("right_", -1.0)):
        frame = parent.worldbody.add_frame(pos=[0, 0, height])
        installed = spec_of(SCENES["arm"])
        install(installed)
        parent.attach(installed, prefix=prefix, frame=frame)
    both = mujoco.MjData(install(parent))
    mujoco.mj_forward(both.model, both)
    mujoco.mj_forward(alone.model, alone)
    option = mujoco.MjvOption()
    option.label = int(mujoco.mjtLabel.mjLABEL_TENDON)
    scene = scene_of(both, option)
    assert [g.label for g in lines(scene) if g.label] == ["left_extensor", "right_extensor"]
    expected = np.array([g.pos for g in lines(scene_of(alone))])
    for tendon, height in enumerate((0.0, -1.0)):
        found = np.array([g.pos for g in lines(scene) if g.objid == tendon])
        np.testing.assert_allclose(found, expected + np.array([0, 0, height]), rtol=0.0, atol=4 * EPS)


# --------------------------------------------------------------------------------------- when, and how safely


def test_nothing_is_drawn_before_an_evaluation_or_after_a_reset() -> None:
    data, _ = evaluated(SCENES["arm"])
    model = data.model
    assert lines(scene_of(data))
    mujoco.mj_resetData(model, data)
    assert not lines(scene_of(data))
    assert not lines(scene_of(mujoco.MjData(model)))
    mujoco.mj_forward(model, data)
    before = len(lines(scene_of(data)))
    assert before > 0
    model.opt.disableflags = int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
    mujoco.mj_forward(model, data)
    assert not lines(scene_of(data))
    model.opt.disableflags = 0
    mujoco.mj_step(model, data)
    assert len(lines(scene_of(data))) == before


def test_a_scene_is_never_overfilled() -> None:
    """The first geoms are those of a larger scene, MuJoCo's status says that some are missing, and it warns once."""
    data, _ = evaluated(SCENES["elbow"])
    whole, warnings = scene_of(data), list[str]()
    assert whole.status == 0
    mujoco.set_mju_user_warning(warnings.append)
    try:
        for room in (0, 1, 7, 50, whole.ngeom - 1):
            warnings.clear()
            scene = scene_of(data, maxgeom=room)
            assert (scene.ngeom, scene.status, len(warnings)) == (room, 1, 1)
            assert "maxgeom" in warnings[0]
            for i in range(room):
                np.testing.assert_array_equal(scene.geoms[i].pos, whole.geoms[i].pos)
    finally:
        mujoco.set_mju_user_warning(None)
    assert scene_of(data, maxgeom=whole.ngeom).status == 0


@pytest.mark.parametrize("integrator", [INTEGRATORS["mjINT_EULER"], INTEGRATORS["mjINT_RK4"]])
def test_drawing_changes_nothing(integrator: int) -> None:
    """Neither the motion nor a byte of the muscles' memory, and a copy of the data draws the same."""
    model = install(spec_of(SCENES["elastic arm"]))
    model.opt.integrator = int(integrator)
    watched, alone, scene = moving(model), moving(model), mujoco.MjvScene(model, 2000)
    option = with_option(mjVIS_ACTUATOR=1)
    for _ in range(40):
        mujoco.mj_step(model, watched)
        mujoco.mj_step(model, alone)
        block = block_address(watched, 0)
        size = ctypes.c_int64.from_address(block + 8 * bk.BYTES).value
        before = ctypes.string_at(block, size)
        mujoco.mjv_updateScene(model, watched, option, None, mujoco.MjvCamera(), int(CAT.mjCAT_ALL), scene)
        assert ctypes.string_at(block, size) == before
        np.testing.assert_array_equal(state_of(watched), state_of(alone))
    drawn, copied = lines(scene), lines(scene_of(copy.copy(watched), option))
    assert len(drawn) == len(copied) > 10
    for one, other in zip(drawn, copied, strict=True):
        np.testing.assert_array_equal(one.mat, other.mat)


def test_the_passive_viewer_s_own_data_draws_the_same() -> None:
    """It copies what a scene needs into data of its own, with mjv_copyData, whenever it is synchronised."""
    data, _ = evaluated(SCENES["elbow"])
    model, others = data.model, mujoco.MjData(data.model)
    copy_visible = library().mjv_copyData
    copy_visible.argtypes, copy_visible.restype = [ctypes.c_void_p] * 3, ctypes.c_void_p
    copy_visible(others._address, model._address, data._address)
    ours, theirs = lines(scene_of(data)), lines(scene_of(others))
    assert len(ours) == len(theirs) > 10
    for one, other in zip(ours, theirs, strict=True):
        np.testing.assert_array_equal(one.pos, other.pos)


@pytest.mark.parametrize(
    ("struct", "field"),
    [
        ("mjvGeom", "matid"),
        ("mjvGeom", "segid"),
        ("mjvScene", "geomorder"),
        ("mjvOption", "frame"),
        ("mjVisual", "map"),
    ],
)
def test_structs_that_are_not_as_declared_are_refused(
    monkeypatch: pytest.MonkeyPatch, struct: str, field: str
) -> None:
    """Muscles then run without being drawn, and a warning says why."""
    declared_structs = without(struct, field)
    monkeypatch.setattr(visualisation, "structs", lambda: declared_structs)
    monkeypatch.setattr(offsets, "structs", lambda: declared_structs)
    with pytest.raises(VersionError, match="cannot run in MuJoCo"):
        visualisation._find()
    with pytest.warns(RuntimeWarning, match="not drawn"):
        assert visualisation.drawing.__wrapped__() is None


def test_without_a_way_to_draw_muscles_run_unseen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mjwrap.plugin.blocks.image.drawing", lambda: None)
    model = install(spec_of(SCENES["arm"].replace('force="400"', 'force="401"')))
    data = moving(model)
    mujoco.mj_step(model, data, nstep=3)
    assert np.isfinite(data.qpos).all()
    assert not lines(scene_of(data))
