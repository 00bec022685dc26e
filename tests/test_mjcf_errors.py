"""A declaration that cannot be understood is a `ModelError` that names the element and lists what there is instead."""

from __future__ import annotations

import math
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import mujoco
import pytest
from declared_models import ARM, EXTENSOR, HILL, MUSCLE, compiled, declared, element

import mjwrap as mw
from mjwrap.mjcf import read_declarations, read_model

SITES = "origin, elbow_side, elbow_inside, via, middle, ball_side, wrist_side, insertion"
SURFACES = "elbow, egg, ulna, ball, palm, wrist"
NUMERICS = (
    "max_isometric_force, optimal_fiber_length, tendon_slack_length, pennation_angle, "
    "max_contraction_velocity, fiber_damping, minimum_activation, max_pennation, "
    "activation_time_constants, activation_smoothing, active_force_length_curve, force_velocity_curve, "
    "fiber_force_length_curve, tendon_force_length_curve, optimal_force, max_tendon_strain, "
    "max_fiber_strain, active_shape, passive_shape, velocity_shape, max_lengthening_force, "
    "velocity_extrapolation, pcsa_force, resting_length, ligament_curve, stiffness, dissipation"
)
PULLEY = '<pulley divisor="2"/><site site="via"/><site site="insertion"/></spatial>'
ACTUATOR = [element("actuator", "extensor")]
ORIGIN, INSERTION, ELBOW = element("site", "origin"), element("site", "insertion"), element("geom", "elbow")
SIDE = element("site", "elbow_side", 1)


def message(model: mujoco.MjModel) -> str:
    """What MuscleSystem says of a model that it refuses; the model stays as it was."""
    limited = model.actuator_forcelimited.copy()
    with pytest.raises(mw.ModelError) as caught:
        mw.MuscleSystem(model)
    assert (model.actuator_forcelimited == limited).all()
    return str(caught.value)


def test_a_mujoco_that_is_too_old_is_told_apart_from_a_bad_model() -> None:
    old: Any = SimpleNamespace()  # a model of MuJoCo 3.10 counts no actuators apart from their controls
    with pytest.raises(mw.VersionError, match=r"needs MuJoCo 3\.11 or newer, this is"):
        read_declarations(old)


def tuple_message(*elements: str, values: dict[str, float] | None = None, law: str | None = None) -> str:
    return message(compiled(custom=declared(elements, values, law)))


# -------------------------------------------------------------------------------------------- routes

ROUTES = {
    "one site": ([ORIGIN], ["must begin and end with a site", "it is: site 'origin'", SITES]),
    "ends on a geom": ([ORIGIN, ELBOW], ["it is: site 'origin', geom 'elbow'", SITES]),
    "begins with a geom": (
        [ELBOW, SIDE, INSERTION],
        ["it is: geom 'elbow' with a hint, site 'insertion'", SITES],
    ),
    "only a geom": ([ELBOW], ["it is: geom 'elbow'", SITES]),
    "hint first": ([SIDE, INSERTION], ["site 'elbow_side'", "directly follow a geom, not nothing", SURFACES]),
    "hint after a site": ([ORIGIN, SIDE, INSERTION], ["site 'elbow_side'", "not site 'origin'", SURFACES]),
    "two hints": (
        [ORIGIN, ELBOW, SIDE, element("site", "via", 1), INSERTION],
        ["site 'via'", "not geom 'elbow' with a hint", SURFACES],
    ),
    "box": ([ORIGIN, element("geom", "crate"), INSERTION], ["geom 'crate'", "of type box", SURFACES]),
    "strange prm": ([ORIGIN, element("site", "via", 3), INSERTION], ["site 'via'", "prm=3", "1 the hint"]),
}


@pytest.mark.parametrize("case", ROUTES)
def test_routes(case: str) -> None:
    route, parts = ROUTES[case]
    text = tuple_message(*ACTUATOR, *route, values=HILL)
    assert "'extensor'" in text or "'mjwrap_m'" in text
    for part in parts:
        assert part in text


def test_neither_sites_nor_a_tendon() -> None:
    made = compiled(
        actuator='<motor name="extensor" joint="elbow"/>', custom=declared(ACTUATOR, {"optimal_force": 1.0})
    )
    assert "tuple 'mjwrap_m': it has neither sites nor a tendon" in message(made)


