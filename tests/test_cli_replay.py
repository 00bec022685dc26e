"""mjwrap replay: says what a recording holds, serves it, and refuses a damaged one in one line."""

import json
import re
import signal
import socket
import subprocess
import sys
import time
import urllib.request
from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np
import pytest

pytest.importorskip("rerun", reason="recordings need the rerun-sdk package")

from cli_runs import CASE2, ELBOW, Ran, run_here, start
from made_up_runs import XML, simulate

import mjwrap as mw
from mjwrap.recording import read_summary


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(XML)


def replay(*arguments: object) -> "subprocess.CompletedProcess[str]":
    command = [sys.executable, "-m", "mjwrap", "replay", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)


def test_replay_prints_what_a_recording_holds(model: mujoco.MjModel, tmp_path: Path) -> None:
    simulate(model, tmp_path / "run.rrd", steps=30)
    done = replay(tmp_path / "run.rrd", "--info")
    assert (done.returncode, done.stderr) == (0, "")
    assert "0 s to 0.058 s, 30 states" in done.stdout
    assert "2: BIC, my muscle/2" in done.stdout
    assert "/world/muscles/BIC/path" in done.stdout


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        ("missing", "there is no recording"),
        ("empty", "not a complete recording"),
        ("text", "not a complete recording"),
        ("cut", "not a complete recording"),
        ("no end", "is incomplete"),
        ("scratched", "not a complete recording"),
    ],
)
def test_replay_refuses_a_damaged_file_in_one_line(
    model: mujoco.MjModel, tmp_path: Path, damage: str, message: str
) -> None:
    path = tmp_path / "run.rrd"
    simulate(model, path, steps=3000)
    whole = path.read_bytes()
    middle = len(whole) // 2
    damaged = {
        "empty": b"",
        "text": b"<mujoco/>\n" * 100,
        "cut": whole[:middle],
        "no end": whole[:-20],
        "scratched": whole[: middle // 2] + bytes(middle) + whole[middle // 2 + middle :],
    }
    path.unlink() if damage == "missing" else path.write_bytes(damaged[damage])
    done = replay(path, "--info")
    assert done.returncode == 2
    assert done.stdout == ""
    assert message in done.stderr
    assert str(path) in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_replay_serves_to_a_browser(model: mujoco.MjModel, tmp_path: Path) -> None:
    simulate(model, tmp_path / "run.rrd", steps=3)
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
        taken = replay(tmp_path / "run.rrd", "--serve", "--port", port)
    assert taken.returncode == 2
    assert f"cannot serve at port {port}" in taken.stderr

    command = [sys.executable, "-m", "mjwrap", "replay", str(tmp_path / "run.rrd"), "--serve"]
    with subprocess.Popen([*command, "--port", str(port)], stdout=subprocess.PIPE, text=True) as server:
        assert server.stdout is not None
        started, stop, address = (server.stdout.readline() for _ in range(3))
        assert f"a browser on this machine at port {port}, and the recording (" in started
        assert f"at port {port + 1}" in started
        assert "Ctrl-C" in stop
        assert address.startswith(f"open http://127.0.0.1:{port}")  # the last line
        check_serving(server, address.split()[-1], port)


def check_serving(server: "subprocess.Popen[str]", address: str, port: int) -> None:
    """See that a browser gets a page, and that Ctrl-C ends all that serves it."""
    try:
        assert address.startswith(f"http://127.0.0.1:{port}?url=")
        assert b"<html" in urllib.request.urlopen(address, timeout=5).read()
    finally:
        server.send_signal(signal.SIGINT)
        assert server.wait(timeout=20) == 0
    for number in (port, port + 1):
        with socket.socket() as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind(("127.0.0.1", number))  # nobody is left there


def test_a_run_is_served_to_a_browser(tmp_path: Path) -> None:
    """The run sends its states to the server, which is there before it and stays after it."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    options = [
        "--duration",
        0.1,
        "--sample",
        0.002,
        "--serve",
        "--port",
        port,
        "--record",
        tmp_path / "r.rrd",
    ]
    with start("run", ELBOW, *options, "--groups", "flexors=BIC*,BRA", "--rate", 60) as run:
        assert run.stderr is not None
        started = run.stderr.readline()
        assert f"a browser on this machine at port {port}, and the run at port {port + 1}" in started
        (address,) = re.findall(r"open (http\S+)", run.stderr.readline())
        assert any("still served" in line for line in run.stderr)  # the run is over
        assert run.stderr.readline() == f"mjwrap run: open {address}\n"
        check_serving(run, address, port)
    held = read_summary(tmp_path / "r.rrd")
    assert held.states == 7  # the 2 ms steps after every 60th of a second, and the first
    assert "/groups/activation/flexors" in held.entities


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP"])
def test_a_server_that_is_ended_leaves_nobody_behind(
    name: str, model: mujoco.MjModel, tmp_path: Path
) -> None:
    simulate(model, tmp_path / "run.rrd", steps=3)
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    command = [sys.executable, "-m", "mjwrap", "replay", str(tmp_path / "run.rrd"), "--serve"]
    with subprocess.Popen([*command, "--port", str(port)], stdout=subprocess.PIPE, text=True) as server:
        try:
            assert server.stdout is not None
            *_, address = (server.stdout.readline().split()[-1] for _ in range(3))
            until(lambda: answers(address), "the server answers")
            number = getattr(signal, name)
            server.send_signal(number)
            assert server.wait(timeout=20) == 128 + number
        finally:
            server.terminate()  # without it a failure would wait for the server without end
    until(lambda: not answers(address), "the server is gone")


def until(holds: Callable[[], bool], what: str) -> None:
    deadline = time.monotonic() + 30
    while not holds():
        assert time.monotonic() < deadline, what
        time.sleep(0.05)


def answers(address: str) -> bool:
    try:
        with urllib.request.urlopen(address, timeout=5) as page:
            return b"<html" in page.read()
    except OSError:
        return False


# -------------------------------------------------------------------------- from a table of states


def here(capsys: pytest.CaptureFixture[str], *arguments: object) -> Ran:
    return run_here("replay", capsys, *arguments)


@pytest.mark.parametrize("suffix", [".csv", ".sto", ".npz"])
def test_the_states_of_a_run_give_its_paths_again(
    suffix: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run, again = tmp_path / f"run{suffix}", tmp_path / "again.npz"
    options = ["--excitation", "pulses", "--duration", 0.2, "--keyframe", "flexed"]
    assert run_here("run", capsys, ELBOW, *options, "--out", run).code == 0
    kinds = ["--columns", "qpos,qvel,activation,length,velocity,tension"]
    ran = here(capsys, run, "--model", ELBOW, "--out", again, "--record", tmp_path / "r.rrd", *kinds)
    assert (ran.code, ran.err) == (0, "")
    assert ran.out.splitlines()[0] == f"{run}: 51 states of {ELBOW}, 0 s to 0.2 s"
    first, second = mw.read_table(run), mw.read_table(again)
    assert np.array_equal(first.time, second.time)
    for name in second.names:
        assert first[name] == pytest.approx(second[name], rel=1e-12, abs=1e-15), name
    assert "0 s to 0.2 s, 51 states" in here(capsys, tmp_path / "r.rrd", "--info").out


def test_states_by_opensims_names_in_degrees(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Of each column it is known what it is; velocities that are not there are differences."""
    path, out = tmp_path / "ik.mot", tmp_path / "t.csv"
    time = np.linspace(0.0, 1.0, 201)
    angle = 60.0 + 30.0 * np.sin(2 * np.pi * time)
    names = ("/jointset/elbow/elbow_flexion/value", "/forceset/BRA/activation", "/ground_force/px")
    values = np.column_stack([angle, 0.25 + 0.0 * time, time])
    mw.write_table(path, mw.Table(time, names, values, {"inDegrees": "yes"}))
    ran = here(capsys, path, "--model", ELBOW, "--out", out, "--columns", "qpos,qvel,activation", "--json")
    facts = json.loads(ran.out)
    assert facts["remarks"] == [
        "velocities are differences of the positions",
        "6 of 7 activations missing, taken from the start: TRIlong, TRIlat, TRImed, BIClong, BICshort, ...",
        "1 column not used: /ground_force/px",
    ]
    table = mw.read_table(out)
    assert table["qpos:elbow_flexion"] == pytest.approx(np.radians(angle), rel=1e-15)
    assert table["activation:BRA"] == pytest.approx(np.full(201, 0.25))
    assert not table["activation:TRIlat"].any()
    exact = np.radians(30.0) * 2 * np.pi * np.cos(2 * np.pi * time)
    assert (
        np.abs(table["qvel:elbow_flexion"] - exact)[1:-1].max()
        < np.radians(30.0) * (2 * np.pi) ** 3 / 6 * 0.005**2
    )


def test_arrays_of_states_need_no_names(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = mujoco.MjModel.from_xml_path(ELBOW)
    qpos, qvel = np.linspace(0.2, 1.0, 5)[:, None], np.ones((5, 1))
    act = np.random.default_rng(0).uniform(size=(5, model.na))
    np.savez(tmp_path / "s.npz", time=np.arange(5) / 5, qpos=qpos, qvel=qvel, act=act)
    ran = here(
        capsys, tmp_path / "s.npz", "--model", ELBOW, "--out", tmp_path / "t.csv", "--columns", "tension"
    )
    assert (ran.code, ran.err) == (0, "")
    table = mw.read_table(tmp_path / "t.csv")
    muscles, data = mw.MuscleSystem(model), mujoco.MjData(model)
    for k in range(5):
        data.qpos[:], data.qvel[:], data.act[:] = qpos[k], qvel[k], act[k]
        muscles.forward(data)
        assert table.values[k] == pytest.approx(muscles.tension, rel=1e-12)


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["{states}"], "is a table of states: name its model with --model"),
        (["{states}", "--model", "nowhere.xml"], "nowhere.xml does not exist"),
        (["{states}", "--model", CASE2], "no column names a joint; the model has: cylinder_y"),
        (["{states}", "--model", ELBOW, "--out", "{folder}/t.pdf"], "must end in .sto"),
        (["{states}", "--model", ELBOW, "--record", "{folder}/r.txt"], "must end in .rrd"),
        (["{states}", "--model", ELBOW, "--keyframe", "bent", "--info"], "'bent'; keyframes"),
        (["{folder}/no.csv", "--model", ELBOW], "no such file"),
        (["{folder}/no.rrd", "--model", ELBOW], "--model needs a table of states"),
        (["{folder}/no.rrd"], "there is no recording"),
    ],
)
def test_a_mistake_with_states_is_told_in_one_line(
    arguments: list[str], told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    states = tmp_path / "s.csv"
    states.write_text("time,elbow_flexion\n0,1\n1,1.2\n")
    ran = here(capsys, *(a.format(states=states, folder=tmp_path) for a in arguments))
    assert ran.code == 2
    assert told in ran.err
    assert len(ran.err.splitlines()) == 1
    assert [p.name for p in tmp_path.iterdir()] == ["s.csv"]
