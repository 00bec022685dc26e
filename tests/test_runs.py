"""Running a model from Python: the same numbers as the command, settings that do not fit, and every sample."""

from pathlib import Path

import numpy as np
import pytest
from cli_runs import ELBOW, run_here, said

import mjwrap as mw
from mjwrap.runs import RunSettings, Simulation, simulate

SHORT = RunSettings(duration=0.02, excitation=["pulses:0.6,0.1"], positions={"elbow_flexion": 0.7})


@pytest.mark.parametrize("mode", ["python", "wrench"])
def test_a_run_from_python_is_the_command(
    mode: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "run.npz"
    options = ["--duration", 0.02, "--excitation", "pulses:0.6,0.1", "--qpos", "elbow_flexion=0.7"]
    ran = run_here("run", capsys, ELBOW, *options, "--mode", mode, "--out", path)
    assert (ran.code, said(ran)) == (0, [])
    settings = RunSettings(duration=0.02, excitation=SHORT.excitation, positions=SHORT.positions, mode=mode)
    ours, table = simulate(ELBOW, settings), mw.read_table(path)
    assert ours.names == table.names
    assert np.array_equal(ours.time, table.time)
    assert np.array_equal(ours.values, table.values)
    assert np.ptp(ours["qpos:elbow_flexion"]) > 0.0


def test_a_simulation_gives_every_sample_and_stops_when_asked() -> None:
    """Time steps of 2 ms: a sample every two of them, as 5 ms is no whole number of steps."""
    simulation = Simulation(ELBOW, SHORT)
    simulation.begin()
    times: list[float] = []
    simulation.advance([lambda data: times.append(data.time)], stopped=lambda: len(times) == 3)
    assert times == pytest.approx([0.0, 0.004, 0.008], abs=1e-12)
    assert simulation.engine.data.time == pytest.approx(0.008, abs=1e-12)
    assert simulation.duration == pytest.approx(0.02, abs=1e-12)


@pytest.mark.parametrize(
    ("settings", "error", "told"),
    [
        (RunSettings(mode="sideways"), mw.ModelError, "'sideways' does not exist; modes: python, wrench"),
        (RunSettings(integrator="verlet"), mw.ModelError, "'verlet' does not exist; integrators: euler"),
        (RunSettings(keyframe="bent"), mw.ModelError, "'bent'; keyframes: extended"),
        (RunSettings(positions={"knee": 1.0}), mw.ModelError, "no hinge or slide 'knee'; there are: elbow"),
        (RunSettings(excitation=["wiggle"]), mw.SignalError, "'wiggle' is not a pattern"),
        (RunSettings(prescribed=["elbow_flexion"]), mw.SignalError, "^'elbow_flexion': write JOINT=PATTERN"),
        (
            RunSettings(prescribed=["elbow_flexion=sine:1,1,1"], positions={"elbow_flexion": 1.0}),
            mw.SignalError,
            "'elbow_flexion=1': this joint's position is prescribed",
        ),
    ],
)
def test_settings_that_do_not_fit_the_model_are_errors(
    settings: RunSettings, error: type[Exception], told: str
) -> None:
    with pytest.raises(error, match=told):
        Simulation(ELBOW, settings)


def test_an_unknown_kind_of_number_is_an_error() -> None:
    with pytest.raises(mw.TableError, match="no kind 'weight'; kinds: qpos, qvel"):
        simulate(ELBOW, SHORT, ["length", "weight"])
