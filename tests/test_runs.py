"""Running a model from Python: the same numbers as the command, settings that do not fit, and every sample."""

from pathlib import Path

import mujoco
import numpy as np
import pytest
from cli_runs import ELBOW, run_here, said
from first_model import edited

import mjwrap as mw
from mjwrap.comparison import compare_motion
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


@pytest.mark.parametrize(
    ("excitation", "told"),
    [
        ("constant:-0.1", "falls to -0.1"),
        ("constant:1.5", "reaches 1.5"),
        ("sine:0.4,1,0.3", "falls to -0.1"),
        ("cosine:0.8,1,0.5", "goes from -0.3 to 1.3"),
        ("step:-1@0.5", "falls to -1"),
        ("pulses:-0.2", "falls to -0.2"),
        ("TABLE", "goes from -0.5 to 2"),
    ],
)
def test_what_is_clipped_is_said_once(excitation: str, told: str, tmp_path: Path) -> None:
    """Of all muscles together, with their range; a comparison of motions says it too."""
    model = mujoco.MjModel.from_xml_path(ELBOW)
    names = mw.MuscleSystem(model).names
    if excitation == "TABLE":
        excitation = str(tmp_path / "e.csv")
        values = np.tile([[-0.5], [2.0]], (1, len(names)))
        mw.write_table(excitation, mw.Table(np.array([0.0, 1.0]), tuple(names), values))
    for start in (
        lambda: Simulation(ELBOW, RunSettings(duration=0.01, excitation=[excitation])),
        lambda: compare_motion(model, [excitation], 0.002),
    ):
        with pytest.warns(UserWarning, match="range of control") as seen:
            start()
        (warning,) = seen
        shown = ", ".join(f"'{name}'" for name in names[:6])
        text = f"the excitation of {shown} and 1 more {told}, outside its range of control, 0 to 1, and is clipped"
        assert str(warning.message).startswith(text)


def test_zero_is_the_rest_of_a_muscle_and_an_ideal_one_has_no_limit(tmp_path: Path) -> None:
    """A muscle with a least activation, and one without an actuator whose force is its excitation times a constant."""
    file = tmp_path / "arm.xml"
    file.write_text(edited())
    Simulation(str(file), RunSettings(duration=0.01, excitation=["TRI=constant:3"]))
    spec = mujoco.MjSpec.from_file(ELBOW)
    for actuator in spec.actuators:
        actuator.ctrlrange = (0.01, 1.0)
    file.write_text(spec.to_xml())
    Simulation(str(file), RunSettings(duration=0.01, excitation=["pulses"]))
    with pytest.warns(UserWarning, match=r"falls to -0.1, outside its range of control, 0.01 to 1"):
        Simulation(str(file), RunSettings(duration=0.01, excitation=["constant:-0.1"]))


@pytest.mark.parametrize(
    "excitation", ["constant:0", "constant:1", "sine:0.5,1,0.5", "pulses", "random", "step:1@0"]
)
def test_what_is_within_the_range_is_not_clipped(excitation: str) -> None:
    Simulation(ELBOW, RunSettings(duration=0.01, excitation=[excitation]))


def test_an_unknown_kind_of_number_is_an_error() -> None:
    with pytest.raises(mw.TableError, match="no kind 'weight'; kinds: qpos, qvel"):
        simulate(ELBOW, SHORT, ["length", "weight"])
