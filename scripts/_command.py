"""Runs a command of mjwrap under the name that its script had before there was a command line."""

import sys


def run(command: str) -> None:
    """Run `mjwrap COMMAND` with this process's arguments, and exit."""
    try:
        from mjwrap.cli import main
    except ModuleNotFoundError as error:
        sys.exit(
            f"{error}; from mjwrap's folder, first install it: {sys.executable} -m pip install '.[demo]'"
        )
    sys.exit(main([command, *sys.argv[1:]]))
