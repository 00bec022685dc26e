"""The one place that decides how kernels are compiled and where the machine code is kept.

numba keys its disk cache on the file of each function alone, so an edit in a callee would go unnoticed. The
cache therefore lives in a folder named by a hash over all kernel sources: any edit starts a new, empty cache.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba.core import config as numba_config
from numba.core import event

from mjwrap.kernels._kernel import Apart, Hidden, Kernel

config: Any = numba_config  # its variables, set from the environment, are not known to type checkers
F = TypeVar("F", bound=Callable[..., Any])
_HERE = Path(__file__).parent
_NOTICE = "mjwrap: compiling its kernels, once for this machine and version ({}) ..."
_FIRST, _FURTHER = (
    "about half a minute",
    "those that nothing has asked for so far; mjwrap warmup compiles all at once",
)


def source_hash() -> str:
    """Return 16 hexadecimal digits that change with any kernel source, numba's version or bounds checking."""
    digest = hashlib.sha256(f"{numba.__version__} {sys.version_info[:2]} {_boundscheck()}".encode())
    for file in sorted(_HERE.rglob("*.py")):
        digest.update(file.name.encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()[:16]


def _boundscheck() -> str:
    return os.environ.get("NUMBA_BOUNDSCHECK", "0")


def _candidates() -> list[Path]:
    """Return the folders in which the cache may live, best first."""
    found = []
    if config.CACHE_DIR:  # NUMBA_CACHE_DIR
        found.append(Path(config.CACHE_DIR))
    if os.environ.get("XDG_CACHE_HOME"):
        found.append(Path(os.environ["XDG_CACHE_HOME"]))
    elif os.name == "nt":
        found.append(Path(os.environ.get("LOCALAPPDATA", tempfile.gettempdir())))
    else:
        with contextlib.suppress(RuntimeError):  # a user without a home
            found.append(Path.home() / ("Library/Caches" if sys.platform == "darwin" else ".cache"))
    user = os.environ.get("USER", os.environ.get("USERNAME", "user"))
    found.append(Path(tempfile.gettempdir()) / f"mjwrap-{user}")
    return found


def _is_trusted(base: Path) -> bool:
    """Return whether nobody else can have put machine code there; anyone may write to the temporary folder."""
    return os.name == "nt" or base.parent != Path(tempfile.gettempdir()) or base.stat().st_uid == os.getuid()


def cache_dir() -> Path:
    """Return the folder of the compiled kernels, created and writable."""
    for base in _candidates():
        folder = base / "mjwrap" / source_hash()
        try:
            folder.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=folder):
                if _is_trusted(base):
                    return folder
        except OSError:
            continue
    return Path(tempfile.mkdtemp(prefix="mjwrap-"))


class _Announcer(event.Listener):
    """Tells the user, once a process, that kernels are being compiled rather than loaded."""

    def __init__(self) -> None:
        self.silent = False

    def on_start(self, event: Any) -> None:
        dispatcher = event.data.get("dispatcher") if event.data else None
        function = getattr(dispatcher, "py_func", None)
        if not self.silent and getattr(function, "__module__", "").startswith("mjwrap.kernels."):
            self.silent = True
            how = _FURTHER if any(Path(_CACHE).rglob("*.nbi")) else _FIRST
            print(_NOTICE.format(how), file=sys.stderr, flush=True)

    def on_end(self, event: Any) -> None:
        pass


_CACHE = str(cache_dir())
event.register("numba:compile", _Announcer())


_OPTIONS: dict[str, Any] = {
    "nopython": True,
    "boundscheck": None,  # by NUMBA_BOUNDSCHECK
    "nogil": True,
    "error_model": "numpy",
    "fastmath": {"contract"},
    "no_cfunc_wrapper": True,
    "_nrt": False,  # no counting of references on every array handed on; no new arrays either
}


def jit(function: F, kind: type[Kernel] = Kernel, **options: bool) -> F:
    """Compile a kernel: no GIL, IEEE semantics but for fused multiply-adds, machine code kept on disk.

    One whose name begins with an underscore cannot be called from Python, which makes it cheaper to compile.
    """
    if config.DISABLE_JIT:
        return function
    if function.__name__.startswith("_"):
        kind, options = Hidden, options | {"no_cpython_wrapper": True}
    before = config.CACHE_DIR
    config.CACHE_DIR = _CACHE  # read by numba when the function is decorated
    try:
        kernel: Any = kind(function, _OPTIONS | options)
        kernel.enable_caching()
        return kernel
    finally:
        config.CACHE_DIR = before


def apart(function: F) -> F:
    """Compile a kernel whose code callers do not take over: a large one, to which a call is nothing."""
    return jit(function, Apart)


def allocating(function: F) -> F:
    """Compile a kernel that makes arrays of its own."""
    return jit(function, _nrt=True)


def inlined(function: F) -> F:
    """Compile a kernel that every caller takes over: a small one, called with constants."""
    return jit(function, forceinline=True)
