"""The options that robustness.py and motion.py share."""

from __future__ import annotations

import argparse
from pathlib import Path

from mjwrap.verification.random_scenes import CLASSES


def add_options(parser: argparse.ArgumentParser, saved: str, replayed: str) -> None:
    """Add them; saved: what --save writes, replayed: what --replay does."""
    parser.add_argument("--classes", nargs="+", choices=CLASSES, default=list(CLASSES), metavar="CLASS")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1, help="processes (default 1)")
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    parser.add_argument("--markdown", action="store_true", help="print the table as Markdown")
    parser.add_argument("--save", type=Path, help=f"write {saved} to this JSON file")
    parser.add_argument("--replay", nargs="+", metavar=("FILE", "INDEX"), help=f"{replayed}, all or one")


def parsed(parser: argparse.ArgumentParser, **least: int) -> argparse.Namespace:
    """Return the options of the command line, checked; least: the smallest value of further whole numbers."""
    options = parser.parse_args()
    for name, value in (*least.items(), ("jobs", 1), ("seed", 0)):
        if getattr(options, name) < value:
            parser.error(f"--{name} must be at least {value}")
    for file in (options.json, options.save):
        if file is not None and not file.parent.is_dir():
            parser.error(f"there is no folder {file.parent}")
    if options.replay and (len(options.replay) > 2 or not Path(options.replay[0]).is_file()):
        parser.error("--replay takes the file of an earlier --save, and perhaps the number of one entry")
    return options
