"""Panels of a comparison's plot with given tables over both programs' curves, a pair for each muscle and joint."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap import MuscleSystem
from mjwrap.cli.common.measured import MeasuredCurve, MeasuredTables, joint_of, odd_scales, read_measured
from mjwrap.comparison.motion import pristine
from mjwrap.poses import JointCurves, curves
from mjwrap.runs.models import single_joints

QUANTITIES = ("length", "moment_arm")


@dataclass(frozen=True, eq=False)
class DataPanel:
    """The curves of one muscle over a joint, and the columns of the tables for it."""

    curves: JointCurves
    muscle: str
    given: Sequence[MeasuredCurve]
    sources: Sequence[str]

    def draw(self, pair: Any, native: Mapping[str, Any], own: Mapping[str, Any]) -> None:
        """Draw length and moment arm of both programs, with the styles of their lines, and the tables over them."""
        from mjwrap.cli.common.measured_drawing import draw_measured, handles

        found, i = self.curves, self.curves.names.index(self.muscle)
        position = 180.0 / math.pi if found.turns else 1.0
        for axis, quantity in zip(pair, QUANTITIES, strict=True):
            scale, unit = (1e3, "mm") if found.turns or quantity == "length" else (1.0, "-")
            axis.plot(position * found.at, scale * found.native[quantity][:, i], label="MuJoCo", **native)
            axis.plot(position * found.at, scale * found[quantity][:, i], label="mjwrap", **own)
            here = [curve for curve in self.given if curve.quantity == quantity]
            for curve in here:
                draw_measured(axis, curve, self.sources.index(curve.source), "0.15", position, scale)
            axis.set_xlabel(f"{found.joint} [{'°' if found.turns else 'm'}]", fontsize=8)
            axis.set_ylabel(f"{quantity.replace('_', ' ')} [{unit}]", fontsize=8.5)
            axis.grid(alpha=0.25)
            axis.tick_params(labelsize=8)
            if here:
                lines = axis.get_legend_handles_labels()[0]
                axis.legend(handles=[*lines[:2], *handles(here, "0.15")], fontsize=7.5, frameon=False)
        pair[0].set_ylabel(f"{self.muscle}\nlength [mm]", fontsize=8.5)


def data_panels(
    model: mujoco.MjModel,
    entries: Sequence[str],
    qpos: NDArray[np.float64],
    side_rule: int | None,
    say: Callable[[str], object],
) -> list[DataPanel]:
    """Return the panels for tables FILE or QUANTITY=FILE over joints, in the tables' order; qpos (nq,): the pose.

    Raises `UserError` if a table names no joint or muscle, or does not say what it holds.
    """
    if not entries:
        return []
    joints, model = list(single_joints(model)), pristine(model)
    names = MuscleSystem(model, side_rule=side_rule).names
    given: dict[str, list[MeasuredCurve]] = {}
    for entry in entries:
        joint = joint_of(entry, joints)
        turns = int(model.jnt_type[single_joints(model)[joint]]) == int(mujoco.mjtJoint.mjJNT_HINGE)
        tables = MeasuredTables([entry])
        given.setdefault(joint, []).extend(read_measured(tables, [joint], turns, names, QUANTITIES, say))
    sources = list(dict.fromkeys(curve.source for own in given.values() for curve in own))
    found: list[DataPanel] = []
    for joint, own in given.items():
        muscles = list(dict.fromkeys(curve.muscle for curve in own))
        drawn = curves(model, joint, muscles, qpos=qpos, native=True, side_rule=side_rule)

        def largest(muscle: str, quantity: str, drawn: JointCurves = drawn) -> float:
            return float(np.nanmax(np.abs(drawn[quantity][:, drawn.names.index(muscle)])))

        for line in odd_scales(own, largest):
            print(f"mjwrap compare: warning: {line}", file=sys.stderr)
        for muscle in muscles:
            here = [curve for curve in own if curve.muscle == muscle]
            found.append(DataPanel(drawn, muscle, here, sources))
    return found
