"""The MJCF files under models/: they load, say what they mean, and behave in plain MuJoCo."""

import math
from itertools import pairwise
from pathlib import Path

import mujoco
import numpy as np
import pytest
from mjcf_reading import MODELS, OBJ, PARAMETERS, elements, load, name_of, parameters, text_of
from naive_tendon import closed_form_length

FILES = sorted(MODELS.glob("*/*.xml"))
FOLDERS = sorted(path for path in MODELS.iterdir() if path.is_dir())
each_file = pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)


def test_every_model_of_the_demo_is_there() -> None:
    expected = {"paper_case1", "paper_case2", "paper_two_cylinders", "elbow", "elbow_conservative", "five_surfaces",
        "finger", "torus_threading"}  # fmt: skip
    assert {path.stem for path in FILES} == expected


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda path: path.name)
def test_each_folder_has_a_readme_that_names_its_files(folder: Path) -> None:
    text = (folder / "README.md").read_text(encoding="utf-8")
    for path in folder.glob("*.xml"):
        assert path.name in text


@each_file
def test_wrapping_surfaces_do_not_collide_and_can_be_seen_through(path: Path) -> None:
    model, _ = load(path)
    wrapped = model.wrap_objid[
        (model.wrap_type == mujoco.mjtWrap.mjWRAP_CYLINDER)
        | (model.wrap_type == mujoco.mjtWrap.mjWRAP_SPHERE)
    ]
    listed = [
        obj for i in range(model.ntuple) for kind, obj, _ in elements(model, i) if kind == OBJ.mjOBJ_GEOM
    ]
    for geom in {*wrapped.tolist(), *listed}:
        assert model.geom_contype[geom] == model.geom_conaffinity[geom] == 0
        assert model.geom_group[geom] in (2, 3)
        assert model.geom_rgba[geom, 3] < 0.5


@each_file
def test_each_declaration_names_one_muscle_one_law_and_its_parameters(path: Path) -> None:
    model, _ = load(path)
    for index in range(model.ntuple):
        assert "mjwrap" in name_of(model, OBJ.mjOBJ_TUPLE, index)
        kinds = [kind for kind, _, _ in elements(model, index)]
        assert kinds.count(OBJ.mjOBJ_ACTUATOR) == 1
        assert kinds.count(OBJ.mjOBJ_TENDON) <= 1
        (law,) = [text_of(model, obj) for kind, obj, _ in elements(model, index) if kind == OBJ.mjOBJ_TEXT]
        values = parameters(model, index)
        assert set(values) == PARAMETERS[law]
        assert all(value >= 0 and math.isfinite(value) for value in values.values())
        for positive in (
            "max_isometric_force",
            "optimal_fiber_length",
            "tendon_slack_length",
            "optimal_force",
        ):
            assert values.get(positive, 1.0) > 0


@each_file
def test_a_route_of_its_own_runs_from_site_to_site_with_hints_behind_geoms(path: Path) -> None:
    model, _ = load(path)
    for index in range(model.ntuple):
        rows = [row for row in elements(model, index) if row[0] in (OBJ.mjOBJ_SITE, OBJ.mjOBJ_GEOM)]
        if not rows:
            assert any(kind == OBJ.mjOBJ_TENDON for kind, _, _ in elements(model, index))
            continue
        assert rows[0][0] == rows[-1][0] == OBJ.mjOBJ_SITE
        for before, row in pairwise(rows):
            if row[2] == 1:
                assert row[0] == OBJ.mjOBJ_SITE
                assert before[0] == OBJ.mjOBJ_GEOM


@each_file
def test_native_muscle_and_declared_muscle_have_the_same_fibre(path: Path) -> None:
    """MuJoCo's implied optimal and tendon length equal the declared ones, seen along the tendon."""
    model, _ = load(path)
    for index in range(model.ntuple):
        values = parameters(model, index)
        if "optimal_fiber_length" not in values:
            continue
        (actuator,) = [obj for kind, obj, _ in elements(model, index) if kind == OBJ.mjOBJ_ACTUATOR]
        (r0, r1, force), (short, long) = (
            model.actuator_gainprm[actuator, :3],
            model.actuator_lengthrange[actuator],
        )
        optimal = (long - short) / (r1 - r0)
        cosine = math.cos(values["pennation_angle"])
        # six decimals of `range` and six digits of `force` are written in the file
        assert optimal == pytest.approx(values["optimal_fiber_length"] * cosine, rel=1e-4)
        assert short - r0 * optimal == pytest.approx(values["tendon_slack_length"], abs=1e-5)
        assert force == pytest.approx(values["max_isometric_force"] * cosine, rel=1e-5)


