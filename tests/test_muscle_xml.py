"""Declarations that are written: every law, surface and mark is read back as given, to the last digit."""

import re
from pathlib import Path

import mujoco
import numpy as np
import pytest
from cli_runs import ELBOW, ROOT, only_files, run_here
from test_curves import ARM

import mjwrap as mw
from mjwrap.files.columns import read_columns
from mjwrap.surfaces.primitives import SURFACES

FINGER = str(ROOT / "models" / "finger" / "finger.xml")
TEXT = Path(ELBOW).read_text()
MODEL = mujoco.MjModel.from_xml_path(ELBOW)
HILL = {
    "max_isometric_force": 987.123456789012,
    "optimal_fiber_length": 0.1 / 3.0,
    "tendon_slack_length": 1e-3 / 7.0,
}
ROUTE = "BRA_origin,flexor_cylinder:flexor_side,BRA_insertion"


HILL_LAW = mw.Millard2012(
    HILL["max_isometric_force"], HILL["optimal_fiber_length"], HILL["tendon_slack_length"]
)


def declared(name: str, route: str, **options: object) -> tuple[mujoco.MjModel, mw.MuscleSystem]:
    fragment = mw.muscle_xml(MODEL, name, route, **options)  # pyright: ignore[reportArgumentType]
    model = mujoco.MjModel.from_xml_string(mw.insert_xml(TEXT, fragment))
    return model, mw.MuscleSystem(model)


def test_a_declared_path_is_that_of_the_native_muscle() -> None:
    """BRA has this route as a tendon with a side site; both go round the same way here."""
    model, muscles = declared("X", ROUTE, parameters={"optimal_force": 100.0})
    data = mujoco.MjData(model)
    for angle in (0.3, 1.2, 2.0):
        data.qpos[0] = angle
        muscles.forward(data)
        assert muscles["X"].length == pytest.approx(muscles["BRA"].length, rel=1e-13)


@pytest.mark.parametrize(
    ("law", "parameters"),
    [
        (mw.DeGrooteFregly2016, HILL),
        (mw.DeGrooteFregly2016, {**HILL, "pennation_angle": 0.1 + 0.2, "fiber_damping": 0.05}),
        (mw.Millard2012, {**HILL, "max_contraction_velocity": 8.5, "tendon_model": "elastic"}),
        (mw.PathActuator, {"optimal_force": 1.0 / 3.0}),
    ],
)
@pytest.mark.parametrize("driven", [True, False])
def test_every_law_comes_back_with_all_its_digits(law: type, parameters: dict, driven: bool) -> None:
    model, muscles = declared("new<&'>", ROUTE, law=law.law, parameters=parameters, driven=driven)
    given = {key: value for key, value in parameters.items() if key != "tendon_model"}
    if "tendon_model" in parameters:
        given["tendon"] = parameters["tendon_model"]
    muscle = muscles["new<&'>"]
    assert muscle.parameters == law(**given)
    assert (muscle.declaration.actuator >= 0) == driven
    data = mujoco.MjData(model)
    muscles.forward(data)
    assert muscle.status == mw.Status.CONVERGED
    with pytest.raises(mw.ModelError, match="already"):
        mw.muscle_xml(model, "new<&'>", ROUTE, parameters={"optimal_force": 1.0}, driven=driven)


def test_a_muscle_of_mujocos_law_keeps_its_attributes() -> None:
    _, muscles = declared("X", ROUTE, law="mujoco", parameters={"lengthrange": (0.1, 0.2), "force": 500.0})
    law = muscles["X"].parameters
    assert isinstance(law, mw.MuJoCoMuscle)
    assert (law.length_range, law.prm[2]) == ((0.1, 0.2), 500.0)


def test_an_actuator_of_the_model_drives_the_muscle() -> None:
    model = mujoco.MjModel.from_xml_string(ARM)
    fragment = mw.muscle_xml(model, "x", "o,o,i", parameters=HILL, actuator="flexor", law="millard_2012")
    muscles = mw.MuscleSystem(mujoco.MjModel.from_xml_string(mw.insert_xml(ARM, fragment)))
    assert muscles["flexor"].parameters == HILL_LAW
    assert (muscles["flexor"].route, muscles.n) == ("o > o > i", 1)


SHAPES = {
    "torus=0.03/0.005": mw.Torus(0.03, 0.005),
    "cone=0.02/0.01/0.05": mw.Cone(0.02, 0.01, 0.05),
    "elliptic_cylinder=0.02/0.01": mw.EllipticCylinder((0.02, 0.01)),
    "cylinder=0.02/0.1": mw.Cylinder(0.02, 0.1),
    "sphere=0.0123456789012345": mw.Sphere(0.0123456789012345),
    "ellipsoid=0.01/0.02/0.03": mw.Ellipsoid((0.01, 0.02, 0.03)),
    "capsule=0.01/0.02": mw.Capsule(0.01, 0.02),
    "finite": mw.Cylinder(0.016, 0.035),
}


