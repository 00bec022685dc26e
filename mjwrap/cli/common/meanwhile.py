"""Compile kernels in a second process while this one goes on, for the first run on a machine."""

from __future__ import annotations

import atexit
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import mjwrap as mw
from mjwrap.kernels.compilation import module_caches
from mjwrap.kernels.compilation.cache_folders import config
from mjwrap.kernels.musculotendon import dynamics
from mjwrap.runs.compile_time import CompileClock

_CODE = "from mjwrap.cli.common.meanwhile import counted; from {} import {} as work; counted(work)"


class OtherProcess:
    """A process that calls a function without arguments, given as "module:function", whose kernels are then kept.

    It ends with this process at the latest. Its messages are not shown.
    """

    def __init__(self, function: str) -> None:
        package = Path(mw.__file__).parent.parent
        path = os.pathsep.join(filter(None, (str(package), os.environ.get("PYTHONPATH"))))
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-c", _CODE.format(*function.split(":"))],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            env={**os.environ, "PYTHONPATH": path},
        )
        atexit.register(self.stop)

    def compiled(self) -> int | None:
        """Wait for the end; return how many functions were compiled, None if the process failed."""
        told, _ = self._process.communicate()
        return int(told) if self._process.returncode == 0 and told.strip().isdigit() else None

    def stop(self) -> None:
        """End it."""
        if self._process.poll() is None:
            self._process.kill()
            self._process.wait()


def counted(work: Callable[[], object]) -> None:
    """Call a function and print how many functions were compiled for it."""
    with CompileClock() as clock:
        work()
    print(clock.compiled)


def can_help() -> bool:
    """Return whether a second process can take over a part of the work."""
    return bool(sys.executable) and (os.cpu_count() or 1) > 1 and not config.DISABLE_JIT


def start_laws() -> OtherProcess | None:
    """Let another process compile the muscle laws, if no kernel of them is kept yet and there is a processor for it.

    The paths come first in every evaluation, and take longer.
    """
    if not can_help():
        return None
    place = module_caches.place(dynamics.simulate.py_func)
    if place is None or place.folder.is_dir():
        return None
    return OtherProcess("mjwrap.cli.common.meanwhile:laws")


def laws() -> None:
    """Simulate a single muscle with an elastic tendon."""
    law = mw.DeGrooteFregly2016(500.0, 0.1, 0.2, tendon="elastic")
    mw.simulate_muscle(law, [0.0, 0.01, 0.02], 0.3, excitation=0.5)
