"""mjwrap run: what it computes is what the package computes, and what it says when it cannot."""

import csv
import json
import math
import re
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import mujoco
import numpy as np
import pytest
from cli_runs import CASE2, ELBOW, ROOT, Ran, environment, finish, run_here, said, start
from naive_tendon import cylinder_length

import mjwrap as mw
from mjwrap.cli.samples import spanned

CART = """
<mujoco>
  <option timestep="{h}" integrator="{integrator}"/>
  <worldbody>
    <body>
      <joint name="cart" type="slide" axis="1 0 0"/><geom size=".05" mass="2" contype="0" conaffinity="0"/>
      <body>
        <joint name="swing" axis="0 1 0"/>
        <geom type="sphere" size=".001" pos="0 0 -.5" mass="1" contype="0" conaffinity="0"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""
ENTERS = """
<mujoco>
  <option gravity="0 0 0"/>
  <worldbody>
    <geom name="ball" type="sphere" size=".05" contype="0" conaffinity="0"/>
    <site name="a" pos="-.1 0 .01"/>
    <body><joint name="slide" type="slide" axis="1 0 0" damping="1"/>
      <geom size=".01" pos=".1 0 0" mass="1" contype="0" conaffinity="0"/><site name="b" pos=".1 0 0"/></body>
  </worldbody>
  <tendon><spatial name="t"><site site="a"/><geom geom="ball"/><site site="b"/></spatial></tendon>
  <actuator><muscle name="stuck" tendon="t" lengthrange=".05 .3"/></actuator>
</mujoco>
"""
OWN = """<custom>
    <numeric name="mjwrap_free_max_isometric_force" data="100"/>
    <numeric name="mjwrap_free_optimal_fiber_length" data=".1"/>
    <numeric name="mjwrap_free_tendon_slack_length" data=".1"/>
    <tuple name="mjwrap_free">
      <element objtype="tendon" objname="t"/>
      <element objtype="numeric" objname="mjwrap_free_max_isometric_force"/>
      <element objtype="numeric" objname="mjwrap_free_optimal_fiber_length"/>
      <element objtype="numeric" objname="mjwrap_free_tendon_slack_length"/>
    </tuple>
  </custom>"""


def rows_of(path: Path) -> list[dict[str, float]]:
    with path.open(newline="") as file:
        return [{name: float(cell) for name, cell in row.items()} for row in csv.DictReader(file)]


def simulate(capsys: pytest.CaptureFixture[str], *arguments: object) -> Ran:
    return run_here("run", capsys, *arguments)


def only_files(folder: Path, *names: str) -> None:
    assert sorted(path.name for path in folder.iterdir()) == sorted(names)


def test_a_run_leaves_the_files_that_it_names(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    outputs = ["--record", tmp_path / "r.rrd", "--plot", tmp_path / "p.png", "--csv", tmp_path / "c.csv"]
    ran = simulate(capsys, ELBOW, "--duration", 0.1, "--excitation", "pulses", *outputs)
    assert ran.code == 0, ran.err
    only_files(tmp_path, "r.rrd", "p.png", "c.csv")
    assert (tmp_path / "p.png").read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / "r.rrd").read_bytes().startswith(b"RRF2")
    for name in ("r.rrd", "p.png", "c.csv"):
        assert str(tmp_path / name) in ran.out
    assert "7 muscles" in ran.out
    assert "times real time" in ran.out
    assert said(ran) == []


def test_the_numbers_are_those_of_the_package(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The same loop by hand gives the same bits, whatever is sampled."""
    table = tmp_path / "c.csv"
    excitation = ["constant:0.1", "BRA=sine:0.3,2,0.3"]
    options = ["--duration", 0.2, "--integrator", "RK4", "--keyframe", "right_angle", "--timestep", 0.001]
    ran = simulate(capsys, ELBOW, *options, "--excitation", *excitation, "--csv", table, "--sample", 0.05)
    assert ran.code == 0, ran.err
    rows = rows_of(table)
    assert [row["time"] for row in rows] == pytest.approx([0.0, 0.05, 0.1, 0.15, 0.2], abs=1e-12)

    model = mujoco.MjModel.from_xml_path(ELBOW)
    model.opt.integrator, model.opt.timestep = mujoco.mjtIntegrator.mjINT_RK4, 0.001
    muscles, data = mw.MuscleSystem(model), mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("right_angle").id)
    for _ in range(200):
        data.ctrl[:] = 0.1
        data.ctrl[model.actuator("BRA").id] = 0.3 + 0.3 * math.sin(2 * math.pi * 2 * data.time)
        muscles.step(data)
    muscles.forward(data)
    assert rows[-1]["qpos:elbow_flexion"] == data.qpos[0]
    for i, name in enumerate(muscles.names):
        found = [rows[-1][f"{kind}:{name}"] for kind in ("activation", "length", "velocity", "tension")]
        kept = [float(x[i]) for x in (muscles.activation, muscles.length, muscles.velocity, muscles.tension)]
        assert found == pytest.approx(kept, rel=1e-13)


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


