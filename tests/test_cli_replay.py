"""mjwrap replay: says what a recording holds, serves it, and refuses a damaged one in one line."""

import contextlib
import signal
import socket
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

import mujoco
import pytest

pytest.importorskip("rerun", reason="recordings need the rerun-sdk package")

from made_up_runs import XML, simulate


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
        ("no end", "cut short"),
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
        try:
            assert server.stdout is not None
            address = server.stdout.readline().split()[-1]
            assert address.startswith(f"http://127.0.0.1:{port}?url=")
            page = b""
            deadline = time.monotonic() + 30
            while not page and time.monotonic() < deadline:
                with contextlib.suppress(OSError):
                    page = urllib.request.urlopen(address, timeout=5).read()
            assert b"<html" in page
        finally:
            server.send_signal(signal.SIGINT)
            assert server.wait(timeout=20) == 0
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        probe.bind(("127.0.0.1", port))  # nobody is left there
