"""The mistakes of a first-time author: each is named with its element and a remedy; docs/mistakes.md lists them."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np
import pytest
from cli_runs import CASE2, ROOT, only_files, run_here, said
from first_model import Edit, compiled, edited, listed
from random_models import ALL, random_model

import mjwrap as mw
from mjwrap.checking import Mistake, possible_mistakes

INSPECT, SWEEP, RUN = ("inspect", "--quick"), ("inspect",), ("run", "--duration", "0.01")
NO_WRAP: list[Edit] = [(listed("geom", "elbow_wrap"), ""), (listed("site", "back", ' prm="1"'), "")]
NO_RING: list[Edit] = [(listed("geom", "sling"), ""), (listed("numeric", "sling_torus_size"), "")]
NO_SIDE: Edit = (listed("site", "elbow_side", ' prm="1"'), "")
COPY = """<tuple name="mjwrap_copy">
      <element objtype="site" objname="triceps_origin"/>
      <element objtype="geom" objname="elbow_wrap"/>
      <element objtype="site" objname="back" prm="1"/>
      <element objtype="site" objname="triceps_insertion"/>
      <element objtype="numeric" objname="TRI_optimal_force"/>
    </tuple></custom>"""

CABLE = """<tendon><spatial name="T"><site site="triceps_origin"/><site site="triceps_insertion"/></spatial></tendon>
  <actuator><motor name="M" tendon="T" gear="10" ctrlrange="0 1"/></actuator>"""
NUMERIC, SIDE = '<numeric name="BIC_max', listed("site", "elbow_side", ' prm="1"')
BIC_FORCE = listed("numeric", "BIC_max_isometric_force")


class Case(NamedTuple):
    """A mistake: edits of the model, the command, its exit code, and the element and remedy that it must name."""

    edits: list[Edit]
    command: tuple[str, ...]
    code: int
    words: list[str]


# By the words with which docs/mistakes.md lists them. {model}, {table}: files that the test writes.
CASES: dict[str, Case] = {
    # ------------------------------------------------------------------------------ the declaration
    "tuple whose name lacks `mjwrap`": Case(
        [("mjwrap_BIC", "BIC")], INSPECT, 0, ["tuple 'BIC'", "nothing reads it", "call it 'mjwrap_BIC'"]
    ),
    "`mjwrap` in capitals": Case(
        [("mjwrap_BIC", "MJWRAP_BIC")], INSPECT, 0, ["tuple 'MJWRAP_BIC'", "in small letters"]
    ),
    "`mjwrap` misspelt": Case([("mjwrap_TRI", "mjwarp_TRI")], INSPECT, 0, ["tuple 'mjwarp_TRI'", "mjwrap_mjwarp_TRI"]),
    "numeric in no tuple": Case(
        [('<numeric name="BIC_max', '<numeric name="BIC_pennation_angle" data=".2"/><numeric name="BIC_max')],
        INSPECT, 0, ["numeric 'BIC_pennation_angle'", "in no tuple", "list it in the tuple of its muscle"],
    ),
    "misspelt numeric in no tuple": Case(
        [('<numeric name="BIC_max', '<numeric name="BIC_pennation_angel" data=".2"/><numeric name="BIC_max')],
        INSPECT, 0, ["numeric 'BIC_pennation_angel'", "(pennation_angle?)", "with 'pennation_angle' in its name"],
    ),
    "misspelt numeric in a tuple": Case(
        [("BIC_optimal_fiber_length", "BIC_optimal_fibre_length")],
        INSPECT, 2, ["numeric 'BIC_optimal_fibre_length'", "optimal_fiber_length"],
    ),
    "text in no tuple": Case(
        [('<numeric name="BIC_max', '<text name="BIC_law" data="millard_2012"/><numeric name="BIC_max')],
        INSPECT, 0, ["text 'BIC_law'", "in no tuple", "list it in the tuple"],
    ),
    "shape of a geom not listed": Case(
        [(listed("numeric", "sling_torus_size"), "")],
        INSPECT, 0, ["geom 'sling'", "as a sphere of 1 mm", "list numeric 'sling_torus_size' directly after the geom"],
    ),
    "placeholder without a shape": Case(
        [("sling_torus_size", "other"), (listed("numeric", "other"), "")],
        INSPECT, 0, ["geom 'sling'", "of only 1 mm", "list the numeric of that shape directly after it"],
    ),
    "geom called torus, wrapped as a sphere": Case(
        [*NO_RING[1:], ('"sling_torus_size"', '"x"'), ('"sling"', '"sling_torus"')],
        INSPECT, 0, ["geom 'sling_torus'", "its name speaks of a torus", "'torus_size' in its name directly after"],
    ),
    "side site without `prm`": Case(
        [(' objname="elbow_side" prm="1"', ' objname="elbow_side"')],
        INSPECT, 0, ["site 'elbow_side'", "side of geom 'elbow_wrap'", 'write prm="1"'],
    ),
    "muscle actuator on a joint": Case(
        [("<actuator/>", '<actuator><muscle name="M" joint="elbow" lengthrange="0 1"/></actuator>')],
        INSPECT, 0, ["actuator 'M'", "muscle on joint 'elbow'", "let it pull a spatial tendon"],
    ),
    "cable that can only push": Case(
        [("<actuator/>", CABLE)], INSPECT, 0, ["cable 'M'", "can only push", 'write gear="-10"']
    ),
    "actuation switched off": Case(
        [('<compiler angle="degree"/>', '<compiler angle="degree"/><option><flag actuation="disable"/></option>')],
        INSPECT, 0, ["model switches all actuators off", "leave out <flag actuation"],
    ),
    "copy of a muscle": Case(
        [("</custom>", COPY)], INSPECT, 0, ["muscle 'copy'", "muscle 'TRI'", "give it its own sites"]
    ),
    # ---------------------------------------------------------------------------- sizes and places
    "sizes in millimetres": Case(
        [('size=".022 .04"', 'size="22 40"')],
        INSPECT, 0, ["geom 'elbow_wrap'", "of 22 m", "sizes are in metres"],
    ),
    "whole model in millimetres": Case(
        [(f'pos="{a}"', f'pos="{b}"') for a, b in (
            (".03 0 -.05", "30 0 -50"), (".032 0 -.12", "32 0 -120"), ("0 0 -.3", "0 0 -300"),
            (".05 0 -.3", "50 0 -300"), ("-.03 0 -.05", "-30 0 -50"), ("-.05 0 -.3", "-50 0 -300"),
            (".022 0 -.08", "22 0 -80"), ("-.025 0 -.06", "-25 0 -60"), (".029 0 -.2", "29 0 -200"),
        )] + [('size=".022 .04"', 'size="22 40"'), ('data=".012 .004"', 'data="12 4"')],
        INSPECT, 0, ["model has muscles that are", "gravity", "in metres"],
    ),
    "fibre length in millimetres": Case(
        [('data=".11"', 'data="110"')],
        INSPECT, 0, ["muscle 'BIC'", "optimal_fiber_length of 110 m", "lengths are in metres"],
    ),
    "time constants in milliseconds": Case(
        [(NUMERIC, '<numeric name="BIC_activation_time_constants" data="10 40"/>' + NUMERIC),
         (BIC_FORCE, BIC_FORCE + listed("numeric", "BIC_activation_time_constants"))],
        INSPECT, 0, ["muscle 'BIC'", "10 and 40 s", "not in milliseconds"],
    ),
    "time constants exchanged": Case(
        [(NUMERIC, '<numeric name="BIC_activation_time_constants" data=".04 .01"/>' + NUMERIC),
         (BIC_FORCE, BIC_FORCE + listed("numeric", "BIC_activation_time_constants"))],
        INSPECT, 0, ["muscle 'BIC'", "more slowly (0.04 s)", "activation comes first"],
    ),
    "contraction velocity in m/s": Case(
        [(NUMERIC, '<numeric name="BIC_max_contraction_velocity" data="1.1"/>' + NUMERIC),
         (BIC_FORCE, BIC_FORCE + listed("numeric", "BIC_max_contraction_velocity"))],
        INSPECT, 0, ["muscle 'BIC'", "max_contraction_velocity of only 1.1", "optimal fibre lengths per second"],
    ),
    "ring beside the path": Case(
        [('pos=".029 0 -.2"', 'pos=".08 0 -.2"')],
        INSPECT, 0, ["geom 'sling' is a ring", "muscle 'BIC'", "inner side of its tube"],
    ),
    "surface far from its muscle": Case(
        [('pos=".029 0 -.2"', 'pos="3 0 -.2"')],
        INSPECT, 0, ["geom 'sling'", "away from muscle 'BIC'", "check its position"],
    ),
    "cylinder along the path": Case(
        [('pos="0 0 -.3" zaxis="0 1 0"', 'pos="0 0 -.3"'), ('"via" pos=".032 0 -.12"', '"via" pos=".023 0 -.12"'),
         *NO_RING, (' objname="elbow_side" prm="1"', ' objname="via"')],
        INSPECT, 0, ["geom 'elbow_wrap' is a cylinder whose axis", "muscle 'TRI'", "turn the geom"],
    ),
    "wrapping geom that collides": Case(
        [('zaxis="0 1 0"/>', 'zaxis="0 1 0" contype="1"/>'), ('0 0 -.25"', '0 0 -.25" conaffinity="1"')],
        INSPECT, 0, ["geom 'elbow_wrap'", "collides with geom 'ulna'", 'contype="0" conaffinity="0"'],
    ),
    "end inside a surface": Case(
        [('"insertion" pos=".022 0 -.08"', '"insertion" pos=".01 0 -.01"')],
        INSPECT, 0, ["muscle 'BIC'", "site 'insertion' is inside geom 'elbow_wrap'", "move its sites out"],
    ),
    "end inside a surface, in a run": Case(
        [('"triceps_insertion" pos="-.025 0 -.06"', '"triceps_insertion" pos="-.001 0 -.001"')],
        RUN, 2, ["muscle 'TRI'", "site 'triceps_insertion' is inside geom 'elbow_wrap'"],
    ),
    "insertion in the wrong body": Case(
        [(listed("site", "triceps_insertion"), listed("site", "back"))],
        INSPECT, 0, ["muscle 'TRI' crosses no joint", "body 'upper_arm'", "put its insertion into the body"],
    ),
    "insertion in the wrong body, in a run": Case(
        [(listed("site", "triceps_insertion"), listed("site", "back"))],
        RUN, 0, ["mjwrap run: warning: muscle 'TRI' crosses no joint"],
    ),
    "path through the axis": Case(
        [*NO_WRAP, ('pos="-.03 0 -.05"', 'pos="0 0 -.05"'), ('pos="-.025 0 -.06"', 'pos="0 0 -.06"')],
        INSPECT, 0, ["muscle 'TRI' has no moment arm", "joint 'elbow'", "check the places of its sites and the axis"],
    ),
    "no surface where one is needed": Case(
        NO_WRAP, SWEEP, 0, ["muscle 'TRI' has moment arms of both signs about joint 'elbow'", "add a surface"]
    ),
    "surface listed twice": Case(
        [(SIDE, SIDE + listed("geom", "elbow_wrap"))],
        INSPECT, 0, ["muscle 'BIC'", "wraps geom 'elbow_wrap' twice", "leave one of them out"],
    ),
    "site listed twice": Case(
        [(listed("site", "via"), 2 * listed("site", "via"))],
        INSPECT, 0, ["muscle 'BIC'", "site 'via', twice", "leave one of them out"],
    ),
    "sites in the wrong order": Case(
        [(listed("site", "origin"), "ORIGIN"), (listed("site", "via"), listed("site", "origin")),
         ("ORIGIN", listed("site", "via"))],
        INSPECT, 0, ["muscle 'BIC' turns back at site 'origin'", "check the order of its sites"],
    ),
    # ------------------------------------------------------------------------------------- angles
    "range in radians, read as degrees": Case(
        [('range="0 130"', 'range="0 2.27"')],
        INSPECT, 0, ["joint 'elbow'", "0 to 2.27 degrees", 'write <compiler angle="radian"/>'],
    ),
    "range in degrees, read as radians": Case(
        [('angle="degree"', 'angle="radian"')],
        INSPECT, 0, ["joint 'elbow'", "0 to 130 rad", 'leave out <compiler angle="radian"/>'],
    ),
    "range with its ends exchanged": Case(
        [('range="0 130"', 'range="130 0"')], INSPECT, 0, ["joint 'elbow'", "down to 0", "write its lower end first"]
    ),
    "keyframe in degrees": Case(
        [("<actuator/>", '<keyframe><key name="bent" qpos="90 0"/></keyframe>')],
        INSPECT, 0, ["keyframe 'bent' puts joint 'elbow' at 90 rad", "in rad, whatever", "90 degrees are 1.571"],
    ),
    "degrees in `--prescribe`": Case(
        [], (*RUN, "--prescribe", "elbow=constant:90"), 2, ["joint 'elbow'", "14.3 turns", "write 90deg"]
    ),
    "degrees in the amplitude of `--prescribe`": Case(
        [], (*RUN, "--prescribe", "elbow=sine:45,1,45"), 2, ["joint 'elbow'", "90 rad", "write 90deg"]
    ),
    "degrees as a frequency": Case(
        [], (*RUN, "--prescribe", "elbow=sine:45deg,1deg"), 2, ["'sine:45deg,1deg'", "only a level, an amplitude"]
    ),
    "degrees in `--qpos`": Case(
        [], (*RUN, "--qpos", "elbow=60"), 2, ["'elbow=60'", "far outside the range of joint 'elbow'", "write 60deg"]
    ),
    "a few degrees in `--qpos`": Case(
        [], (*RUN, "--qpos", "elbow=5"), 0, ["warning: 'elbow=5' lies outside the joint's range", "write 5deg"]
    ),
    "degrees for a slide": Case(
        [], (*RUN, "--qpos", "cylinder_y=1deg"), 2, ["joint 'cylinder_y' is a slide", "in m, without deg"]
    ),
    "degrees in `--range`": Case(
        [], (*INSPECT[:1], "--range", "elbow=0,90"), 2, ["range of joint 'elbow'", "write elbow=0deg,90deg"]
    ),
    "table of degrees that does not say so": Case(
        [], (*RUN, "--prescribe", "{table}"), 2, ["column 'elbow'", "90 at time 1 s", "inDegrees=yes"]
    ),
    "states in degrees that do not say so": Case(
        [], ("replay", "{table}", "--model", "{model}", "--out", "{out}"), 2, ["column 'elbow'", "inDegrees=yes"]
    ),
    "table of a few degrees that does not say so": Case(
        [], (*RUN, "--prescribe", "{few}"), 0,
        ["column 'elbow' reaches 4 rad at time 1 s", "outside the range of joint 'elbow'", "inDegrees=yes"],
    ),
    "many turns of a wheel": Case(
        [], (*RUN, "--prescribe", "axle=90"), 0, ["warning: 'axle=90'", "14.3 turns of joint 'axle'", "write 90deg"]
    ),
    "excitation in percent": Case(
        [], (*RUN, "--excitation", "BIC=constant:50"), 0, ["the excitation of 'BIC' reaches 50", "divide them by 100"]
    ),
    "excitation below zero": Case(
        [], (*RUN, "--excitation", "BIC=sine:0.5,1"), 0,
        ["the excitation of 'BIC' falls to -0.5", "its range of control, 0 to 1", "needs an offset"],
    ),
    "control outside the range of a servo": Case(
        [("<actuator/>", CABLE.replace("<motor", "<position")), ('gear="10" ctrlrange="0 1"', 'ctrlrange=".07 .14"')],
        (*RUN, "--excitation", "M=step:0.1@0.01"), 0,
        ["the excitation of 'M' falls to 0", "its range of control, 0.07 to 0.14", "see its ctrlrange"],
    ),
}  # fmt: skip


def command_of(case: Case, folder: Path) -> list[str]:
    """Write the files of a case; return the words of its command."""
    model, table = folder / "arm.xml", folder / "ik.mot"
    model.write_text(edited(*case.edits))
    mw.write_table(table, mw.Table(np.array([0.0, 1.0]), ("elbow",), np.array([[0.0], [90.0]])))
    few = folder / "few.mot"
    if "{few}" in case.command:
        mw.write_table(few, mw.Table(np.array([0.0, 1.0]), ("elbow",), np.array([[0.0], [4.0]])))
    given = {"model": model, "table": table, "few": few, "out": folder / "o.csv"}
    name, *rest = (w.format(**given) for w in case.command)
    needs_model = name != "replay"
    source = CASE2 if any("cylinder_y" in word for word in rest) else str(model)
    return [name, *[source] * needs_model, *rest]


@pytest.mark.filterwarnings("default")
@pytest.mark.parametrize("name", CASES)
def test_a_mistake_is_named_with_its_element_and_a_remedy(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    case = CASES[name]
    command, *arguments = command_of(case, tmp_path)
    ran = run_here(command, capsys, *arguments)
    assert ran.code == case.code, ran.err
    lines = said(ran) if command == "run" or case.code else ran.out.splitlines()
    assert any(all(word in line for word in case.words) for line in lines), "\n".join(lines)
    if case.code:
        only_files(tmp_path, "arm.xml", "ik.mot")


def page_rows() -> dict[str, str]:
    """Return what the page says of each mistake."""
    text = (ROOT / "docs" / "mistakes.md").read_text()
    rows = re.findall(r"^\| (.+?) \| (.+) \|$", text, re.MULTILINE)
    return {name: told for name, told in rows if name not in ("mistake", "---")}


@pytest.mark.filterwarnings("default")
def test_run_warns_where_the_page_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    told = page_rows()
    names = [name for name in told if told[name].startswith("inspect, run")]
    assert len(names) >= 20
    for name in names:
        case = CASES[name]
        model = tmp_path / "arm.xml"
        model.write_text(edited(*case.edits))
        ran = run_here("run", capsys, model, "--duration", 0.01)
        warned = [line for line in said(ran) if line.startswith("mjwrap run: warning: ")]
        assert any(all(word in line for word in case.words) for line in warned), (name, ran.code, ran.err)


@pytest.mark.parametrize("mode", ["wrench", "transmission"])
def test_run_warns_in_every_mode(mode: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = tmp_path / "arm.xml"
    model.write_text(edited(("mjwrap_BIC", "BIC")))
    ran = run_here("run", capsys, model, "--duration", 0.01, "--mode", mode)
    assert ran.code == 0, ran.err
    assert any("warning: tuple 'BIC' looks like" in line for line in said(ran))


def test_many_warnings_of_a_run_are_cut_short(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = tmp_path / "arm.xml"
    made = "".join(f'<numeric name="m{k}_torus_size" data="1 .1"/>' for k in range(9))
    model.write_text(edited(("</custom>", f"{made}</custom>")))
    lines = said(run_here("run", capsys, model, "--duration", 0.01))
    assert len(lines) == 6
    assert lines[-1] == f"mjwrap run: warning: 4 more; mjwrap inspect {model} lists them"


def test_inspect_has_moment_arms_and_mistakes_as_values(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = tmp_path / "arm.xml"
    model.write_text(edited(("mjwrap_TRI", "TRI")))
    values = json.loads(run_here("inspect", capsys, model, "--quick", "--json").out)
    muscles = mw.MuscleSystem(compiled())
    arms = muscles.moment_arms(mujoco.MjData(muscles.model), "elbow")
    assert values["moment_arms"] == {"BIC": {"elbow": pytest.approx(float(arms[0, 0]))}}
    (mistake,) = values["possible_mistakes"]
    assert mistake["kind"] == "tuple that nothing reads"
    assert mistake["element"] == "tuple 'TRI'"
    text = run_here("inspect", capsys, model, "--quick").out
    assert f"  BIC  elbow {1e3 * float(arms[0, 0]):+.3g}\n" in text
    assert "1 possible mistake:\n  tuple 'TRI' looks like" in text


def test_models_of_every_kind_are_searched_without_an_error() -> None:
    """Balls, free joints, mocap bodies and every surface; whatever is found has an element that the model has."""
    for seed in range(12):
        muscles = mw.MuscleSystem(random_model(seed, ALL))
        for mistake in possible_mistakes(muscles):
            assert mistake.text
            assert mistake.remedy
            kind, _, name = mistake.element.partition(" ")
            assert kind in ("muscle", "geom", "joint", "site"), mistake
            assert kind != "muscle" or name.strip("'") in muscles.names


def test_the_page_lists_every_mistake_and_their_number() -> None:
    text = (ROOT / "docs" / "mistakes.md").read_text()
    assert list(page_rows()) == list(CASES)
    assert f"{len(CASES)} mistakes" in text
    assert len(CASES) >= 32


def test_the_model_without_a_mistake_has_no_finding(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert possible_mistakes(mw.MuscleSystem(compiled())) == []
    path = tmp_path / "arm.xml"
    path.write_text(edited())
    ran = run_here(
        "run",
        capsys,
        path,
        "--duration",
        0.01,
        "--prescribe",
        "elbow=sine:5deg,1,15deg",
        "--excitation",
        "sine:0.5,1,0.5",
    )
    assert (ran.code, said(ran)) == (0, [])


@pytest.mark.parametrize("sweep", [False, True])
def test_a_search_leaves_no_trace(sweep: bool) -> None:
    model = compiled()
    muscles, data = mw.MuscleSystem(model), mujoco.MjData(model)
    data.qpos[:] = 0.4
    muscles.step(data, 3)
    branch, state = muscles.branch(data), (muscles.length, muscles.tension, muscles.time, muscles.failures)
    assert muscles.length[0] > 0.0
    possible_mistakes(muscles, rest=model.qpos0 + 0.2, sweep=sweep)
    after = (muscles.length, muscles.tension, muscles.time, muscles.failures)
    for before, now in zip(state, after, strict=True):
        np.testing.assert_array_equal(before, now)
    np.testing.assert_array_equal(muscles.branch(data), branch)


def test_findings_are_values_with_kind_element_text_and_remedy() -> None:
    found = possible_mistakes(mw.MuscleSystem(compiled(("mjwrap_BIC", "BIC"))))
    (mistake,) = found
    assert (mistake.kind, mistake.element) == (Mistake.UNREAD_TUPLE, "tuple 'BIC'")
    assert str(mistake) == f"{mistake.element} {mistake.text}; {mistake.remedy}"
    with pytest.raises(mw.StateError, match="shape"):
        possible_mistakes(mw.MuscleSystem(compiled()), rest=np.zeros(9))


@pytest.mark.parametrize(
    ("text", "value"), [("90deg", np.pi / 2), ("-45°", -np.pi / 4), ("0.5", 0.5), (" 30 deg", np.pi / 6)]
)
def test_positions_are_read_in_their_unit(text: str, value: float, tmp_path: Path) -> None:
    from mjwrap.runs.angles import position

    assert position(text) == pytest.approx(value, abs=1e-15)


@pytest.mark.parametrize("columns", ["elbow", "qpos:elbow", "/jointset/j/elbow/value"])
@pytest.mark.parametrize("kind", ["csv", "mot"])
def test_a_header_in_degrees_is_honoured(
    columns: str, kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The same motion in radians and in degrees, as states, gives the same lengths."""
    model, given = tmp_path / "arm.xml", tmp_path / f"deg.{kind}"
    model.write_text(edited())
    time, angle = np.array([0.0, 1.0, 2.0]), np.array([[0.0], [1.0], [2.0]])
    if kind == "csv":
        rows = "\n".join(f"{t},{float(np.degrees(a))!r}" for t, a in zip(time, angle[:, 0], strict=True))
        given.write_text(f"# inDegrees=yes\n# made by hand, in degrees\ntime,{columns}\n{rows}\n")
    else:
        mw.write_table(given, mw.Table(time, (columns,), np.degrees(angle), {"inDegrees": "yes"}))
    mw.write_table(tmp_path / "rad.csv", mw.Table(time, (columns,), angle))
    out = []
    for name in (given.name, "rad.csv"):
        ran = run_here("replay", capsys, tmp_path / name, "--model", model, "--out", tmp_path / "o.csv")
        assert ran.code == 0, ran.err
        assert said(ran) == []
        out.append(mw.read_table(tmp_path / "o.csv")["length:BIC"])
    np.testing.assert_allclose(out[0], out[1], rtol=0, atol=1e-12)
    assert np.ptp(out[0]) > 1e-3


@pytest.mark.filterwarnings("default")
def test_a_recorded_wheel_may_turn_many_times(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model, given = tmp_path / "arm.xml", tmp_path / "spin.csv"
    model.write_text(edited())
    mw.write_table(given, mw.Table(np.array([0.0, 1.0]), ("qpos:axle",), np.array([[0.0], [90.0]])))
    ran = run_here("replay", capsys, given, "--model", model, "--out", tmp_path / "o.csv")
    assert ran.code == 0
    (line,) = said(ran)
    assert "warning" in line
    assert "joint 'axle' has no range" in line
    assert len(mw.read_table(tmp_path / "o.csv").time) == 2
