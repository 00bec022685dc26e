"""Output files that appear whole or not at all."""

from __future__ import annotations

import argparse
import contextlib
import json
import math
import os
import uuid
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import IO, Any

from mjwrap.cli.errors import RunError, UserError


class Output:
    """A file that appears whole, under its own name, or not at all.

    The place is tried at once, so that an unwritable one shows before a run. `part` is written to, `publish` gives it
    the name `path`; an older file of that name stays until then. What is not published is removed at the end.
    """

    _open: list[Output] = []  # noqa: RUF012

    def __init__(self, path: str, option: str, suffixes: Sequence[str]) -> None:
        self.path, self.option = Path(path), option
        self._file: IO[str] | None = None
        if self.path.suffix.lower() not in suffixes:
            raise UserError(f"{option} '{path}': the name must end in {' or '.join(suffixes)}")
        if any(other.path.resolve() == self.path.resolve() for other in Output._open):
            raise UserError(f"{option} '{path}': another output goes to the same file")
        if self.path.exists() and not (self.path.is_file() and os.access(self.path, os.W_OK)):
            raise UserError(f"cannot write {option} '{path}': it is not a file, or write-protected")
        unique = f"{os.getpid()}-{uuid.uuid4().hex[:8]}"
        self.part = self.path.with_name(f".{self.path.stem}.{unique}.part{self.path.suffix}")
        try:
            self.part.open("xb").close()
        except OSError as error:
            raise UserError(f"cannot write {option} '{path}': {_reason(error, self.path)}") from None
        Output._open.append(self)

    def open_text(self) -> IO[str]:
        """Return the part, open for text; it is closed with the output."""
        self._file = self.part.open("w", encoding="utf-8", newline="")
        return self._file

    def publish(self) -> None:
        """Put the finished file on the disk and give it its name."""
        with self.writing():
            if self._file is not None:
                self._file.close()
            with self.part.open("rb+") as file:
                os.fsync(file.fileno())
            os.replace(self.part, self.path)
        Output._open.remove(self)

    @contextlib.contextmanager
    def writing(self) -> Iterator[None]:
        """Turn what the disk refuses inside a with block into an error in one line."""
        try:
            yield
        except OSError as error:
            reason = (error.strerror or str(error)).lower()
            raise RunError(
                f"writing {self.option} '{self.path}' failed: {reason}; nothing was kept of it"
            ) from None

    @classmethod
    def discard_open(cls) -> None:
        """Remove every part that has not become a file."""
        for output in cls._open:
            with contextlib.suppress(OSError):
                if output._file is not None:
                    output._file.close()
            with contextlib.suppress(OSError):
                output.part.unlink(missing_ok=True)
        cls._open.clear()


def _reason(error: OSError, path: Path) -> str:
    folder = path.absolute().parent
    if isinstance(error, FileNotFoundError) and not folder.exists():
        existing = next(parent for parent in folder.parents if parent.exists())
        return f"there is no folder '{folder}' (the path exists as far as '{existing}')"
    return (error.strerror or str(error)).lower()


def add_json(parser: argparse.ArgumentParser, what: str) -> None:
    """Add the option --json, with a file or without one."""
    parser.add_argument(
        "--json",
        nargs="?",
        const="-",
        metavar="FILE.json",
        help=f"{what}, as JSON; without a file name (or with -) on standard output, in place of the text",
    )


class Report:
    """What a command says: text on standard output, and, where --json asks for it, the same as values."""

    def __init__(self, path: str | None) -> None:
        self._instead = path == "-"
        self._path = path
        self._file = Output(path, "--json", (".json",)) if path and not self._instead else None

    def say(self, text: str = "") -> None:
        """Print a line of text, unless JSON takes its place."""
        if not self._instead:
            print(text)

    def finish(self, facts: Mapping[str, Any]) -> None:
        """Write the values, if they were asked for."""
        text = json.dumps(plain(facts), indent=1, allow_nan=False, ensure_ascii=False)
        if self._instead:
            print(text)
        elif self._file is not None:
            with self._file.writing():
                self._file.part.write_text(text + "\n", encoding="utf-8")
            self._file.publish()
            print(f"json:      {self._path}")


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
