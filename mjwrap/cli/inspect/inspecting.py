"""Inspect a model: list its muscles, and judge their parameters over the joints' ranges."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap import implausible, length_ranges
from mjwrap.calibration.joints import JointSpace
from mjwrap.checking.mistakes import PossibleMistake, possible_mistakes
from mjwrap.cli.common.errors import FAULTS, UserError
from mjwrap.cli.common.output import Report
from mjwrap.cli.inspect.cables import cable_rows, cable_table
from mjwrap.cli.inspect.declared import as_values, table
from mjwrap.cli.inspect.moment_arms import arms_table, moment_arms
from mjwrap.cli.inspect.parts import parts_of, parts_text
from mjwrap.poses.angles import check_range
from mjwrap.runs.models import load, single_joints, start_keyframe, start_state
from mjwrap.system import CableSystem, MuscleSystem, is_cable
from mjwrap.text import counted, counted_paths


@dataclass(frozen=True)
class InspectSettings:
    """The settings of `mjwrap inspect`.

    model: a file or a model by name. keyframe: the rest pose, None for qpos0. seed: of the random poses. side_rule: as
    for `MuscleSystem`. ranges: of joints by name, in place of the model's [rad, m]. quick: judge only the parameters
    and the rest pose. strict: exit code 1 if something is implausible. json: a file for the report as values, "-" for
    standard output, or None.
    """

    model: str
    keyframe: str | None
    seed: int
    side_rule: int | None
    ranges: Mapping[str, tuple[float, float]]
    quick: bool
    strict: bool
    json: str | None


def inspect(settings: InspectSettings) -> int:
    """List the muscles, judge their parameters, and return the exit code."""
    model = load(settings.model)
    rest = start_state(model, start_keyframe(model, settings.keyframe)).qpos
    joints = dict(settings.ranges)
    JointSpace(
        copy.copy(model), rest, joints
    )  # read first, so that a mistake in a range is reported before the work
    for name, (low, high) in joints.items():
        if name in (single := single_joints(model)):
            check_range(model, single[name], low, high, f"{name}={low:g}deg,{high:g}deg")
    report = Report(settings.json)
    muscles = CableSystem(model, side_rule=settings.side_rule)
    parts = parts_of(model, muscles.declarations)
    if not muscles.names and not muscles.native:
        if not any(parts.values()):
            raise UserError(
                "the model has no muscles and no actuators on spatial tendons: nothing to inspect"
            )
        report.say(f"{settings.model}: no muscles and no actuators on spatial tendons")
        report.say(parts_text(parts))
        report.finish({"model": settings.model, **parts})
        return 0
    report.say(
        f"{settings.model}: {counted_paths(muscles.n, len(muscles.cables))} with geodesic paths, "
        f"{len(muscles.native)} with MuJoCo's own paths"
    )
    ranges = {} if settings.quick else length_ranges(muscles, ranges=joints, base=rest, seed=settings.seed)
    own = [muscle for muscle in muscles.declarations if not is_cable(muscle)]
    cables = cable_rows(model, muscles, rest, ranges)
    if own:
        report.say(table(model, own))
    if cables:
        report.say(cable_table(cables))
    for name, reason in muscles.native.items():
        report.say(f"{name}: stays with MuJoCo: {reason}")
    if any(parts.values()):
        report.say(parts_text(parts))
    arms = moment_arms(muscles, rest)
    report.say(arms_table(model, arms))
    mistakes = possible_mistakes(muscles, rest=rest, sweep=not settings.quick)
    report.say(mistakes_table(mistakes))
    found = implausible(muscles, ranges=ranges, rest=rest)
    report.say(found.table())
    values: dict[str, Any] = {
        "model": settings.model,
        "side_rule": muscles.side_rule,
        "muscles": [as_values(model, muscle) for muscle in own],
        "cables": cables,
        "native": muscles.native,
        **parts,
        "unmet_hints": _unmet_hints(muscles, rest),
        "moment_arms": arms,
        "possible_mistakes": [asdict(mistake) for mistake in mistakes],
    }
    report.finish(values | found.as_dict())
    return FAULTS if settings.strict and found.findings else 0


def _unmet_hints(muscles: MuscleSystem, rest: NDArray[np.float64]) -> dict[str, list[str]]:
    """Return the geoms that each muscle passes on another side than their hints ask for, after a start in `rest`."""
    data = mujoco.MjData(muscles.model)
    data.qpos[:] = rest
    muscles.forward(data)
    found = {name: muscles.unmet_hints(i) for i, name in enumerate(muscles.names)}
    return {name: geoms for name, geoms in found.items() if geoms}


def mistakes_table(found: Sequence[PossibleMistake]) -> str:
    """Return a line for each possible mistake."""
    if not found:
        return "the declaration shows no likely mistake"
    return "\n".join([f"{counted(len(found), 'possible mistake')}:", *(f"  {mistake}" for mistake in found)])