def test_many_muscles_make_a_plot_too(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Sixty muscles over twenty joints."""
    bodies = "".join(
        f'<body pos="{0.2 * k} 0 0"><joint name="j{k}" axis="0 1 0"/><geom size=".02" mass="1" contype="0" '
        f'conaffinity="0" pos="0 0 -.1"/><site name="s{k}" pos="0 .02 -.1"/></body>'
        for k in range(20)
    )
    tendons = "".join(
        f'<spatial name="t{i}"><site site="o"/><site site="s{i % 20}"/></spatial>' for i in range(60)
    )
    muscles = "".join(f'<muscle name="m{i}" tendon="t{i}" lengthrange=".1 5"/>' for i in range(60))
    model = tmp_path / "m.xml"
    model.write_text(
        f'<mujoco><worldbody><site name="o" pos="0 0 1"/>{bodies}</worldbody><tendon>{tendons}</tendon>'
        f"<actuator>{muscles}</actuator></mujoco>"
    )
    ran = simulate(capsys, model, "--duration", 0.05, "--excitation", "random", "--plot", tmp_path / "p.png")
    assert ran.code == 0, ran.err
    width, height = np.frombuffer((tmp_path / "p.png").read_bytes()[16:24], dtype=">u4").tolist()
    assert width >= 1000
    assert height >= 60 * 3 * 12  # three panels of sixty rows, twelve pixels each


def test_a_model_without_muscles_runs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = tmp_path / "m.xml"
    model.write_text(CART.format(h=0.002, integrator="Euler"))
    ran = simulate(capsys, model, "--duration", 0.05, "--plot", tmp_path / "p.svg")
    assert ran.code == 0, ran.err
    assert "0 muscles" in ran.out


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["nowhere.xml"], "nowhere.xml"),
        (["{text}"], "not a model that MuJoCo can load"),
        (["myo_sim:spider"], "spider|myo-sim"),
        ([ELBOW, "--duration", "-1"], "--duration.*above zero"),
        ([ELBOW, "--duration", "nan"], "--duration"),
        ([ELBOW, "--timestep", "0"], "--timestep"),
        ([ELBOW, "--integrator", "verlet"], "euler.*rk4.*implicit"),
        ([ELBOW, "--seed", "-1"], "--seed"),
        ([ELBOW, "--frobnicate"], "unrecognized"),
        ([ELBOW, "--excitation", "wiggle"], "'wiggle' is not a pattern; patterns: constant"),
        ([ELBOW, "--excitation", "BRAX=constant:1"], "BRAX.*TRIlong, TRIlat"),
        ([ELBOW, "--excitation", "{nan}"], "line 3, column 'BRA': nan is not finite"),
        ([ELBOW, "--keyframe", "bent"], "'bent'; keyframes: extended, right_angle, flexed"),
        ([ELBOW, "--qpos", "knee=1"], "no hinge or slide 'knee'; there are: elbow_flexion"),
        ([ELBOW, "--qpos", "elbow_flexion=nan"], "not finite"),
        ([ELBOW, "--qpos", "elbow_flexion"], "not a number"),
        ([ELBOW, "--prescribe", "elbow_flexion=step:1@1"], "cannot jump"),
        ([ELBOW, "--prescribe", "knee=sine:1,1"], "knee.*elbow_flexion"),
        ([ELBOW, "--prescribe", "elbow_flexion=sine:1,1", "--qpos", "elbow_flexion=1"], "is prescribed"),
        ([ELBOW, "--plot", "{folder}/missing/p.png"], "there is no folder.*missing"),
        ([ELBOW, "--plot", "{folder}/p.docx"], r"must end in \.png or \.pdf or \.svg"),
        ([ELBOW, "--csv", "{folder}/sub.csv"], "it is a folder"),
        ([ELBOW, "--record", "{folder}/missing/r.rrd"], "no folder"),
        ([ELBOW, "--record", "{folder}/r.bin"], r"must end in \.rrd"),
        ([ELBOW, "--out", "{folder}/t.xlsx"], r"must end in \.sto or \.mot or \.csv or \.npz"),
        ([ELBOW, "--columns", "length"], "goes with --out or --csv"),
        ([ELBOW, "--camera", "side"], "goes with --video"),
        ([ELBOW, "--duration", "long"], "'long' is no number"),
        (
            [ELBOW, "--csv", "{folder}/t.csv", "--columns", "length,weight"],
            "no kind 'weight'; kinds: qpos, qvel",
        ),
        (
            [ELBOW, "--video", "{folder}/f.gif", "--mode", "python"],
            "--video shows the muscles of the engine plugin",
        ),
        ([ELBOW, "--video", "{folder}/f.avi"], r"\.mp4|OpenGL"),
        ([ELBOW, "--video", "{folder}/f.gif", "--video-size", "640"], "like 640x480"),
        (
            [ELBOW, "--mode", "sideways"],
            "mode 'sideways' does not exist; modes: python, wrench, transmission",
        ),
        ([ELBOW, "--excitation", "{text}.sto"], r"text\.xml\.sto'.*no such file"),
        ([ELBOW, "--csv", "{folder}/c.csv", "--plot", "{folder}/missing/p.png"], "missing"),
    ],
)
def test_a_mistake_is_told_in_one_line_and_leaves_nothing(
    arguments: list[str], told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text, bad = tmp_path / "text.xml", tmp_path / "nan.csv"
    text.write_text("not MJCF")
    bad.write_text("time,BRA\n0,0\n1,nan\n")
    (tmp_path / "sub.csv").mkdir()
    filled = [a.format(text=text, nan=bad, folder=tmp_path) for a in arguments]
    ran = simulate(capsys, *filled)
    assert ran.code == 2
    (line,) = said(ran)
    assert line.startswith("mjwrap run: ")
    assert re.search(told, line), line
    assert ran.out == ""
    only_files(tmp_path, "text.xml", "nan.csv", "sub.csv")


def test_a_motion_that_blows_up_is_told_and_leaves_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = tmp_path / "m.xml"
    text = CART.format(h=0.01, integrator="Euler")
    model.write_text(text.replace('name="cart"', 'name="cart" stiffness="1e9"'))
    ran = simulate(
        capsys, model, "--qpos", "cart=1", "--csv", tmp_path / "c.csv", "--plot", tmp_path / "p.png"
    )
    assert ran.code == 1
    assert "unstable" in said(ran)[-1]
    only_files(tmp_path, "m.xml")


def test_a_path_that_is_not_found_is_counted_or_stops_a_strict_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The insertion swings into the ball and out again; where it starts inside there is nothing to hold."""
    model = tmp_path / "m.xml"
    model.write_text(ENTERS)
    options = [model, "--duration", 0.01, "--csv", tmp_path / "c.csv"]
    swing = ["--prescribe", "slide=sine:-0.09,50"]
    ran = simulate(capsys, *options, *swing, "--strict")
    assert ran.code == 1
    assert re.match("mjwrap run: .*'stuck'.*site 'b' is inside geom 'ball'", said(ran)[-1])
    only_files(tmp_path, "m.xml")
    ran = simulate(capsys, *options, "--qpos", "slide=-0.09")
    assert ran.code == 2
    assert re.match(
        "mjwrap run: muscle 'stuck' has no path at the start.*site 'b' is inside geom 'ball'", said(ran)[-1]
    )
    only_files(tmp_path, "m.xml")
    ran = simulate(capsys, *options, *swing)
    assert (ran.code, said(ran)) == (0, [])
    assert "stuck: 4 steps without a path" in ran.out
    assert "site 'b' is inside geom 'ball'" in ran.out
    only_files(tmp_path, "m.xml", "c.csv")


def test_a_full_disk_is_told_and_leaves_nothing(tmp_path: Path) -> None:
    """A limit on file size stands for the full disk: the write fails in the same way, in the middle of the run."""

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))

    outputs = ["--csv", tmp_path / "c.csv", "--sample", 0.001]
    ran = finish(start("run", ELBOW, "--duration", 5, *outputs, preexec_fn=limit))
    assert ran.code == 1
    (line,) = said(ran)
    assert "c.csv" in line
    assert "too large" in line
    only_files(tmp_path)


