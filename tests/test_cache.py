"""Machine code is compiled once, with one line of notice, kept where that can be, and never older than its sources."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numba
import pytest
from numba.core import config

import mjwrap as mw
from mjwrap.kernels import _jit

PACKAGE = Path(mw.__file__).parent
NOTICE = "mjwrap: compiling its kernels"
PATIENCE = 5.0  # [s] 2 is the aim; machines that run tests are busy

# A path over a cylinder and a sphere with a via point between them: most of what is compiled.
SOLVE = """
import json, mjwrap as mw
row = [mw.Obstacle(mw.Cylinder(0.03), hint=(0.0, 0.03, 0.0)), mw.ViaPoint((-0.06, 0.01, 0.01)),
       mw.Obstacle(mw.Sphere(0.02), pos=(-0.1, 0.0, 0.01), hint=(0.0, 0.02, 0.0))]
path = mw.solve_path((0.1, 0.01, 0.0), (-0.2, 0.0, 0.02), row)
twists = [[0.1, 0.2, 0.3, 1.0, -0.5, 0.2]] * 3
from mjwrap.kernels import _jit
print(json.dumps({
    "numbers": [path.length, path.speed((0.1, 0, 0), (0, 0.2, 0), twists), *path.wrenches(5.0).ravel().tolist(),
                *path.points(0.01).ravel().tolist()],
    "converged": bool(path.converged), "folder": _jit._CACHE}))
"""
# The same path as a sweep, which calls compiled code that a solution of one path has kept already.
SWEEP = (
    SOLVE.split("path =")[0]
    + """
import numpy as np
from mjwrap.kernels import _jit
pos = np.tile([[0.0, 0.0, 0.0], [-0.06, 0.01, 0.01], [-0.1, 0.0, 0.01]], (3, 1, 1))
quat = np.tile([1.0, 0.0, 0.0, 0.0], (3, 3, 1))
sweep = mw.solve_sweep((0.1, 0.01, 0.0), (-0.2, 0.0, 0.02), row, pos, quat)
print(json.dumps({"numbers": sweep.length.tolist(), "folder": _jit._CACHE}))
"""
)
# A kernel that compiles in seconds, and that calls one in another file.
PULL = """
import json, numpy as np
from mjwrap.kernels import _jit
from mjwrap.kernels.musculotendon import fiber
print(json.dumps({"numbers": [fiber.velocity_curve(2, 0.3)[0]], "folder": _jit._CACHE}))
"""


@dataclass
class Run:
    """What one program said and how long it took [s], interpreter and imports included."""

    numbers: list[float]
    folder: Path
    told: list[str]
    seconds: float


def run(program: str, home: Path, package: Path = PACKAGE, **environment: str) -> Run:
    """Run a program in a fresh interpreter whose caches are under `home`."""
    kept = {key: value for key, value in os.environ.items() if not key.startswith(("NUMBA", "XDG"))}
    kept |= {"PYTHONPATH": str(package.parent), "XDG_CACHE_HOME": str(home), "TMPDIR": str(home.parent)}
    started = time.perf_counter()
    done = subprocess.run(
        [sys.executable, "-c", program],
        capture_output=True,
        text=True,
        env=kept | environment,
        cwd=home.parent,
    )
    seconds = time.perf_counter() - started
    assert done.returncode == 0, done.stderr
    said: dict[str, Any] = json.loads(done.stdout)
    assert said.get("converged", True)
    return Run(said["numbers"], Path(said["folder"]), done.stderr.splitlines(), seconds)


@dataclass
class Starts:
    """The first start of a program on a machine and the second."""

    home: Path
    first: Run
    second: Run


@pytest.fixture(scope="module")
def starts(tmp_path_factory: pytest.TempPathFactory) -> Starts:
    home = tmp_path_factory.mktemp("machine") / "cache"
    return Starts(home, run(SOLVE, home), run(SOLVE, home))


# -------------------------------------------------------------------------- first and second start


@pytest.mark.slow
def test_the_first_start_says_in_one_line_that_it_compiles(starts: Starts) -> None:
    assert len(starts.first.told) == 1
    assert starts.first.told[0].startswith(NOTICE)


@pytest.mark.slow
def test_machine_code_is_kept_in_the_users_cache(starts: Starts, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("NUMBA_BOUNDSCHECK", raising=False)
    assert starts.first.folder.is_relative_to(starts.home)
    assert starts.first.folder.name == _jit.source_hash()
    assert list(starts.first.folder.rglob("*.nbc"))


@pytest.mark.slow
def test_the_second_start_is_silent_and_fast_and_finds_the_same_bits(
    starts: Starts, capsys: pytest.CaptureFixture[str]
) -> None:
    with capsys.disabled():
        print(f"\nfirst start {starts.first.seconds:.1f} s, second {starts.second.seconds:.2f} s")
    assert starts.second.told == []
    assert starts.second.numbers == starts.first.numbers
    assert starts.second.seconds < PATIENCE


@pytest.mark.slow
def test_uncompiled_kernels_find_the_same(starts: Starts) -> None:
    plain = run(SOLVE, starts.home, NUMBA_DISABLE_JIT="1")
    assert plain.told == []
    # without fused multiply-adds: some rounding errors more, along a handful of Newton iterations
    assert plain.numbers == pytest.approx(starts.first.numbers, rel=1e-11, abs=1e-12)


@pytest.mark.slow
def test_machine_code_that_calls_other_code_finds_it(starts: Starts) -> None:
    """Large kernels are called by a symbol: its address has to be there before the caller, wherever that is kept."""
    assert run(SWEEP, starts.home).told  # links what the first start kept
    kept = list(starts.first.folder.rglob("geodesics.geodesic-*"))
    assert kept
    for path in kept:
        path.unlink()
    found = run(SWEEP, starts.home)
    assert len(found.told) == 1
    assert run(SWEEP, starts.home).told == []
    assert run(SOLVE, starts.home).numbers == starts.first.numbers
    assert found.numbers == pytest.approx(starts.first.numbers[:1] * 3, rel=1e-13)


# ----------------------------------------------------------------------- never older than its sources


def test_an_edit_in_a_called_file_is_noticed(tmp_path: Path) -> None:
    package, home = tmp_path / "mjwrap", tmp_path / "cache"
    shutil.copytree(PACKAGE, package, ignore=shutil.ignore_patterns("__pycache__"))
    before = run(PULL, home, package)
    assert before.told[0].startswith(NOTICE)
    assert run(PULL, home, package).told == []
    callee = package / "kernels" / "musculotendon" / "degroote_fregly.py"
    text = callee.read_text()
    assert text.count("0.8825327733249912") == 1
    callee.write_text(text.replace("0.8825327733249912", "0.9825327733249912"))
    after = run(PULL, home, package)
    assert after.told[0].startswith(NOTICE)
    assert after.folder != before.folder
    assert abs(after.numbers[0] - before.numbers[0]) > 1e-3
    callee.write_text(text)
    again = run(PULL, home, package)
    assert again.told == []
    assert again.numbers == before.numbers


LOOK = """
import json, mjwrap as mw
from mjwrap.kernels import _jit
muscles = [mw.Millard2012(100.0, 0.1, 0.2), mw.DeGrooteFregly2016(100.0, 0.1, 0.2), mw.MuscleSystem]
print(json.dumps({"numbers": [], "folder": _jit._CACHE}))
"""


def test_an_import_compiles_nothing(tmp_path: Path) -> None:
    assert run(LOOK, tmp_path / "cache").told == []


KERNELS = sorted(path.name for path in (PACKAGE / "kernels").glob("*.py"))


@pytest.mark.parametrize("name", KERNELS)
def test_every_kernel_source_counts(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for path in (PACKAGE / "kernels").glob("*.py"):
        shutil.copy(path, tmp_path)
    monkeypatch.setattr(_jit, "_HERE", tmp_path)
    before = _jit.source_hash()
    with (tmp_path / name).open("a") as file:
        file.write("# a remark\n")
    assert _jit.source_hash() != before


def test_what_else_starts_a_new_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A new kernel file, another numba, checked bounds; and each of them another one."""
    monkeypatch.delenv("NUMBA_BOUNDSCHECK", raising=False)
    hashes = [_jit.source_hash()]
    monkeypatch.setenv("NUMBA_BOUNDSCHECK", "1")
    hashes.append(_jit.source_hash())
    monkeypatch.delenv("NUMBA_BOUNDSCHECK")
    monkeypatch.setattr(numba, "__version__", "99.0")
    hashes.append(_jit.source_hash())
    for path in (PACKAGE / "kernels").glob("*.py"):
        shutil.copy(path, tmp_path)
    (tmp_path / "another_surface.py").touch()
    monkeypatch.setattr(_jit, "_HERE", tmp_path)
    hashes.append(_jit.source_hash())
    assert len(set(hashes)) == len(hashes)


