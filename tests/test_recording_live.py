"""A recording streamed to a running viewer: here rerun's own server, which writes what arrives into a file."""

import os
import signal
import socket
import subprocess
import sys
import time
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import mujoco
import pytest

import mjwrap as mw

pytest.importorskip("rerun", reason="recordings need the rerun-sdk package")

from made_up_runs import XML, Muscles, recorder, simulate, states
from rerun.chunk import RrdReader

from mjwrap.recording import read_summary

pytestmark = pytest.mark.skipif(os.name != "posix", reason="ends the server with a signal")


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(XML)


@contextmanager
def server(got: Path) -> Iterator[tuple[str, "subprocess.Popen[bytes]"]]:
    """A process that takes the place of the viewer; its address."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    command = [sys.executable, "-m", "rerun_cli", "--save", str(got), "--port", str(port)]
    process = subprocess.Popen(
        command, start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    try:
        deadline = time.monotonic() + 60
        while True:
            try:
                socket.create_connection(("127.0.0.1", port), timeout=1).close()
                break
            except OSError:
                assert time.monotonic() < deadline, "the server does not come up"
                time.sleep(0.05)
        yield f"rerun+http://127.0.0.1:{port}/proxy", process
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def tensions(path: Path) -> list[float]:
    """The rows of a muscle that have arrived, in a file that may still grow."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # rerun warns of the missing table of contents
        reader = RrdReader(path)
        chunks = [c for c in reader.stream() if c.entity_path == "/tension/BIC" and not c.is_static]
    return [value[0] for c in chunks for value in c.to_record_batch().column("Scalars:scalars").to_pylist()]


def arrived(path: Path, count: int) -> list[float]:
    """The rows once there are `count` of them."""
    deadline = time.monotonic() + 30
    while True:
        try:
            rows = tensions(path)
        except (RuntimeError, ValueError):  # cut in the middle of a message
            rows = []
        if len(rows) >= count or time.monotonic() > deadline:
            return rows
        time.sleep(0.1)


@pytest.mark.parametrize("beside", [False, True])
def test_a_viewer_gets_every_state(model: mujoco.MjModel, tmp_path: Path, beside: bool) -> None:
    file = tmp_path / "run.rrd" if beside else None
    with server(tmp_path / "got.rrd") as (address, _):
        log, _ = simulate(model, file, connect=address)
        assert arrived(tmp_path / "got.rrd", len(log)) == [s.tension[0] for s in log]
    if file is not None:
        assert read_summary(file).states == len(log)


def test_states_arrive_while_the_run_goes_on(model: mujoco.MjModel, tmp_path: Path) -> None:
    muscles = Muscles(model)
    with server(tmp_path / "got.rrd") as (address, _), recorder(model, muscles, None, connect=address) as run:
        for data in states(model, muscles, 5):
            run.log(data)
            time.sleep(0.25)  # a batch is due five times a second
        assert len(arrived(tmp_path / "got.rrd", 4)) >= 4


def lose_the_viewer(model: mujoco.MjModel, got: Path, path: Path | None) -> None:
    """Record 100 states, in batches of ten, to a viewer that ends after twenty."""
    muscles = Muscles(model)
    with (
        server(got) as (address, process),
        recorder(model, muscles, path, connect=address, flush_every=10) as run,
    ):
        for k, data in enumerate(states(model, muscles, 100)):
            run.log(data)
            if k == 20:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
                time.sleep(0.5)


def test_a_viewer_that_goes_away_leaves_the_file(model: mujoco.MjModel, tmp_path: Path) -> None:
    with pytest.warns(RuntimeWarning, match=r"is gone; the recording to .* continues"):
        lose_the_viewer(model, tmp_path / "got.rrd", tmp_path / "run.rrd")
    assert read_summary(tmp_path / "run.rrd").states == 100


def test_a_viewer_that_goes_away_without_a_file_is_an_error(model: mujoco.MjModel, tmp_path: Path) -> None:
    with pytest.raises(mw.RecordingError, match=r"the viewer at .* is gone"):
        lose_the_viewer(model, tmp_path / "got.rrd", None)


def test_nobody_to_stream_to_is_said_before_the_run(model: mujoco.MjModel, tmp_path: Path) -> None:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        address = f"rerun+http://127.0.0.1:{probe.getsockname()[1]}/proxy"
    with pytest.raises(mw.RecordingError, match=r"cannot connect to a viewer .* start one first"):
        recorder(model, Muscles(model), tmp_path / "run.rrd", connect=address)
    with pytest.raises(mw.RecordingError, match="an address looks like rerun"):
        recorder(model, Muscles(model), None, connect="localhost:9876")
    with pytest.raises(mw.RecordingError, match="a recording needs a file name"):
        recorder(model, Muscles(model), None)
    assert not list(tmp_path.iterdir())