def test_a_fixed_tendon_has_no_path() -> None:
    tendon = EXTENSOR + '<fixed name="sum"><joint joint="elbow" coef="1"/></fixed>'
    text = message(compiled(tendon=tendon, custom=declared([element("tendon", "sum")], HILL)))
    assert "tuple 'mjwrap_m': tendon 'sum' is fixed" in text


@pytest.mark.parametrize("radius", [0.0, -0.01, math.nan, math.inf])
def test_radii_of_a_model_that_was_changed_in_memory(radius: float) -> None:
    model = compiled()
    model.geom("ball").size[0] = radius
    text = message(model)
    wanted = f"Sphere: radius must be finite and positive [m], not {radius}"
    assert f"muscle 'extensor': geom 'ball': {wanted}" in text


def test_a_pulley_divisor_that_was_changed_in_memory() -> None:
    model = compiled(tendon=EXTENSOR.replace("</spatial>", PULLEY))
    model.wrap_prm[model.wrap_type == mujoco.mjtWrap.mjWRAP_PULLEY] = -1.0
    assert "muscle 'extensor': pulley divisor -1.0 must be positive" in message(model)


# ---------------------------------------------------------------------------------------- parameters


@pytest.mark.parametrize("missing", HILL)
def test_a_missing_numeric(missing: str) -> None:
    values = {key: value for key, value in HILL.items() if key != missing}
    text = tuple_message(*ACTUATOR, values=values, law="degroote_fregly_2016")
    assert "muscle 'extensor' (tuple 'mjwrap_m')" in text
    assert f"needs numeric {missing}; given: {', '.join(values)}" in text


def test_a_path_actuator_without_a_force() -> None:
    text = tuple_message(*ACTUATOR, law="path_actuator")
    assert "law 'path_actuator' needs numeric optimal_force; given: none" in text


def test_an_unknown_numeric() -> None:
    text = tuple_message(*ACTUATOR, values=HILL | {"flexibility": 3.0})
    assert "numeric 'mjwrap_m_flexibility' must contain exactly one of these in its name" in text
    assert NUMERICS in text


def test_a_numeric_that_is_given_twice() -> None:
    custom = declared(ACTUATOR, HILL).replace(
        "<tuple", '<numeric name="b_max_isometric_force" data="1"/><tuple'
    )
    custom = custom.replace("</tuple>", element("numeric", "b_max_isometric_force") + "</tuple>")
    text = message(compiled(custom=custom))
    assert "max_isometric_force is given twice, the second time by numeric 'b_max_isometric_force'" in text


def test_a_numeric_with_too_many_values() -> None:
    custom = declared(ACTUATOR, HILL).replace('data="600.0"', 'data="600 700"')
    text = message(compiled(custom=custom))
    assert "numeric 'mjwrap_m_max_isometric_force' must have 1 value, not 2" in text


def test_a_parameter_that_the_law_does_not_have() -> None:
    text = tuple_message(*ACTUATOR, values={"optimal_force": 3.0, "pennation_angle": 0.1})
    assert "law 'path_actuator' has no parameter pennation_angle; it has: optimal_force" in text


BAD_HILL = [
    ("optimal_fiber_length", [0.0, -0.1, math.nan, math.inf], "finite and positive"),
    ("max_isometric_force", [0.0, -1.0, math.nan], "finite and positive"),
    ("tendon_slack_length", [-0.1, math.nan], "finite and >= 0"),
    ("pennation_angle", [-0.1, math.pi / 2, math.nan], "in [0, pi/2) [rad]"),
    ("max_contraction_velocity", [0.0, math.nan], "finite and positive"),
    ("fiber_damping", [-0.1, math.inf], "finite and >= 0"),
]


@pytest.mark.parametrize(
    ("key", "value", "wanted"), [(key, value, wanted) for key, values, wanted in BAD_HILL for value in values]
)
def test_a_parameter_without_sense(key: str, value: float, wanted: str) -> None:
    model = compiled(custom=declared(ACTUATOR, HILL | {key: 0.5}))
    model.numeric(f"mjwrap_m_{key}").data[0] = value
    text = message(model)
    assert f"muscle 'extensor' (tuple 'mjwrap_m'): degroote_fregly_2016: {key} must be {wanted}" in text
    assert repr(value) in text