def test_ctrl_c_keeps_what_was_simulated(tmp_path: Path) -> None:
    table, plot, recording = tmp_path / "c.csv", tmp_path / "p.png", tmp_path / "r.rrd"
    outputs = ["--csv", table, "--plot", plot, "--record", recording]
    process = start("run", ELBOW, "--duration", 1e5, "--excitation", "random", *outputs)
    parts = time.monotonic() + 60
    while not any(p.suffix == ".csv" and p.stat().st_size > 20_000 for p in tmp_path.iterdir()):
        assert time.monotonic() < parts, "the run did not start"
        assert process.poll() is None, process.communicate()
        time.sleep(0.1)
    process.send_signal(signal.SIGINT)
    ran = finish(process)
    assert ran.code == 130, ran.err
    assert said(ran) == ["mjwrap run: stopped by Ctrl-C; the files hold what was simulated"]
    only_files(tmp_path, "c.csv", "p.png", "r.rrd")
    times = np.array([row["time"] for row in rows_of(table)])
    assert np.diff(times) == pytest.approx(
        0.006 * np.ones(len(times) - 1), abs=0.0045
    )  # whole rows to the last
    info = subprocess.run(
        [sys.executable, "-m", "mjwrap", "replay", str(recording), "--info"],
        capture_output=True, text=True, cwd=ROOT, env=environment(), check=True,
    )  # fmt: skip
    assert "BRA" in info.stdout


