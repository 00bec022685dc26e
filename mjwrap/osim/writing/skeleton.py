"""Bodies, joints and couplings of an OpenSim model as MJCF."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from mjwrap.mjcf.coordinate_functions import ANGLE, LENGTH
from mjwrap.mjcf.tuple_names import AXES, COORDINATE
from mjwrap.osim.description.bodies import Coordinate
from mjwrap.osim.description.functions import Array, Piecewise, linear
from mjwrap.osim.description.model import OsimModel
from mjwrap.osim.report import APPROXIMATED, EXACT, Report
from mjwrap.osim.writing.assembly import assemble
from mjwrap.osim.writing.couplings import write_coupling
from mjwrap.osim.writing.document import Document
from mjwrap.osim.writing.drivers import Drivers, Substitute, drivers_of
from mjwrap.osim.writing.ellipsoids import EllipsoidSlide
from mjwrap.osim.writing.inertias import Written, written_inertias
from mjwrap.osim.writing.motions import AxisMotion, evaluated
from mjwrap.osim.writing.piece_algebra import composed, flattened
from mjwrap.osim.writing.quartics import inverse_pieces
from mjwrap.osim.writing.rotations import quaternion
from mjwrap.osim.writing.sites import MOST_NUMBERS
from mjwrap.osim.writing.tree import Branch, branches_of
from mjwrap.osim.writing.unique_names import body_name

# The inertia of a body that only shows a coordinate, as a share of the model's mass: the error of a coupling through it
# grows as it gets smaller, 4e-10 s^2 times force by mass at 1 ms.
CARRIER = 1e-5
CLAMPED = "clamped Coordinate"  # the kind of a report's entry


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
    def __init__(self, document: Document, report: Report, drivers: Drivers, limits: bool) -> None:
        self.document, self.report, self.drivers, self.limits = document, report, drivers, limits
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
            name=body_name(branch.body),
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
            attributes.update(self.range_of(drivers.coordinates[coordinate]))
        elif coordinate in drivers.substitutes and drivers.substitutes[coordinate].motion is motion:
            name = drivers.substitutes[coordinate].joint
            self.shown.add(coordinate)
            reference = motion.value(drivers.value)
            attributes.update(self.range_of(drivers.coordinates[coordinate], self.ranges[name]))
        else:
            name = self.name(f"{branch.joint.name}_{motion.name}")
            reference = motion.value(drivers.value)
            if not isinstance(motion, EllipsoidSlide):
                self.followers.append((name, reference, coordinate, motion.function))
        self.joints.append((name, motion))
        self.references[name] = reference
        return {"name": name, **attributes, "axis": axis, "ref": reference}

    def range_of(self, coordinate: Coordinate, image: tuple[float, float] | None = None) -> dict[str, object]:
        """Return range and limit of a coordinate's joint, and report them.

        A clamp becomes a limit only if limits are wanted, and not of what follows others, is locked or starts outside.
        image: the range of the joint where that is not the coordinate's.
        """
        low, high = coordinate.range
        if not low < high:
            return {}
        inside = low <= self.drivers.value(coordinate.name) <= high
        free = coordinate.name not in self.drivers.couplers and not coordinate.locked
        limited = self.limits and coordinate.clamped and free and inside
        kind = CLAMPED if coordinate.clamped else "unclamped Coordinate"
        if limited:
            self.report.add(kind, coordinate.name, APPROXIMATED, "a limit stops its joint; OpenSim heeds a clamp where "
                            "a pose is set, not in a motion")  # fmt: skip
        else:
            self.report.add(kind, coordinate.name, EXACT, "its joint has the range, but no limit")
        return {"range": image or (low, high), "limited": limited}

    def carrier(self, coordinate: Coordinate, least: float) -> None:
        """Write a body whose only joint shows a coordinate that no axis shows."""
        name = coordinate.name
        turn = coordinate.motion != "translational"
        element = self.document.add("worldbody", "body", name=self.name(f"{name}_carrier"), gravcomp=1)
        self.document.add(element, "joint", name=name, type="hinge" if turn else "slide", axis=(1, 0, 0),
                          ref=self.drivers.value(name), **self.range_of(coordinate))  # fmt: skip
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
            substitute = self.drivers.substitutes.get(name)
            if substitute is not None:
                self.substitute(name, substitute)
                continue
            data = flattened(driver[1])
            if len(data) <= MOST_NUMBERS:
                self.tuple(name, driver[0], None, {"function": data})
            self.report.add("Coordinate", name, EXACT if name in self.drivers.couplers else APPROXIMATED,
                            f"a function of joint '{driver[0]}', in {len(driver[1].origins)} pieces",
                            driver[1].error or float("nan"), "rad or m" if driver[1].error else "")  # fmt: skip

    def substitute(self, name: str, substitute: Substitute) -> None:
        """Write that a joint is a function of a coordinate."""
        function = substitute.motion.function
        data = flattened(function)
        if len(data) <= MOST_NUMBERS:
            mark = ANGLE if self.drivers.coordinates[name].motion == "rotational" else LENGTH
            self.tuple(name, substitute.joint, mark, {"function": data, "range": substitute.extent})
        count = len(function.origins)
        self.report.add("Coordinate", name, EXACT, f"joint '{substitute.joint}' is a function of it, in {count} "
                        f"piece{'s' * (count > 1)}; what follows it follows the joint")  # fmt: skip

    def tuple(
        self, name: str, joint: str, mark: float | None, numerics: Mapping[str, Iterable[float]]
    ) -> None:
        """Write the tuple of a coordinate: a joint with a mark, and numerics by the ends of their names."""
        record = self.document.add("custom", "tuple", name=f"{COORDINATE}{name}")
        self.document.add(record, "element", objtype="joint", objname=joint, prm=mark)
        for end, data in numerics.items():
            numeric = self.document.numeric(f"{COORDINATE}{name}_{end}", data)
            self.document.add(record, "element", objtype="numeric", objname=numeric)

    def axes(self) -> None:
        """Write which joints are axes only: a tuple."""
        only = [name for name, _ in self.joints if name not in self.drivers.coordinates]
        if not only:
            return
        record = self.document.add("custom", "tuple", name=AXES)
        for name in only:
            self.document.add(record, "element", objtype="joint", objname=name)

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


def write_bodies(document: Document, model: OsimModel, report: Report, limits: bool) -> Skeleton:
    """Write bodies, joints, coordinates and couplers; return what later parts need to know of them.

    limits: whether clamped coordinates get limits.
    """
    branches = branches_of(model)
    drivers = drivers_of(model, branches)
    assemble(model, branches, drivers)
    inertias = written_inertias(model.bodies, branches)
    writer = _Writer(document, report, drivers, limits)
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
    writer.axes()
    return Skeleton(branches, drivers, inertias, writer.joints)
