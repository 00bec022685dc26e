"""The pages for users of another program: their command lines run in order, as a reader types them, in one folder.

A later line may read what an earlier one wrote, so nothing is made shorter but films and the reports on many poses. The
code that needs MyoSuite is run where MyoSuite is installed; test_docs.py runs the rest.
"""

import importlib.util
import os
import shlex
import warnings
from itertools import pairwise
from pathlib import Path
from typing import Any

import mujoco
import pytest
from cli_runs import run_here
from doc_commands import FENCE, ROOT, of_page

import mjwrap as mw
from mjwrap.video import offscreen

PAGES = ["from_opensim.md", "opensim.md", "from_myosuite.md", "cables.md"]
LESS = {"compare": ["--samples", "5", "--bases", "0", "--duration", "0"], "check": ["--poses", "2"]}


def lines(page: str) -> list[str]:
    """Return the command lines of a page that its readers type, in order."""
    return [line.text for line in of_page(page, (ROOT / "docs" / page).read_text()) if line.typed]


def films() -> bool:
    """Return whether films can be made here."""
    if importlib.util.find_spec("PIL") is None:
        return False
    try:
        offscreen.Offscreen(mujoco.MjModel.from_xml_string("<mujoco/>"), 8, 8).close()
    except mw.RecordingError:
        return False
    return True


@pytest.mark.parametrize("page", PAGES)
def test_the_commands_of_a_page_run_one_after_another(
    page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    if any("myo_sim:" in text for text in lines(page)):
        pytest.importorskip("myo_sim", reason="the models of the page are in myo-sim")
    monkeypatch.chdir(tmp_path)
    os.symlink(ROOT / "models", tmp_path / "models")
    ran = 0
    for text in lines(page):
        program, *words = shlex.split(text)
        if program != "mjwrap" or (words[0] == "replay" and words[1].endswith(".rrd")):  # it opens a viewer
            continue
        if "--video" in words and not films():
            continue
        shorter = ["--duration", "0.1"] if "--video" in words else LESS.get(words[0], [])
        with warnings.catch_warnings():
            warnings.filterwarnings(
                "ignore", message=".*empty prefix"
            )  # from how myo_sim composes its models
            result = run_here(words[0], capsys, *words[1:], *shorter)
        assert result.code == 0, (text, result.err)
        outputs = [b for a, b in pairwise(words) if a in ("-o", "--plot", "--record", "--report")]
        assert all(Path(name).stat().st_size > 1000 for name in outputs), text
        ran += 1
    assert ran >= 3


def test_the_code_for_myosuite_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("myosuite", reason="the code is about MyoSuite's environments")
    monkeypatch.chdir(tmp_path)
    text = (ROOT / "docs" / "from_myosuite.md").read_text()
    mark = "<!-- no-test: needs MyoSuite"
    code = [
        fence["body"]
        for fence in FENCE.finditer(text)
        if fence["language"] == "python"
        and text[: fence.start()].rstrip().rpartition("\n")[2].startswith(mark)
    ]
    assert len(code) == 2
    names: dict[str, Any] = {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # MyoSuite's own
        for body in code:
            exec(body, names)
            bare = names["env"].unwrapped
            assert bare.data.time > 0.0
            muscles = mw.plugin.read(bare.data)
            assert len(muscles.names) == bare.model.nu
            assert sum(muscles.failures) == 0
