"""Motors, servos and other actuators on spatial tendons: in a `CableSystem`, and in every command."""

from __future__ import annotations

import json
import re
from pathlib import Path

import mujoco
import numpy as np
import pytest
from cable_robot import CABLES, drive
from cli_runs import ROOT, rows_of, run_here
from native_twins import EXPLICIT, INTEGRATORS

import mjwrap as mw
from mjwrap.checking import check_model
from mjwrap.checking.mistakes import possible_mistakes
from mjwrap.cli.inspect.cables import kind
from mjwrap.comparison import compare_motion, compare_poses
from mjwrap.mjcf import read_declarations
from mjwrap.plugin import native
from mjwrap.runs import RunSettings, simulate
from mjwrap.system import CableSystem

FINGER = str(ROOT / "models" / "finger" / "finger.xml")
PULL = ("fdp=cosine:0.016,0.5,0.112", "extensor=constant:0.05", "fds=constant:0.1")
# a tendon that only a spring pulls, over a ball, and a joint with its own motor
BARE = CABLES.replace(
    "</tendon>",
    '<spatial name="spring" stiffness="5"><site site="p_back"/><geom geom="ball"/><site site="h"/></spatial></tendon>',
)
FIXED = CABLES.replace(
    "</worldbody>",
    '<body pos="3 0 0"><joint name="wheel"/><geom size=".1" contype="0" conaffinity="0"/></body></worldbody>',
).replace("</actuator>", '<motor name="wheel" joint="wheel"/></actuator>')


def model_of(xml: str) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(xml)


# ----------------------------------------------------------------------------------------------- the system


