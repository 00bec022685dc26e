"""Test whether `linking.py` works with the installed numba; where it does not, kernels are plain numba functions.

`linking.py` uses inner parts of numba, which may change in any release. Releases with which mjwrap was tested are
accepted. Any other release has to compile, store and load four small functions (`probe.py`), once, which takes about
a second. The result is kept on the disk.
"""

from __future__ import annotations

import contextlib
import os
import sys
import time
from functools import cache
from pathlib import Path

import numba

from mjwrap.kernels.compilation import cache_folders

TESTED = ("0.65", "0.66", "0.67", "0.68")  # releases tested with `benchmarks/numba_versions.py`
_PASSED, _FAILED, _BEGUN = "passed", "failed", "begun"
_PATIENCE = 60.0  # [s] a test that began longer ago and left no result has crashed
_NOTICE = (
    "mjwrap: numba {} differs internally from the versions that mjwrap is tested with; "
    "kernels are compiled by numba.njit alone, which takes longer"
)


@cache
def is_plain() -> bool:
    """Return whether kernels are compiled by numba.njit alone: on request, or because numba failed the test."""
    if os.environ.get("MJWRAP_PLAIN_NJIT", "0") not in ("", "0"):
        return True
    if (
        numba.__version__.startswith(tuple(f"{version}." for version in TESTED))
        or cache_folders.config.DISABLE_JIT
    ):
        return False
    if passes(cache_folders.base()):
        return False
    print(_NOTICE.format(numba.__version__), file=sys.stderr, flush=True)
    return True


def passes(base: Path) -> bool:
    """Return whether this numba passes the test; the result is read from a folder, or found and written there."""
    python = f"py{sys.version_info[0]}{sys.version_info[1]}"
    path = base / f"numba-{numba.__version__}-{python}-{_probed()}.txt"
    with contextlib.suppress(OSError):
        verdict, age = path.read_text(), time.time() - path.stat().st_mtime
        if verdict in (_PASSED, _FAILED):
            return verdict == _PASSED
        if age > _PATIENCE:  # the test crashed inside numba
            return False
    _write(path, _BEGUN)
    verdict = _PASSED if _try() else _FAILED
    _write(path, verdict)
    return verdict == _PASSED


def _probed() -> str:
    """Return a hash of the sources of the test: a changed test runs again."""
    import hashlib

    files = [Path(__file__).with_name(name) for name in ("linking.py", "pipeline.py", "probe.py")]
    return hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()[:8]


def _try() -> bool:
    """Return whether the small functions give the expected results; an exception inside numba means no."""
    try:
        from mjwrap.kernels.compilation import probe

        return probe.passes()
    except Exception:
        return False


def _write(path: Path, text: str) -> None:
    """Write a file in one step; where that fails, the next process runs the test again."""
    with contextlib.suppress(OSError):
        part = path.with_suffix(f".{os.getpid()}")
        part.write_text(text)
        part.replace(path)
