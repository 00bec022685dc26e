"""The command line: `mjwrap COMMAND`, or `python -m mjwrap COMMAND`."""

from mjwrap.cli.main import main

__all__ = ["main"]
