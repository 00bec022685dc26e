"""Turn an OpenSim model into a MuJoCo model with geodesic muscles, and report what became of every element.

MODEL.osim is read without OpenSim. The result is an MJCF file, with its meshes beside it, that plain MuJoCo loads and
that every command of mjwrap runs. Coordinates become joints of the same name, in rad and m; muscles keep their names.

--verify compares the written model with OpenSim at random poses: bodies, mass matrix, lengths, moment arms, tensions,
and two motions. It needs the opensim package (pip install opensim), or its numbers in a file from a machine that has
it: --numbers FILE.json keeps them there, and reads them where the file exists.

Examples:
  mjwrap import mjwrap:leg -o leg.xml
  mjwrap import arm26.osim -o arm26.xml
  mjwrap import gait10dof18musc.osim --geometry Geometry --report gait.html
  mjwrap import arm26.osim -o arm26.xml --verify --numbers arm26_opensim.json --json arm26.json

The exit code is 1 if --verify finds a large difference without a reason.
"""

from __future__ import annotations

import argparse
import shlex

from mjwrap.cli.common.arguments import add_json, at_least
from mjwrap.cli.importing.importing import ImportSettings, import_model


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    add = parser.add_argument
    add("model", metavar="MODEL.osim", help="OpenSim model, or mjwrap:NAME")
    add(
        "-o",
        "--out",
        metavar="FILE.xml",
        help="MJCF file to write (default: MODEL.xml in the present folder)",
    )
    add("--geometry", nargs="+", action="extend", default=[], metavar="FOLDER", help="folders with the model's meshes, "
        "beside its own folder and the folder Geometry in it")  # fmt: skip
    add("--limits", action="store_true", help="make clamped coordinates limits of their joints, as OpenSim's motions "
        "do not; without it, joints have the ranges only")  # fmt: skip
    add("--report", metavar="FILE.html", help="write the report as a page")
    add_json(parser, "write the report")
    add("--verify", action="store_true", help="compare the written model with OpenSim")
    add(
        "--numbers",
        metavar="FILE.json",
        help="with --verify: OpenSim's numbers, read if the file exists, else written",
    )
    add("--poses", type=at_least(1), default=50, metavar="N", help="with --verify: number of random poses (default "
        "%(default)s)")  # fmt: skip
    add(
        "--seed",
        type=at_least(0),
        default=0,
        metavar="N",
        help="seed of the random poses (default %(default)s)",
    )


def execute(options: argparse.Namespace) -> int:
    """Run the command and return its exit code."""
    return import_model(
        ImportSettings(
            model=options.model,
            out=options.out,
            geometry=tuple(options.geometry),
            limits=options.limits,
            page=options.report,
            json=options.json,
            verify=options.verify or options.numbers is not None,
            numbers=options.numbers,
            poses=options.poses,
            seed=options.seed,
            command=shlex.join(["mjwrap", "import", *options.given]),
        )
    )