def test_every_surface_can_be_declared() -> None:
    assert {word.partition("=")[0] for word in SHAPES} - {"finite"} == {
        s.numeric.removesuffix("_size") for s in SURFACES if s.numeric
    }
    for word, surface in SHAPES.items():
        route = f"BRA_origin,flexor_cylinder@{word}:flexor_side,flexor_cylinder@{word},BRA_insertion"
        _, muscles = declared("X", route, parameters={"optimal_force": 1.0})
        first, second = muscles["X"].declaration.routes[0].nodes
        assert first.surface == second.surface == surface
        assert (first.hint_site >= 0, second.hint_site) == (True, -1)


def test_random_routes_are_read_back() -> None:
    rng = np.random.default_rng(5)
    sites = [MODEL.site(i).name for i in range(MODEL.nsite)]
    for _ in range(50):
        stops, wanted = [str(rng.choice(sites))], []
        for _ in range(rng.integers(0, 5)):
            if rng.random() < 0.4:
                stops.append(str(rng.choice(sites)))
                wanted.append(stops[-1])
            else:
                word, hint = str(rng.choice(list(SHAPES))), str(rng.choice(sites))
                stops.append(f"flexor_cylinder@{word}" + (f":{hint}" if rng.random() < 0.5 else ""))
                wanted.append(SHAPES[word])
        stops.append(str(rng.choice([site for site in sites if site != stops[0]])))
        _, muscles = declared("X", ",".join(stops), parameters={"optimal_force": 1.0})
        (route,) = muscles["X"].declaration.routes
        found = [node.surface or MODEL.site(node.site).name for node in route.nodes]
        assert found == wanted
        assert [sites[route.origin], sites[route.insertion]] == [stops[0], stops[-1]]


@pytest.mark.parametrize(
    ("route", "options", "told"),
    [
        ("BRA_origin", {}, "at least two stops"),
        ("BRA_origin,flexor_cylinder,BRA_origin", {}, "one site only, 'BRA_origin'"),
        ("BRA_origin,,BRA_insertion", {}, "at least two stops"),
        ("flexor_cylinder,BRA_insertion", {}, "first stop must be a site, not geom 'flexor_cylinder'"),
        ("BRA_orgin,BRA_insertion", {}, "no site or geom 'BRA_orgin' .did you mean 'BRA_origin'"),
        ("geom/zzz,BRA_insertion", {}, "no geom 'zzz'; there are: humerus_shaft"),
        (
            "BRA_origin,flexor_cylinder:flexor_sid,BRA_insertion",
            {},
            "hint 'flexor_sid' is not a site .did you mean",
        ),
        (
            "BRA_origin,flexor_cylinder@tours=1/2,BRA_insertion",
            {},
            "no shape 'tours'; shapes: .*torus.*finite",
        ),
        (
            "BRA_origin,flexor_cylinder@torus=1,BRA_insertion",
            {},
            r"write torus=major_radius/minor_radius \[m\]",
        ),
        (
            ROUTE,
            {"parameters": {}},
            "needs a law and its parameters: degroote_fregly_2016: max_isometric_force",
        ),
        (ROUTE, {"parameters": {"force": 3.0}}, "law 'mujoco' needs lengthrange"),
        (
            ROUTE,
            {"parameters": {"max_isometric": 3.0}},
            "no parameter 'max_isometric' .did you mean 'max_isometric_f",
        ),
        (ROUTE, {"parameters": {"optimal_force": "much"}}, "optimal_force must be a number, not 'much'"),
        (ROUTE, {"law": "hill"}, "law 'hill' does not exist; laws: degroote"),
        (ROUTE, {"law": "millard_2012", "parameters": {"optimal_force": 1.0}}, "needs max_isometric_force"),
        (ROUTE, {"parameters": {**HILL, "optimal_force": 1.0}}, "has no parameter optimal_force; it has"),
        (ROUTE, {"parameters": {**HILL, "pennation_angle": 3.0}}, "pennation_angle"),
        (
            ROUTE,
            {"parameters": {"optimal_force": 1.0, "tendon_model": "elastic"}},
            "tendon_model must be one of rigid",
        ),
        (ROUTE, {"actuator": "BRX"}, "no actuator 'BRX'; actuators: TRIlong"),
        (ROUTE, {"actuator": "BRD"}, "actuator 'BRD' drives a muscle already, that of tuple 'mjwrap_BRD'"),
        (ROUTE, {"name": "two words"}, "contains a space"),
        (ROUTE, {"name": "BRA"}, "has the actuator 'BRA' already: give its name as the actuator"),
        (ROUTE, {"name": "x_torus_size"}, "contains 'torus_size', which is the name of a parameter"),
    ],
)
def test_mistakes_are_named(route: str, options: dict, told: str) -> None:
    given = {"parameters": {"optimal_force": 1.0}, "name": "X"} | options
    with pytest.raises(mw.MjwrapError, match=told):
        mw.muscle_xml(MODEL, given.pop("name"), route, **given)


