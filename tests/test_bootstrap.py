"""bootstrap.py: what it says when it cannot work, and when it uses an environment again."""

import importlib.util
import subprocess
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture
def bootstrap(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """The script as a module, at work in an empty folder with a project file."""
    spec = importlib.util.spec_from_file_location("bootstrap", ROOT / "bootstrap.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    (tmp_path / "pyproject.toml").write_text("[project]\n")
    monkeypatch.setattr(module, "ROOT", tmp_path)
    return module


class Commands:
    """Stands in for `subprocess.run`: keeps the commands, answers with an exit code, makes environments."""

    def __init__(self, failing: str = "", code: int = 0) -> None:
        self.ran: list[list[str]] = []
        self.failing, self.code = failing, code

    def __call__(self, command: list[str], **_: object) -> subprocess.CompletedProcess[str]:
        self.ran.append(command)
        if command[1:3] == ["-m", "venv"]:
            python = Path(command[-1]) / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")
            python.parent.mkdir(parents=True, exist_ok=True)
            python.touch()
        fails = self.failing and self.failing in command
        return subprocess.CompletedProcess(command, self.code if fails else 0)

    def count(self, word: str) -> int:
        return sum(word in command for command in self.ran)


def test_an_old_python_is_told_which_one_is_needed(
    bootstrap: ModuleType, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(bootstrap.sys, "version_info", (3, 9, 2))
    assert bootstrap.main(["demo"]) == 1
    assert "needs Python 3.11 or newer, this is 3.9" in capsys.readouterr().err


def test_a_python_without_venv_is_told_how_to_get_it(
    bootstrap: ModuleType, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "ensurepip", None)
    assert bootstrap.main(["test"]) == 1
    assert "apt install python3-venv" in capsys.readouterr().err


def test_somebody_elses_environment_is_left_alone(
    bootstrap: ModuleType, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    commands = Commands()
    monkeypatch.setattr(bootstrap.subprocess, "run", commands)
    mine = bootstrap.ROOT / ".venv" / "mine"
    mine.parent.mkdir()
    mine.touch()
    assert bootstrap.main(["test"]) == 1
    assert "did not make it" in capsys.readouterr().err
    assert mine.exists()
    assert commands.ran == []


def test_a_failed_installation_keeps_pips_code_and_is_made_anew(
    bootstrap: ModuleType, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    commands = Commands(failing="pip", code=23)
    monkeypatch.setattr(bootstrap.subprocess, "run", commands)
    assert bootstrap.main(["test"]) == 23
    assert "network" in capsys.readouterr().err
    assert commands.count("pytest") == 0
    commands.failing = ""
    assert bootstrap.main(["test"]) == 0
    assert (commands.count("venv"), commands.count("pip"), commands.count("pytest")) == (2, 2, 1)


def test_an_environment_is_used_again_until_the_project_file_changes(
    bootstrap: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    commands = Commands()
    monkeypatch.setattr(bootstrap.subprocess, "run", commands)
    assert bootstrap.main(["test", "-k", "word"]) == 0
    assert bootstrap.main(["test"]) == 0
    assert (commands.count("venv"), commands.count("pip"), commands.count("pytest")) == (1, 1, 2)
    assert commands.ran[2][-2:] == ["-k", "word"]

    (bootstrap.ROOT / "pyproject.toml").write_text("[project]\nversion = '2'\n")
    assert bootstrap.main(["test"]) == 0
    assert (commands.count("venv"), commands.count("pip")) == (1, 2)


def test_mujoco_3_and_4_have_environments_of_their_own(
    bootstrap: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    commands = Commands()
    monkeypatch.setattr(bootstrap.subprocess, "run", commands)
    assert bootstrap.main(["test"]) == 0
    assert bootstrap.main(["test", "--mujoco", "4"]) == 0
    pins = [command[-1] for command in commands.ran if "pip" in command]
    assert pins == ["mujoco<4", "mujoco>=4"]
    assert (bootstrap.ROOT / ".venv" / bootstrap.STAMP).exists()
    assert (bootstrap.ROOT / ".venv-mujoco4" / bootstrap.STAMP).exists()


def test_the_code_of_the_tests_passes_through(bootstrap: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bootstrap.subprocess, "run", Commands(failing="pytest", code=5))
    assert bootstrap.main(["test"]) == 5


def test_a_demo_that_leaves_nothing_is_an_error(
    bootstrap: ModuleType, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(bootstrap.subprocess, "run", Commands())
    assert bootstrap.main(["demo"]) == 1
    assert "did not leave out/elbow.rrd and out/elbow.png" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "screen", "shown"), [([], True, 1), (["--no-view"], True, 0), ([], False, 0)]
)
def test_a_demo_is_played_where_there_is_a_screen(
    bootstrap: ModuleType, monkeypatch: pytest.MonkeyPatch, options: list[str], screen: bool, shown: int
) -> None:
    commands = Commands()
    monkeypatch.setattr(bootstrap.subprocess, "run", commands)
    monkeypatch.setattr(bootstrap, "has_screen", lambda: screen)
    (bootstrap.ROOT / "out").mkdir()
    for name in ("elbow.rrd", "elbow.png"):
        (bootstrap.ROOT / "out" / name).touch()
    assert bootstrap.main(["demo", *options]) == 0
    assert commands.count("replay") == shown


def test_there_is_no_screen_without_a_person_at_a_terminal(
    bootstrap: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.delenv("CI", raising=False)
    for person in (True, False):
        monkeypatch.setattr(bootstrap.sys, "stdin", SimpleNamespace(isatty=lambda person=person: person))
        assert bootstrap.has_screen() is person
    monkeypatch.setenv("CI", "true")
    monkeypatch.setattr(bootstrap.sys, "stdin", SimpleNamespace(isatty=lambda: True))
    assert not bootstrap.has_screen()
