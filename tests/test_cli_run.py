"""mjwrap run: the files that it leaves hold what the package computes, in every mode."""

import json
import math
import subprocess
import sys
from pathlib import Path

import mujoco
import numpy as np
import pytest
from cli_runs import CART, CASE2, ELBOW, ENTERS, ROOT, environment, only_files, rows_of, said, simulate

import mjwrap as mw
from mjwrap.model.kinematic_tree import crossed_dofs

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
    assert height >= 60 * 12  # sixty rows of twelve pixels each, in three panels side by side


def test_a_model_without_muscles_runs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = tmp_path / "m.xml"
    model.write_text(CART.format(h=0.002, integrator="Euler"))
    ran = simulate(capsys, model, "--duration", 0.05, "--plot", tmp_path / "p.svg")
    assert ran.code == 0, ran.err
    assert "0 muscles" in ran.out


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
        kept = [np.flatnonzero(row).tolist() for row in crossed_dofs(model, muscles.declarations)]
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
