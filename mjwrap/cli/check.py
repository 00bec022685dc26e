"""Check on your own model the laws that hold on every model, pass or fail, each with its worst figure and where.

MODEL is an MJCF or MJB file, or myo_sim:NAME, a model that the myo-sim package composes. At random poses, from a cold
start: are paths tangent to their surfaces, are the lengthening speed and the moment arms the derivatives of the length,
is the generalised force -F dl/dq, do each muscle's forces balance, is their power -F dl/dt? Along sweeps of every
joint: does a length or a moment arm jump, is there a path everywhere? In a short motion without losses: is the energy
that the skeleton gains the muscles' work?

Examples:
  mjwrap check models/elbow/elbow.xml
  mjwrap check myo_sim:myoarm_r --poses 5 --samples 51 --json check.json

Exit code 1 where a law does not hold.
"""

from __future__ import annotations

import argparse
import contextlib
from dataclasses import dataclass

from mjwrap.checking import check_model
from mjwrap.cli.common.arguments import add_json, add_model, at_least
from mjwrap.cli.common.errors import FAULTS
from mjwrap.cli.common.output import Report
from mjwrap.cli.common.progress import Stages
from mjwrap.runs.models import load, start_keyframe, start_state
from mjwrap.text import counted


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say which arguments there are."""
    add_model(parser, "pose to sweep around", "of the random poses")
    add = parser.add_argument
    add("--poses", type=at_least(1), default=20, metavar="N", help="random poses (%(default)s)")
    add("--samples", type=at_least(3), default=101, metavar="N", help="poses of a sweep (%(default)s)")
    add_json(parser, "verdicts and figures")


@dataclass(frozen=True)
class CheckSettings:
    """The settings of `mjwrap check`.

    model: a file, or "myo_sim:NAME". keyframe: the pose to sweep around, None for qpos0. poses: random ones, drawn with
    seed; samples: poses of a sweep. json: a file for the figures, "-" for standard output, or None.
    """

    model: str
    keyframe: str | None
    poses: int
    samples: int
    seed: int
    json: str | None


def execute(options: argparse.Namespace) -> int:
    """Check, and return the exit code."""
    return check(
        CheckSettings(
            options.model, options.keyframe, options.poses, options.samples, options.seed, options.json
        )
    )


def check(settings: CheckSettings) -> int:
    """Check, and say what holds; return the exit code."""
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
            progress=progress,
        )
    facts = found.facts
    drawn, sweeps = counted(facts["random_poses"], "random pose"), counted(facts["sweeps"], "sweep")
    if coupled := facts["joints_that_follow"]:
        sweeps += f" ({counted(coupled, 'coupled joint')} moved along)"
    poses = f"{drawn} and {sweeps} of {counted(facts['poses_of_a_sweep'], 'pose')}"
    report.say(f"{settings.model}: {counted(facts['muscles'], 'muscle')} at {poses}")
    report.say(found.table())
    failed = len(found.failed)
    report.say(f"{failed} of {counted(len(found.checks), 'check')} failed" if failed else "no check failed")
    report.finish({"model": settings.model, **found.as_dict()})
    return FAULTS if failed else 0
