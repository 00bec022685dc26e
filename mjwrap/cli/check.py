"""Test a model: tangency, derivatives, forces, energy, jumps. Prints pass or fail, the worst error and its location.

MODEL is an MJCF or MJB file, mjwrap:NAME (a model that comes with mjwrap), or myo_sim:NAME (myo-sim package).

At random poses, without a previous path to start from, the command tests that paths are tangent to their surfaces, that
the lengthening speed and the moment arms are the derivatives of the length, that the generalised force is -F dl/dq,
that the forces of each muscle balance, and that their power is -F dl/dt. Along sweeps of every joint it tests that
every path exists, and that no length or moment arm jumps. In a short motion without losses it tests that the energy of
the skeleton grows by the work of the muscles.

Examples:
  mjwrap check models/elbow/elbow.xml
  mjwrap check myo_sim:myoarm_r --poses 5 --samples 51 --json check.json

The exit code is 1 if a test fails.
"""

from __future__ import annotations

import argparse
import contextlib
from dataclasses import dataclass

from mjwrap.checking import check_model
from mjwrap.cli.common.arguments import add_json, add_model, add_tendons, at_least
from mjwrap.cli.common.errors import FAULTS
from mjwrap.cli.common.output import Report
from mjwrap.cli.common.progress import Stages
from mjwrap.runs.models import load, start_keyframe, start_state
from mjwrap.text import counted, counted_paths


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    add_model(parser, "keyframe whose pose the sweeps start from", "seed of the random poses")
    add = parser.add_argument
    add(
        "--poses",
        type=at_least(1),
        default=20,
        metavar="N",
        help="number of random poses (default %(default)s)",
    )
    add(
        "--samples",
        type=at_least(3),
        default=101,
        metavar="N",
        help="number of poses along a sweep (default %(default)s)",
    )
    add_tendons(parser, "test")
    add_json(parser, "write the results")


@dataclass(frozen=True)
class CheckSettings:
    """The settings of `mjwrap check`.

    model: a file or a model by name. keyframe: the pose to sweep around, None for qpos0. poses: number of random poses,
    drawn with seed; samples: number of poses along a sweep. side_rule: as for `MuscleSystem`. json: a file for the
    results, "-" for standard output, or None. tendons: test tendons without an actuator, too.
    """

    model: str
    keyframe: str | None
    poses: int
    samples: int
    seed: int
    side_rule: int | None
    json: str | None
    tendons: bool = False


def execute(options: argparse.Namespace) -> int:
    """Run the command and return its exit code."""
    return check(
        CheckSettings(
            model=options.model,
            keyframe=options.keyframe,
            poses=options.poses,
            samples=options.samples,
            seed=options.seed,
            side_rule=options.side_rule,
            json=options.json,
            tendons=options.tendons,
        )
    )


def check(settings: CheckSettings) -> int:
    """Test a model, print the results, and return the exit code."""
    model = load(settings.model)
    base = start_state(model, start_keyframe(model, settings.keyframe)).qpos
    report = Report(settings.json)
    with contextlib.closing(Stages("steps", "checking")) as progress:
        found = check_model(
            model,
            poses=settings.poses,
            samples=settings.samples,
            base=base,
            seed=settings.seed,
            side_rule=settings.side_rule,
            tendons=settings.tendons,
            progress=progress,
        )
    facts = found.facts
    drawn, sweeps = counted(facts["random_poses"], "random pose"), counted(facts["sweeps"], "sweep")
    if coupled := facts["joints_that_follow"]:
        sweeps += f" ({counted(coupled, 'coupled joint')} moved along)"
    poses = f"{drawn} and {sweeps} of {counted(facts['poses_of_a_sweep'], 'pose')}"
    paths = counted_paths(facts["muscles"], facts["cables"], facts["tendons"])
    report.say(f"{settings.model}: {paths} at {poses}")
    report.say(found.table())
    failed = len(found.failed)
    report.say(f"{failed} of {counted(len(found.checks), 'check')} failed" if failed else "no check failed")
    report.finish({"model": settings.model, **found.as_dict()})
    return FAULTS if failed else 0
