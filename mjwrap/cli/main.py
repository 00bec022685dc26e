"""The command `mjwrap`: the list of its commands; the module of a command loads when it is called."""

from __future__ import annotations

import importlib
import io
import os
import sys
from collections.abc import Sequence
from types import ModuleType

import mjwrap
from mjwrap.cli.common import console
from mjwrap.cli.common.errors import RUN_FAILED, USER_ERROR, RunError
from mjwrap.cli.common.output import note_inputs, say, written
from mjwrap.text import nearest

COMMANDS = {
    "import": "turn an OpenSim model (.osim) into a MuJoCo model with geodesic muscles",
    "run": "simulate a model with its muscles along geodesic paths",
    "plot": "plot lengths, moment arms and forces over a joint, with tables of data over them",
    "compare": "compare MuJoCo's built-in tendons with mjwrap's paths on the same model",
    "inspect": "list the muscles of a model, what drives them, and which parameters are implausible",
    "init": "write the declaration of a muscle along a route, to paste into a model",
    "check": "test the paths, moment arms, forces and energy of a model",
    "replay": "show a recording, or make one from a table of states",
    "warmup": "compile everything in advance, so that later commands start faster",
}
EVALUATING = ("run", "compare", "plot", "inspect", "check", "warmup")  # compute forces of muscles
ROOMS = {"import": "importing"}  # where a command's name is a word of Python
HELP = """usage: mjwrap COMMAND ...
       mjwrap COMMAND --help
       mjwrap --version

Geodesic muscles for MuJoCo.

commands:
{commands}

MODEL is an MJCF or MJB file, mjwrap:NAME (a model that comes with mjwrap), or myo_sim:NAME (myo-sim package).

Examples:
  mjwrap run models/elbow/elbow.xml --duration 2 --excitation pulses --plot elbow.png
  mjwrap inspect models/elbow/elbow.xml
  mjwrap check models/elbow/elbow.xml

Exit codes: 0 done; 1 faults found, or the run failed; 2 a mistake on the command line or in a file; 130 Ctrl-C."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command; return its exit code, as `HELP` lists them."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:  # where the shell closed standard output
            setattr(sys, name, open(os.devnull, "w"))  # noqa: SIM115
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(
            errors="backslashreplace"
        )  # print names in letters that the terminal lacks, too
    try:
        try:
            return _command(given)
        finally:
            with written():
                sys.stdout.flush()
    except BrokenPipeError:
        return RUN_FAILED
    except RunError as error:
        print(f"mjwrap: {error}", file=sys.stderr)
        return RUN_FAILED


def _command(given: list[str]) -> int:
    first = given[0] if given else "--help"
    if first in ("-h", "--help"):
        lines = (f"  {name:9s} {text}" for name, text in COMMANDS.items())
        say(HELP.format(commands="\n".join(lines)))
        return 0 if given else USER_ERROR
    if first == "--version":
        say(f"mjwrap {mjwrap.__version__}")
        return 0
    if first not in COMMANDS:
        kind = "option" if first.startswith("-") else "command"
        print(
            f"mjwrap: no {kind} '{first}'{nearest(first, COMMANDS)}; commands: {', '.join(COMMANDS)} (see mjwrap "
            "--help)",
            file=sys.stderr,
        )
        return USER_ERROR
    return console.run(f"mjwrap {first}", lambda: _execute(first, given[1:]))


def module_of(name: str) -> ModuleType:
    """Return the module of a command, which has its help text, `add_arguments` and `execute`."""
    room = importlib.import_module(f"mjwrap.cli.{ROOMS.get(name, name)}")
    return importlib.import_module(f"{room.__name__}.command") if hasattr(room, "__path__") else room


def parser_of(name: str) -> console.Parser:
    """Return the parser of a command."""
    command = module_of(name)
    parser = console.Parser(f"mjwrap {name}", command.__doc__ or "", _commands_with)
    command.add_arguments(parser)
    return parser


def _commands_with(option: str) -> list[str]:
    """Return the commands that have an option."""
    return [name for name in COMMANDS if option in parser_of(name).options()]


def _execute(name: str, arguments: list[str]) -> int:
    command = module_of(name)
    options = parser_of(name).parse_args(arguments)
    options.given = list(arguments)  # as typed, for outputs that quote the command
    note_inputs(console.inputs(options))
    if name in EVALUATING:
        from mjwrap.cli.common.meanwhile import start_laws  # loads numba

        start_laws()
    return command.execute(options)
