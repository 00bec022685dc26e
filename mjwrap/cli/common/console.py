"""Run a command: its parser, one-line errors, exit codes, and warnings of libraries."""

from __future__ import annotations

import argparse
import contextlib
import itertools
import os
import re
import sys
import textwrap
import warnings
from collections.abc import Callable, Iterator
from typing import Any, NoReturn

from mjwrap.cli.common.errors import RUN_FAILED, USER_ERROR, RunError, UserError
from mjwrap.cli.common.output import discard_outputs
from mjwrap.cli.common.stopping import Stopped, stoppable
from mjwrap.errors import GeometryError, MjwrapError, ModelError, SignalError
from mjwrap.text import nearest

_SUFFIXES = (".xml", ".mjb", ".rrd", ".sto", ".mot", ".csv", ".npz")
_MYO_NOISE = (
    "Attaching a spec with an empty prefix"  # raised by myo_sim's models; matters only when they are saved
)

_NEGATIVE = re.compile(r"-\.?\d")

INPUTS = (
    "model",
    "file",
    "excitation",
    "prescribe",
    "states",
    "lengths",
    "moment_arms",
    "data",
)  # name what is read


class _Help(argparse.HelpFormatter):
    """Fill paragraphs to the width of the terminal; indented lines stay as they are."""

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        found: list[str] = []
        for block in text.strip().split("\n"):
            if block and found and found[-1] and not (block[0] == " " or found[-1][0] == " "):
                found[-1] += f" {block}"
            else:
                found.append(block)
        return "\n".join(
            line if line.startswith(" ") else textwrap.fill(line, width, break_long_words=False)
            for line in found
        )


class Parser(argparse.ArgumentParser):
    """A parser with one-line errors, whose help is the module docstring of the command, examples last.

    elsewhere: returns the commands that have an option, for the message about one that this command lacks.
    """

    def __init__(
        self, name: str, documentation: str, elsewhere: Callable[[str], list[str]] | None = None
    ) -> None:
        self._elsewhere = elsewhere
        what, mark, examples = documentation.partition("\nExamples:")
        super().__init__(
            prog=name,
            description=what,
            epilog=(mark + examples).strip() or None,
            allow_abbrev=False,
            formatter_class=_Help,
        )

    def parse_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Read the arguments; a model or recording after --json or --connect is not taken as their value.

        After an option with one value, a word like -10deg,20deg is this value, not an option.
        """
        given = list(args or [])
        single = {f for a in self._actions if a.nargs is None for f in a.option_strings}
        for i in range(len(given) - 1, 0, -1):
            if given[i - 1] in single and _NEGATIVE.match(given[i]):
                given[i - 1 : i + 1] = [f"{given[i - 1]}={given[i]}"]
        optional = {f: a.const for a in self._actions if a.nargs == "?" for f in a.option_strings}
        for i, (word, following) in enumerate(itertools.pairwise(given)):
            if word in optional and (
                following.lower().endswith(_SUFFIXES) or following.startswith(("mjwrap:", "myo_sim:"))
            ):
                given[i] = f"{word}={optional[word]}"
        found, unknown = self.parse_known_args(given, namespace)
        if unknown:
            self.error(f"unrecognized arguments: {' '.join(unknown)}{self._meant(unknown)}")
        return found

    def options(self) -> list[str]:
        """Return the options of the command."""
        return [flag for action in self._actions for flag in action.option_strings]

    def _meant(self, unknown: list[str]) -> str:
        """Return what resembles the first option that does not exist, or which commands have it."""
        option = next((word.partition("=")[0] for word in unknown if word.startswith("--")), "")
        having = self._elsewhere(option) if option and self._elsewhere else []
        if having:
            return (
                f"; {' and '.join(having)} {'has' if len(having) == 1 else 'have'} {option}, not {self.prog}"
            )
        return nearest(option, self.options()) if option else ""

    def format_help(self) -> str:
        """Return the help: the usage line names the required arguments only, the list below all of them."""
        needed = [a for a in self._actions if not a.option_strings]
        names = [f"[{a.metavar}]" if a.nargs == "?" else str(a.metavar) for a in needed]
        self.usage = " ".join([self.prog, *names, "[OPTION ...]"])
        return super().format_help()

    def error(self, message: str) -> NoReturn:
        """Print the message and exit with code 2."""
        if "arguments are required" in message and "--" not in message:
            message += "; write it before the options, because some options take all words that follow"
        self.exit(USER_ERROR, f"{self.prog}: {message} (see {self.prog} --help)\n")


def inputs(options: argparse.Namespace) -> Iterator[str]:
    """Yield the arguments that may name a file to be read."""
    for option in INPUTS:
        given = getattr(options, option, None) or []
        yield from [given] if isinstance(given, str) else given


def run(name: str, body: Callable[[], int]) -> int:
    """Run a command's body and return its exit code; an error becomes one line on standard error and an exit code.

    2: a mistake that the user can correct; 1: the run failed; 128 + n: ended by signal n, so 130 for Ctrl-C. Unfinished
    output files are removed.
    """
    try:
        with stoppable(), _quiet(name):
            return body()
    except (UserError, ModelError, SignalError, GeometryError) as error:
        return _say(name, error, USER_ERROR)
    except (RunError, MjwrapError) as error:
        return _say(name, error, RUN_FAILED)
    except MemoryError:
        return _say(name, "out of memory", RUN_FAILED)
    except KeyboardInterrupt as error:
        # If the signal came inside an exec or eval (numba has some), `python -m` would end by the signal, whatever
        # the exit code; the next exec makes it forget that.
        exec("")
        stop = error if isinstance(error, Stopped) else Stopped()
        return _say(name, f"stopped by {stop.name}", stop.code)
    finally:
        discard_outputs()


def _say(name: str, error: object, code: int) -> int:
    print(f"{name}: {' '.join(str(error).split())}", file=sys.stderr)
    return code


@contextlib.contextmanager
def _quiet(name: str) -> Iterator[None]:
    """Show each warning once, as one line on standard error, and keep MuJoCo from writing MUJOCO_LOG.TXT."""
    try:
        import mujoco  # imported here, because --help does not need it
    except (
        RuntimeError,
        AttributeError,
    ) as error:  # raised by MuJoCo if MUJOCO_GL names a backend that is not installed
        backend = os.environ.get("MUJOCO_GL")
        if backend is None:
            raise
        raise UserError(
            f"MuJoCo cannot be loaded with MUJOCO_GL={backend}: {error}; unset MUJOCO_GL, or try egl"
        ) from None

    seen: set[str] = set()

    def show(text: str) -> None:
        kind = text.split(". ")[0]
        if kind not in seen and not kind.startswith(_MYO_NOISE):
            seen.add(kind)
            print(f"{name}: warning: {' '.join(text.split())}", file=sys.stderr)

    mujoco.set_mju_user_warning(show)
    try:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", message=_MYO_NOISE)
            warnings.showwarning = lambda message, *_: show(str(message))
            yield
    finally:
        mujoco.set_mju_user_warning(None)
