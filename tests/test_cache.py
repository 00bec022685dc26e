"""Machine code is compiled once, with one line of notice, kept where that can be, and never older than its sources."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import pytest
from fresh_starts import NOTICE, SOLVE, Run, copy_of_the_package, kernel_file, run

from mjwrap.kernels.compilation import import_closure, module_caches, probe, self_test

PATIENCE = 5.0  # [s] 2 is the aim; machines that run tests are busy

# The same path as a sweep, which calls compiled code that a solution of one path has kept already.
SWEEP = (
    SOLVE.split("path =")[0]
    + """
import numpy as np
from mjwrap.kernels.compilation import cache_folders
pos = np.tile([[0.0, 0.0, 0.0], [-0.06, 0.01, 0.01], [-0.1, 0.0, 0.01]], (3, 1, 1))
quat = np.tile([1.0, 0.0, 0.0, 0.0], (3, 3, 1))
sweep = mw.solve_sweep((0.1, 0.01, 0.0), (-0.2, 0.0, 0.02), row, pos, quat)
print(json.dumps({"numbers": sweep.length.tolist(), "folder": str(cache_folders.base())}))
"""
)
# A kernel that compiles in seconds, and that calls one in another file.
PULL = """
import json, numpy as np
from mjwrap.kernels.compilation import cache_folders
from mjwrap.kernels.musculotendon import dispatch
print(json.dumps({"numbers": [dispatch.velocity_curve(2, 0.3)[0]], "folder": str(cache_folders.base())}))
"""


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
    assert starts.first.folder == starts.home / "mjwrap"
    folders = {path.parent.name for path in starts.first.folder.rglob("*.nbc")}
    assert folders
    for folder in folders:
        module, _, version = folder.rpartition("-")
        assert version == import_closure.key(module, *module_caches.circumstances())


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
    package, home = copy_of_the_package(tmp_path), tmp_path / "cache"
    before = run(PULL, home, package)
    assert before.told[0].startswith(NOTICE)
    assert run(PULL, home, package).told == []
    callee = kernel_file(package, "degroote_fregly")
    text = callee.read_text()
    assert text.count("0.8825327733249912") == 1
    callee.write_text(text.replace("0.8825327733249912", "0.9825327733249912"))
    after = run(PULL, home, package)
    assert after.told[0].startswith(NOTICE)
    assert len([folder for folder in after.folder.iterdir() if "degroote_fregly-" in folder.name]) == 2
    assert abs(after.numbers[0] - before.numbers[0]) > 1e-3
    callee.write_text(text)
    again = run(PULL, home, package)
    assert again.told == []
    assert again.numbers == before.numbers


LOOK = """
import json, mjwrap as mw
from mjwrap.kernels.compilation import cache_folders
muscles = [mw.Millard2012(100.0, 0.1, 0.2), mw.DeGrooteFregly2016(100.0, 0.1, 0.2), mw.MuscleSystem]
print(json.dumps({"numbers": [], "folder": str(cache_folders.base())}))
"""


def test_an_import_compiles_nothing(tmp_path: Path) -> None:
    assert run(LOOK, tmp_path / "cache").told == []


def test_kernels_run_from_a_place_passed_over_to(tmp_path: Path) -> None:
    blocked = tmp_path / "blocked"
    blocked.touch()
    found = run(PULL, blocked)
    assert found.folder.is_relative_to(tmp_path)
    assert not found.folder.is_relative_to(blocked)
    assert len(found.told) == 1
    assert run(PULL, blocked).told == []


# ------------------------------------------------------------------ what is shared, and what is left alone


@pytest.mark.slow
def test_a_copy_of_the_package_shares_machine_code_and_needs_no_more_for_an_edit_elsewhere(
    starts: Starts, tmp_path: Path
) -> None:
    """Where the package lies and what a path does not reach make no difference."""
    package = copy_of_the_package(tmp_path)
    for path in package.rglob("*.py"):
        os.utime(path)
    copied = run(SOLVE, starts.home, package)
    assert copied.told == []
    assert copied.numbers == starts.first.numbers
    with kernel_file(package, "umberger").open("a") as file:
        file.write("# a remark\n")
    edited = run(SOLVE, starts.home, package)
    assert edited.told == []
    assert edited.numbers == starts.first.numbers


# ------------------------------------------------------------------------------------- plain functions


@pytest.mark.slow
def test_kernels_that_numba_compiles_alone_find_the_same(starts: Starts) -> None:
    """As where numba is one that the kernels' way of being linked does not fit."""
    plain = run(SOLVE, starts.home, MJWRAP_PLAIN_NJIT="1")
    assert len(plain.told) == 1
    assert plain.told[0].startswith(NOTICE)
    # other code is taken over, so that other multiplications and additions are fused
    assert plain.numbers == pytest.approx(starts.first.numbers, rel=1e-11, abs=1e-12)
    again = run(SOLVE, starts.home, MJWRAP_PLAIN_NJIT="1")
    assert again.told == []
    assert again.numbers == plain.numbers


