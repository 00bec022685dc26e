"""Every command line of README.md, CONTRIBUTING.md, docs/ and the help texts is one that its program takes.

Each is read by the program's own parser, and the models, scripts, tests and extras that it names exist. Files that a
reader brings are listed here; any other has to be made by an earlier line of its page. What of `mjwrap` takes seconds
really runs, with options behind it that make it shorter.
"""

import argparse
import importlib
import importlib.util
import os
import re
import runpy
import shlex
import sys
import tomllib
from pathlib import Path
from typing import Any

import doc_commands
import mujoco
import pytest
from cli_runs import run_here
from doc_commands import PAGES, ROOT, Line

import bootstrap
import mjwrap as mw
from mjwrap.cli.common import console
from mjwrap.cli.main import COMMANDS, module_of
from mjwrap.mjcf.named_models import own_models, own_osim_models
from mjwrap.video import offscreen

LINES = [
    *doc_commands.of_help(),
    *(x for page in PAGES for x in doc_commands.of_page(page.name, page.read_text())),
]
# What a reader brings, in examples about files of another program or of an earlier run.
BROUGHT = {
    "arm.xml",
    "arm.osim",
    "arm26.osim",
    "gait10dof18musc.osim",
    "arm26_opensim.json",
    "motion.mot",
    "ik.mot",
    "states.npz",
    "lengths.sto",
    "arms.sto",
    "arms.csv",
    "controls.sto",
}
OPENSIM = re.compile(r"arm_MuscleAnalysis_\w+\.sto")
CHECKERS = {"mkdocs", "ruff", "pyright", "lint-imports"}
SHORTER = {
    "run": ["--duration", "0.02"],
    "compare": ["--samples", "3", "--bases", "0", "--duration", "0.02"],
    "check": ["--poses", "1", "--samples", "3"],
    "inspect": ["--quick"],
    "plot": ["--samples", "5"],
    "init": [],
}


class Read(Exception):
    """A script has read its arguments."""


def refusal(line: Line, made: set[str]) -> str | None:
    """Return what is wrong with a command line, or None; what it makes is added to `made`."""
    words = shlex.split(line.text)
    if re.fullmatch(r"[A-Z_]+=\w+", words[0]):  # a variable of the environment, for this command alone
        words = words[1:]
    program, rest = Path(words[0]).name, words[1:]
    if program == "python" and rest[:2] == ["-m", "mjwrap"]:
        program, rest = "mjwrap", rest[2:]
    if program == "mjwrap":
        return _mjwrap(rest, line, made)
    if program in ("python", "python3"):
        if rest == ["bootstrap.py", "demo"]:
            made.update({bootstrap.DEMO_RECORDING, bootstrap.DEMO_PLOT})
        return _python(rest)
    if program == "pytest":
        return _pytest(rest)
    if program == "pip":
        known = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
        extras = {x for word in rest for found in re.findall(r"\[(.*?)\]", word) for x in found.split(",")}
        return f"no extra {extras - set(known)}" if extras - set(known) else None
    others = program in CHECKERS or words == [".", ".venv/bin/activate"]
    return None if others else f"what is '{words[0]}'?"


def _mjwrap(words: list[str], line: Line, made: set[str]) -> str | None:
    if words == [] or words[0] in ("COMMAND", "--help", "--version"):
        return None
    if words[0] not in COMMANDS:
        return f"no command {words[0]}"
    if len(words) == 1 or (not line.typed and words[1].startswith("--")):
        # the name of a command, or of one of its options, in a sentence
        return None if words[1:] == [] or words[1] in _options(words[0]) else f"no option {words[1]}"
    try:
        options = _parser(words[0]).parse_args(words[1:])
    except SystemExit:
        return "the parser refuses it"
    named = [getattr(options, name, None) for name in ("model", "file", "states", "lengths")]
    given = [name for each in named for name in (each if isinstance(each, list) else [each])]
    given += [entry.rpartition("=")[2] for entry in getattr(options, "data", None) or []]
    given += [arm.partition("=")[2] for arm in getattr(options, "moment_arms", [])]
    given += [x for x in getattr(options, "excitation", []) if Path(x).suffix in mw.files.SUFFIXES]
    wrong = [name for name in given if name and not _exists(name, line, made)]
    made.update(filter(None, (getattr(options, x, None) for x in ("record", "out", "csv", "video", "plot"))))
    if getattr(options, "analysis", None):
        made.add(f"{options.analysis}_MuscleAnalysis")  # and what follows it
    return f"no {wrong}" if wrong else None