@pytest.mark.parametrize(
    ("integrator", "transmission"),
    [*((each, True) for each in INTEGRATORS.values()), *((each, False) for each in EXPLICIT)],
)
def test_a_robot_moves_as_its_native_twin(integrator: int, transmission: bool) -> None:
    """For 1 s, to rounding, where MuJoCo has all paths exactly; a muscle that acts by wrenches damps explicitly."""
    models = model_of(CABLES), model_of(CABLES)
    for model in models:
        model.opt.integrator = int(integrator)
    data, twin = (mujoco.MjData(model) for model in models)
    muscles = CableSystem(models[0], transmission=transmission)
    assert muscles.cables == ["winch", "brake", "tackle", "leash"]
    gear = twin.model.actuator_gear[:, 0]
    for _ in range(500):
        drive(data)
        drive(twin)
        muscles.step(data)
        mujoco.mj_step(twin.model, twin)
        np.testing.assert_allclose(data.qpos, twin.qpos, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(muscles.tension, -gear * twin.actuator_force, rtol=1e-9, atol=1e-9)
    muscles.forward(data)
    mujoco.mj_forward(twin.model, twin)
    np.testing.assert_allclose(muscles.tension, -gear * twin.actuator_force, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(muscles.length * gear, twin.actuator_length, rtol=1e-12)
    np.testing.assert_allclose(muscles.velocity * gear, twin.actuator_velocity, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("integrator", ["mjINT_EULER", "mjINT_RK4", "mjINT_IMPLICITFAST"])
def test_the_finger_moves_in_python_as_in_the_plugin(integrator: str) -> None:
    """Over rings, an ellipsoid and cylinders in a row, which MuJoCo does not have."""
    model, plugged = mujoco.MjModel.from_xml_path(FINGER), mw.load(FINGER, mode="transmission")
    for each in (model, plugged):
        each.opt.integrator = int(INTEGRATORS[integrator])
    muscles, data, other = CableSystem(model), mujoco.MjData(model), mujoco.MjData(plugged)
    for each in (data, other):
        mujoco.mj_resetDataKeyframe(each.model, each, each.model.key("bent").id)
    start = data.qpos.copy()
    for _ in range(300):
        muscles.step(data)
        mujoco.mj_step(plugged, other)
    np.testing.assert_allclose(data.qpos, other.qpos, rtol=0.0, atol=1e-11)
    assert np.abs(data.qpos - start).max() > 0.05
    assert not muscles.failures.any()


def test_mistakes_call_a_cable_so_and_let_two_actuators_share_a_tendon() -> None:
    for transmission in (False, True):
        assert possible_mistakes(CableSystem(model_of(CABLES), transmission=transmission)) == []
    copy = CABLES.replace(
        "</tendon>",
        '<spatial name="copy"><site site="front"/><site site="a"/></spatial></tendon>',
    ).replace("</actuator>", '<motor name="copy" tendon="copy"/></actuator>')
    (found,) = possible_mistakes(CableSystem(model_of(copy)))
    assert str(found).startswith("cable 'copy' has the same sites and surfaces as cable 'leash'; ")


def test_moment_arms_about_a_free_joint_have_their_units(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The leash pulls at (0, 0, 0.35) + (0.02, 0, -0.2), to (0, 1, 1.3): unit vector first, then torque in mm."""
    path = tmp_path / "robot.xml"
    path.write_text(CABLES)
    ran = run_here("inspect", capsys, path, "--quick")
    (line,) = [text for text in ran.out.splitlines() if text.startswith("  leash   #0[0]")]
    pull = np.array([0.0, 1.0, 1.3]) - [0.02, 0.0, 0.15]
    pull /= np.linalg.norm(pull)
    turn = 1e3 * np.cross([0.02, 0.0, -0.25], pull)  # about the platform's origin
    told = [float(word) for word in re.findall(r"#0\[\d\] (\S+?),", line)]
    assert told == pytest.approx([*pull, *turn], rel=5e-3)


def test_cables_are_called_so_in_notebooks() -> None:
    robot, finger = CableSystem(model_of(CABLES)), CableSystem(mujoco.MjModel.from_xml_path(FINGER))
    assert repr(robot).startswith("CableSystem(1 muscle and 4 cables: winch, ")
    assert repr(CableSystem(model_of(CABLES), transmission=True)) == repr(robot)
    assert "<th>muscle</th>" in robot._repr_html_()
    assert "<th>cable</th>" in finger._repr_html_()
    assert "cable winch</caption>" in robot["winch"]._repr_html_()
    assert "muscle flexor</caption>" in robot["flexor"]._repr_html_()


def test_without_cables_it_is_a_muscle_system() -> None:
    """The same bits."""
    path = str(ROOT / "models" / "elbow" / "elbow.xml")
    states = []
    for make in (mw.MuscleSystem, CableSystem):
        model = mujoco.MjModel.from_xml_path(path)
        muscles, data = make(model), mujoco.MjData(model)
        data.ctrl[:] = 0.3
        muscles.step(data, 50)
        states.append(np.concatenate([data.qpos, data.act, muscles.tension]))
    np.testing.assert_array_equal(*states)


def test_a_path_over_a_body_that_the_tendon_does_not_touch_is_named_when_it_moves() -> None:
    """Its lengths can be computed; MuJoCo has no room for its moment."""
    lines = '<element objtype="site" objname="p_front"/><element objtype="geom" objname="far"/>'
    xml = CABLES.replace(
        "</worldbody>",
        '<body pos="0 1 0.6"><joint axis="0 0 1"/><geom name="far" type="cylinder" size=".02 .1" contype="0" '
        'conaffinity="0" zaxis="1 0 0" mass="1"/></body></worldbody>',
    ).replace(
        "</mujoco>",
        '<custom><tuple name="mjwrap_leash"><element objtype="actuator" objname="leash"/>'
        + lines
        + '<element objtype="site" objname="a"/></tuple></custom></mujoco>',
    )
    model = model_of(xml)
    muscles, data = CableSystem(model), mujoco.MjData(model)
    muscles.forward(data)
    assert muscles.length[muscles.index("leash")] > 0.1
    with pytest.raises(mw.ModelError, match="muscle 'leash': its path runs over body"):
        muscles.step(data)


def test_bare_tendons_are_paths_without_a_force() -> None:
    model = model_of(BARE)
    muscles, data = CableSystem(model, tendons=True), mujoco.MjData(model)
    assert muscles.bare == ["spring"]
    muscles.forward(data)
    mujoco.mj_forward(model, data)
    i = muscles.index("spring")
    assert muscles.length[i] == pytest.approx(data.ten_length[model.tendon("spring").id], abs=1e-12)
    assert muscles.tension[i] == 0.0


def test_kinds_of_actuators() -> None:
    """Every element of MJCF that has a name here, as MuJoCo compiles it."""
    elements = {
        "motor": "", "position": 'kp="5" kv="1"', "velocity": 'kv="2"', "intvelocity": 'kp="3" actrange="0 1"',
        "damper": 'kv="1" ctrlrange="0 1"', "general": 'gainprm="-30"', "cylinder": 'area="2"',
    }  # fmt: skip
    tendon = '<spatial name="t"><site site="left"/><site site="p_left"/></spatial></tendon>'
    text = "".join(f'<{name} tendon="t" {more}/>' for name, more in elements.items())
    model = model_of(CABLES.replace("</tendon>", tendon).replace("</actuator>", text + "</actuator>"))
    found = [kind(model, i) for i in range(5, model.nactuator)]
    assert found == ["motor", "position", "velocity", "intvelocity", "damper", "general", "general"]


# -------------------------------------------------------------------------------------------- in the package


def test_a_run_is_that_of_the_twin() -> None:
    """The table of a run has lengths and tensions of all cables, in Python and in the plugin."""
    tables = [
        simulate(FINGER, RunSettings(0.2, mode=mode, excitation=PULL, keyframe="rest"))
        for mode in ("python", "transmission")
    ]
    assert tables[0].names == tables[1].names
    assert "tension:fdp" in tables[0].names
    np.testing.assert_allclose(tables[0].values, tables[1].values, rtol=1e-7, atol=1e-9)
    assert tables[0]["tension:fds"] == pytest.approx(np.full(len(tables[0].time), 1.5))


def test_a_comparison_has_cables_and_bare_tendons() -> None:
    model = model_of(BARE)
    found = compare_poses(model, samples=9, bases=0, tendons=True)
    assert list(found.muscles) == ["winch", "brake", "tackle", "flexor", "leash", "spring"]
    assert found.at_fault == 0
    for name in ("winch", "tackle", "leash"):
        assert found.muscles[name].counts["AGREE"] == found.poses
    assert list(compare_poses(model, samples=9, bases=0).muscles) == [*list(found.muscles)[:-1]]


def test_a_comparison_of_motions_drives_the_cables() -> None:
    """Where the paths are MuJoCo's, both motions are; the finger's are not."""
    model = model_of(CABLES)
    moved = compare_motion(model, ["sine:0.2,2,0.7"], 0.3)
    assert np.abs(moved.mjwrap[-1] - moved.mjwrap[0]).max() > 0.01
    assert np.abs(moved.difference).max() < 1e-10
    finger = compare_motion(mujoco.MjModel.from_xml_path(FINGER), PULL, 0.1)
    assert np.abs(finger.difference).max() > 0.01


def test_a_check_pulls_the_cables() -> None:
    """Paths, derivatives, forces and energy of every cable, whatever its control would do."""
    found = check_model(mujoco.MjModel.from_xml_path(FINGER), poses=3, samples=21)
    assert found.facts["cables"] == found.facts["muscles"] == 3
    assert not found.failed
    values = {check.name: check for check in found.checks}
    for name in ("velocity", "moment_arm", "virtual_work", "balance", "power", "energy"):
        assert values[name].count > 0, name
        assert not values[name].skipped


# -------------------------------------------------------------------------------------------- in the commands


def test_inspect_lists_the_cables(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    report = tmp_path / "r.json"
    ran = run_here("inspect", capsys, FINGER, "--json", report)
    assert ran.code == 0, ran.err
    assert "3 cables with geodesic paths, 0 with MuJoCo's own paths" in ran.out
    cables = {row["name"]: row for row in json.loads(report.read_text())["cables"]}
    fdp = cables["fdp"]
    assert fdp["actuator"] == "position"
    assert (fdp["gear"], fdp["control"], fdp["force"]) == (1.0, [0.07, 0.14], [-40.0, 0.0])
    short, long = fdp["length_range"]
    assert 0.05 < short < fdp["length"] < long < 0.14
    assert "a1 (torus, side a1_hole) > a2 (torus, side a2_hole)" in ran.out
    assert "findings: 0" in ran.out


def test_compare_calls_cables_and_tendons_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The keys of the JSON file stay."""
    file, page, values = tmp_path / "robot.xml", tmp_path / "r.html", tmp_path / "r.json"
    file.write_text(BARE)
    options = (file, "--samples", 5, "--bases", 0, "--duration", 0, "--report", page, "--json", values)
    for given, counted, noun, nouns in (
        ((), "1 muscle and 4 cables", "muscle or cable", "muscles and cables"),
        (("--muscles", "winch", "leash"), "2 cables", "cable", "cables"),
        (("--tendons", "--muscles", "spring"), "1 tendon without an actuator", "tendon", "tendons"),
        (("--muscles", "flexor"), "1 muscle", "muscle", "muscles"),
    ):
        ran = run_here("compare", capsys, *options, *given)
        assert ran.code == 0, ran.err
        assert ran.out.startswith(f"{file}: {counted} at ")
        assert ran.out.splitlines()[1].startswith(f"{noun}  ")
        text = page.read_text()
        for part in (
            f"<h2>All {nouns}</h2>",
            f"<h2>Each {noun}</h2>",
            f"{nouns} compared at",
            f'<th class="text">{noun}</th>',
        ):
            assert part in text
        assert "muscles" in json.loads(values.read_text())
    ran = run_here("compare", capsys, file, "--muscles", "wench")
    assert "no muscle or cable 'wench' (did you mean 'winch'?); muscles and cables: winch" in ran.err


def test_what_stays_with_mujoco_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "robot.xml"
    file.write_text(CABLES)
    ran = run_here("run", capsys, file, "--mode", "wrench", "--duration", 0.01)
    assert ran.code == 0, ran.err
    assert "1 muscle," in ran.out
    for name in ("winch", "brake", "tackle", "leash"):
        assert f"{name}: it is not a muscle; modes python and transmission drive it" in ran.out
    ran = run_here("run", capsys, file, "--duration", 0.01)
    assert "1 muscle and 4 cables" in ran.out
    assert "left to MuJoCo" not in ran.out
    ran = run_here("run", capsys, FINGER, "--mode", "wrench", "--duration", 0.01)
    assert ran.code == 2
    assert "pull along it in mode 'transmission'" in ran.err


def test_an_installed_model_names_its_native_cables() -> None:
    named = native(mw.install(mujoco.MjSpec.from_string(CABLES)))
    assert list(named) == ["winch", "brake", "tackle", "leash"]
    assert set(named.values()) == {"it is not a muscle; mode 'transmission' drives it along mjwrap's path"}
    assert native(mw.install(mujoco.MjSpec.from_string(CABLES), mode="transmission")) == {}


COMMANDS = {
    "inspect": ["--quick"],
    "check": ["--poses", "1", "--samples", "3"],
    "compare": ["--samples", "3", "--bases", "0", "--duration", "0.02", "--excitation", "winch=constant:1"],
    "run": ["--duration", "0.02"],
    "plot": ["--joint", "#2", "--range", "-30deg,30deg", "--muscle", "*", "--samples", "3", "--csv"],
}
SAVED = ("wrench.xml", "wrench.mjb", "transmission.xml", "transmission.mjb")


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Installed specs of the robot, which has a muscle and cables, saved in every way."""
    folder, files = tmp_path_factory.mktemp("saved"), {}
    for mode in ("wrench", "transmission"):
        spec = mujoco.MjSpec.from_string(CABLES)
        model = mw.install(spec, mode=mode)
        files[f"{mode}.xml"], files[f"{mode}.mjb"] = folder / f"{mode}.xml", folder / f"{mode}.mjb"
        files[f"{mode}.xml"].write_text(spec.to_xml())
        mujoco.mj_saveModel(model, str(files[f"{mode}.mjb"]))
    return files


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("name", SAVED)
def test_a_saved_installed_model_opens_in_every_command(
    name: str, command: str, saved: dict[str, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    table = [tmp_path / "t.csv"] if COMMANDS[command][-1:] == ["--csv"] else []
    ran = run_here(command, capsys, saved[name], *COMMANDS[command], *table)
    assert ran.code == 0, ran.err
    assert "1 muscle and 4 cables" in ran.out


@pytest.mark.parametrize("mode", ["python", "wrench", "transmission"])
@pytest.mark.parametrize("name", SAVED)
def test_a_saved_installed_model_runs_in_every_mode(
    name: str, mode: str, saved: dict[str, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """And moves as it did before it was saved; an MJB keeps its own mode of the plugin, and says so."""
    table, native = tmp_path / "t.csv", tmp_path / "native.csv"
    options = ["--duration", 0.05, "--excitation", "sine:0.2,2,0.7", "--mode", mode]
    ran = run_here("run", capsys, saved[name], *options, "--csv", table)
    if name.endswith(".mjb") and mode != "python" and not name.startswith(mode):
        assert ran.code == 2
        assert f"was saved with mode '{name.split('.')[0]}'" in ran.err
        return
    assert ran.code == 0, ran.err
    plain = tmp_path / "plain.xml"
    plain.write_text(CABLES)
    run_here("run", capsys, plain, *options, "--csv", native)
    for row, other in zip(rows_of(table), rows_of(native), strict=True):
        for key, value in other.items():
            assert row[key] == pytest.approx(value, rel=1e-6, abs=1e-6), key


def test_states_of_a_run_give_the_same_tensions(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table, again = tmp_path / "t.npz", tmp_path / "again.npz"
    run_here(
        "run", capsys, FINGER, "--duration", 0.5, "--keyframe", "rest", "--out", table, "--excitation", *PULL
    )
    ran = run_here("replay", capsys, table, "--model", FINGER, "--out", again)
    assert ran.code == 0, ran.err
    first, second = mw.read_table(table), mw.read_table(again)
    for name in second.names:
        np.testing.assert_allclose(second[name], first[name], rtol=1e-7, atol=1e-10, err_msg=name)
    assert np.abs(second["tension:fdp"]).max() > 0.1


def test_motors_on_joints_are_not_cables() -> None:
    found = read_declarations(model_of(FIXED), cables=True)
    assert [m.name for m in found.muscles] == ["winch", "brake", "tackle", "flexor", "leash"]
    assert found.native == {}
