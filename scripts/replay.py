#!/usr/bin/env python3
"""Replay a recording: in the native viewer, in a browser, or say what it holds.

python scripts/replay.py FILE.rrd            open it (in a browser where there is no display)
python scripts/replay.py FILE.rrd --serve    serve it to a browser until Ctrl-C
python scripts/replay.py FILE.rrd --info     print what it holds
"""

import argparse
import os
import sys

from mjwrap.errors import MjwrapError
from mjwrap.recording import Summary, open_native, read_summary, serve


def main() -> int:
    """Run the command line; the exit code is 1 where the file is missing or damaged."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter, allow_abbrev=False
    )
    parser.add_argument("file", help="recording (.rrd)")
    parser.add_argument("--serve", action="store_true", help="serve to a browser on this machine")
    parser.add_argument(
        "--port", type=int, default=9090, help="where to serve (default %(default)s, and the next)"
    )
    parser.add_argument("--info", action="store_true", help="print what the recording holds, and stop")
    arguments = parser.parse_args()
    try:
        summary = read_summary(arguments.file)
        if arguments.info:
            print(describe(summary), flush=True)
            return 0
        if arguments.serve or not has_display():
            return serve_until_stopped(arguments.file, arguments.port)
        return open_native(arguments.file)
    except MjwrapError as error:
        print(f"replay: {error}", file=sys.stderr)
        return 1
    except BrokenPipeError:  # the reader of --info has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except KeyboardInterrupt:
        return 130


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


def serve_until_stopped(path: str, port: int) -> int:
    """Serve a recording until Ctrl-C or the end of the server."""
    address, process = serve(path, port)
    print(f"Open {address}\nCtrl-C stops serving.", flush=True)
    try:
        return process.wait()
    except KeyboardInterrupt:
        return 0
    finally:
        process.terminate()
        process.wait()


if __name__ == "__main__":
    sys.exit(main())
