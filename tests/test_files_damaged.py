"""Damaged tables are a `TableError`, whatever is damaged; what killed processes have left goes with the next run."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import mjwrap as mw
from mjwrap.files.leftovers import part_name, remove_leftovers

CASES = Path(__file__).resolve().parents[2] / "shared" / "cases" / "34_damaged_npz"
NUMBER = 250


def written(suffix: str, folder: Path) -> Path:
    path = folder / f"table{suffix}"
    time = np.linspace(0.0, 1.0, 21)
    values = np.random.default_rng(0).normal(size=(21, 3))
    mw.write_table(path, mw.Table(time, ("a", "b c", "ü"), values, {"inDegrees": "no"}))
    return path


def damaged(whole: bytes, rng: np.random.Generator) -> bytes:
    """Return a file with flipped, missing, repeated or foreign bytes."""
    found = bytearray(whole)
    for _ in range(rng.integers(1, 4)):
        at = int(rng.integers(len(found)))
        kind = rng.integers(5)
        if kind == 0:
            found[at] ^= 1 << int(rng.integers(8))
        elif kind == 1:
            found[at] = int(rng.integers(256))
        elif kind == 2:
            del found[at : at + int(rng.integers(1, 40))]
        elif kind == 3:
            found[at:at] = found[: int(rng.integers(1, 40))]
        else:
            del found[at:]
        if not found:
            break
    return bytes(found)


@pytest.mark.parametrize("suffix", [".npz", ".sto", ".mot", ".csv"])
def test_a_damaged_table_is_read_or_refused_by_name(suffix: str, tmp_path: Path) -> None:
    path = written(suffix, tmp_path)
    whole, rng, refused = path.read_bytes(), np.random.default_rng(34), 0
    for _ in range(NUMBER):
        path.write_bytes(damaged(whole, rng))
        try:
            table = mw.read_table(path)
        except mw.TableError:
            refused += 1
        else:
            assert table.values.dtype == np.float64
            assert np.isfinite(table.values).all()
    assert refused > NUMBER // 2


@pytest.mark.skipif(not CASES.is_dir(), reason="needs the shared cases beside the checkout")
@pytest.mark.parametrize("file", sorted(CASES.glob("*.npz")), ids=lambda file: file.stem)
def test_the_damaged_files_of_the_cases_are_refused(file: Path) -> None:
    with pytest.raises(mw.TableError, match=file.name):
        mw.read_table(file)


@pytest.mark.parametrize(
    "arrays",
    [
        {"time": np.array(1.0), "a": np.ones(1)},
        {"time": np.array(["0", "1"]), "a": np.ones(2)},
        {"time": np.zeros((2, 2)), "a": np.ones(2)},
        {"time": np.arange(0.0), "a": np.ones(0)},
        {"time": np.arange(2.0), "a": np.ones((2, 2, 2))},
        {"time": np.arange(2.0), "a": np.array(3.0)},
        {"time": np.arange(2.0), "columns": np.array(["a"]), "values": np.array([["x"], ["y"]])},
        {"time": np.arange(2.0), "columns": np.array(["a"]), "values": np.ones(2)},
        {"time": np.arange(2.0), "columns": np.array(["a", "b"]), "values": np.ones((2, 1))},
        {"time": np.arange(2.0) * 1j, "a": np.ones(2)},
        {"time": np.array([0.0, np.nan]), "a": np.ones(2)},
    ],
)
def test_arrays_of_other_shapes_and_kinds_are_refused(arrays: dict[str, np.ndarray], tmp_path: Path) -> None:
    np.savez(tmp_path / "table.npz", **arrays)  # pyright: ignore[reportArgumentType]
    with pytest.raises(mw.TableError, match=r"table\.npz"):
        mw.read_table(tmp_path / "table.npz")


# ------------------------------------------------------------------------------- what killed processes leave


WRITER = """
import os, sys
from mjwrap.files.atomic import PartFile
file = PartFile(sys.argv[1], ".csv")
file.open_text().write("time,a")
os._exit(9)
"""


def test_a_killed_process_leaves_a_part_that_the_next_output_removes(tmp_path: Path) -> None:
    target = tmp_path / "run.csv"
    target.write_text("from before")
    subprocess.run([sys.executable, "-c", WRITER, str(target)], check=False)
    (left,) = [path for path in tmp_path.iterdir() if path != target]
    assert left.name.startswith(".run.")
    assert target.read_text() == "from before"
    written(".csv", tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["run.csv", "table.csv"]


def test_what_is_in_use_or_not_ours_stays(tmp_path: Path) -> None:
    own, dead = part_name(tmp_path / "run.csv"), subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    pid = str(os.getpid())
    names = [
        own,
        own.replace(pid, "1"),  # a process of another user
        own.replace(f"-{pid}-", f"elsewhere-{dead.pid}-"),  # of another machine
        f".run.{dead.pid}.part.csv",
        "run.part.csv",
    ]
    for name in names:
        (tmp_path / name).touch()
    gone = tmp_path / own.replace(f"-{pid}-", f"-{dead.pid}-")
    gone.touch()
    assert remove_leftovers(tmp_path) == [gone]
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(names)
