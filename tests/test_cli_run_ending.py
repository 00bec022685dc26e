"""What a run says at its end, what it warns of, and what its measured time leaves out."""

import json
import time
from pathlib import Path

import mujoco
import numba
import numpy as np
import pytest
from cli_runs import CASE2, ELBOW, run_here, said

import mjwrap as mw
from mjwrap.cli.run.ending import ended, undriven
from mjwrap.runs import RunSettings, Simulation, load, simulate
from mjwrap.runs.compile_time import CompileClock

SHORT = ("--duration", 0.01)
SAVED = "nothing was saved: --plot"
JOINTS = """
<mujoco><option gravity="0 0 0"/>
  <worldbody>
    <body><freejoint name="ship"/><geom size=".1" contype="0" conaffinity="0"/></body>
    <body><joint name="ball" type="ball"/><geom size=".1" contype="0" conaffinity="0"/></body>
    {hinges}
  </worldbody>
  <actuator><motor name="push" joint="h0"/></actuator>
</mujoco>
"""


def test_a_run_says_where_it_ended(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    ran = run_here(
        "run", capsys, ELBOW, "--duration", 0.1, "--qpos", "elbow_flexion=1.5", "--json", tmp_path / "j.json"
    )
    end = json.loads((tmp_path / "j.json").read_text())["positions"]["elbow_flexion"][0]
    assert f"ended at 0.1 s with elbow_flexion {np.degrees(end):.1f}°\n" in ran.out


def test_joints_of_every_kind_are_told_and_the_rest_counted(tmp_path: Path) -> None:
    hinges = "".join(
        f'<body><joint name="h{i}" axis="0 0 1"/><geom size=".1" contype="0" conaffinity="0"/></body>'
        for i in range(5)
    )
    slide = '<body><joint name="s" type="slide"/><geom size=".1" contype="0" conaffinity="0"/></body>'
    file = tmp_path / "m.xml"
    file.write_text(JOINTS.format(hinges=hinges + slide))
    simulation = Simulation(str(file), RunSettings(duration=0.002))
    simulation.begin()
    data = simulation.engine.data
    data.time = 2.0
    data.qpos[:3] = 0.25, -0.1, 0.0
    data.qpos[7:11] = np.cos(0.25), 0.0, 0.0, np.sin(0.25)  # half a radian
    data.joint("s").qpos = -0.125
    data.joint("h0").qpos, data.joint("h3").qpos, data.joint("h4").qpos = (
        -1e-9,
        np.radians(30.0),
        np.radians(-3.0),
    )
    assert ended(simulation) == (
        "ended at 2 s with ship (250, -100, 0) mm, ball 28.6°, h0 0.0°, h3 30.0°, h4 -3.0°, s -125 mm "
        "(of 8 joints those that moved most)"
    )


@pytest.mark.parametrize("mode", ["python", "transmission"])
def test_a_servo_pulls_at_a_control_of_zero(mode: str, capsys: pytest.CaptureFixture[str]) -> None:
    """The finger's servo, whose lengths begin at 70 mm, bends it; a motor's zero is no set point."""
    ran = run_here("run", capsys, "mjwrap:finger", *SHORT, "--mode", mode)
    assert ran.code == 0
    assert (
        "all controls were zero, which is a set point and not the absence of force for fdp: "
        "add --excitation fdp=constant:0.105\n"
    ) in ran.out


def test_nothing_moves_because_all_controls_are_zero(tmp_path: Path) -> None:
    file = tmp_path / "m.xml"
    file.write_text(
        JOINTS.format(hinges='<body><joint name="h0"/><geom size=".1" contype="0" conaffinity="0"/></body>')
    )
    for excitation, told in (
        ((), "nothing moved, because all controls are zero: add --excitation push=constant:0.5"),
        (("push=constant:0",), "nothing moved"),
        (("push=constant:0.1",), ""),
        (("push=step:1@0.005",), ""),  # zero at first
    ):
        simulation = Simulation(str(file), RunSettings(duration=0.01, excitation=excitation))
        simulation.begin()
        simulation.advance()
        assert undriven(simulation).startswith(told), excitation
        assert bool(undriven(simulation)) == bool(told)


@pytest.mark.parametrize(
    ("model", "options", "told"),
    [
        (
            ELBOW,
            [],
            "all controls were zero, so that only gravity, springs and passive forces moved it: add --excitation",
        ),
        (ELBOW, ["--mode", "wrench"], "all controls were zero"),
        (ELBOW, ["--excitation", "pulses"], ""),
        (CASE2, ["--prescribe", "cylinder_y=sine:0.02,1"], ""),
    ],
)
def test_zero_controls_are_told_where_nobody_chose_them(
    model: str, options: list[str], told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    ran = run_here("run", capsys, model, *SHORT, *options)
    assert ("controls" in ran.out) == bool(told)
    assert told in ran.out


def test_what_could_be_saved_is_told_only_where_nothing_is(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert SAVED in run_here("run", capsys, ELBOW, *SHORT).out
    for option, name in (
        ("--out", "t.sto"),
        ("--record", "r.rrd"),
        ("--json", "j.json"),
        ("--analysis", "a"),
    ):
        assert SAVED not in run_here("run", capsys, ELBOW, *SHORT, option, tmp_path / name).out


def table(path: Path, start: float, end: float, column: str = "BRA") -> Path:
    mw.write_table(path, mw.Table(np.array([start, end]), (column,), np.array([[0.2], [0.4]])))
    return path


@pytest.mark.parametrize(
    ("start", "end", "told"),
    [
        (0.0, 1.0, []),
        (0.0, 0.02, []),
        (0.0, 0.018, []),  # the last step
        (
            0.0,
            0.01,
            ["table ends before the run (0.02 s), its last values are held from then on: '{}' at 0.01 s"],
        ),
        (
            0.01,
            1.0,
            ["table begins later than the run, its first values are held until then: '{}' at 0.01 s"],
        ),
    ],
)
@pytest.mark.parametrize(("option", "column"), [("--excitation", "BRA"), ("--prescribe", "elbow_flexion")])
@pytest.mark.filterwarnings("default")
def test_a_table_that_does_not_cover_the_run_is_told(
    start: float, end: float, told: list[str], option: str, column: str, tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    file = table(tmp_path / "t.csv", start, end, column)
    ran = run_here("run", capsys, ELBOW, "--duration", 0.02, option, file)
    assert said(ran) == [f"mjwrap run: warning: {line.format(file)}" for line in told]


def test_python_warns_too(tmp_path: Path) -> None:
    file = table(tmp_path / "t.csv", 0.0, 0.01)
    with pytest.warns(UserWarning, match="table ends before the run"):
        simulate(ELBOW, RunSettings(duration=0.02, excitation=[str(file)]))


def test_compilation_is_no_part_of_the_measured_time() -> None:
    """A sample and a step that compile take as long as they do without."""
    simulation = Simulation(ELBOW, RunSettings(duration=0.02))
    simulation.begin()
    spent: list[float] = []

    def compile_something(_: object) -> None:
        started = time.perf_counter()
        k = len(spent)
        numba.njit(lambda x: np.sin(x) ** k + np.linalg.norm(np.ones(3) * x))(1.0 + k)
        spent.append(time.perf_counter() - started)

    with CompileClock() as clock:
        wall = simulation.advance([compile_something])
    assert clock.seconds > 0.5 * sum(spent) > 0.0
    assert wall.outputs < sum(spent) - 0.9 * clock.seconds + 0.1
    assert wall.simulation < 1.0


@pytest.mark.parametrize("mode", ["python", "wrench", "transmission"])
def test_the_rehearsal_changes_no_bit(mode: str) -> None:
    """Runs are those of the loop that anybody writes."""
    table = simulate(ELBOW, RunSettings(duration=0.05, mode=mode, excitation=["pulses"]), kinds=["qpos"])
    if mode == "python":
        model = load(ELBOW)
        muscles = mw.MuscleSystem(model)
    else:
        model = mw.load(ELBOW, mode)
        muscles = None
    data = mujoco.MjData(model)
    expected = Simulation(ELBOW, RunSettings(excitation=["pulses"])).excitation
    for _ in range(25):
        for name, signal in expected.signals.items():
            data.actuator(name).ctrl = signal.value(data.time)
        if muscles is not None:
            muscles.step(data)
        else:
            mujoco.mj_step(model, data)
    assert table["qpos:elbow_flexion"][-1] == data.qpos[0]
