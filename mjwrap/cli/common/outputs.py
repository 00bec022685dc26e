"""Several outputs of one command, each on its own: if one fails, the others are still completed."""

from __future__ import annotations

import sys
import traceback
from collections.abc import Callable
from typing import Any

from mjwrap.cli.common.errors import RunError
from mjwrap.errors import MjwrapError


class Outputs:
    """The outputs of a command by name; `failed` says why an output could not be completed.

    An output that fails is left out from then on. `RunError` ends the command once all that take samples have failed.
    """

    def __init__(self, command: str) -> None:
        self._command = command
        self._logs: dict[str, Callable[[Any], object]] = {}
        self._closes: dict[str, Callable[[], object]] = {}
        self.failed: dict[str, str] = {}

    def add(
        self, name: str, log: Callable[[Any], object] | None, close: Callable[[], object] | None = None
    ) -> None:
        """Add an output. log: called with the state of every sample; close: completes the output at the end."""
        if log is not None:
            self._logs[name] = log
        if close is not None:
            self._closes[name] = close

    @property
    def any_logs(self) -> bool:
        """Whether any output takes samples."""
        return bool(self._logs)

    def log(self, state: Any) -> None:
        """Log a state to all outputs that have not failed."""
        for name, log in list(self._logs.items()):
            if not self.attempt(name, lambda log=log: log(state), quiet=len(self._logs) == 1):
                del self._logs[name]
                self._closes.pop(name, None)
                if not self._logs:
                    raise RunError(self.failed[name])

    def close(self) -> None:
        """Complete all outputs that have not failed."""
        for name, close in self._closes.items():
            self.attempt(name, close)
        self._logs.clear()
        self._closes.clear()

    def attempt(self, name: str, action: Callable[[], object], *, quiet: bool = False) -> bool:
        """Do something for an output, and return whether it succeeded; if not, remember the error and print it.

        quiet: print nothing but the traceback of an unexpected error.
        """
        try:
            action()
        except Exception as error:
            expected = isinstance(error, MjwrapError | RunError | OSError)
            if not expected:
                traceback.print_exc()
            self.failed[name] = str(error) if expected else f"{type(error).__name__}: {error}"
            if not quiet:
                print(f"mjwrap {self._command}: {name}: {self.failed[name]}", file=sys.stderr, flush=True)
            return False
        return True

    def completed(self, files: dict[str, str]) -> dict[str, str]:
        """Return those of the files, by the name of their output, that were completed."""
        return {name: path for name, path in files.items() if name not in self.failed}
