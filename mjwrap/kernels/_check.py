"""Whether numba is one on which `_kernel.py` can build; where it is not, kernels are plain numba functions.

What `_kernel.py` builds on is no public part of numba. Versions that the tests ran with are taken as they are; any
other has to compile, keep and load four small functions once, which takes a second. The verdict is kept on the disk.
"""

from __future__ import annotations

import contextlib
import os
import sys
import time
from functools import cache
from pathlib import Path

import numba

from mjwrap.kernels import _folders

TESTED = ("0.65", "0.66", "0.67", "0.68")  # by `benchmarks/numba_versions.py`
_PASSED, _FAILED, _BEGUN = "passed", "failed", "begun"
_PATIENCE = 60.0  # [s] after which a process that began is taken to have crashed
_NOTICE = (
    "mjwrap: numba {} links compiled functions in another way than the versions that mjwrap is tested with; "
    "kernels are compiled by numba.njit alone, which takes longer"
)


@cache
def is_plain() -> bool:
    """Return whether kernels are compiled by numba.njit alone: on request, or because numba is not as expected."""
    if os.environ.get("MJWRAP_PLAIN_NJIT", "0") not in ("", "0"):
        return True
    if (
        numba.__version__.startswith(tuple(f"{version}." for version in TESTED))
        or _folders.config.DISABLE_JIT
    ):
        return False
    if passes(_folders.base()):
        return False
    print(_NOTICE.format(numba.__version__), file=sys.stderr, flush=True)
    return True


def passes(base: Path) -> bool:
    """Return whether this numba passes; a verdict is read from a folder, or found and written to it."""
    python = f"py{sys.version_info[0]}{sys.version_info[1]}"
    path = base / f"numba-{numba.__version__}-{python}-{_probed()}.txt"
    with contextlib.suppress(OSError):
        verdict, age = path.read_text(), time.time() - path.stat().st_mtime
        if verdict in (_PASSED, _FAILED):
            return verdict == _PASSED
        if age > _PATIENCE:  # it ended inside numba
            return False
    _write(path, _BEGUN)
    verdict = _PASSED if _try() else _FAILED
    _write(path, verdict)
    return verdict == _PASSED


def _probed() -> str:
    """Return a hash over what is tried: a new version of it is tried anew."""
    import hashlib

    files = [Path(__file__).with_name(name) for name in ("_kernel.py", "_probe.py")]
    return hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()[:8]


def _try() -> bool:
    """Return whether the small functions find what they should; whatever goes wrong inside numba is a no."""
    try:
        from mjwrap.kernels import _probe

        return _probe.passes()
    except Exception:
        return False


def _write(path: Path, text: str) -> None:
    """Write a file in one go; without one, the next process tries again."""
    with contextlib.suppress(OSError):
        part = path.with_suffix(f".{os.getpid()}")
        part.write_text(text)
        part.replace(path)
