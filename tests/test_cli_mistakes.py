"""mjwrap run: what it says when it cannot, in one line, and that nothing is left behind."""

import re
import resource
from pathlib import Path

import numpy as np
import pytest
from cli_runs import CART, ELBOW, ENTERS, finish, only_files, run_here, said, simulate, start

from mjwrap import Table, write_table


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["nowhere.xml"], "nowhere.xml"),
        (["{text}"], "not a model that MuJoCo can load"),
        (["myo_sim:spider"], "spider|myo-sim"),
        ([ELBOW, "--duration", "-1"], "--duration.*above zero"),
        ([ELBOW, "--duration", "nan"], "--duration"),
        ([ELBOW, "--timestep", "0"], "--timestep"),
        ([ELBOW, "--integrator", "verlet"], "euler.*rk4.*implicit"),
        ([ELBOW, "--seed", "-1"], "--seed"),
        ([ELBOW, "--frobnicate"], "unrecognized"),
        ([ELBOW, "--excitation", "wiggle"], "'wiggle' is not a pattern; patterns: constant"),
        ([ELBOW, "--excitation", "BRAX=constant:1"], "BRAX.*TRIlong, TRIlat"),
        ([ELBOW, "--excitation", "{nan}"], "line 3, column 'BRA': nan is not finite"),
        ([ELBOW, "--keyframe", "bent"], "'bent'; keyframes: extended, right_angle, flexed"),
        ([ELBOW, "--qpos", "knee=1"], "no hinge or slide 'knee'; there are: elbow_flexion"),
        ([ELBOW, "--qpos", "elbow_flexion=nan"], "not finite"),
        ([ELBOW, "--qpos", "elbow_flexion"], "write JOINT=VALUE"),
        ([ELBOW, "--qpos", "elbow_flexion=bent"], "not a number"),
        ([ELBOW, "--prescribe", "elbow_flexion"], "write JOINT=PATTERN.*joints: elbow_flexion"),
        ([ELBOW, "--rate", "50"], "--rate needs a recording: add --record, --connect or --serve"),
        ([ELBOW, "--record", "{folder}/r.rrd", "--groups", "flexors"], "write NAME=PATTERN,PATTERN"),
        (
            [ELBOW, "--record", "{folder}/r.rrd", "--groups", "flexors=BIX*"],
            "no muscle 'BIX\\*'; muscles: TRIlong",
        ),
        ([ELBOW, "--connect", "here"], "cannot connect to a viewer at 'here'"),
        ([ELBOW, "--connect", "--serve"], "not allowed with"),
        ([ELBOW, "--prescribe", "elbow_flexion=step:1@1"], "cannot jump"),
        ([ELBOW, "--prescribe", "knee=sine:1,1"], "knee.*elbow_flexion"),
        ([ELBOW, "--prescribe", "elbow_flexion=sine:1,1,1", "--qpos", "elbow_flexion=1"], "is prescribed"),
        ([ELBOW, "--plot", "{text}/missing/p.png"], "text.xml' is not a folder"),
        ([ELBOW, "--plot", "{folder}/p.docx"], r"must end in \.png or \.pdf or \.svg"),
        ([ELBOW, "--csv", "{folder}/sub.csv"], "it is a folder"),
        ([ELBOW, "--record", "{text}/r.rrd"], "text.xml' is not a folder"),
        ([ELBOW, "--record", "{folder}/r.bin"], r"must end in \.rrd"),
        ([ELBOW, "--out", "{folder}/t.xlsx"], r"must end in \.sto or \.mot or \.csv or \.npz"),
        ([ELBOW, "--columns", "length"], "needs a table: add --out or --csv"),
        ([ELBOW, "--camera", "side"], "needs a film: add --video"),
        ([ELBOW, "--duration", "long"], "'long' is not a number"),
        (
            [ELBOW, "--csv", "{folder}/t.csv", "--columns", "length,weight"],
            "no kind 'weight'; kinds: qpos, qvel",
        ),
        (
            [ELBOW, "--video", "{folder}/f.gif", "--mode", "python"],
            "--video needs the engine plugin",
        ),
        ([ELBOW, "--video", "{folder}/f.avi"], r"\.mp4|OpenGL"),
        ([ELBOW, "--video", "{folder}/f.gif", "--video-size", "640"], "like 640x480"),
        (
            [ELBOW, "--mode", "sideways"],
            "mode 'sideways' does not exist; modes: python, wrench, transmission",
        ),
        ([ELBOW, "--excitation", "{text}.sto"], r"text\.xml\.sto'.*no such file"),
        ([ELBOW, "--csv", "{folder}/out/c.csv", "--plot", "{text}/p.png"], "is not a folder"),
    ],
)
def test_a_mistake_is_told_in_one_line_and_leaves_nothing(
    arguments: list[str], told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text, bad = tmp_path / "text.xml", tmp_path / "nan.csv"
    text.write_text("not MJCF")
    bad.write_text("time,BRA\n0,0\n1,nan\n")
    (tmp_path / "sub.csv").mkdir()
    filled = [a.format(text=text, nan=bad, folder=tmp_path) for a in arguments]
    ran = simulate(capsys, *filled)
    assert ran.code == 2
    (line,) = said(ran)
    assert line.startswith("mjwrap run: ")
    assert re.search(told, line), line
    assert ran.out == ""
    only_files(tmp_path, "text.xml", "nan.csv", "sub.csv")


@pytest.mark.parametrize(
    ("command", "option"),
    [
        ("run {elbow} --excitation BRA.sto --out BRA.sto", "--out"),
        ("run {elbow} --excitation BRA.csv --csv sub/../BRA.csv", "--csv"),
        ("run {elbow} --prescribe q.csv --csv link.csv", "--csv"),
        ("run {elbow} --excitation p_MuscleAnalysis_Length.sto --analysis p", "--analysis"),
        ("run m.rrd --record m.rrd", "--record"),
        ("run m.svg --plot m.svg", "--plot"),
        ("check m.json --json m.json", "--json"),
        ("inspect m.json --json=m.json", "--json"),
        ("replay q.npz --model {elbow} --out q.npz", "--out"),
        ("replay s.csv --model m.rrd --record m.rrd", "--record"),
        ("compare {elbow} --excitation BRA.csv --csv BRA.csv", "--csv"),
        ("compare {elbow} --states q.csv --lengths BRA.csv --csv BRA.csv", "--csv"),
        ("compare {elbow} --states q.npz --moment-arms elbow_flexion=BRA.csv --csv BRA.csv", "--csv"),
        ("compare m.html --report m.html", "--report"),
    ],
)
def test_no_output_takes_the_place_of_an_input(
    command: str,
    option: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    columns = {
        "BRA.sto": "BRA", "BRA.csv": "BRA", "q.csv": "elbow_flexion", "q.npz": "elbow_flexion", "s.csv": "slide",
    }  # fmt: skip
    for file, column in columns.items():
        write_table(file, Table(np.array([0.0, 1.0]), (column,), np.array([[0.2], [0.3]])))
    Path("p_MuscleAnalysis_Length.sto").write_bytes(Path("BRA.sto").read_bytes())
    Path("sub").mkdir()
    Path("link.csv").symlink_to("q.csv")
    for suffix in ("rrd", "svg", "json", "html"):
        Path(f"m.{suffix}").write_text(ENTERS)
    before = {path: path.read_bytes() for path in tmp_path.iterdir() if path.is_file()}
    name, *arguments = command.format(elbow=ELBOW).split()
    ran = run_here(name, capsys, *arguments)
    assert ran.code == 2
    assert re.fullmatch(f"mjwrap {name}: {option} '.*': that file is also read", said(ran)[-1])
    assert {path: path.read_bytes() for path in tmp_path.iterdir() if path.is_file()} == before


@pytest.mark.parametrize(
    ("command", "told"),
    [("check", "no check failed"), ("compare", "no simulation: the model has no joint")],
)
def test_a_model_without_joints_has_nothing_to_sweep(
    command: str, told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = tmp_path / "m.xml"
    model.write_text(re.sub("<joint[^>]*/>", "", ENTERS))
    ran = run_here(command, capsys, model)
    assert (ran.code, said(ran)) == (0, [])
    assert told in ran.out


def test_a_motion_that_blows_up_is_told_and_leaves_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = tmp_path / "m.xml"
    text = CART.format(h=0.01, integrator="Euler")
    model.write_text(text.replace('name="cart"', 'name="cart" stiffness="1e9"'))
    ran = simulate(
        capsys, model, "--qpos", "cart=1", "--csv", tmp_path / "c.csv", "--plot", tmp_path / "p.png"
    )
    assert ran.code == 1
    assert "unstable" in said(ran)[-1]
    only_files(tmp_path, "m.xml")


def test_a_path_that_is_not_found_is_counted_or_stops_a_strict_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The insertion swings into the ball and out again; where it starts inside there is nothing to hold."""
    model = tmp_path / "m.xml"
    model.write_text(ENTERS)
    options = [model, "--duration", 0.01, "--csv", tmp_path / "c.csv"]
    swing = ["--prescribe", "slide=sine:-0.09,50"]
    ran = simulate(capsys, *options, *swing, "--strict")
    assert ran.code == 1
    assert re.match("mjwrap run: .*'stuck'.*site 'b' is inside geom 'ball'", said(ran)[-1])
    only_files(tmp_path, "m.xml")
    ran = simulate(capsys, *options, "--qpos", "slide=-0.09")
    assert ran.code == 2
    assert re.match(
        "mjwrap run: muscle 'stuck' has no path at the start.*site 'b' is inside geom 'ball'", said(ran)[-1]
    )
    only_files(tmp_path, "m.xml")
    ran = simulate(capsys, *options, *swing)
    assert (ran.code, said(ran)) == (0, [])
    assert "stuck: 4 steps without a path" in ran.out
    assert "site 'b' is inside geom 'ball'" in ran.out
    only_files(tmp_path, "m.xml", "c.csv")


def test_a_full_disk_is_told_and_leaves_nothing(tmp_path: Path) -> None:
    """A limit on file size stands for the full disk: the write fails in the same way, in the middle of the run."""

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))

    outputs = ["--csv", tmp_path / "c.csv", "--sample", 0.001]
    ran = finish(start("run", ELBOW, "--duration", 5, *outputs, preexec_fn=limit))
    assert ran.code == 1
    (line,) = said(ran)
    assert "c.csv" in line
    assert "too large" in line
    only_files(tmp_path)
