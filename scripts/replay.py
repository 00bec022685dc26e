#!/usr/bin/env python3
"""Replay a recording: in rerun's own viewer, in a browser, or say what it holds.

Without an option the viewer opens, or where there is no display the recording is served to a browser. Exit code 2
where the file is missing or damaged.
"""

from __future__ import annotations

import argparse
import os
import sys

from _common import Parser, UserError, run

from mjwrap.errors import RecordingError
from mjwrap.recording import Summary, open_native, read_summary, serve


def read_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Read the command line."""
    parser = Parser(prog="replay", description=__doc__, allow_abbrev=False)
    parser.add_argument("file", help="recording (.rrd)")
    what = parser.add_mutually_exclusive_group()
    what.add_argument(
        "--serve", action="store_true", help="serve it to a browser on this machine until Ctrl-C"
    )
    what.add_argument("--info", action="store_true", help="print what it holds, and stop")
    parser.add_argument(
        "--port",
        type=port,
        default=9090,
        metavar="N",
        help="where to serve: N and N + 1 (default %(default)s)",
    )
    return parser.parse_args(arguments)


def port(text: str) -> int:
    """Return a port that has a next one, for argparse."""
    number = int(text)
    if not 0 < number < 65535:
        raise argparse.ArgumentTypeError(f"{text} must lie between 1 and 65534")
    return number


def replay(options: argparse.Namespace) -> int:
    """Look at the whole file first, so that a damaged one is an error here and not an empty viewer."""
    try:
        summary = read_summary(options.file)
        if options.info:
            print(describe(summary), flush=True)
            return 0
        if options.serve or not has_display():
            return serve_until_stopped(options.file, options.port)
        return open_native(options.file)
    except RecordingError as error:
        raise UserError(str(error)) from None


def describe(summary: Summary) -> str:
    """What a recording holds, a fact a line."""
    lines = [
        f"file      {summary.path} ({summary.path.stat().st_size / 1e6:.1f} MB)",
        f"model     {summary.model}",
        f"time      {summary.start:g} s to {summary.end:g} s, {summary.states} states",
        f"muscles   {len(summary.muscles)}: {', '.join(summary.muscles)}",
        f"entities  {len(summary.entities)}:",
    ]
    return "\n".join(lines + [f"    {path}" for path in summary.entities])


def has_display() -> bool:
    """Whether a window can be opened."""
    return sys.platform in ("darwin", "win32") or any(
        os.environ.get(v) for v in ("DISPLAY", "WAYLAND_DISPLAY")
    )


def serve_until_stopped(path: str, number: int) -> int:
    """Serve a recording until Ctrl-C or the end of the server."""
    address, process = serve(path, number)
    print(f"open {address}\nCtrl-C stops serving", flush=True)
    try:
        return process.wait()
    except KeyboardInterrupt:
        return 0
    finally:
        process.terminate()
        process.wait()


if __name__ == "__main__":
    arguments = read_arguments()
    sys.exit(run("replay", lambda: replay(arguments)))
