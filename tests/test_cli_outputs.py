"""Each output of a command stands alone, and names are text in all of them."""

from __future__ import annotations

import json
from pathlib import Path

import mujoco
import numpy as np
import pytest

import mjwrap as mw
from mjwrap.cli.common.errors import RunError
from mjwrap.cli.common.outputs import Outputs
from mjwrap.cli.main import main

# Names that mean something to matplotlib, TeX, HTML, CSV, file systems or format strings.
NAMES = [
    "$el_{$",
    "$x$",
    "a$b",
    "_hidden",
    "<b>&amp;",
    "{0}",
    "%s",
    "50 %",
    "a,b",
    '"quoted"',
    "../up",
    "ü°",
    "\\frac",
]
MODEL = """
<mujoco>
  <compiler angle="radian"/>
  <worldbody>
    <geom name="{geom}" type="sphere" size=".03" contype="0" conaffinity="0"/>
    <site name="{origin}" pos="-.1 0 .05"/>
    <body name="{body}">
      <joint name="{joint}" type="hinge" axis="0 1 0" range="-.5 .5" limited="true" damping=".1"/>
      <geom size=".01" pos=".2 0 0" mass="1" contype="0" conaffinity="0"/>
      <site name="{insertion}" pos=".15 0 .02"/>
    </body>
  </worldbody>
  <tendon>
    <spatial name="{tendon}"><site site="{origin}"/><geom geom="{geom}"/><site site="{insertion}"/></spatial>
  </tendon>
  <actuator><muscle name="{muscle}" tendon="{tendon}" lengthrange=".2 .4"/></actuator>
</mujoco>
"""


def named(name: str, folder: Path) -> Path:
    """Return a model all of whose elements have the name."""
    from xml.sax.saxutils import escape

    safe = escape(name, {'"': "&quot;"})
    kinds = ("geom", "origin", "body", "joint", "insertion", "tendon", "muscle")
    path = folder / "model.xml"
    text = MODEL.format(**{kind: safe + (kind if kind in ("origin", "insertion") else "") for kind in kinds})
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("name", NAMES)
def test_names_are_text_in_every_output(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = named(name, tmp_path)
    out = {kind: tmp_path / f"out.{kind}" for kind in ("png", "csv", "npz", "rrd", "json", "html")}
    code = main(["run", str(model), "--duration", "0.02", "--plot", str(out["png"]), "--csv", str(out["csv"]), "--out",
                 str(out["npz"]), "--record", str(out["rrd"]), "--json", str(out["json"]), "--analysis",
                 str(tmp_path / "a")])  # fmt: skip
    assert (code, capsys.readouterr().err) == (0, "")
    assert all(out[kind].stat().st_size for kind in ("png", "csv", "npz", "rrd", "json"))
    assert json.loads(out["json"].read_text(encoding="utf-8"))["muscles"] == [name]
    for table in (out["csv"], out["npz"]):
        assert f"qpos:{name}" in mw.read_table(table).names or name in "".join(mw.read_table(table).names)
    code = main(["compare", str(model), "--samples", "5", "--duration", "0.01", "--plot", str(out["png"]), "--report",
                 str(out["html"])])  # fmt: skip
    assert (code, capsys.readouterr().err) == (0, "")
    assert "&lt;b&gt;" in out["html"].read_text(encoding="utf-8") or name != "<b>&amp;"


# ----------------------------------------------------------------------------------- one fails, the others do not


FAILURES = {
    "plot": "mjwrap.cli.run.plot.plot_run",
    "table": "mjwrap.runs.run_table.RunTableFile.close",
    "recording": "mjwrap.recording.Recorder.log",
    "analysis": "mjwrap.runs.muscle_analysis_tables.MuscleAnalysisTables.log",
}


ERRORS = OSError(28, "No space left on device"), mw.RecordingError("it is gone"), ZeroDivisionError("odd")


@pytest.mark.parametrize("broken", FAILURES)
@pytest.mark.parametrize("error", ERRORS, ids=lambda error: type(error).__name__)
def test_an_output_that_fails_leaves_the_others(
    broken: str,
    error: Exception,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise error

    monkeypatch.setattr(FAILURES[broken], fail)
    model = named("arm", tmp_path)
    files = {"plot": "p.png", "table": "t.npz", "recording": "r.rrd", "analysis": "a"}
    places = {kind: tmp_path / file for kind, file in files.items()}
    report = tmp_path / "report.json"
    code = main(["run", str(model), "--duration", "0.02", "--plot", str(places["plot"]), "--out", str(places["table"]),
                 "--record", str(places["recording"]), "--analysis", str(places["analysis"]), "--json",
                 str(report)])  # fmt: skip
    said = capsys.readouterr()
    assert code == 1
    assert f"mjwrap run: {broken}: " in said.err
    assert str(error).split("] ")[-1] in said.err
    assert ("Traceback" in said.err) == isinstance(error, ZeroDivisionError)
    facts = json.loads(report.read_text())
    assert set(facts["failed"]) == {broken}
    assert set(facts["files"]) == set(places) - {broken}
    for name in set(places) - {broken, "analysis"}:
        assert places[name].stat().st_size
    assert list(tmp_path.glob("a_MuscleAnalysis*")) != [] or broken == "analysis"
    assert not list(tmp_path.glob(".*.part*"))


def test_a_command_ends_when_nothing_takes_samples_any_more(capsys: pytest.CaptureFixture[str]) -> None:
    def fail(_: object) -> None:
        raise mw.RecordingError("full")

    taken: list[object] = []
    outputs = Outputs("run")
    outputs.add("one", fail)
    outputs.add("two", lambda state: taken.append(state) if not taken else fail(state))
    outputs.log(1)
    assert capsys.readouterr().err == "mjwrap run: one: full\n"
    with pytest.raises(RunError, match="full"):
        outputs.log(2)
    assert outputs.failed == {"one": "full", "two": "full"}
    assert capsys.readouterr().err == ""


def test_an_interrupt_is_no_failure_of_an_output() -> None:
    def stop() -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        Outputs("run").attempt("plot", stop)


def test_the_model_of_the_names_is_loaded() -> None:
    """The names that are tried are those that a model keeps."""
    assert len(set(NAMES)) == len(NAMES)
    spec = mujoco.MjSpec()
    for name in NAMES:
        spec.worldbody.add_site(name=name)
    model = spec.compile()
    assert [model.site(i).name for i in range(model.nsite)] == NAMES
    assert np.array_equal(np.sort([model.site(n).id for n in NAMES]), np.arange(len(NAMES)))
