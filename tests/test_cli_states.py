"""States that mjwrap replay reads: of the right model, and whole, also where tendons are elastic."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from cli_runs import ELBOW, run_here

import mjwrap as mw

ELASTIC = ("BRA", "BRD")
FREE = """
<mujoco>
  <worldbody>
    <site name="a" pos="-.1 0 .01"/>
    <body><joint name="slide" type="slide" axis="1 0 0" damping="1"/>
      <geom size=".01" pos=".1 0 0" mass="1" contype="0" conaffinity="0"/><site name="b" pos=".13 0 0"/></body>
  </worldbody>
  <tendon><spatial name="t"><site site="a"/><site site="b"/></spatial></tendon>
  <custom>
    <numeric name="mjwrap_free_max_isometric_force" data="100"/>
    <numeric name="mjwrap_free_optimal_fiber_length" data=".1"/>
    <numeric name="mjwrap_free_tendon_slack_length" data=".13"/>
    <text name="free_tendon_model" data="elastic"/>
    <tuple name="mjwrap_free">
      <element objtype="tendon" objname="t"/>
      <element objtype="numeric" objname="mjwrap_free_max_isometric_force"/>
      <element objtype="numeric" objname="mjwrap_free_optimal_fiber_length"/>
      <element objtype="numeric" objname="mjwrap_free_tendon_slack_length"/>
      <element objtype="text" objname="free_tendon_model"/>
    </tuple>
  </custom>
</mujoco>
"""


@pytest.fixture
def elastic(tmp_path: Path) -> Path:
    """The elbow with two elastic tendons, whose states are in act."""
    declared = mw.MuscleSystem(mujoco.MjModel.from_xml_path(ELBOW)).declarations
    laws: dict[str, Any] = {m.name: m.parameters for m in declared}
    spec = mujoco.MjSpec.from_file(ELBOW)
    mw.set_laws(spec, {name: replace(laws[name], tendon="elastic") for name in ELASTIC})
    path = tmp_path / "elastic.xml"
    path.write_text(spec.to_xml())
    return path


@pytest.mark.parametrize(
    "kinds", [None, "qpos,qvel,activation,fiber_length,tension", "qpos,qvel,act,tension"]
)
def test_states_of_elastic_tendons_replay_exactly(
    kinds: str | None, elastic: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """By the columns that a run leaves unasked, by names, and by act."""
    run, again = tmp_path / "run.npz", tmp_path / "again.npz"
    columns = ["--columns", kinds] if kinds else []
    options = ["--duration", 0.1, "--excitation", "pulses:0.6,0.1", "--sample", 0.01]
    assert run_here("run", capsys, elastic, *options, "--out", run, *columns).code == 0
    ran = run_here("replay", capsys, run, "--model", elastic, "--out", again, "--columns", "tension")
    assert (ran.code, ran.err) == (0, "")
    assert "not given" not in ran.out
    first, second = mw.read_table(run), mw.read_table(again)
    for name in second.names:
        assert np.ptp(first[name]) > 0.1, name
        assert second[name] == pytest.approx(first[name], rel=1e-9), name


@pytest.mark.parametrize("mode", ["python", "wrench"])
def test_states_without_an_actuator_replay_exactly(
    mode: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model, run, again = (tmp_path / name for name in ("free.xml", "run.csv", "again.csv"))
    model.write_text(FREE)
    options = ["--duration", 0.1, "--excitation", "sine:0.4,5,0.5", "--mode", mode, "--out", run]
    assert run_here("run", capsys, model, *options).code == 0
    columns = "activation,fiber_length,tension"
    ran = run_here("replay", capsys, run, "--model", model, "--out", again, "--columns", columns)
    assert (ran.code, ran.err) == (0, "")
    assert "not given" not in ran.out
    first, second = mw.read_table(run), mw.read_table(again)
    for name in second.names:
        assert np.ptp(first[name]) > 1e-3, name
        assert second[name] == pytest.approx(first[name], rel=1e-9), name


def test_fibre_lengths_that_are_not_there_are_named(
    elastic: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    names = mw.MuscleSystem(mujoco.MjModel.from_xml_path(str(elastic))).names
    columns = ("qpos:elbow_flexion", "qvel:elbow_flexion", *(f"activation:{name}" for name in names))
    states, out = tmp_path / "s.csv", tmp_path / "t.csv"
    mw.write_table(states, mw.Table(np.arange(2.0), columns, np.full((2, len(columns)), 0.3)))
    ran = run_here("replay", capsys, states, "--model", elastic, "--out", out)
    assert "2 of 2 fibre lengths missing, taken from the start, or in static equilibrium: BRA, BRD" in ran.out
    assert "activations" not in ran.out


@pytest.mark.parametrize(
    ("suffix", "kind", "columns", "told"),
    [
        ("npz", "qpos", 3, "qpos has 3 columns, the model 1: elbow_flexion"),
        ("csv", "qpos", 3, "qpos has 3 columns, the model 1"),
        ("npz", "qvel", 2, "qvel has 2 columns, the model 1"),
        ("npz", "act", 6, "act has 6 columns, the model 7"),
        ("npz", "act", 8, "act has 8 columns, the model 7"),
        ("npz", "ctrl", 1, "ctrl has 1 column, the model 7"),
    ],
)
def test_arrays_of_another_model_are_refused(
    suffix: str, kind: str, columns: int, told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, time = tmp_path / f"wrong.{suffix}", np.linspace(0.0, 1.0, 11)
    arrays: dict[str, Any] = {"qpos": np.full((11, 1), 0.5), kind: np.full((11, columns), 0.5)}
    if suffix == "npz":
        np.savez(path, time=time, **arrays)
    else:
        names = tuple(f"{name}[{i}]" for name, array in arrays.items() for i in range(array.shape[1]))
        mw.write_table(path, mw.Table(time, names, np.hstack(list(arrays.values()))))
    ran = run_here("replay", capsys, path, "--model", ELBOW, "--out", tmp_path / "o.csv")
    assert (ran.code, len(ran.err.splitlines())) == (2, 1)
    assert told in ran.err
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


def test_columns_of_another_model_are_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Results of the model's own muscles follow from the state; what it does not know is told."""
    names = ("qpos:elbow_flexion", "qpos:knee", "length:BRA", "moment_arm:BRA:elbow_flexion", "length:SOL")
    states = tmp_path / "s.csv"
    mw.write_table(states, mw.Table(np.arange(2.0), names, np.full((2, 5), 0.3)))
    ran = run_here("replay", capsys, states, "--model", ELBOW, "--out", tmp_path / "t.csv")
    assert "2 columns not used: qpos:knee, length:SOL" in ran.out