def test_activation_time_constants() -> None:
    values = HILL | {"activation_time_constants": (0.01, 0.04)}
    text = message(compiled(custom=declared(ACTUATOR, values)))
    assert "activation_time_constants is only for muscles whose activation mjwrap integrates" in text
    model = compiled(actuator="", custom=declared([element("tendon", "extensor")], values))
    model.numeric("mjwrap_m_activation_time_constants").data[1] = 0.0
    assert "activation_time_constants must be finite and positive [s], not 0.01 and 0.0" in message(model)
    values = HILL | {"activation_time_constants": 0.01}
    model = compiled(actuator="", custom=declared([element("tendon", "extensor")], values))
    assert "must have 2 values, not 1" in message(model)


# ---------------------------------------------------------------------------------------------- laws


def test_an_unknown_law() -> None:
    text = tuple_message(*ACTUATOR, values=HILL, law="hill_1938")
    assert "muscle 'extensor' (tuple 'mjwrap_m'): law 'hill_1938' does not exist" in text
    assert "laws: degroote_fregly_2016, millard_2012, mujoco, path_actuator" in text


def test_two_laws() -> None:
    custom = declared(ACTUATOR, HILL, "mujoco").replace(
        "<tuple", '<text name="b_law" data="path_actuator"/><tuple'
    )
    custom = custom.replace("</tuple>", element("text", "b_law") + "</tuple>")
    assert "law is given twice, the second time by text 'b_law'" in message(compiled(custom=custom))


def test_mujocos_law_needs_a_muscle_actuator() -> None:
    for actuator, elements in (
        ("", [element("tendon", "extensor")]),
        ('<motor name="extensor" tendon="extensor"/>', ACTUATOR),
    ):
        text = message(compiled(actuator=actuator, custom=declared(elements, law="mujoco")))
        assert "'extensor'" in text
        assert "law 'mujoco' needs a muscle actuator in the tuple" in text
        assert (
            "degroote_fregly_2016 (needs max_isometric_force, optimal_fiber_length, tendon_slack_length)"
            in text
        )
        assert "path_actuator (needs optimal_force)" in text


def test_mujocos_law_needs_curves_that_act_along_a_path() -> None:
    actuator = '<muscle name="extensor" joint="elbow" lengthrange="-1 1"/>'
    text = message(compiled(actuator=actuator, custom=declared([*ACTUATOR, ORIGIN, INSERTION])))
    assert (
        "muscle 'extensor' (tuple 'mjwrap_m'): law 'mujoco' cannot be used with its actuator: it does not pull"
        in text
    )


@pytest.mark.parametrize("bounds", [(0.3, 0.3), (0.4, 0.3)])
def test_native_curves_without_an_optimal_length(bounds: tuple[float, float]) -> None:
    model = compiled()
    model.actuator_lengthrange[0] = bounds
    assert (
        "muscle 'extensor': mujoco: length range must be increasing: optimal fibre length is zero"
        in message(model)
    )


@pytest.mark.parametrize(
    ("column", "value", "part"),
    [(6, 0.0, "vmax"), (5, -1.0, "lmax"), (1, 0.5, "range"), (2, math.nan, "force"), (8, math.inf, "fvmax")],
)
def test_native_curves_that_are_undefined(column: int, value: float, part: str) -> None:
    model = compiled()
    model.actuator_gainprm[0, column] = model.actuator_biasprm[0, column] = value
    assert f"muscle 'extensor': mujoco: {part} must be" in message(model)


# --------------------------------------------------------------------------------- actuators, tuples


def test_two_tuples_for_one_actuator() -> None:
    custom = declared(ACTUATOR, HILL) + declared(ACTUATOR, HILL, muscle="n")
    text = message(compiled(custom=custom))
    assert "actuator 'extensor' is in two tuples, 'mjwrap_m' and 'mjwrap_n'" in text


def test_two_muscles_of_one_name() -> None:
    text = message(compiled(custom=declared([element("tendon", "extensor")], HILL)))
    assert "two muscles are called 'extensor'" in text
    assert "list the actuator in the tuple" in text