def test_a_verdict_on_numba_is_found_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert self_test.passes(tmp_path)
    monkeypatch.setattr(self_test, "_try", lambda: pytest.fail("tried again"))
    assert self_test.passes(tmp_path)
    (verdict,) = tmp_path.iterdir()
    verdict.write_text("failed")
    assert not self_test.passes(tmp_path)


def test_a_numba_that_crashed_or_raised_does_not_pass(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail() -> bool:
        raise AttributeError("'JITCodeLibrary' object has no attribute '_reload_init'")

    monkeypatch.setattr(probe, "passes", fail)
    assert not self_test.passes(tmp_path)
    (verdict,) = tmp_path.iterdir()
    verdict.write_text("begun")
    os.utime(verdict, (0, 0))  # by a process that has long ended
    monkeypatch.setattr(probe, "passes", lambda: True)
    assert not self_test.passes(tmp_path)
    os.utime(verdict)  # by one that may still be at it
    assert self_test.passes(tmp_path)


UNKNOWN = """
import json
from mjwrap.kernels.compilation import self_test
self_test.TESTED = ()
from mjwrap.kernels.compilation import cache_folders
from mjwrap.kernels.musculotendon import dispatch
numbers = [dispatch.velocity_curve(2, 0.3)[0], self_test.is_plain()]
print(json.dumps({"numbers": numbers, "folder": str(cache_folders.base())}))
"""


def test_an_unknown_numba_is_tried_and_one_that_does_not_fit_is_said(tmp_path: Path) -> None:
    fit = run(UNKNOWN, tmp_path / "fit")
    assert fit.numbers[1] is False
    assert len(fit.told) == 1  # that it compiles
    unfit = run(
        UNKNOWN.replace("TESTED = ()", "TESTED, self_test._try = (), lambda: False"), tmp_path / "unfit"
    )
    assert unfit.numbers == [pytest.approx(fit.numbers[0], rel=1e-14), True]
    assert len(unfit.told) == 2
    assert "numba.njit alone" in unfit.told[0]
    assert unfit.told[1].startswith(NOTICE)


# ------------------------------------------------------------------------------------- what is announced


NAMELESS = """
import json, types, numba
from mjwrap.kernels.compilation import cache_folders
from mjwrap.kernels.musculotendon import fiber
function = types.FunctionType((lambda x: x + 1.0).__code__, {}, "nameless")
function.__module__ = None
print(json.dumps({"numbers": [numba.njit(function)(1.0)], "folder": str(cache_folders.base())}))
"""


def test_a_users_function_that_belongs_to_no_module_is_compiled(tmp_path: Path) -> None:
    found = run(NAMELESS, tmp_path / "cache")
    assert (found.numbers, found.told) == ([2.0], [])
