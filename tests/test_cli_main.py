"""The command `mjwrap`: help, exit codes, what is loaded, and the commands that have no test file of their own."""

import json
import re
import shlex
import subprocess
import sys
from pathlib import Path

import mujoco
import pytest
from cli_runs import CASE2, ELBOW, ENTERS, ROOT, Ran, environment, finish, run_here, said, start

from mjwrap.cli import main
from mjwrap.cli.main import COMMANDS
from mjwrap.kernels.compilation import cache_folders


def test_help_names_every_command_and_its_examples(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--help"]) == 0
    overview = capsys.readouterr().out
    for name in COMMANDS:
        assert f"\n  {name} " in overview
        ran = run_here(name, capsys, "--help")
        assert (ran.code, ran.err) == (0, "")
        assert f"Examples:\n  mjwrap {name}" in ran.out
        assert max(map(len, ran.out.splitlines())) <= 120


def examples(capsys: pytest.CaptureFixture[str]) -> list[list[str]]:
    """Return the examples of all help texts that need no other package, display or file of the user's."""
    found = []
    for name in COMMANDS:
        lines = run_here(name, capsys, "--help").out.splitlines()
        found += [shlex.split(line)[1:] for line in lines if line.startswith(f"  mjwrap {name}")]
    other = re.compile(r"myo_sim:|arm\.xml|arm26|gait10|--serve|replay elbow\.rrd$")
    return [words for words in found if not other.search(" ".join(words))]


def test_the_examples_of_the_help_texts_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """One after the other in a folder that has the models, so that one may use what another one left."""
    pytest.importorskip("PIL", reason="GIFs need Pillow")
    (tmp_path / "models").symlink_to(ROOT / "models")
    monkeypatch.chdir(tmp_path)
    given = examples(capsys)
    assert {words[0] for words in given} == set(COMMANDS)
    for words in given:
        ran = run_here(words[0], capsys, *words[1:])
        assert ran.code == 0 or "OpenGL" in ran.err, (words, ran.err)


def test_help_fits_a_narrow_terminal(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", "60")
    for name in COMMANDS:
        lines = run_here(name, capsys, "--help").out.splitlines()
        assert lines[0].startswith(f"usage: mjwrap {name} ")
        text = [line for line in lines if not line.startswith("  ")]
        assert max(map(len, text)) <= 60, text


def test_a_wrong_command_is_told_in_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate"]) == 2
    assert capsys.readouterr().err.startswith(
        "mjwrap: no command 'simulate'; commands: import, run, plot, compare, inspect"
    )
    assert main(["--frob"]) == 2
    assert "no option '--frob'" in capsys.readouterr().err
    assert main([]) == 2
    assert "usage: mjwrap COMMAND" in capsys.readouterr().out
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == "mjwrap 0.1.0\n"
    assert run_here("check", capsys).code == 2


@pytest.mark.parametrize(
    ("script", "command"),
    [
        ("simulate", "run"),
        ("compare_tendon", "compare"),
        ("replay", "replay"),
        ("inspect_muscles", "inspect"),
    ],
)
def test_the_scripts_are_the_commands(script: str, command: str) -> None:
    done = subprocess.run(
        [sys.executable, str(ROOT / "scripts" / f"{script}.py"), "nowhere.xml", "--frob"],
        capture_output=True, text=True, check=False, env=environment(),
    )  # fmt: skip
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith(f"mjwrap {command}: unrecognized arguments: --frob")


def test_help_loads_neither_mujoco_nor_what_draws() -> None:
    code = (
        "import sys; from mjwrap.cli import main; main(['--help']); "
        "print(sorted({'mujoco', 'numba', 'numpy', 'rerun', 'matplotlib', 'tqdm'} & set(sys.modules)))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, env=environment(), check=True
    )
    assert done.stdout.splitlines()[-1] == "[]"


def inspect(capsys: pytest.CaptureFixture[str], *arguments: object) -> Ran:
    return run_here("inspect", capsys, *arguments)


def test_inspect_says_what_is_declared(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    ran = inspect(capsys, ELBOW, "--quick")
    assert (ran.code, said(ran)) == (0, [])
    (line,) = (line for line in ran.out.splitlines() if line.startswith("BRA "))
    assert line.split()[:6] == ["BRA", "degroote_fregly_2016", "987.3", "85.8", "53.5", "rigid"]
    assert "BRA_origin > flexor_cylinder (cylinder, side flexor_side) > BRA_insertion" in line
    values = json.loads(inspect(capsys, ELBOW, "--quick", "--json").out)
    assert [muscle["name"] for muscle in values["muscles"]] == list(mujoco_names(ELBOW))
    (muscle,) = (m for m in values["muscles"] if m["name"] == "BRA")
    assert muscle["parameters"]["max_isometric_force"] == 987.26
    (route,) = muscle["routes"]
    assert route["stops"][0]["surface"] == "Cylinder"
    assert (
        inspect(capsys, "--quick", "--json", ELBOW).out
        == inspect(capsys, ELBOW, "--quick", "--json", "-").out
    )
    wrong = inspect(capsys, ELBOW, "--json", tmp_path / "j.txt")
    assert (wrong.code, "must end in .json" in wrong.err) == (2, True)


def mujoco_names(path: str) -> list[str]:
    model = mujoco.MjModel.from_xml_path(path)
    return [model.actuator(i).name for i in range(model.nu)]


def test_inspect_says_mistakes_before_anything_else(capsys: pytest.CaptureFixture[str]) -> None:
    ran = inspect(capsys, ELBOW, "--range", "knee=0,1")
    assert (ran.code, ran.out) == (2, "")
    assert said(ran) == [
        "mjwrap inspect: there is no joint 'knee' for which a range is given; joints: elbow_flexion"
    ]


def test_files_are_written_where_nobody_reads_standard_output(tmp_path: Path) -> None:
    codes = []
    for options in (["--csv", tmp_path / "c.csv", "--json", tmp_path / "j.json"], []):
        with start("run", ELBOW, "--duration", 0.01, *options) as process:
            assert process.stdout is not None
            assert process.stderr is not None
            process.stdout.close()
            assert "Traceback" not in process.stderr.read()
        codes.append(process.returncode)
    assert codes == [0, 1]
    assert json.loads((tmp_path / "j.json").read_text())["files"] == {"csv": str(tmp_path / "c.csv")}


def test_inspect_says_what_stays_native_and_why(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    path = tmp_path / "m.xml"
    muscle = '<muscle name="joint" joint="cylinder_y" lengthrange="0 1"/>'
    path.write_text(Path(CASE2).read_text().replace("</actuator>", f"{muscle}</actuator>"))
    ran = inspect(capsys, path, "--quick")
    assert "1 muscle with geodesic paths, 1 with MuJoCo's own paths" in ran.out
    assert "joint: stays with MuJoCo: " in ran.out
    assert list(json.loads(inspect(capsys, path, "--quick", "--json").out)["native"]) == ["joint"]


def test_check_passes_or_fails_by_its_exit_code(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    few = ["--poses", 2, "--samples", 11]
    ran = run_here("check", capsys, ELBOW, *few)
    assert (ran.code, said(ran)) == (0, [])
    assert ran.out.splitlines()[-1] == "no check failed"
    path = tmp_path / "m.xml"
    path.write_text(ENTERS)
    ran = run_here("check", capsys, path, *few, "--json", tmp_path / "c.json")
    assert ran.code == 1
    assert "FAIL  the model allows a path at every pose" in ran.out
    assert "is inside geom 'ball'" in ran.out
    values = json.loads((tmp_path / "c.json").read_text())
    assert [c["name"] for c in values["checks"] if c["verdict"] == "fail"] == ["model"]
    assert values["passed"] is False
    empty = tmp_path / "empty.xml"
    empty.write_text("<mujoco/>")
    ran = run_here("check", capsys, empty)
    assert (ran.code, said(ran)) == (
        2,
        ["mjwrap check: the model has no muscles with geodesic paths: nothing to check"],
    )


def test_warmup_leaves_nothing_to_compile(capsys: pytest.CaptureFixture[str]) -> None:
    first = json.loads(run_here("warmup", capsys, "--json").out)
    assert Path(first["folder"]) == cache_folders.base()
    again = json.loads(finish(start("warmup", ELBOW, "--json")).out)
    assert (again["compiled"], again["folder"]) == (0, first["folder"])
    names = [part["part"] for part in again["parts"]]
    assert sorted(names) == sorted(
        ["first step", "paths", "muscles", "plugin", "recording", "surfaces", ELBOW]
    )
    done = finish(start("run", ELBOW, "--duration", "0.01", "--mode", "wrench"))
    assert (done.code, done.err) == (0, "")


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["run", ELBOW, "--exitation", "pulses"], r"arguments: --exitation pulses \(did you mean '--excitation'"),
        (["inspect", ELBOW, "--muscle=BRA"], r"--muscle=BRA; plot and init have --muscle, not mjwrap inspect \(see"),
        (["run", ELBOW, "--tendons"], r"compare and check have --tendons, not mjwrap run"),
        (["check", ELBOW, "--frob"], r"unrecognized arguments: --frob \(see mjwrap check --help\)"),
        (["inspect", ELBOW, "extra"], r"unrecognized arguments: extra \(see"),
        (["inpsect", ELBOW], r"no command 'inpsect' \(did you mean 'inspect'\?\); commands: import"),
    ],
)  # fmt: skip
def test_an_unknown_option_is_answered_with_what_was_meant(
    arguments: list[str], told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    try:
        code: object = main(arguments)
    except SystemExit as stopped:
        code = stopped.code
    assert code == 2
    assert re.search(told, capsys.readouterr().err)
