"""Constraints other than couplers, as equalities of MuJoCo between sites: none of them depends on the default pose."""

from __future__ import annotations

import numpy as np

from mjwrap.osim.description.bodies import (
    Constraint,
    Coupler,
    DistanceConstraint,
    Frame,
    PointConstraint,
    PointOnLineConstraint,
)
from mjwrap.osim.description.functions import Array
from mjwrap.osim.description.model import OsimModel
from mjwrap.osim.report import APPROXIMATED, EXACT, LEFT_OUT, Report
from mjwrap.osim.writing.assembly import Poses, worst_residual
from mjwrap.osim.writing.couplings import SOLIMP, SOLREF, write_hold
from mjwrap.osim.writing.document import Document
from mjwrap.osim.writing.motions import placed
from mjwrap.osim.writing.rotations import quaternion
from mjwrap.osim.writing.skeleton import Skeleton
from mjwrap.osim.writing.tree import Plane
from mjwrap.osim.writing.unique_names import UniqueNames, plain_name

REACH = 1.0  # [m] from a plane to each of the two sites from which its points are equally far


class _Writer:
    def __init__(self, document: Document) -> None:
        self.document = document
        self.sites = UniqueNames(document, "site")
        self.tendons = UniqueNames(document, "spatial", "fixed", section="tendon")
        self.equalities = UniqueNames(document, "joint", "connect", "weld", "tendon", section="equality")

    def site(self, body: str, transform: Array, name: str) -> str:
        """Write a site on a body at a transform (4, 4); return its name."""
        unique = self.sites.new(name)
        self.document.add(self.document.bodies[body], "site", name=unique, pos=transform[:3, 3],
                          quat=quaternion(transform[:3, :3]), group=4)  # fmt: skip
        return unique

    def between(self, kind: str, name: str, first: Frame, second: Frame) -> None:
        """Write a connect or weld equality between two frames."""
        sites = [
            self.site(frame.body, placed(frame), f"{name}_{k}") for k, frame in ((1, first), (2, second))
        ]
        self.document.add("equality", kind, name=self.equalities.new(name), site1=sites[0], site2=sites[1],
                          solref=SOLREF, solimp=SOLIMP)  # fmt: skip

    def line(self, name: str, first: str, second: str) -> str:
        """Write an invisible tendon that is the straight line between two sites; return its name."""
        unique = self.tendons.new(name)
        element = self.document.add("tendon", "spatial", name=unique, rgba=(0, 0, 0, 0), width=1e-4)
        for site in (first, second):
            self.document.add(element, "site", site=site)
        return unique

    def distance(self, name: str, first: Frame, second: Frame, change: float) -> None:
        """Write that two points keep their distance at the default pose plus a change."""
        sites = [
            self.site(frame.body, placed(frame), f"{name}_{k}") for k, frame in ((1, first), (2, second))
        ]
        self.document.add("equality", "tendon", name=self.equalities.new(name), tendon1=self.line(name, *sites),
                          polycoef=(change, 0, 0, 0, 0), solref=SOLREF, solimp=SOLIMP)  # fmt: skip

    def plane(self, name: str, plane: Plane) -> None:
        """Write that a point stays in a plane: equally far from two sites on both sides of the plane."""
        point = self.site(plane.mover, plane.place, f"{name}_point")
        lines = []
        for sign in (1.0, -1.0):
            end = np.eye(4)
            end[:3, 3] = plane.frame[:3, 3] + plane.frame[:3, :3] @ (sign * REACH * plane.axis)
            end_name = f"{name}_{'above' if sign > 0.0 else 'below'}"
            lines.append(self.line(end_name, self.site(plane.body, end, end_name), point))
        self.document.add("equality", "tendon", name=self.equalities.new(name), tendon1=lines[0], tendon2=lines[1],
                          polycoef=(0, 1, 0, 0, 0), solref=SOLREF, solimp=SOLIMP)  # fmt: skip


