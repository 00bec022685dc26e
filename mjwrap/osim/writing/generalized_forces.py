"""Forces on coordinates: actuators, limits, springs, and bushings that are springs of six coordinates."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mjwrap.osim.description.bodies import Frame
from mjwrap.osim.description.forces import (
    Bushing,
    CoordinateActuator,
    LimitForce,
    OtherForce,
    SpringGeneralizedForce,
)
from mjwrap.osim.description.functions import Array
from mjwrap.osim.description.model import OsimModel
from mjwrap.osim.report import APPROXIMATED, EXACT, LEFT_OUT, Report
from mjwrap.osim.writing.document import Document
from mjwrap.osim.writing.motions import Motion, placed
from mjwrap.osim.writing.skeleton import Skeleton
from mjwrap.osim.writing.unique_names import UniqueNames

UNLIMITED = 1e10


@dataclass(frozen=True)
class _Place:
    """Where a force on a coordinate acts: joint, and slope of the coordinate by the joint's qpos, and its value at zero."""

    joint: str
    slope: float
    at_zero: float


class _Writer:
    def __init__(self, document: Document, report: Report, skeleton: Skeleton) -> None:
        self.document, self.report, self.skeleton = document, report, skeleton
        self.tendons = UniqueNames(document, "fixed", "spatial", section="tendon")
        self.actuators = UniqueNames(document, "general", "muscle", section="actuator")

    def place(self, kind: str, name: str, coordinate: str) -> _Place | None:
        """Return where a force on a coordinate acts; None, with an entry in the report, where it cannot."""
        driver = self.skeleton.drivers.driver(coordinate)
        if driver is None:
            self.report.add(kind, name, LEFT_OUT, f"there is no coordinate '{coordinate}'")
            return None
        joint, function = driver
        if function is None:
            return _Place(joint, 1.0, 0.0)
        if not function.is_linear:
            self.report.add(kind, name, LEFT_OUT, f"coordinate '{coordinate}' is a curved function of joint '{joint}'")
            return None
        return _Place(joint, float(function(0.0, 1)), float(function(0.0)))

    def spring(self, name: str, place: _Place, rest: tuple[float, float], stiffness: float, damping: float) -> None:
        """Write a linear spring and damper on a coordinate, slack between two values of it [rad or m]."""
        ends = sorted((value - place.at_zero) for value in rest)
        tendon = self.document.add("tendon", "fixed", name=self.tendons.new(name), stiffness=stiffness,
                                   damping=damping, springlength=ends)  # fmt: skip
        self.document.add(tendon, "joint", joint=place.joint, coef=place.slope)

    def actuator(self, force: CoordinateActuator) -> None:
        place = self.place("CoordinateActuator", force.name, force.coordinate)
        if place is None:
            return
        low, high = force.control_range
        bounded = np.isfinite([low, high]).all() and low < high
        self.document.add("actuator", "general", name=self.actuators.new(force.name), joint=place.joint,
                          gear=force.optimal_force * place.slope, ctrllimited=bounded,
                          ctrlrange=(low, high) if bounded else None)  # fmt: skip
        self.report.add("CoordinateActuator", force.name, EXACT)

    def limit(self, force: LimitForce) -> None:
        place = self.place("CoordinateLimitForce", force.name, force.coordinate)
        if place is None:
            return
        lower, upper = force.lower_limit, force.upper_limit
        if force.upper_stiffness > 0.0:
            self.spring(f"{force.name}_upper", place, (-UNLIMITED, upper), force.upper_stiffness, 0.0)
        if force.lower_stiffness > 0.0:
            self.spring(f"{force.name}_lower", place, (lower, UNLIMITED), force.lower_stiffness, 0.0)
        stiffness = max(force.upper_stiffness, force.lower_stiffness)
        text = "stiff from the limit on, where OpenSim's stiffness rises smoothly over the transition"
        if force.damping > 0.0:
            text += f"; its damping of {force.damping:.4g}, which acts outside the limits only, is left out"
        self.report.add("CoordinateLimitForce", force.name, APPROXIMATED, text,
                        _transition_error(force.transition, stiffness), "N m or N, at most")  # fmt: skip

    def generalized_spring(self, force: SpringGeneralizedForce) -> None:
        place = self.place("SpringGeneralizedForce", force.name, force.coordinate)
        if place is not None:
            self.spring(force.name, place, (force.rest, force.rest), force.stiffness, force.viscosity)
            self.report.add("SpringGeneralizedForce", force.name, EXACT, "spring and damper of a fixed tendon")

    def bushing(self, force: Bushing) -> None:
        places = self._six_axes(force)
        if isinstance(places, str):
            self.report.add("BushingForce", force.name, LEFT_OUT, places)
            return
        stiffness = np.concatenate([force.rotational_stiffness, force.translational_stiffness])
        damping = np.concatenate([force.rotational_damping, force.translational_damping])
        for k, place in enumerate(places):
            if place is not None and (stiffness[k] or damping[k]):
                axis = ("rx", "ry", "rz", "tx", "ty", "tz")[k]
                self.spring(f"{force.name}_{axis}", place, (0.0, 0.0), float(stiffness[k]), float(damping[k]))
        self.report.add("BushingForce", force.name, EXACT, "springs and dampers on the coordinates between its frames")

    def _six_axes(self, force: Bushing) -> list[_Place | None] | str:
        """Return where each of the six deviations is a coordinate, or why not; None for one that stays zero."""
        for branch in self.skeleton.branches:
            joint = branch.joint
            turned = _same(force.first, joint.child) and _same(force.second, joint.parent)
            if not (turned or (_same(force.first, joint.parent) and _same(force.second, joint.child))):
                continue
            motions = [step for step in branch.chain if isinstance(step, Motion)]
            if turned and len(motions) > 1:
                return "it measures its joint from the child's side, where rotations are not the joint's angles"
            places: list[_Place | None] = [None] * 6
            for axes, first in ((joint.rotations, 0), (joint.translations, 3)):
                for k, axis in enumerate(axes):
                    if not axis.coordinates or axis.function.is_constant:
                        if float(axis.function(0.0)) != 0.0:
                            return f"joint '{joint.name}' has a constant offset"
                        continue
                    direction = axis.axis / np.linalg.norm(axis.axis)
                    column = int(np.argmax(np.abs(direction)))
                    aligned = abs(abs(direction[column]) - 1.0) < 1e-9
                    if not aligned or (first == 0 and len(motions) > 1 and column != k):
                        return f"the axes of joint '{joint.name}' are not the three axes of the bushing's frame in order"
                    if places[first + column] is not None or not axis.function.is_linear:
                        return f"joint '{joint.name}' moves along its axes by functions that are not linear"
                    place = self.place("BushingForce", force.name, axis.coordinates[0])
                    if place is None:
                        return f"coordinate '{axis.coordinates[0]}' has no joint"
                    slope = float(axis.function(0.0, 1)) * float(np.sign(direction[column])) * (-1.0 if turned else 1.0)
                    offset = float(axis.function(0.0)) * slope
                    places[first + column] = _Place(place.joint, slope * place.slope, slope * place.at_zero + offset)
            return places
        return "its frames are not those of a joint, so its angles are no coordinates; MuJoCo has no such force"