@each_file
def test_five_native_seconds_stay_finite(path: Path) -> None:
    model, data = load(path)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    muscles = model.actuator_gaintype == mujoco.mjtGain.mjGAIN_MUSCLE
    while data.time < 5:
        data.ctrl[muscles] = 0.2 * (1 - math.cos(2 * math.pi * data.time)) / 2
        mujoco.mj_step(model, data)
    assert np.isfinite(data.qpos).all()
    assert np.abs(data.qvel).max() < 10
    assert not any(warning.number for warning in data.warning)


@each_file
def test_saving_the_spec_keeps_model_and_declarations(path: Path) -> None:
    spec = mujoco.MjSpec.from_file(str(path))
    model = spec.compile()
    again = mujoco.MjModel.from_xml_string(spec.to_xml())
    assert [again.ntuple, again.nnumeric, again.ntext, again.nkey] == [
        model.ntuple,
        model.nnumeric,
        model.ntext,
        model.nkey,
    ]
    for index in range(model.ntuple):
        assert elements(again, index) == elements(model, index)
        # decimals written by the saver, not by the file
        assert parameters(again, index) == pytest.approx(parameters(model, index), rel=1e-5)


@each_file
def test_two_copies_attach_under_prefixes(path: Path) -> None:
    single, single_data = load(path)
    mujoco.mj_forward(single, single_data)
    parent = mujoco.MjSpec()
    for place, prefix in enumerate(("left_", "right_")):
        child = mujoco.MjSpec.from_file(str(path))
        parent.option.timestep, parent.option.integrator = child.option.timestep, child.option.integrator
        parent.attach(child, prefix=prefix, frame=parent.worldbody.add_frame(pos=[0, place, 0]))
    model = parent.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert model.ntuple == 2 * single.ntuple
    for prefix in ("left_", "right_"):
        for index in range(single.ntuple):
            twin = model.tuple(prefix + name_of(single, OBJ.mjOBJ_TUPLE, index)).id
            assert parameters(model, twin) == parameters(single, index)
            assert len(elements(model, twin)) == len(elements(single, index))
        for tendon in range(single.ntendon):
            length = data.tendon(prefix + name_of(single, OBJ.mjOBJ_TENDON, tendon)).length[0]
            assert length == pytest.approx(single_data.ten_length[tendon], abs=1e-12)


@pytest.mark.parametrize(
    ("stem", "amplitude", "share"), [("paper_case1", 0.009, 1.0), ("paper_case2", 0.02, 2 / 3)]
)
def test_paper_scenes_wrap_natively_as_the_closed_form_says(
    stem: str, amplitude: float, share: float
) -> None:
    model, data = load(MODELS / stem / f"{stem}.xml")
    times = 0.012 * np.arange(251)
    touched = 0
    for time in times:
        data.qpos[0] = amplitude * math.sin(2 * math.pi * time)
        mujoco.mj_forward(model, data)
        assert data.ten_length[0] == pytest.approx(closed_form_length(model, data, 0), abs=1e-14)
        touched += int(data.ten_wrapnum[0] == 4)
    # case 2 lifts off where 2 sin < -1, a third of each period
    assert touched / len(times) == pytest.approx(share, abs=2 / len(times))


@pytest.mark.parametrize("stem", ["paper_case1", "paper_case2", "paper_two_cylinders"])
def test_the_start_keyframe_is_the_motion_at_time_zero(stem: str) -> None:
    model, _ = load(MODELS / stem / f"{stem}.xml")
    omega = 2 * math.pi
    expected = {
        "paper_case1": ([0], [0.009 * omega]),
        "paper_case2": ([0], [0.02 * omega]),
        "paper_two_cylinders": (
            [0, 0.0015 * math.cos(0.24 * omega)],
            [0.0015 * omega, -0.0015 * omega * math.sin(0.24 * omega)],
        ),
    }
    position, velocity = expected[stem]
    assert model.key_qpos[0] == pytest.approx(position, abs=1e-12)
    assert model.key_qvel[0] == pytest.approx(velocity, abs=1e-9)
    assert model.key_ctrl[0, 1:] == pytest.approx([*position, *velocity], abs=1e-9)


@pytest.mark.myo
def test_myo_elbow_is_where_its_readme_says() -> None:
    myo_sim = pytest.importorskip("myo_sim")
    path = Path(myo_sim.get_xml_path("elbow"))
    assert path.as_posix().endswith("models/legacy/elbow/myoelbow_1dof6muscles.xml")
    assert "myoelbow_1dof6muscles.xml" in (MODELS / "myo_elbow" / "README.md").read_text(encoding="utf-8")
    model, _ = load(path)
    names = [name_of(model, OBJ.mjOBJ_ACTUATOR, i) for i in range(model.nu)]
    assert names == ["TRIlong", "TRIlat", "TRImed", "BIClong", "BICshort", "BRA"]
