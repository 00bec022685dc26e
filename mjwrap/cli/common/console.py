"""Running a command: its parser, errors in one line, exit codes, and warnings of libraries."""

from __future__ import annotations

import argparse
import contextlib
import itertools
import os
import sys
import textwrap
import warnings
from collections.abc import Callable, Iterator
from typing import Any, NoReturn

from mjwrap.cli.common.errors import RUN_FAILED, USER_ERROR, RunError, UserError
from mjwrap.cli.common.output import discard_outputs
from mjwrap.cli.common.stopping import Stopped, stoppable
from mjwrap.errors import GeometryError, MjwrapError, ModelError, SignalError

_SUFFIXES = (".xml", ".mjb", ".rrd", ".sto", ".mot", ".csv", ".npz")
_MYO_NOISE = (
    "Attaching a spec with an empty prefix"  # myo_sim's models do that; it matters for saving them only
)

INPUTS = ("model", "file", "excitation", "prescribe", "states", "lengths", "moment_arms")  # name what is read


class _Help(argparse.HelpFormatter):
    """Fills paragraphs to the width of the terminal; what is indented stays as it is."""

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
    """A parser whose errors are one line, and whose help is a command's documentation, its examples last."""

    def __init__(self, name: str, documentation: str) -> None:
        what, mark, examples = documentation.partition("\nExamples:")
        super().__init__(
            prog=name,
            description=what,
            epilog=(mark + examples).strip() or None,
            allow_abbrev=False,
            formatter_class=_Help,
        )

    def parse_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Read the arguments; a model or recording after --json or --connect is not the place that these go to."""
        given = list(args or [])
        optional = {f: a.const for a in self._actions if a.nargs == "?" for f in a.option_strings}
        for i, (word, following) in enumerate(itertools.pairwise(given)):
            if word in optional and (
                following.lower().endswith(_SUFFIXES) or following.startswith("myo_sim:")
            ):
                given[i] = f"{word}={optional[word]}"
        return super().parse_args(given, namespace)

    def format_help(self) -> str:
        """Return the help, in which the first line names what is needed and the list all that is possible."""
        needed = [a for a in self._actions if not a.option_strings]
        names = [f"[{a.metavar}]" if a.nargs == "?" else str(a.metavar) for a in needed]
        self.usage = " ".join([self.prog, *names, "[OPTION ...]"])
        return super().format_help()

    def error(self, message: str) -> NoReturn:
        """Print the message and stop."""
        if "arguments are required" in message and "--" not in message:
            message += "; it comes before the options, some of which take all words that follow"
        self.exit(USER_ERROR, f"{self.prog}: {message} (see {self.prog} --help)\n")


def inputs(options: argparse.Namespace) -> Iterator[str]:
    """Yield what a command's arguments name to be read: files, or what may stand for one."""
    for option in INPUTS:
        given = getattr(options, option, None) or []
        yield from [given] if isinstance(given, str) else given


def run(name: str, body: Callable[[], int]) -> int:
    """Run a command's body and return its exit code; errors become one line on standard error and a code.

    2: the user can mend it; 1: the run failed; 128 and the signal's number where one asked it to end, so 130 for
    Ctrl-C. Output files that are not finished are removed.
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
        # Where it came up inside an exec or eval (numba has some), `python -m` would end by the signal, whatever
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
    """Show each warning once, in a line on standard error, and leave no MUJOCO_LOG.TXT behind."""
    try:
        import mujoco  # here, so that help needs none of it
    except (
        RuntimeError,
        AttributeError,
    ) as error:  # what MuJoCo raises where MUJOCO_GL fits nothing installed
        backend = os.environ.get("MUJOCO_GL")
        if backend is None:
            raise
        raise UserError(
            f"MuJoCo does not load with MUJOCO_GL={backend}: {error}; unset it, or try egl"
        ) from None

    seen: set[str] = set()

    def show(text: str) -> None:
        kind = text.split(".")[0]
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