# -------------------------------------------------------------------------- tables, modes, JSON


@pytest.mark.parametrize("suffix", [".sto", ".csv", ".npz"])
def test_a_table_holds_what_is_asked_for(
    suffix: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Every moment arm that is not zero is there, as −∂l/∂q, at the state of its row."""
    path = tmp_path / f"t{suffix}"
    kinds = "qpos,qvel,act,length,moment_arm"
    ran = simulate(
        capsys, ELBOW, "--duration", 0.05, "--excitation", "constant:0.4", "--out", path, "--columns", kinds
    )
    assert ran.code == 0, ran.err
    only_files(tmp_path, path.name)
    table = mw.read_table(path)
    model = mujoco.MjModel.from_xml_path(ELBOW)
    muscles, data = mw.MuscleSystem(model), mujoco.MjData(model)
    for k in range(len(table.time)):
        data.qpos[0], data.qvel[0] = table["qpos:elbow_flexion"][k], table["qvel:elbow_flexion"][k]
        jacobian = muscles.length_jacobian(data)
        for i, name in enumerate(muscles.names):
            assert table[f"length:{name}"][k] == muscles.length[i]
            assert table[f"moment_arm:{name}:elbow_flexion"][k] == -jacobian[i, 0]
    assert {name.partition(":")[0] for name in table.names} == set(kinds.split(","))
    assert table["act:BRA"][-1] > 0.1


def test_moment_arms_that_are_left_out_are_zero() -> None:
    for path in (CASE2, str(ROOT / "models" / "five_surfaces" / "five_surfaces.xml")):
        model = mujoco.MjModel.from_xml_path(path)
        muscles, data = mw.MuscleSystem(model), mujoco.MjData(model)
        jacobian = muscles.length_jacobian(data)
        kept = [spanned(model, muscle) for muscle in muscles.declarations]
        assert all(not np.delete(row, dofs).any() for row, dofs in zip(jacobian, kept, strict=True))
        assert any(kept)


def test_the_plugin_moves_the_model_to_the_same_places(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    tables = {}
    for mode in ("python", "wrench", "transmission"):
        path = tmp_path / f"{mode}.npz"
        options = ["--excitation", "random:2", "--integrator", "rk4", "--duration", 0.2, "--out", path]
        ran = simulate(capsys, ELBOW, "--mode", mode, *options)
        assert ran.code == 0, ran.err
        tables[mode] = mw.read_table(path)
    first = tables["python"]
    for table in tables.values():
        assert table.names == first.names
        assert np.array_equal(table.time, first.time)
        assert np.abs(table.values - first.values).max() < 1e-9
    assert np.array_equal(tables["wrench"]["qpos:elbow_flexion"], first["qpos:elbow_flexion"])


def test_a_film_shows_the_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Frames at the asked rate, half as fast as the run; the motion is the same as without it."""
    image = pytest.importorskip("PIL.Image", reason="GIFs need Pillow")
    film, table, alone = tmp_path / "f.gif", tmp_path / "t.npz", tmp_path / "a.npz"
    options = ["--duration", 0.2, "--excitation", "constant:0.5"]
    size = ["--video-size", "96x64", "--fps", 20, "--speed", 0.5]
    ran = simulate(capsys, ELBOW, *options, "--video", film, *size, "--out", table)
    if "OpenGL" in ran.err:
        pytest.skip(ran.err)
    assert ran.code == 0, ran.err
    assert "plugin mode wrench" in ran.out
    assert f"video:     {film}" in ran.out
    with image.open(film) as frames:
        seconds = sum(frames.seek(k) or frames.info["duration"] for k in range(frames.n_frames)) / 1e3
        assert frames.size == (96, 64)
        assert frames.n_frames in (8, 9)
    assert seconds == pytest.approx(0.4, abs=0.06)
    assert simulate(capsys, ELBOW, *options, "--mode", "wrench", "--out", alone).code == 0
    assert np.array_equal(mw.read_table(table).values, mw.read_table(alone).values)


def test_the_plugin_drives_muscles_without_an_actuator(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Their excitation and activation are the plugin's own: the table has them all the same."""
    model = tmp_path / "m.xml"
    text = ENTERS.replace('<actuator><muscle name="stuck" tendon="t" lengthrange=".05 .3"/></actuator>', OWN)
    assert OWN in text
    model.write_text(text)
    tables = []
    for mode in ("python", "wrench"):
        path = tmp_path / f"{mode}.npz"
        ran = simulate(
            capsys, model, "--mode", mode, "--excitation", "constant:0.5", "--duration", 0.05, "--out", path
        )
        assert (ran.code, "not found" in ran.out) == (0, False)
        tables.append(mw.read_table(path))
    assert tables[0]["activation:t"][-1] > 0.1
    assert np.abs(tables[0].values - tables[1].values).max() < 1e-9


def test_excitations_come_from_opensims_files(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The same numbers as CSV and as .sto, there under OpenSim's names; and the table of a run drives another one."""
    times, level = np.array([0.0, 0.1]), np.array([[0.1, 0.2], [0.9, 0.4]])
    mw.write_table(tmp_path / "u.csv", mw.Table(times, ("BRA", "TRIlat"), level))
    mw.write_table(tmp_path / "u.sto", mw.Table(times, ("/forceset/BRA", "TRIlat.excitation"), level))
    ends = []
    for given in ("u.csv", "u.sto", "c.csv"):
        options = ["--duration", 0.1, "--sample", 0.002, "--csv", tmp_path / "c.csv"]
        ran = simulate(capsys, ELBOW, "--excitation", tmp_path / given, *options)
        assert ran.code == 0, ran.err
        ends.append(rows_of(tmp_path / "c.csv")[-1])
    assert ends[0] == ends[1]
    assert ends[0] == pytest.approx(ends[2], rel=1e-12)
    mw.write_table(tmp_path / "u.sto", mw.Table(times, ("/forceset/BRA", "BRA"), level))
    ran = simulate(capsys, ELBOW, "--excitation", tmp_path / "u.sto")
    assert ran.code == 2
    assert "are both muscle or actuator 'BRA'" in ran.err


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


def test_json_takes_the_place_of_the_text(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    ran = simulate(capsys, ELBOW, "--duration", 0.02, "--csv", tmp_path / "c.csv", "--json")
    facts = json.loads(ran.out)
    assert facts["simulated"] == pytest.approx(0.02)
    assert (len(facts["muscles"]), facts["mode"], facts["paths_not_found"]) == (7, "python", {})
    assert facts["files"] == {"csv": str(tmp_path / "c.csv")}
    both = simulate(capsys, ELBOW, "--duration", 0.02, "--json", tmp_path / "j.json")
    assert "7 muscles" in both.out
    assert json.loads((tmp_path / "j.json").read_text()).keys() == facts.keys()


def test_nothing_heavy_loads_unless_it_is_asked_for(tmp_path: Path) -> None:
    code = (
        "import sys; from mjwrap.cli import main; "
        f"code = main(['run', {ELBOW!r}, '--duration', '0.01', '--csv', {str(tmp_path / 'c.csv')!r}]); "
        "print(code, sorted({'rerun', 'matplotlib', 'tqdm', 'pyarrow'} & set(sys.modules)))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, env=environment(), check=True
    )
    assert done.stdout.splitlines()[-1] == "0 []"