# --------------------------------------------------------------------------------- where it is kept


@pytest.fixture
def places(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A machine on which every place for a cache is under one folder."""
    monkeypatch.setattr(config, "CACHE_DIR", "")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    return tmp_path


def test_the_cache_is_where_the_user_wants_it(places: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert _jit.cache_dir() == places / "xdg" / "mjwrap" / _jit.source_hash()
    monkeypatch.setattr(config, "CACHE_DIR", str(places / "numba"))
    assert _jit.cache_dir() == places / "numba" / "mjwrap" / _jit.source_hash()


def test_a_place_that_cannot_be_written_is_passed_over(places: Path) -> None:
    (places / "xdg").write_text("a file where a folder is wanted")
    found = _jit.cache_dir()
    assert found.is_relative_to(places / "temporary")
    assert found.name == _jit.source_hash()
    assert _jit.cache_dir() == found


def test_a_user_without_a_home(places: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_home() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setattr(Path, "home", no_home)
    assert _jit.cache_dir().is_relative_to(places / "temporary")


@pytest.mark.skipif(os.name == "nt", reason="files have no numbered owners there")
def test_machine_code_of_somebody_else_is_not_trusted(places: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Anyone may make the folder in the temporary one; loading machine code runs it."""
    (places / "xdg").touch()
    shared = _jit.cache_dir()
    me = os.getuid()
    monkeypatch.setattr(os, "getuid", lambda: me + 1)
    found = _jit.cache_dir()
    assert found != shared
    assert found.is_relative_to(places / "temporary")


def test_without_any_lasting_place_each_process_has_its_own(
    places: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    blocked = places / "blocked"
    blocked.touch()
    monkeypatch.setattr(_jit, "_candidates", lambda: [blocked, blocked / "below"])
    first, second = _jit.cache_dir(), _jit.cache_dir()
    assert first != second
    assert first.is_dir()
    assert second.is_relative_to(places / "temporary")


def test_kernels_run_from_a_place_passed_over_to(tmp_path: Path) -> None:
    blocked = tmp_path / "blocked"
    blocked.touch()
    found = run(PULL, blocked)
    assert found.folder.is_relative_to(tmp_path)
    assert not found.folder.is_relative_to(blocked)
    assert len(found.told) == 1
    assert run(PULL, blocked).told == []
