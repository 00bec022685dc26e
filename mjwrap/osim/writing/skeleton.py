"""Bodies, joints and couplings of an OpenSim model as MJCF."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mjwrap.osim.description.bodies import Coordinate
from mjwrap.osim.description.functions import Array, Piecewise, linear
from mjwrap.osim.description.model import OsimModel
from mjwrap.osim.report import APPROXIMATED, EXACT, Report
from mjwrap.osim.writing.assembly import assemble
from mjwrap.osim.writing.couplings import write_coupling
from mjwrap.osim.writing.document import Document
from mjwrap.osim.writing.drivers import Drivers, drivers_of
from mjwrap.osim.writing.ellipsoids import EllipsoidSlide
from mjwrap.osim.writing.inertias import Written, written_inertias
from mjwrap.osim.writing.motions import AxisMotion, evaluated
from mjwrap.osim.writing.piece_algebra import composed, flattened
from mjwrap.osim.writing.quartics import inverse_pieces
from mjwrap.osim.writing.rotations import quaternion
from mjwrap.osim.writing.sites import MOST_NUMBERS
from mjwrap.osim.writing.tree import Branch, branches_of

# The inertia of a body that only shows a coordinate, as a share of the model's mass: the error of a coupling through it
# grows as it gets smaller, 4e-10 s^2 times force by mass at 1 ms.
CARRIER = 1e-5


@dataclass(frozen=True)
class Skeleton:
    """What was written: the tree, the joints of the coordinates, and the inertias."""

    branches: list[Branch]
    drivers: Drivers
    inertias: dict[str, Written]
    joints: list[tuple[str, AxisMotion]]  # the name and the motion of every joint of a body

    def qpos(self, values: dict[str, float]) -> dict[str, float]:
        """Return qpos of every joint of a body at values of all coordinates, exactly, without pieces."""
        return {
            name: values[name] if name in values else motion.value(values.__getitem__)
            for name, motion in self.joints
        }


class _Writer:
    def __init__(self, document: Document, report: Report, drivers: Drivers) -> None:
        self.document, self.report, self.drivers = document, report, drivers
        self.taken = {*drivers.coordinates, *(each.joint for each in drivers.substitutes.values())}
        self.followers: list[tuple[str, float, str, Piecewise]] = []  # joint, reference, coordinate, function
        self.shown: set[str] = set()
        self.references = {name: drivers.value(name) for name in drivers.coordinates}
        self.ranges = {name: coordinate.range for name, coordinate in drivers.coordinates.items()}
        for name, each in drivers.substitutes.items():
            low, high = sorted(map(float, each.motion.function(drivers.coordinates[name].range)))
            self.ranges[each.joint] = low, high
        self.joints: list[tuple[str, AxisMotion]] = []

    def name(self, wanted: str) -> str:
        name = "_".join(wanted.split())
        while name in self.taken:
            name += "_"
        self.taken.add(name)
        return name

    def body(self, branch: Branch, inertia: Written) -> None:
        """Write a body with its joints and its inertia."""
        values = self.drivers.value
        home = evaluated(branch.chain, values)
        element = self.document.add(
            self.document.bodies[branch.parent],
            "body",
            name=branch.body if branch.body != "world" else "world_",  # MuJoCo's name of ground
            pos=home[:3, 3],
            quat=quaternion(home[:3, :3]),
        )
        self.document.bodies[branch.body] = element
        after = np.eye(4)  # the body in the frame that a motion has moved
        joints = []
        for step in reversed(branch.chain):
            if isinstance(step, AxisMotion):
                joints.append(self.joint(branch, step, after))
                after = step.transform(step.value(values)) @ after
            else:
                after = step @ after
        for attributes in reversed(joints):
            self.document.add(element, "joint", **attributes)
        if inertia.properties is not None:
            moments, axes = inertia.properties.principal()
            self.document.add(element, "inertial", pos=inertia.properties.center, mass=inertia.properties.mass,
                              quat=quaternion(axes), diaginertia=moments)  # fmt: skip

    def joint(self, branch: Branch, motion: AxisMotion, after: Array) -> dict[str, object]:
        """Return the attributes of a motion's joint; remember whether it follows a coordinate."""
        drivers, coordinate = self.drivers, motion.coordinate
        axis = after[:3, :3].T @ motion.axis
        attributes: dict[str, object] = {"type": "hinge" if motion.turn else "slide"}
        if motion.turn:
            attributes["pos"] = -after[:3, :3].T @ after[:3, 3]
        if drivers.carriers.get(coordinate) is motion:
            name = coordinate
            self.shown.add(coordinate)
            axis = axis * float(motion.function(0.0, 1))
            reference = drivers.value(coordinate)
            attributes.update(self.limits(drivers.coordinates[coordinate]))
        elif coordinate in drivers.substitutes and drivers.substitutes[coordinate].motion is motion:
            name = drivers.substitutes[coordinate].joint
            self.shown.add(coordinate)
            reference = motion.value(drivers.value)
            attributes.update(self.limits(drivers.coordinates[coordinate], self.ranges[name]))
        else:
            name = self.name(f"{branch.joint.name}_{motion.name}")
            reference = motion.value(drivers.value)
            if not isinstance(motion, EllipsoidSlide):
                self.followers.append((name, reference, coordinate, motion.function))
        self.joints.append((name, motion))
        self.references[name] = reference
        return {"name": name, **attributes, "axis": axis, "ref": reference}

    def limits(self, coordinate: Coordinate, image: tuple[float, float] | None = None) -> dict[str, object]:
        """Return range and limit of a coordinate's joint; what follows others, or starts outside, has no limit.

        image: the range of the joint where that is not the coordinate's.
        """
        low, high = coordinate.range
        if not low < high:
            return {}
        limited = coordinate.clamped and coordinate.name not in self.drivers.couplers
        inside = low <= self.drivers.value(coordinate.name) <= high
        return {"range": image or (low, high), "limited": limited and inside and not coordinate.locked}

    def carrier(self, coordinate: Coordinate, least: float) -> None:
        """Write a body whose only joint shows a coordinate that no axis shows."""
        name = coordinate.name
        turn = coordinate.motion != "translational"
        element = self.document.add("worldbody", "body", name=self.name(f"{name}_carrier"), gravcomp=1)
        self.document.add(element, "joint", name=name, type="hinge" if turn else "slide", axis=(1, 0, 0),
                          ref=self.drivers.value(name), **self.limits(coordinate))  # fmt: skip
        self.document.add(element, "inertial", pos=(0, 0, 0), mass=least, diaginertia=[least] * 3)
        self.report.add("Coordinate", name, APPROXIMATED,
                        f"no axis turns or slides one to one with it, so a body of its own shows it, of {least:.3g} kg "
                        f"and {least:.3g} kg m^2", least, "kg m^2" if turn else "kg")  # fmt: skip

    def couplings(self) -> None:
        """Write the equalities of axes that follow coordinates, and of coordinates that follow others."""
        drivers = self.drivers
        for name in drivers.coordinates:
            dependence = drivers.dependence(name)
            if dependence is not None and name in self.shown:
                self.follow(name, drivers.value(name), *dependence)
        for joint, reference, coordinate, function in self.followers:
            self.follow(joint, reference, coordinate, function)

    def functions(self) -> None:
        """Write how coordinates that are no joint's qpos follow from one: a tuple of the joint and a numeric."""
        for name in self.drivers.coordinates:
            driver = self.drivers.driver(name)
            if driver is None or driver[1] is None:
                continue
            data = flattened(driver[1])
            if len(data) <= MOST_NUMBERS:
                record = self.document.add("custom", "tuple", name=f"mjwrap_coordinate_{name}")
                numeric = self.document.numeric(f"mjwrap_coordinate_{name}_function", data)
                self.document.add(record, "element", objtype="joint", objname=driver[0])
                self.document.add(record, "element", objtype="numeric", objname=numeric)
            self.report.add("Coordinate", name, EXACT if name in self.drivers.couplers else APPROXIMATED,
                            f"a function of joint '{driver[0]}', in {len(driver[1].origins)} pieces",
                            driver[1].error or float("nan"), "rad or m" if driver[1].error else "")  # fmt: skip

    def follow(self, joint: str, reference: float, coordinate: str, function: Piecewise) -> None:
        """Write that a joint is a function of a coordinate, and report it."""
        leader, inner = self.drivers.leader(coordinate)
        total = function if inner is None else composed(function, inner)
        substitute = self.drivers.substitutes.get(leader)
        if substitute is not None:
            low, high = substitute.extent
            shown = substitute.motion.function
            for digits in (10, 9, 8):
                found = inverse_pieces(shown, low, high, 10.0**-digits, total)
                assert found is not None
                if len(found.origins) <= MOST_NUMBERS:
                    break
            total = found
            leader = substitute.joint
        at = self.references[leader]
        low, high = self.ranges[leader]
        low, high = min(low, at), max(high, at)
        room = 0.1 * (high - low)
        written = write_coupling(
            self.document, (joint, reference), (leader, at), total, (low - room, high + room)
        )
        count = len(written.origins)
        self.report.add("Coupling", joint, APPROXIMATED if written.error > 0.0 else EXACT,
                        f"follows {leader} by {count} polynomial{'s' * (count > 1)}", written.error or float("nan"),
                        "rad or m" if written.error else "")  # fmt: skip


def write_bodies(document: Document, model: OsimModel, report: Report) -> Skeleton:
    """Write bodies, joints, coordinates and couplers; return what later parts need to know of them."""
    branches = branches_of(model)
    drivers = drivers_of(model, branches)
    assemble(model, branches, drivers)
    inertias = written_inertias(model.bodies, branches)
    writer = _Writer(document, report, drivers)
    for branch in branches:
        if not (branch.copy_of and branch.fixed):
            writer.body(branch, inertias[branch.body])
    least = CARRIER * (sum(body.mass for body in model.bodies) or 1.0)
    moving = {step.coordinate for branch in branches for step in branch.chain if isinstance(step, AxisMotion)}
    needed = moving | {coupler.independent[0] for coupler in drivers.couplers.values()}
    for name, coordinate in drivers.coordinates.items():
        if name not in writer.shown and name not in drivers.couplers and name in needed:
            writer.carrier(coordinate, least)
            drivers.carriers.setdefault(
                name, AxisMotion(True, np.array([1.0, 0.0, 0.0]), name, linear(1.0), "")
            )
            writer.shown.add(name)
    writer.couplings()
    writer.functions()
    return Skeleton(branches, drivers, inertias, writer.joints)
