"""Output of commands: files that are written completely or not at all, and a report as text or JSON."""

from __future__ import annotations

import contextlib
import json
import math
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, TypeVar

from mjwrap.cli.common.errors import RunError, UserError
from mjwrap.cli.common.stopping import silence
from mjwrap.errors import RecordingError
from mjwrap.files.atomic import PartFile, uninterrupted

Kept = TypeVar("Kept")
_files: list[PartFile] = []  # output files of the running command
_inputs: set[str] = set()  # resolved paths of the files that the command reads


def note_inputs(entries: Iterable[str]) -> None:
    """Remember the files among the entries (FILE or JOINT=FILE): no output may overwrite them."""
    for entry in entries:
        for path in (entry, entry.partition("=")[2]):
            if os.path.isfile(path):
                _inputs.add(os.path.realpath(path))


def check_unread(path: str, option: str) -> None:
    """Raise `UserError` if an output would overwrite a file that the command reads."""
    if os.path.realpath(path) in _inputs:
        raise UserError(f"{option} '{path}': that file is also read")


def open_output(path: str, option: str, *suffixes: str) -> PartFile:
    """Open an output file; raises `UserError` if it cannot be written, which is before the run."""
    check_unread(path, option)
    with uninterrupted():
        file = opened(lambda: PartFile(path, *suffixes, option=option))
        _files.append(file)
    if any(other.path.resolve() == file.path.resolve() for other in _files[:-1]):
        raise UserError(f"{option} '{path}': another output goes to the same file")
    return file


def open_analysis(path: str) -> PartFile:
    """Open one of the tables of --analysis, as `open_output` does."""
    return open_output(path, "--analysis", ".sto")


def open_motion(path: str) -> PartFile:
    """Open the file of --motion, as `open_output` does."""
    return open_output(path, "--motion", ".mot", ".sto")


def opened(make: Callable[[], Kept]) -> Kept:
    """Return the file, recording or film that `make` opens; raises `UserError` if it cannot be written."""
    try:
        return make()
    except RecordingError as error:
        raise UserError(str(error)) from None


def discard_outputs() -> None:
    """Remove unfinished output files at the end of a command."""
    for file in _files:
        file.discard()
    _files.clear()
    _inputs.clear()


class Report:
    """The report of a command: text on standard output and, with --json, the same as values."""

    def __init__(self, path: str | None) -> None:
        self._instead = path == "-"
        self._file = open_output(path, "--json", ".json") if path and not self._instead else None

    def say(self, text: str = "") -> None:
        """Print a line of text, unless JSON goes to standard output."""
        if not self._instead:
            say(text)

    def finish(self, facts: Mapping[str, Any]) -> None:
        """Write the values as JSON, if --json was given."""
        values = plain(facts)
        if self._instead:
            unicode = (sys.stdout.encoding or "").lower().startswith("utf")
            say(json.dumps(values, indent=1, allow_nan=False, ensure_ascii=not unicode))
        elif self._file is not None:
            self._file.write_text(json.dumps(values, indent=1, allow_nan=False, ensure_ascii=False) + "\n")
            say(f"json:      {self._file.path}")


def say(text: str) -> None:
    """Print at once; if standard output is closed, go on, so that the output files are still written."""
    try:
        with written():
            print(text, flush=True)
    except BrokenPipeError:
        if not _files:
            raise


@contextlib.contextmanager
def written() -> Iterator[None]:
    """After an error of standard output discard the rest; raises `RunError` unless a pipe was closed."""
    try:
        yield
    except OSError as error:
        silence(sys.stdout.fileno())
        if isinstance(error, BrokenPipeError):
            raise
        raise RunError(f"cannot write to standard output: {(error.strerror or str(error)).lower()}") from None


def plain(value: Any) -> Any:
    """Convert a value for JSON: arrays to lists, numbers that are not finite to null."""
    if hasattr(value, "tolist"):  # NumPy's arrays and numbers
        value = value.tolist()
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(key): plain(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [plain(each) for each in value]
    return value
