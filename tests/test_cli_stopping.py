"""Ctrl-C, kill and a closed terminal: what was done is kept whole, or nothing is."""

import json
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np
import pytest
from cli_runs import (
    ELBOW,
    Ran,
    finish,
    only_files,
    rows_of,
    said,
    start,
)

import mjwrap as mw
from mjwrap.recording import read_summary

SIGNALS = [(signal.SIGINT, 130, "Ctrl-C"), (signal.SIGTERM, 143, "SIGTERM"), (signal.SIGHUP, 129, "SIGHUP")]


def stop_when(process: "subprocess.Popen[str]", number: int, ready: Callable[[], bool]) -> Ran:
    """Send a signal to a command once it has come far enough, and wait for its end."""
    deadline = time.monotonic() + 60
    while not ready():
        assert time.monotonic() < deadline, "the run did not start"
        assert process.poll() is None, process.communicate()
        time.sleep(0.02)
    process.send_signal(number)
    return finish(process)


@pytest.mark.parametrize(("number", "code", "name"), SIGNALS)
def test_a_run_that_is_stopped_keeps_what_was_simulated(
    number: int, code: int, name: str, tmp_path: Path
) -> None:
    table, plot, recording, facts = (tmp_path / name for name in ("c.csv", "p.png", "r.rrd", "j.json"))
    outputs = ["--csv", table, "--plot", plot, "--record", recording, "--json", facts]
    process = start("run", ELBOW, "--duration", 1e5, "--excitation", "random", *outputs)
    ran = stop_when(
        process,
        number,
        lambda: any(p.suffix == ".csv" and p.stat().st_size > 20_000 for p in tmp_path.iterdir()),
    )
    assert ran.code == code, ran.err
    assert said(ran) == [f"mjwrap run: stopped by {name}; the files contain the run up to this moment"]
    only_files(tmp_path, "c.csv", "p.png", "r.rrd", "j.json")
    assert json.loads(facts.read_text())["stopped_by"] == name
    times = np.array([row["time"] for row in rows_of(table)])
    # whole rows to the last, 4 or 6 ms apart
    assert np.diff(times) == pytest.approx(0.006 * np.ones(len(times) - 1), abs=0.0045)
    held = read_summary(recording)
    assert (held.states, held.end) == (len(times), pytest.approx(times[-1], abs=1e-9))


@pytest.mark.parametrize(("number", "code", "name"), SIGNALS[1:])
def test_what_is_stopped_before_it_has_a_result_leaves_nothing(
    number: int, code: int, name: str, tmp_path: Path
) -> None:
    """As soon as the first file is there: the run compiles or begins, the comparison is at its first poses."""
    old = tmp_path / "c.csv"
    old.write_text("an older file")
    process = start("compare", ELBOW, "--samples", 2001, "--csv", old, "--report", tmp_path / "r.html")
    ran = stop_when(process, number, lambda: len(list(tmp_path.iterdir())) > 2)
    assert (ran.code, said(ran)) == (code, [f"mjwrap compare: stopped by {name}"])
    only_files(tmp_path, "c.csv")
    assert old.read_text() == "an older file"


def test_a_recording_without_a_state_is_not_kept(tmp_path: Path) -> None:
    model = mujoco.MjModel.from_xml_path(ELBOW)
    with pytest.raises(KeyboardInterrupt), mw.Recorder(model, mw.MuscleSystem(model), tmp_path / "r.rrd"):
        raise KeyboardInterrupt
    only_files(tmp_path)


def test_a_closed_terminal_that_is_ignored_stays_ignored(tmp_path: Path) -> None:
    """As under nohup."""
    process = start(
        "run", ELBOW, "--duration", 0.1, "--csv", tmp_path / "c.csv",
        preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN),
    )  # fmt: skip
    ran = stop_when(process, signal.SIGHUP, lambda: any(tmp_path.iterdir()))
    assert (ran.code, said(ran)) == (0, [])


def test_replayed_states_are_kept_as_far_as_they_came(tmp_path: Path) -> None:
    states, table = tmp_path / "states.npz", tmp_path / "t.csv"
    time = np.linspace(0.0, 1.0, 1_000_000)
    np.savez(states, time=time, qpos=np.full((len(time), 1), 0.5), qvel=np.zeros((len(time), 1)))
    process = start("replay", states, "--model", ELBOW, "--out", table)
    ran = stop_when(
        process,
        signal.SIGTERM,
        lambda: any(p.suffix == ".csv" and p.stat().st_size > 20_000 for p in tmp_path.iterdir()),
    )
    assert (ran.code, said(ran)) == (143, ["mjwrap replay: stopped by SIGTERM"])
    only_files(tmp_path, "states.npz", "t.csv")
    assert f": {len(rows_of(table))} states of " in ran.out
