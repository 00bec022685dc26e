"""A command that needs a library that is not installed names the option and the extra, before the run."""

import sys
import tomllib
from pathlib import Path

import pytest
from cli_runs import ELBOW, ROOT, only_files, run_here, said

EXTRAS = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]


@pytest.mark.parametrize(
    ("command", "option", "name", "library", "extra", "package"),
    [
        ("run", "--plot", "p.png", "matplotlib", "demo", "matplotlib"),
        ("compare", "--plot", "p.png", "matplotlib", "demo", "matplotlib"),
        ("compare", "--report", "r.html", "matplotlib", "demo", "matplotlib"),
        ("run", "--video", "f.mp4", "av", "video", "av"),
        ("run", "--video", "f.gif", "PIL.Image", "video", "pillow"),
    ],
)
def test_the_right_extra_is_named(
    command: str, option: str, name: str, library: str, extra: str, package: str, tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.setitem(sys.modules, library, None)
    ran = run_here(command, capsys, ELBOW, option, tmp_path / name)
    assert ran.code == 2
    (line,) = said(ran)
    assert f"pip install 'mjwrap[{extra}]', or pip install {package}" in line
    assert any(entry.startswith(package) for entry in EXTRAS[extra])
    assert option in line or Path(name).suffix in line
    only_files(tmp_path)
