"""A bad place, a full disk, an error or Ctrl-C: a recording is whole or not there, and the error says why."""

import collections
import contextlib
import os
import signal
import subprocess
import sys
import time
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import mjwrap as mw

pytest.importorskip("rerun", reason="recordings need the rerun-sdk package")

from made_up_runs import ROOT, XML, Muscles, moving, read, recorder, simulate, states

from mjwrap.recording import read_summary


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(XML)


@pytest.mark.parametrize(
    ("place", "message"),
    [
        ("file/missing/run.rrd", "file' is not a folder"),
        ("run.txt", r"must end in \.rrd.*run\.rrd"),
        ("folder.rrd", "is a folder"),
        ("file/run.rrd", "is not a folder"),
        ("device.rrd", "a device or a pipe"),
    ],
)
def test_a_bad_path_is_an_error_before_the_run(
    model: mujoco.MjModel, tmp_path: Path, place: str, message: str
) -> None:
    (tmp_path / "folder.rrd").mkdir()
    (tmp_path / "file").touch()
    (tmp_path / "device.rrd").symlink_to("/dev/full")
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(mw.RecordingError, match=message) as caught:
        recorder(model, Muscles(model), tmp_path / place)
    assert str(tmp_path / place) in str(caught.value)
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="permissions do not bind this user")
def test_a_folder_without_permission_is_an_error_before_the_run(
    model: mujoco.MjModel, tmp_path: Path
) -> None:
    tmp_path.chmod(0o500)
    try:
        with pytest.raises(mw.RecordingError, match="permission denied"):
            recorder(model, Muscles(model), tmp_path / "run.rrd")
    finally:
        tmp_path.chmod(0o700)


@pytest.mark.parametrize(
    "option",
    [
        {"path_rate": 0}, {"path_rate": np.nan}, {"rate": "60"}, {"rate": np.inf}, {"flush_every": 0},
        {"flush_every": 2.5}, {"flush_every": 1e3}, {"spacing": -1}, {"force_scale": "big"},
    ],
)  # fmt: skip
def test_a_bad_option_is_an_error(model: mujoco.MjModel, tmp_path: Path, option: dict[str, Any]) -> None:
    with pytest.raises(mw.RecordingError, match=f"{next(iter(option))} must be"):
        recorder(model, Muscles(model), tmp_path / "run.rrd", **option)
    assert list(tmp_path.iterdir()) == []


def test_room_that_is_not_there_leaves_nothing(model: mujoco.MjModel, tmp_path: Path) -> None:
    with pytest.raises(MemoryError):
        recorder(model, Muscles(model), tmp_path / "run.rrd", flush_every=2**50)
    assert list(tmp_path.iterdir()) == []


def test_rerun_switched_off_is_an_error(
    model: mujoco.MjModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RERUN", "off")
    with pytest.raises(mw.RecordingError, match="RERUN=on"):
        recorder(model, Muscles(model), tmp_path / "run.rrd")
    assert list(tmp_path.iterdir()) == []


@contextlib.contextmanager
def room_for(size: int) -> Iterator[None]:
    """Let no file of this process grow beyond `size` bytes: what a full disk is to a writer."""
    resource = pytest.importorskip("resource", reason="needs POSIX resource limits")
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)


@pytest.mark.parametrize(
    "flush_every", [50, 10**6]
)  # the disk is full at a flush of log, or not before close
def test_a_full_disk_is_an_error_and_leaves_nothing_half_written(
    model: mujoco.MjModel, tmp_path: Path, flush_every: int
) -> None:
    path = tmp_path / "run.rrd"
    simulate(model, path, steps=3)
    old = path.read_bytes()
    with room_for(len(old) + 50_000), pytest.raises(mw.RecordingError, match="file too large") as caught:
        simulate(model, path, steps=20_000 if flush_every < 1000 else 3000, flush_every=flush_every)
    assert str(path) in str(caught.value)
    assert list(tmp_path.iterdir()) == [path]
    assert path.read_bytes() == old


def test_a_disk_too_full_for_the_last_bytes_is_an_error(model: mujoco.MjModel, tmp_path: Path) -> None:
    """The table of contents is written when the file is closed, where rerun itself reports nothing."""
    simulate(model, tmp_path / "whole.rrd")
    size = (tmp_path / "whole.rrd").stat().st_size
    with room_for(size - 2000), pytest.raises(mw.RecordingError, match="file too large"):
        simulate(model, tmp_path / "run.rrd")
    assert list(tmp_path.iterdir()) == [tmp_path / "whole.rrd"]


def test_a_refused_rename_is_an_error(model: mujoco.MjModel, tmp_path: Path) -> None:
    """Somebody made a folder of that name during the run."""
    record = recorder(model, Muscles(model), tmp_path / "run.rrd")
    (tmp_path / "run.rrd").mkdir()
    with pytest.raises(mw.RecordingError, match="is a directory"):
        record.close()
    assert list(tmp_path.iterdir()) == [tmp_path / "run.rrd"]


def test_after_a_failure_no_more_is_logged(model: mujoco.MjModel, tmp_path: Path) -> None:
    muscles = Muscles(model)
    data = next(states(model, muscles, 1))
    record = recorder(model, muscles, tmp_path / "run.rrd", flush_every=1)
    with room_for(1000), pytest.raises(mw.RecordingError, match="too large"):
        collections.deque((record.log(data) for _ in range(1000)), maxlen=0)
    with pytest.raises(mw.RecordingError, match="failed before"):
        record.log(data)
    record.close()  # nothing left to do, nothing to complain of twice
    assert list(tmp_path.iterdir()) == []