def _parser(name: str) -> argparse.ArgumentParser:
    parser = console.Parser(f"mjwrap {name}", "")
    module_of(name).add_arguments(parser)
    return parser


def _options(name: str) -> set[str]:
    return {text for action in _parser(name)._actions for text in action.option_strings}


def _exists(name: str, line: Line, made: set[str]) -> bool:
    if name.startswith("myo_sim:"):
        if importlib.util.find_spec("myo_sim") is None:
            return True  # not to be known here
        import myo_sim

        return name.removeprefix("myo_sim:") in {*myo_sim.REGISTRY, *myo_sim._composed_models()}
    if name.startswith("mjwrap:"):
        known = {*own_models(), *own_osim_models()}
        return name.removeprefix("mjwrap:") in known or (not line.typed and name == "mjwrap:NAME")
    if not line.typed and name in ("MODEL", "MODEL.osim", "FILE"):
        return True
    brought = name in BROUGHT or bool(OPENSIM.fullmatch(name))
    # a recording may be made by the page's Python, and in a help text by another command
    python = Path(ROOT / "docs" / line.where)
    shown = python.is_file() and f'"{name}"' in python.read_text()
    analysed = re.sub(r"(_MuscleAnalysis)_\w+\.sto$", r"\1", name) in made
    return brought or shown or analysed or name in made or (ROOT / name).is_file()


def _python(words: list[str]) -> str | None:
    if words == ["-m", "build"]:  # installed by the line before
        return None
    if words[0] == "-m":
        return None if importlib.util.find_spec(words[1]) else f"no module {words[1]}"
    if words[0] == "-c":
        return None
    script = ROOT / words[0]
    if not script.is_file():
        return f"no file {words[0]}"
    code = script.read_text()
    if "parse_args(" not in code and "parse_known_args(" not in code and "argparse" not in code:
        return "it takes no arguments" if words[1:] else None
    return _script(script, words[1:])


def _script(script: Path, words: list[str]) -> str | None:
    """Run a script as far as its arguments."""
    path, argv, known = sys.path[:], sys.argv, argparse.ArgumentParser.parse_known_args

    reading = False

    def stop(self: argparse.ArgumentParser, args: Any = None, namespace: Any = None) -> Any:
        nonlocal reading
        if reading:  # a command's own parser, within the first one
            return known(self, args, namespace)
        reading = True
        _, more = known(self, args, namespace)
        if more and script.name != "bootstrap.py":  # which hands them to pytest
            self.error(f"unrecognized {more}")
        raise Read

    try:
        sys.path.insert(0, str(script.parent))
        sys.argv = [str(script), *words]
        argparse.ArgumentParser.parse_known_args = stop  # pyright: ignore[reportAttributeAccessIssue]
        runpy.run_path(str(script), run_name="__main__")
    except Read:
        return None
    except ModuleNotFoundError as error:
        if error.name != "opensim":
            raise
        return None  # a script beside OpenSim, which is optional: not to be known here
    except SystemExit as code:
        return f"it ends with {code.code} on its arguments"
    finally:
        argparse.ArgumentParser.parse_known_args, sys.argv, sys.path[:] = known, argv, path
    return "it reads no arguments"


