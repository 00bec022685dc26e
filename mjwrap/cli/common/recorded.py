"""What commands record: the options that say so, the `Recorder` that they ask for, and serving it to a browser."""

from __future__ import annotations

import argparse
import contextlib
from collections.abc import Callable, Sequence
from typing import Any

from mjwrap.cli.common.arguments import port, positive
from mjwrap.cli.common.errors import UserError
from mjwrap.cli.common.output import check_unread, opened
from mjwrap.cli.common.stopping import Stopped
from mjwrap.recording import Recorder, Server

LOCAL = "local"  # stands for the viewer on this machine
HOW = ("rate", "groups", "force_scale")  # options that only say how it is recorded


def add_recording(parser: Any, places: Any) -> None:
    """Add the options of a recording; places: the group of those that exclude each other."""
    add = parser.add_argument
    add("--record", metavar="FILE.rrd", help="recording for the rerun viewer (mjwrap replay)")
    places.add_argument(
        "--connect",
        nargs="?",
        const=LOCAL,
        metavar="URL",
        help="stream to a viewer that runs: rerun+http://HOST:PORT/proxy, or without an address the one here",
    )
    add = parser.add_argument
    add(
        "--rate",
        type=positive,
        metavar="HZ",
        help="states per simulated second of its curves (default: every one)",
    )
    add("--groups", nargs="+", action="extend", default=[], metavar="NAME=PATTERN,...", help="muscles whose curves "
        "stand together (* and ? stand for anything; default: those that move the same body)")  # fmt: skip
    add(
        "--force-scale",
        type=positive,
        metavar="M/N",
        help="length of its force arrows (default: fits the model)",
    )


def add_serving(parser: Any, places: Any, what: str) -> None:
    """Add the options that serve a recording to a browser."""
    places.add_argument(
        "--serve", action="store_true", help=f"{what} to a browser on this machine until Ctrl-C"
    )
    parser.add_argument(
        "--port",
        type=port,
        default=9090,
        metavar="N",
        help="where to serve: N and N + 1 (default %(default)s)",
    )


def check_how(options: argparse.Namespace, recorded: bool, places: str) -> None:
    """Raise `UserError` where options say how to record, and nothing is recorded."""
    for name in HOW:
        if getattr(options, name) and not recorded:
            raise UserError(f"--{name.replace('_', '-')} is for a recording: it goes with {places}")


def open_recorder(
    options: argparse.Namespace,
    model: Any,
    muscles: Any,
    stack: contextlib.ExitStack,
    path: str | None,
    connect: str,
) -> Recorder:
    """Return the recorder that the options ask for, to be closed by `stack`; connect: an address, LOCAL or empty."""
    groups = read_groups(options.groups)
    if path is not None:
        check_unread(path, "--record")
    recorder = opened(
        lambda: Recorder(
            model,
            muscles,
            path,
            connect=True if connect == LOCAL else connect,
            rate=options.rate,
            groups=groups,
            force_scale=options.force_scale,
        )
    )
    return stack.enter_context(recorder)


def read_groups(entries: Sequence[str]) -> dict[str, list[str]] | None:
    """Return groups of muscles from "NAME=PATTERN,PATTERN"; None where there are no entries."""
    found: dict[str, list[str]] = {}
    for entry in entries:
        name, _, text = entry.partition("=")
        patterns = [pattern.strip() for pattern in text.split(",")]
        if not name or not all(patterns):
            raise UserError(f"--groups '{entry}': write NAME=PATTERN,PATTERN, for example 'flexors=BIC*,BRA'")
        found.setdefault(name, []).extend(patterns)
    return found or None


def end(server: Server) -> None:
    """End a server."""
    server.process.terminate()
    server.process.wait()


def serve_until_stopped(server: Server, tell: Callable[[], object]) -> int:
    """Tell where, and serve until Ctrl-C or the end of the server; return the exit code."""
    try:
        tell()
        return server.process.wait()
    except Stopped as stop:
        return 0 if stop.name == "Ctrl-C" else stop.code
    finally:
        end(server)