def write_constraints(document: Document, model: OsimModel, report: Report, skeleton: Skeleton) -> None:
    """Write all constraints but the first coupler of each coordinate, which `write_bodies` wrote."""
    writer = _Writer(document)
    poses = Poses(skeleton.branches, skeleton.drivers.value)
    for branch in skeleton.branches:
        for plane in branch.planes:
            axis = "xyz"[int(np.argmax(np.abs(plane.axis)))]
            writer.plane(f"{plain_name(branch.joint.name)}_plane_{axis}", plane)
        if branch.copy_of:
            child = branch.joint.child
            name = f"{plain_name(branch.joint.name)}_loop"
            if branch.fixed:
                writer.between("weld", name, branch.joint.parent, child)
            else:
                own = Frame(branch.body, np.zeros(3), np.eye(3))
                writer.between("weld", name, Frame(branch.copy_of, np.zeros(3), np.eye(3)), own)
            report.add(branch.joint.kind, branch.joint.name, EXACT,
                       f"closes a loop: '{branch.copy_of}' is carried in equal parts by welded copies")  # fmt: skip
    for constraint in model.constraints:
        if not isinstance(constraint, Coupler):
            _write(writer, constraint, poses)
            residual = float(np.abs(poses.residual(constraint)).max())
            report.add(type(constraint).__name__, constraint.name, EXACT,
                       f"holds at the default pose within {residual:.1e}")  # fmt: skip
        else:
            first = skeleton.drivers.couplers[constraint.dependent]
            if first is not constraint:
                report.add("CoordinateCouplerConstraint", constraint.name, LEFT_OUT,
                           f"{constraint.dependent} already follows by '{first.name}'")  # fmt: skip
    _write_locks(document, report, skeleton)
    worst = worst_residual(model, skeleton.branches, skeleton.drivers.value)
    if worst > 1e-9:
        report.add("Model", model.name, APPROXIMATED, "no pose near the default one satisfies all constraints; the "
                   "largest error of one", worst, "m or rad")  # fmt: skip


def _write(writer: _Writer, constraint: Constraint, poses: Poses) -> None:
    name = plain_name(constraint.name)
    if isinstance(constraint, PointOnLineConstraint):
        line = placed(constraint.line)
        for k, axis in enumerate(poses.across(constraint.direction)):
            writer.plane(f"{name}_{k + 1}", Plane(constraint.line.body, line, axis, constraint.point.body,
                                                  placed(constraint.point)))  # fmt: skip
    elif isinstance(constraint, DistanceConstraint):
        change = -float(poses.residual(constraint)[0])
        writer.distance(name, constraint.first, constraint.second, change if abs(change) > 1e-12 else 0.0)
    elif not isinstance(constraint, Coupler):
        kind = "connect" if isinstance(constraint, PointConstraint) else "weld"
        writer.between(kind, name, constraint.first, constraint.second)


def _write_locks(document: Document, report: Report, skeleton: Skeleton) -> None:
    drivers = skeleton.drivers
    for name, coordinate in drivers.coordinates.items():
        held = coordinate.locked or coordinate.prescribed is not None
        if not held or name in drivers.couplers:
            continue
        driver = drivers.driver(name)
        if driver is None or (name not in drivers.carriers and name not in drivers.substitutes):
            continue
        write_hold(document, driver[0])
        if coordinate.prescribed is None:
            report.add(
                "Coordinate", name, EXACT, f"locked: equality '{driver[0]}_locked' keeps its default value"
            )
        elif coordinate.prescribed.is_constant:
            report.add(
                "Coordinate", name, EXACT, f"prescribed by a constant: equality '{driver[0]}_locked' keeps it"
            )
        else:
            report.add("Coordinate", name, APPROXIMATED, f"prescribed by a function of time: '{driver[0]}_locked' "
                       "keeps its value at time 0")  # fmt: skip
