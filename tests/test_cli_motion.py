"""mjwrap run: joints and muscles follow the patterns and tables that they are given."""

import math
from pathlib import Path

import numpy as np
import pytest
from cli_runs import CART, CASE2, ELBOW, rows_of, simulate
from naive_tendon import cylinder_length

import mjwrap as mw


def test_the_papers_cylinder_is_driven_by_prescription(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Case 2 of the paper at all its 251 poses; lengths and speeds against tangents and an arc in closed form."""
    table = tmp_path / "c.csv"
    motion = ["--prescribe", "cylinder_y=sine:0.02,1", "--duration", 3, "--sample", 0.012]
    ran = simulate(capsys, CASE2, *motion, "--excitation", "constant:0.5", "--csv", table)
    assert ran.code == 0, ran.err
    rows = rows_of(table)
    assert len(rows) == 251
    side = np.array([0.0, 0.013, 0.0])
    for row in rows:

        def length(t: float) -> float:
            y = 0.02 * math.sin(2 * math.pi * t)
            ends = np.array([0.02, -y, -0.025]), np.array([-0.02, -y, -0.005])
            return cylinder_length(*ends, 0.01, side)

        assert row["length:muscle"] == pytest.approx(length(row["time"]), rel=1e-12)


def swing(amplitude: float, hertz: float, duration: float) -> float:
    """Angle of a pendulum whose pivot moves by amplitude sin(2 pi hertz t), by small Runge-Kutta steps."""
    omega, g, l = 2 * math.pi * hertz, 9.81, 0.5

    def slope(t: float, x: np.ndarray) -> np.ndarray:
        pivot = -amplitude * omega**2 * math.sin(omega * t)
        return np.array([x[1], -(g * math.sin(x[0]) - pivot * math.cos(x[0])) / l])

    x, n = np.array([0.3, 0.0]), 20000
    h = duration / n
    for k in range(n):
        t = k * h
        a = slope(t, x)
        b = slope(t + h / 2, x + h / 2 * a)
        c = slope(t + h / 2, x + h / 2 * b)
        x = x + h / 6 * (a + 2 * b + 2 * c + slope(t + h, x + h * c))
    return float(x[0])


@pytest.mark.parametrize("integrator", ["Euler", "RK4"])
def test_other_joints_feel_a_prescribed_motion(
    integrator: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A pendulum on a driven cart comes to its reference as the step is halved, by RK4 at second order."""
    errors = []
    for h in (0.004, 0.002, 0.001):
        model, table = tmp_path / "m.xml", tmp_path / "c.csv"
        model.write_text(CART.format(h=h, integrator=integrator))
        motion = ["--prescribe", "cart=sine:0.2,1.3", "--qpos", "swing=0.3", "--duration", 1]
        ran = simulate(capsys, model, *motion, "--csv", table)
        assert ran.code == 0, ran.err
        last = rows_of(table)[-1]
        assert last["qpos:cart"] == pytest.approx(0.2 * math.sin(2.6 * math.pi * last["time"]), abs=1e-12)
        errors.append(abs(last["qpos:swing"] - swing(0.2, 1.3, 1.0)))
    order = 1 if integrator == "Euler" else 2
    assert math.log2(errors[0] / errors[1]) > order - 0.1
    assert math.log2(errors[1] / errors[2]) > order - 0.1
    assert errors[2] < (2.6 * math.pi * 0.001) ** order  # the driven turn of one step, to that order


def test_a_file_prescribes_a_joint(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    times = np.linspace(0.0, 1.0, 41)
    angles = 1.0 - 0.5 * np.cos(2 * np.pi * times)  # at rest at both ends
    motion, table = tmp_path / "motion.csv", tmp_path / "c.csv"
    lines = [f"{t!r},{a!r}" for t, a in zip(times.tolist(), angles.tolist(), strict=True)]
    motion.write_text("\n".join(["time,elbow_flexion", *lines, ""]))
    ran = simulate(capsys, ELBOW, "--prescribe", motion, "--csv", table)
    assert ran.code == 0, ran.err
    for row in rows_of(table):  # a cubic spline through 41 samples of one wave is good to 1e-5
        assert row["qpos:elbow_flexion"] == pytest.approx(
            1.0 - 0.5 * math.cos(2 * math.pi * row["time"]), abs=1e-5
        )


def test_prescribed_degrees_are_turned_into_radians(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, table = tmp_path / "ik.mot", tmp_path / "c.csv"
    degrees = mw.Table(
        np.array([0.0, 1.0]), ("elbow_flexion",), np.array([[90.0], [90.0]]), {"inDegrees": "yes"}
    )
    mw.write_table(path, degrees)
    assert simulate(capsys, ELBOW, "--prescribe", path, "--duration", 0.01, "--csv", table).code == 0
    assert rows_of(table)[-1]["qpos:elbow_flexion"] == pytest.approx(0.5 * math.pi, abs=1e-12)


def test_excitations_come_from_opensims_files(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The same numbers as CSV and as .sto, there under OpenSim's names; and the table of a run drives another one."""
    times, level = np.array([0.0, 0.1]), np.array([[0.1, 0.2], [0.9, 0.4]])
    mw.write_table(tmp_path / "u.csv", mw.Table(times, ("BRA", "TRIlat"), level))
    mw.write_table(tmp_path / "u.sto", mw.Table(times, ("/forceset/BRA", "TRIlat.excitation"), level))
    ends = []
    for given, left in (("u.csv", "c.csv"), ("u.sto", "c.csv"), ("c.csv", "d.csv")):
        options = ["--duration", 0.1, "--sample", 0.002, "--csv", tmp_path / left]
        ran = simulate(capsys, ELBOW, "--excitation", tmp_path / given, *options)
        assert ran.code == 0, ran.err
        ends.append(rows_of(tmp_path / left)[-1])
    assert ends[0] == ends[1]
    assert ends[0] == pytest.approx(ends[2], rel=1e-12)
    mw.write_table(tmp_path / "u.sto", mw.Table(times, ("/forceset/BRA", "BRA"), level))
    ran = simulate(capsys, ELBOW, "--excitation", tmp_path / "u.sto")
    assert ran.code == 2
    assert "are both muscle or actuator 'BRA'" in ran.err
