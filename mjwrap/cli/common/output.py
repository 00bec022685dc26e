"""Output of commands: files that appear whole or not at all, and a report as text or JSON."""

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
_files: list[PartFile] = []  # of the command that runs
_inputs: set[str] = set()  # resolved paths of the files that it reads


def note_inputs(entries: Iterable[str]) -> None:
    """Remember the files among the entries (FILE or JOINT=FILE), which no output may take the place of."""
    for entry in entries:
        for path in (entry, entry.partition("=")[2]):
            if os.path.isfile(path):
                _inputs.add(os.path.realpath(path))


def check_unread(path: str, option: str) -> None:
    """Raise `UserError` where an output would take the place of a file that the command reads."""
    if os.path.realpath(path) in _inputs:
        raise UserError(f"{option} '{path}': that file is also read")


def open_output(path: str, option: str, *suffixes: str) -> PartFile:
    """Return a file to be written; what is wrong with its place is the user's to mend, before the run."""
    check_unread(path, option)
    with uninterrupted():
        file = opened(lambda: PartFile(path, *suffixes, option=option))
        _files.append(file)
    if any(other.path.resolve() == file.path.resolve() for other in _files[:-1]):
        raise UserError(f"{option} '{path}': another output goes to the same file")
    return file


def open_analysis(path: str) -> PartFile:
    """Return one of the tables of --analysis, as `open_output` does."""
    return open_output(path, "--analysis", ".sto")


def opened(make: Callable[[], Kept]) -> Kept:
    """Return a file, recording or film that has been begun; what is wrong with its place is the user's to mend."""
    try:
        return make()
    except RecordingError as error:
        raise UserError(str(error)) from None


def discard_outputs() -> None:
    """Remove what has not become a file, at the end of a command."""
    for file in _files:
        file.discard()
    _files.clear()
    _inputs.clear()


class Report:
    """What a command says: text on standard output, and, where --json asks for it, the same as values."""

    def __init__(self, path: str | None) -> None:
        self._instead = path == "-"
        self._file = open_output(path, "--json", ".json") if path and not self._instead else None

    def say(self, text: str = "") -> None:
        """Print a line of text, unless JSON takes its place."""
        if not self._instead:
            say(text)

    def finish(self, facts: Mapping[str, Any]) -> None:
        """Write the values, if they were asked for."""
        values = plain(facts)
        if self._instead:
            unicode = (sys.stdout.encoding or "").lower().startswith("utf")
            say(json.dumps(values, indent=1, allow_nan=False, ensure_ascii=not unicode))
        elif self._file is not None:
            self._file.write_text(json.dumps(values, indent=1, allow_nan=False, ensure_ascii=False) + "\n")
            say(f"json:      {self._file.path}")


def say(text: str) -> None:
    """Print at once; where nobody reads it, files that were asked for are still written."""
    try:
        with written():
            print(text, flush=True)
    except BrokenPipeError:
        if not _files:
            raise


@contextlib.contextmanager
def written() -> Iterator[None]:
    """After an error of standard output let the rest go nowhere; all but a closed pipe is a `RunError`."""
    try:
        yield
    except OSError as error:
        silence(sys.stdout.fileno())
        if isinstance(error, BrokenPipeError):
            raise
        raise RunError(f"cannot write to standard output: {(error.strerror or str(error)).lower()}") from None


def plain(value: Any) -> Any:
    """Return a value as JSON knows it: arrays as lists, what is not finite as null."""
    if hasattr(value, "tolist"):  # NumPy's arrays and numbers
        value = value.tolist()
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(key): plain(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [plain(each) for each in value]
    return value