def test_two_actuators_or_two_tendons_in_a_tuple() -> None:
    second = MUSCLE.replace('name="extensor"', 'name="second"')
    custom = declared([*ACTUATOR, element("actuator", "second")], HILL)
    text = message(compiled(actuator=MUSCLE + second, custom=custom))
    assert "tuple 'mjwrap_m': a muscle can have only one actuator, not 2: extensor, second" in text
    tendon = EXTENSOR + EXTENSOR.replace('name="extensor"', 'name="second"')
    custom = declared([element("tendon", "extensor"), element("tendon", "second")], HILL)
    text = message(compiled(tendon=tendon, custom=custom))
    assert "a muscle can have only one tendon, not 2: extensor, second" in text


@pytest.mark.parametrize(("kind", "name"), [("body", "hand"), ("tuple", "others")])
def test_elements_of_other_types(kind: str, name: str) -> None:
    custom = declared([*ACTUATOR, element(kind, name)], HILL)
    custom = '<tuple name="others"><element objtype="site" objname="via"/></tuple>' + custom
    text = message(compiled(custom=custom))
    assert (
        f"tuple 'mjwrap_m': {kind} '{name}' cannot be used; use actuator, tendon, site, geom, joint, numeric"
        in text
    )


UNFIT = {
    "servo": (
        '<dcmotor name="extensor" tendon="extensor" motorconst="1" resistance="1"/>',
        "is not fixed, affine",
    ),
    "early": (
        '<general name="extensor" tendon="extensor" dyntype="user" actdim="1" actearly="true"/>',
        "it has actearly, and its dynamics are not",
    ),
    "delay": (
        '<motor name="extensor" tendon="extensor" delay="0.01" nsample="8"/>',
        "its control has a delay",
    ),
}


@pytest.mark.parametrize("case", UNFIT)
def test_actuators_that_cannot_be_taken_over(case: str) -> None:
    actuator, reason = UNFIT[case]
    text = message(compiled(actuator=actuator, custom=declared(ACTUATOR, {"optimal_force": 3.0})))
    assert "muscle 'extensor' (tuple 'mjwrap_m'): its actuator cannot be taken over" in text
    assert reason in text


def test_a_force_range_of_nothing() -> None:
    model = compiled()
    mw.MuscleSystem(model)
    with pytest.raises(mw.ModelError, match=r"muscle 'extensor': its force range is 0 to 0.*release\(\)"):
        read_declarations(model)


# --------------------------------------------------------------------------------------------- files


def refused(path: Path) -> str:
    with pytest.raises(mw.ModelError) as caught:
        read_model(path)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_files_that_are_not_models(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name, contents in {"empty.xml": "", "prose.xml": "Call me Ishmael.", "page.xml": "<html/>"}.items():
        (tmp_path / name).write_text(contents)
        assert re.search(rf"{name} is not a model that MuJoCo can load: .*\w", refused(tmp_path / name))
    (tmp_path / "junk.mjb").write_bytes(b"no model at all" * 10)
    assert "junk.mjb is not a model that MuJoCo can load: " in refused(tmp_path / "junk.mjb")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["empty.xml", "junk.mjb", "page.xml", "prose.xml"]


def test_a_model_that_names_what_is_not_there(tmp_path: Path) -> None:
    path = tmp_path / "arm.xml"
    path.write_text(
        ARM.format(tendon=EXTENSOR.replace("via", "viaduct"), actuator=MUSCLE, custom="", option="")
    )
    assert "viaduct" in refused(path)


def test_a_missing_file_and_a_folder(tmp_path: Path) -> None:
    (tmp_path / "arm.xml").touch()
    (tmp_path / "leg.mjb").touch()
    (tmp_path / "notes.txt").touch()
    text = refused(tmp_path / "amr.xml")
    assert (
        f"{tmp_path / 'amr.xml'} does not exist (did you mean 'arm.xml'?); models in {tmp_path}: arm.xml"
        in text
    )
    assert f"{tmp_path} is a folder; models in {tmp_path}: arm.xml, leg.mjb" in refused(tmp_path)
    assert "does not exist, nor does the folder nowhere" in refused(Path("nowhere") / "arm.xml")