def test_a_text_that_is_no_model_is_refused() -> None:
    with pytest.raises(mw.ModelError, match="no </mujoco>"):
        mw.insert_xml("<robot/>", "")


# ------------------------------------------------------------------------------------------ the command

SET = ["--set", "optimal_force=100"]


def test_the_command_prints_what_to_paste(capsys: pytest.CaptureFixture[str]) -> None:
    ran = run_here("init", capsys, ELBOW, "--muscle", "X", "--route", ROUTE, *SET)
    assert ran.code == 0
    assert ran.out == mw.muscle_xml(MODEL, "X", ROUTE, parameters={"optimal_force": 100.0})
    assert re.search(
        r"X is 149.56 mm long .* elbow_flexion 15.94 mm; paste the text before </mujoco>", ran.err
    )
    assert Path(ELBOW).read_text() == TEXT
    assert not list(Path(ELBOW).parent.glob(".mjwrap_init*"))


def test_the_command_writes_a_whole_model(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "new.xml"
    ran = run_here("init", capsys, ELBOW, "--muscle", "X", "--route", ROUTE, *SET, "-o", out)
    assert (ran.code, ran.err) == (0, "")
    assert mw.MuscleSystem(mujoco.MjModel.from_xml_path(str(out))).names[-1] == "X"
    refused = run_here("init", capsys, out, "--muscle", "Y", "--route", ROUTE, *SET, "-o", out)
    assert refused.code == 2
    assert "that file is also read" in refused.err
    again = run_here(
        "init", capsys, out, "--muscle", "Y", "--route", ROUTE, *SET, "--in-place", "--no-actuator"
    )
    assert (again.code, again.err) == (0, "")
    assert mw.MuscleSystem(mujoco.MjModel.from_xml_path(str(out))).names[-2:] == ["X", "Y"]
    only_files(tmp_path, "new.xml")


def test_the_command_adds_a_muscle_to_cables(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """In a folder that it makes; the cable that the model has on this tendon has the same path."""
    out, table = tmp_path / "made" / "new.xml", tmp_path / "t.csv"
    route = "fds_origin,mcp_drum:mcp_below,fds_via,fds_insertion"
    ran = run_here("init", capsys, FINGER, "--muscle", "X", "--route", route, *SET, "-o", out)
    assert (ran.code, ran.err) == (0, "")
    assert run_here("plot", capsys, out, "--joint", "mcp", "--csv", table).out.startswith(
        "new.xml: 1 muscle and 3 cables"
    )
    columns = read_columns(table)
    for quantity in ("length:{}", "moment_arm:{}:mcp"):
        twin = columns[quantity.format("fds")]
        assert columns[quantity.format("X")] == pytest.approx(twin, abs=1e-12)


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--set", "optimal_force"], "write KEY=VALUE"),
        (["--set", "optimal_force=1", "--out", "{model}/x.xml"], "elbow.xml' is not a folder"),
        (["--set", "optimal_force=1", "--out", "{folder}/x.mjb"], r"must end in \.xml"),
        (
            ["--set", "optimal_force=1", "--actuator", "BRA", "--law", "millard_2012"],
            "needs max_isometric_force",
        ),
    ],
)
def test_the_command_names_mistakes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], told: str
) -> None:
    words = [word.format(folder=tmp_path, model=ELBOW) for word in arguments]
    ran = run_here("init", capsys, ELBOW, "--muscle", "X", "--route", ROUTE, *words)
    assert ran.code == 2
    assert re.search(told, ran.err)
    only_files(tmp_path)


def test_a_model_by_name_is_copied_first(capsys: pytest.CaptureFixture[str]) -> None:
    for name, told in (
        ("mjwrap:elbow", f"copy its file and name the copy: {ELBOW}"),
        ("mjwrap:arm", "it has: elbow"),
    ):
        ran = run_here("init", capsys, name, "--muscle", "X", "--route", ROUTE, *SET)
        assert ran.code == 2
        assert told in ran.err


def test_keyframes_of_the_model_stay_valid(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A new actuator is the last one, so that MuJoCo fills its states with zeros."""
    keyed, out = tmp_path / "keyed.xml", tmp_path / "out.xml"
    key = '<keyframe><key name="k" act="1 1 1 1 1 1 1"/></keyframe></mujoco>'
    keyed.write_text(TEXT.replace("</mujoco>", key))
    hill = [f"{key}={value}" for key, value in HILL.items()]
    given = ["--muscle", "X", "--route", ROUTE, "--set", *hill, "tendon_model=elastic", "-o", out]
    assert run_here("init", capsys, keyed, *given).code == 0
    model = mujoco.MjModel.from_xml_path(str(out))
    assert model.key("k").act.tolist() == [1.0] * 7 + [0.0, 0.0]