def _same(first: Frame, second: Frame) -> bool:
    return first.body == second.body and bool(np.allclose(placed(first), placed(second), rtol=0.0, atol=1e-5))


def _transition_error(transition: float, stiffness: float) -> float:
    """Return the largest difference between a spring and one whose stiffness rises as a smooth step over a transition."""
    x: Array = np.linspace(0.0, 1.0, 401)
    smooth = x**3 * (10.0 + x * (6.0 * x - 15.0))
    return float((stiffness * transition * x * (1.0 - smooth)).max())


def write_generalized_forces(
    document: Document, model: OsimModel, report: Report, skeleton: Skeleton
) -> None:
    """Write all forces on coordinates, and bushings; name other forces in the report."""
    writer = _Writer(document, report, skeleton)
    for force in model.forces:
        if isinstance(force, OtherForce):
            report.add(force.kind, force.name, LEFT_OUT, "mjwrap does not import this class")
            continue
        written = {
            CoordinateActuator: writer.actuator,
            LimitForce: writer.limit,
            SpringGeneralizedForce: writer.generalized_spring,
            Bushing: writer.bushing,
        }.get(type(force))
        if written is None:
            continue
        if force.active:
            written(force)  # type: ignore[arg-type]
        else:
            report.add(type(force).__name__, force.name, LEFT_OUT, "switched off in the file")