def _pytest(words: list[str]) -> str | None:
    files = [ROOT / word for word in words if word.startswith("tests/")]
    missing = [file.name for file in files if not file.is_file()]
    if missing or not files:
        return f"no {missing or 'test file'}"
    if "-k" in words:
        names = " ".join(re.findall(r"def (test_\w+)", " ".join(file.read_text() for file in files)))
        if words[words.index("-k") + 1] not in names:
            return f"no test {words[words.index('-k') + 1]}"
    return None


def refusals(lines: list[Line], monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return the wrong ones among command lines, each with what is wrong."""
    monkeypatch.chdir(ROOT)
    made: dict[str, set[str]] = {}  # by page; the help texts are one
    found = [(line, refusal(line, made.setdefault(line.where.split()[0], set()))) for line in lines]
    return [f"{line.where}: {line.text}: {why}" for line, why in found if why]


def test_every_command_line_is_one_that_its_program_takes(monkeypatch: pytest.MonkeyPatch) -> None:
    assert len(LINES) > 100
    assert refusals(LINES, monkeypatch) == []


@pytest.mark.parametrize(
    "text",
    [
        "mjwrap run models/elbow/elbow.xml --durations 2",
        "mjwrap run models/elbow/no.xml",
        "mjwrap replay out/no.rrd",
        "mjwrap simulate models/elbow/elbow.xml",
        "python benchmarks/robustness/energy.py --frob",
        "python benchmarks/no.py",
        "python docs/_figures/surfaces.py --frob",
        "pytest tests/test_paths.py -k frob",
        "pytest tests/test_no.py",
        "pip install '.[frob]'",
        "frob models/elbow/elbow.xml",
    ],
)
def test_a_wrong_command_line_is_noticed(text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    page = f"```sh\n{text}\n```\n"
    assert len(refusals(list(doc_commands.of_page("page.md", page)), monkeypatch)) == 1


def cheap(line: Line) -> bool:
    """Whether a line is a run of `mjwrap` on a model of this repository, with no window and no other run before it."""
    words = shlex.split(line.text)
    if words[0] != "mjwrap" or words[1:2] == [] or words[1] not in SHORTER or "models/" not in line.text:
        return False
    if {"--connect", "--serve"} & set(words):  # a viewer listens to it
        return False
    if "--in-place" in words or "out/" in " ".join(
        _given(words)
    ):  # it changes the model; another line made its table
        return False
    driven = words[words.index("--excitation") + 1] if "--excitation" in words else ""
    if Path(driven).suffix in mw.files.SUFFIXES:  # a table that another run made
        return False
    return not BROUGHT & set(words) and (line.typed or "models/" in words[2])


def _given(words: list[str]) -> list[str]:
    """Return the words of a command line that are no names of outputs."""
    outputs = {"-o", "--out", "--csv", "--plot", "--record", "--video", "--json", "--report", "--analysis"}
    return [word for before, word in zip(["", *words], words, strict=False) if before not in outputs]


RUN = sorted({line.text for line in LINES if cheap(line)})


@pytest.mark.parametrize("text", RUN)
def test_a_command_line_runs(
    text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "out").mkdir()
    os.symlink(ROOT / "models", tmp_path / "models")
    words = shlex.split(text)[1:]
    if "myo_sim:" in text:
        pytest.importorskip("myo_sim", reason="the model of the line is in myo-sim")
    if "--video" in words:
        pytest.importorskip("PIL", reason="GIFs need Pillow")
        if ".mp4" in text:
            pytest.importorskip("av", reason="MP4s need PyAV")
        try:
            offscreen.Offscreen(mujoco.MjModel.from_xml_string("<mujoco/>"), 8, 8).close()
        except mw.RecordingError as error:
            pytest.skip(str(error))
    still = ["--duration", "0"] if "--duration 0 " in f"{text} " else []  # a line that simulates nothing
    ran = run_here(words[0], capsys, *words[1:], *SHORTER[words[0]], *still)
    assert ran.code == 0, ran.err
