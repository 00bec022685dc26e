"""Forces on coordinates: actuators, limits, springs, and bushings that are springs of six coordinates."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mjwrap.osim.description.bodies import Joint
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
from mjwrap.osim.writing.assembly import Poses
from mjwrap.osim.writing.document import Document
from mjwrap.osim.writing.ellipsoids import EllipsoidSlide
from mjwrap.osim.writing.rotations import quaternion
from mjwrap.osim.writing.skeleton import Skeleton
from mjwrap.osim.writing.unique_names import UniqueNames

UNLIMITED = 1e10
TURNING_FREELY = ("FreeJoint", "BallJoint", "EllipsoidJoint")
TORQUE = (
    "; OpenSim turns it into a torque about an axis of the parent frame, here it acts on the angle itself"
)


@dataclass(frozen=True)
class _Place:
    """Where a force on a coordinate acts: joint, slope of the coordinate by the joint's qpos, and its value at zero."""

    joint: str
    slope: float
    at_zero: float


class _Writer:
    def __init__(self, document: Document, report: Report, skeleton: Skeleton) -> None:
        self.document, self.report, self.skeleton = document, report, skeleton
        self.tendons = UniqueNames(document, "fixed", "spatial", section="tendon")
        self.actuators = UniqueNames(document, "general", "muscle", section="actuator")
        # Coordinates on which a force acts in OpenSim as a torque about an axis of the joint's parent frame.
        self.turns: dict[str, tuple[Joint, int]] = {
            coordinate.name: (branch.joint, axis)
            for branch in skeleton.branches
            if branch.joint.kind in TURNING_FREELY
            for axis, coordinate in enumerate(branch.joint.coordinates[:3])
        }

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
            self.report.add(
                kind, name, LEFT_OUT, f"coordinate '{coordinate}' is a curved function of joint '{joint}'"
            )
            return None
        return _Place(joint, float(function(0.0, 1)), float(function(0.0)))

    def spring(
        self, name: str, place: _Place, rest: tuple[float, float], stiffness: float, damping: float
    ) -> None:
        """Write a linear spring and damper on a coordinate, slack between two values of it [rad or m]."""
        ends = sorted((value - place.at_zero) for value in rest)
        tendon = self.document.add("tendon", "fixed", name=self.tendons.new(name), stiffness=stiffness,
                                   damping=damping, springlength=_rest(*ends))  # fmt: skip
        self.document.add(tendon, "joint", joint=place.joint, coef=place.slope)

    def actuator(self, force: CoordinateActuator) -> None:
        place = self.place("CoordinateActuator", force.name, force.coordinate)
        if place is None:
            return
        low, high = force.control_range
        bounded = np.isfinite([low, high]).all() and low < high
        about = self.turns.get(force.coordinate)
        at: dict[str, object]
        if about is None:
            at = {"joint": place.joint, "gear": force.optimal_force * place.slope}
        else:
            joint, axis = about
            sites = [
                UniqueNames(self.document, "site").new(f"{force.name}_{which}")
                for which in ("child", "parent")
            ]
            for site, frame in zip(sites, (joint.child, joint.parent), strict=True):
                self.document.add(self.document.bodies[frame.body], "site", name=site, pos=frame.position,
                                  quat=quaternion(frame.rotation), group=4)  # fmt: skip
            torque = np.zeros(6)
            torque[3 + axis] = force.optimal_force
            at = {"site": sites[0], "refsite": sites[1], "gear": torque}
        self.document.add("actuator", "general", name=self.actuators.new(force.name), **at, ctrllimited=bounded,
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
        text += TORQUE * (force.coordinate in self.turns)
        self.report.add("CoordinateLimitForce", force.name, APPROXIMATED, text,
                        _transition_error(force.transition, stiffness), "N m or N, at most")  # fmt: skip

    def generalized_spring(self, force: SpringGeneralizedForce) -> None:
        place = self.place("SpringGeneralizedForce", force.name, force.coordinate)
        if place is not None:
            self.spring(force.name, place, (force.rest, force.rest), force.stiffness, force.viscosity)
            turned = force.coordinate in self.turns
            self.report.add("SpringGeneralizedForce", force.name, APPROXIMATED if turned else EXACT,
                            "spring and damper of a fixed tendon" + TORQUE * turned)  # fmt: skip

    def bushing(self, force: Bushing) -> None:
        deviations = self._affine(force)
        if deviations is None:
            self.report.add("BushingForce", force.name, LEFT_OUT, "its angles and displacements are not linear in the "
                            "coordinates between its bodies, and MuJoCo has no such force")  # fmt: skip
            return
        offset, slopes = deviations
        stiffness = np.concatenate([force.rotational_stiffness, force.translational_stiffness])
        damping = np.concatenate([force.rotational_damping, force.translational_damping])
        for k, part in enumerate(("rx", "ry", "rz", "tx", "ty", "tz")):
            terms = {joint: row[k] for joint, row in slopes.items() if row[k] != 0.0}
            if not terms or not (stiffness[k] or damping[k]):
                continue
            tendon = self.document.add("tendon", "fixed", name=self.tendons.new(f"{force.name}_{part}"),
                                       stiffness=float(stiffness[k]), damping=float(damping[k]),
                                       springlength=_rest(-offset[k], -offset[k]))  # fmt: skip
            for joint, slope in terms.items():
                self.document.add(tendon, "joint", joint=joint, coef=slope)
        self.report.add(
            "BushingForce", force.name, EXACT, "springs and dampers on the coordinates between its frames"
        )

    def _affine(self, force: Bushing) -> tuple[Array, dict[str, Array]] | None:
        """Return the six deviations at zero and their slopes (6,) by joint, if they are linear in joints' positions.

        A deviation is an angle of the second frame in the first, body-fixed x-y-z, or a displacement along its axes.
        """
        joints = {
            name: motion for name, motion in self.skeleton.joints if not isinstance(motion, EllipsoidSlide)
        }
        drivers = self.skeleton.drivers
        names = [name for name in joints if drivers.driver(name) == (name, None)]
        others = [motion.coordinate for name, motion in joints.items() if name not in names]
        rng = np.random.default_rng(0)
        samples = rng.uniform(-0.5, 0.5, (3 * len(names) + 6, len(names)))
        rows = []
        for sample in samples:
            values = drivers.values | dict(zip(names, map(float, sample), strict=True))
            poses = Poses(self.skeleton.branches, values.__getitem__)
            rows.append(_deviations(poses.frame(force.first), poses.frame(force.second)))
        matrix = np.concatenate([np.ones((len(samples), 1)), samples], axis=1)
        found, *_ = np.linalg.lstsq(matrix, np.array(rows), rcond=None)
        curved = float(np.abs(matrix @ found - np.array(rows)).max()) > 1e-9
        moving = {
            name: np.where(np.abs(row) > 1e-12, row, 0.0) for name, row in zip(names, found[1:], strict=True)
        }
        moving = {name: row for name, row in moving.items() if row.any()}
        if curved or set(moving).intersection(others):
            return None  # an axis that follows one of these coordinates by a function is a joint of its own
        return found[0], moving


def _deviations(first: Array, second: Array) -> Array:
    """Return the body-fixed x-y-z angles and the displacement (6,) of the second pose (4, 4) in the first."""
    turn = first[:3, :3].T @ second[:3, :3]
    angles = (
        np.arctan2(-turn[1, 2], turn[2, 2]),
        np.arcsin(np.clip(turn[0, 2], -1.0, 1.0)),
        np.arctan2(-turn[0, 1], turn[0, 0]),
    )
    return np.array([*angles, *(first[:3, :3].T @ (second[:3, 3] - first[:3, 3]))])


def _rest(low: float, high: float) -> tuple[float, float]:
    """Return the lengths between which a tendon is slack; MuJoCo takes -1 twice for the length at the default pose."""
    return (low, high) if (low, high) != (-1.0, -1.0) else (np.nextafter(-1.0, 0.0), np.nextafter(-1.0, 0.0))


def _transition_error(transition: float, stiffness: float) -> float:
    """Return the largest difference between a spring and one whose stiffness rises smoothly over a transition."""
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
            report.add(force.kind, force.name, LEFT_OUT, force.text)
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
