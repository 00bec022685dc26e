"""Compute curves of muscles over a joint, and write them as a picture and a table."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mjwrap.cli.common.errors import UserError
from mjwrap.cli.common.figures import need_matplotlib
from mjwrap.cli.common.measured import MeasuredCurve, MeasuredTables, odd_scales, read_measured
from mjwrap.cli.common.output import open_output, say
from mjwrap.cli.plot.model_curves import ModelCurves, shown_unit, write_curves
from mjwrap.errors import ModelError
from mjwrap.poses import JointCurves, curves
from mjwrap.poses.angles import check_range
from mjwrap.runs.models import find_joint, load, start_keyframe, start_state
from mjwrap.text import aligned, counted_paths


@dataclass(frozen=True)
class PlotSettings:
    """The settings of `mjwrap plot`.

    models: files or names; joints: the joint in each of them. muscles: patterns of names, None for all that
    the joint moves. quantities: of `QUANTITIES`. span: positions of the joint [rad or m], None for its range. samples:
    number of positions. activation: 0 to 1. keyframe, positions: pose of the other joints [rad or m]. native: draw
    MuJoCo's tendons, too. side_rule: as for `MuscleSystem`. data: tables, or None. picture, csv: files, or None.
    """

    models: Sequence[str]
    joints: Sequence[str]
    muscles: Sequence[str] | None
    quantities: Sequence[str]
    span: tuple[float, float] | None
    samples: int
    activation: float
    keyframe: str | None
    positions: Mapping[str, float]
    native: bool
    side_rule: int | None
    data: MeasuredTables | None
    picture: str | None
    csv: str | None


def plot(settings: PlotSettings) -> int:
    """Compute the curves, write the files, report, and return the exit code."""
    picture = open_output(settings.picture, "--out", ".png", ".pdf", ".svg") if settings.picture else None
    table = open_output(settings.csv, "--csv", ".csv") if settings.csv else None
    if picture is not None:
        need_matplotlib("--out")
    found = [
        ModelCurves(label, _curves(settings, source, joint))
        for label, source, joint in zip(
            labels(settings.models), settings.models, settings.joints, strict=True
        )
    ]
    turns = {each.curves.turns for each in found}
    if len(turns) > 1:
        raise UserError("the joints turn in some models and slide in others: plot them one by one")
    for quantity in settings.quantities:
        _check_values(found, quantity)
    for each in found:
        say(_told(each))
    muscles = list(dict.fromkeys(name for each in found for name in each.curves.names))
    given: list[MeasuredCurve] = []
    if settings.data is not None:
        joints = list(dict.fromkeys(settings.joints))
        given = read_measured(settings.data, joints, turns == {True}, muscles, settings.quantities, say)
        for line in odd_scales(given, lambda muscle, quantity: _largest(found, muscle, quantity)):
            print(f"mjwrap plot: warning: {line}", file=sys.stderr)
        say("\n".join(aligned(_misfits(found, given), (0, 1, 2, 3))))
    if table is not None:
        write_curves(table, found, settings.quantities)
        say(f"csv:  {settings.csv}")
    if picture is not None:
        from mjwrap.cli.plot.figure import plot_curves

        plot_curves(picture, found, settings.quantities, given)
        say(f"plot: {settings.picture}")
    return 0


def labels(models: Sequence[str]) -> list[str]:
    """Return a short name for each model, with as much of its path as tells it from the others."""
    depth = 1
    parts = [Path(source).parts if not source.startswith("myo_sim:") else (source,) for source in models]
    while len({part[-depth:] for part in parts}) < len(set(parts)) and depth < max(map(len, parts)):
        depth += 1
    return ["/".join(part[-depth:]) for part in parts]


def _curves(settings: PlotSettings, source: str, joint: str) -> JointCurves:
    model = load(source)
    pose = start_state(model, start_keyframe(model, settings.keyframe), settings.positions).qpos
    try:
        if settings.span is not None:
            low, high = settings.span
            check_range(model, find_joint(model, joint, joint), low, high, f"{low:g}deg,{high:g}deg")
        return curves(
            model,
            joint,
            settings.muscles,
            samples=settings.samples,
            span=settings.span,
            qpos=pose,
            activation=settings.activation,
            native=settings.native,
            side_rule=settings.side_rule,
        )
    except ModelError as error:
        raise ModelError(f"{source}: {error}") from None


def _check_values(found: Sequence[ModelCurves], quantity: str) -> None:
    """Raise `UserError` if muscles have paths, and yet none of them has a quantity."""
    if not any(np.isfinite(each.curves["length"]).any() for each in found):
        return  # `_told` names the muscles
    if any(np.isfinite(each.curves[quantity]).any() for each in found):
        return
    cables = all(len(each.curves.cables) == len(each.curves.names) for each in found)
    why = "cables have lengths and moment arms only" if cables else "their laws have no fibres"
    raise UserError(f"no muscle has a value of '{quantity}': {why}")


def _told(each: ModelCurves) -> str:
    found = each.curves
    low, high = found.at[0], found.at[-1]
    places = (
        f"{math.degrees(low):.4g}° to {math.degrees(high):.4g}°"
        if found.turns
        else f"{low:.4g} to {high:.4g} m"
    )
    text = f"{each.label}: {counted_paths(len(found.names), len(found.cables))}, {found.joint} from {places}"
    if found.follows:
        text += f"; {found.joint} follows {found.follows} in the model, and is moved alone here"
    lost = [name for i, name in enumerate(found.names) if np.isnan(found["length"][:, i]).any()]
    if lost:
        text += f"; no path at some positions: {', '.join(lost)}"
    return text


def _largest(found: Sequence[ModelCurves], muscle: str, quantity: str) -> float:
    tops = [
        float(np.nanmax(np.abs(each.curves[quantity][:, each.curves.names.index(muscle)]), initial=0.0))
        for each in found
        if muscle in each.curves.names
    ]
    return max(tops, default=0.0)


def _misfits(found: Sequence[ModelCurves], given: Sequence[MeasuredCurve]) -> list[list[str]]:
    """Return rows of a table: how far each model is from each column of data, where both have values."""
    rows = [["table", "muscle", "quantity", "model", "rows", "model - table: mean", "rms", "largest"]]
    for curve in given:
        for each in found:
            here = each.curves
            if curve.muscle not in here.names or np.isnan(curve.value).all():
                continue
            own = here[curve.quantity][:, here.names.index(curve.muscle)]
            slack = 1e-6 * float(np.ptp(here.at))  # positions are written with a few digits
            within = (curve.at >= here.at[0] - slack) & (curve.at <= here.at[-1] + slack)
            gap = np.where(within, np.interp(curve.at, here.at, own), np.nan) - curve.value
            gap = gap[np.isfinite(gap)]
            numbers = ["-"] * 3
            if gap.size:
                k = int(np.argmax(np.abs(gap)))
                scale, unit = shown_unit(curve.quantity, here.turns)
                marks = (gap.mean(), math.sqrt(float((gap**2).mean())), gap[k])
                numbers = [f"{scale * mark:.3g} {unit}".rstrip() for mark in marks]
            rows.append([curve.source, curve.muscle, curve.quantity, each.label, str(gap.size), *numbers])
    return rows if len(rows) > 1 else []