def test_an_error_in_the_run_leaves_an_older_recording_as_it_was(
    model: mujoco.MjModel, tmp_path: Path
) -> None:
    path = tmp_path / "run.rrd"
    simulate(model, path, steps=3)
    old = path.read_bytes()
    muscles = Muscles(model)

    def run() -> None:
        with recorder(model, muscles, path, flush_every=5) as record:
            for step, data in enumerate(states(model, muscles, 40)):
                record.log(data)
                if step == 30:
                    raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        run()
    assert list(tmp_path.iterdir()) == [path]
    assert path.read_bytes() == old


def test_until_it_is_closed_an_older_recording_stays(model: mujoco.MjModel, tmp_path: Path) -> None:
    path = tmp_path / "run.rrd"
    simulate(model, path, steps=3)
    muscles = Muscles(model)
    with recorder(model, muscles, path, flush_every=5) as record:
        for data in states(model, muscles, 40):
            record.log(data)
        assert read_summary(path).states == 3
    assert read_summary(path).states == 40
    assert list(tmp_path.iterdir()) == [path]


def test_ctrl_c_leaves_a_recording_of_what_was_logged(model: mujoco.MjModel, tmp_path: Path) -> None:
    muscles = Muscles(model)

    def run() -> None:
        with recorder(model, muscles, tmp_path / "run.rrd", flush_every=7) as record:
            for step, data in enumerate(states(model, muscles, 40)):
                record.log(data)
                if step == 24:
                    os.kill(os.getpid(), signal.SIGINT)
                    time.sleep(1)  # the signal arrives in here

    with pytest.raises(KeyboardInterrupt):
        run()
    summary = read_summary(tmp_path / "run.rrd")
    assert (summary.states, summary.end) == (25, 0.048)


def test_ctrl_c_during_a_flush_neither_loses_nor_repeats_a_row(
    model: mujoco.MjModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from mjwrap.recording.stream import Stream

    send = Stream.send

    def interrupted(self: Stream, batches: list[Any]) -> None:
        os.kill(os.getpid(), signal.SIGINT)
        send(self, batches)

    muscles = Muscles(model)
    handler = signal.getsignal(signal.SIGINT)

    def run() -> None:
        with recorder(model, muscles, tmp_path / "run.rrd", flush_every=7) as record:
            for step, data in enumerate(states(model, muscles, 40)):
                monkeypatch.setattr(Stream, "send", interrupted if step == 13 else send)
                record.log(data)

    with pytest.raises(KeyboardInterrupt):
        run()
    times = [t for t, _ in moving(read(tmp_path / "run.rrd")["/length/BIC"]["Scalars:scalars"])]
    assert times == [2_000_000 * step for step in range(14)]
    assert signal.getsignal(signal.SIGINT) is handler


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
def test_a_process_forked_during_the_run_does_not_hold_up_the_end(
    model: mujoco.MjModel, tmp_path: Path
) -> None:
    code = f"""
import os, signal, sys, time
sys.path[:0] = [{str(ROOT)!r}, {str(ROOT / "tests")!r}]
import mujoco, made_up_runs as t
from mjwrap.recording import read_summary
model = mujoco.MjModel.from_xml_string(t.XML)
muscles = t.Muscles(model)
with t.recorder(model, muscles, t.Path({str(tmp_path / "run.rrd")!r})) as record:
    for data in t.states(model, muscles, 40):
        record.log(data)
    child = os.fork()
    if child == 0:
        time.sleep(60)
        os._exit(0)
print(read_summary({str(tmp_path / "run.rrd")!r}).states)
os.kill(child, signal.SIGKILL)
"""
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=30
    )
    assert done.stdout == "40\n"


def test_a_closed_recorder_takes_no_more(model: mujoco.MjModel, tmp_path: Path) -> None:
    muscles = Muscles(model)
    data = next(states(model, muscles, 1))
    record = recorder(model, muscles, tmp_path / "run.rrd")
    record.log(data)
    record.close()
    record.close()
    with pytest.raises(mw.RecordingError, match=r"cannot log to '.*run\.rrd': it is closed"):
        record.log(data)


@pytest.mark.parametrize("later", [0.001, np.nan])
def test_time_goes_forward(model: mujoco.MjModel, tmp_path: Path, later: float) -> None:
    muscles = Muscles(model)
    data = next(states(model, muscles, 1))
    with recorder(model, muscles, tmp_path / "run.rrd") as record:
        muscles.time = 0.5
        record.log(data)
        muscles.time = later
        with pytest.raises(mw.RecordingError, match="after a reset"):
            record.log(data)
    assert read_summary(tmp_path / "run.rrd").states == 1


def test_a_forgotten_recorder_is_reported(model: mujoco.MjModel, tmp_path: Path) -> None:
    record = recorder(model, Muscles(model), tmp_path / "run.rrd")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        del record
    assert [w.category for w in caught] == [RuntimeWarning]
    assert "never closed" in str(caught[0].message)
    assert list(tmp_path.iterdir()) == []
