"""Motions of imported models as OpenSim reads them, and tables of `mjwrap replay --analysis` beside MuscleAnalysis."""

import json

import mujoco
import numpy as np
import pytest
from cli_runs import run_here
from osim_models import FROZEN, compiled, imported

import mjwrap as mw

NAME = "leg6dof9musc"


@pytest.fixture(scope="module")
def frozen():
    return json.loads((FROZEN / f"replay_{NAME}.json").read_text())


@pytest.fixture(scope="module")
def table(frozen):
    """Return the motion that OpenSim replayed, made anew."""
    model = compiled(NAME)
    data = mujoco.MjData(model)
    names = mw.MuscleSystem(model).coordinates
    rows = []
    for k in range(len(frozen["time"])):
        mw.osim.set_coordinates(model, data, {name: frozen["coordinates"][name][k] for name in names})
        rows.append(data.qpos.copy())
    return mw.osim.motion_table(model, frozen["time"], rows)


def test_a_motion_has_opensims_coordinates(table, frozen):
    for name, values in frozen["coordinates"].items():  # those that follow others, too
        assert table[name] == pytest.approx(values, abs=1e-12)
    assert not table.in_degrees


@pytest.mark.parametrize("suffix", [".mot", ".sto"])
def test_opensims_header_says_radians(table, suffix, tmp_path):
    mw.write_table(tmp_path / f"m{suffix}", table)
    lines = (tmp_path / f"m{suffix}").read_text().splitlines()
    end = lines.index("endheader")
    assert lines[0] == "Coordinates"
    assert "inDegrees=no" in lines[:end]
    assert lines[end + 1].split("\t")[:1] == ["time"]
    assert mw.read_table(tmp_path / f"m{suffix}").values == pytest.approx(table.values, abs=0.0)


def test_replayed_lengths_and_moment_arms_are_those_of_muscle_analysis(table, frozen, tmp_path, capsys):
    imported(NAME).save(tmp_path / "m.xml")
    mw.write_table(tmp_path / "m.mot", table)
    ran = run_here(
        "replay", capsys, tmp_path / "m.mot", "--model", tmp_path / "m.xml", "--analysis", tmp_path / "a"
    )
    assert ran.code == 0, ran.err
    lengths = mw.read_table(tmp_path / "a_MuscleAnalysis_Length.sto")
    for muscle, values in frozen["lengths"].items():  # OpenSim writes eight digits
        assert lengths[muscle] == pytest.approx(values, abs=2e-8)
    compared = 0
    for coordinate in mw.MuscleSystem(compiled(NAME)).coordinates:
        path = tmp_path / f"a_MuscleAnalysis_MomentArm_{coordinate}.sto"
        if path.exists():
            arms = mw.read_table(path)
            for muscle, values in frozen["moment_arms"][coordinate].items():
                assert arms[muscle] == pytest.approx(values, abs=2e-8)
                compared += 1
    assert compared >= 27


def test_motions_that_do_not_fit_the_model_are_refused():
    model = mujoco.MjModel.from_xml_string("<mujoco/>")
    with pytest.raises(mw.StateError, match=r"qpos \(T, 0\)"):
        mw.osim.motion_table(model, [0.0], np.zeros((1, 2)))
    with pytest.raises(mw.StateError, match="finite"):
        mw.osim.motion_table(model, [np.nan], np.zeros((1, 0)))


def test_run_and_replay_write_the_motion_for_opensim(tmp_path, capsys):
    model = compiled(NAME)
    imported(NAME).save(tmp_path / "m.xml")
    run = ["--duration", 0.05, "--excitation", "pulses", "--out", tmp_path / "s.sto", "--columns", "qpos"]
    ran = run_here("run", capsys, tmp_path / "m.xml", *run, "--motion", tmp_path / "m.mot")
    assert ran.code == 0, ran.err
    motion, states = mw.read_table(tmp_path / "m.mot"), mw.read_table(tmp_path / "s.sto")
    assert motion.metadata["inDegrees"] == "no"
    assert len(motion.time) == 11
    assert set(mw.osim.coordinates(model, mujoco.MjData(model))) == set(motion.names)
    for name in (model.joint(i).name for i in range(model.njnt)):
        assert np.array_equal(motion[name], states[f"qpos:{name}"])
    assert (
        np.ptp(motion["knee_angle_pat_r"]) > 1e-4
    )  # the patella's coordinate is no joint, and follows the knee
    again = ["--model", tmp_path / "m.xml", "--motion", tmp_path / "again.sto"]
    ran = run_here("replay", capsys, tmp_path / "m.mot", *again)
    assert ran.code == 0, ran.err
    assert np.array_equal(mw.read_table(tmp_path / "again.sto").values, motion.values)


@pytest.mark.parametrize("arguments", [["run", "m.xml"], ["replay", "m.mot", "--model", "m.xml"]])
def test_a_motion_is_mot_or_sto(arguments, table, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    imported(NAME).save("m.xml")
    mw.write_table("m.mot", table)
    ran = run_here(arguments[0], capsys, *arguments[1:], "--motion", "m.csv")
    assert ran.code == 2
    assert "--motion 'm.csv'" in ran.err
