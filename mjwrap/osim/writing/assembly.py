"""The default pose, which satisfies all constraints: the nearest one to the default values, as in OpenSim."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mjwrap.osim.description.bodies import (
    GROUND,
    Constraint,
    Coupler,
    DistanceConstraint,
    Frame,
    PointConstraint,
    PointOnLineConstraint,
)
from mjwrap.osim.description.functions import Array
from mjwrap.osim.description.model import OsimModel
from mjwrap.osim.writing.drivers import Drivers
from mjwrap.osim.writing.motions import Values, evaluated, placed
from mjwrap.osim.writing.rotations import quaternion
from mjwrap.osim.writing.tree import Branch

FREE = 1e3  # how much farther a coordinate moves that the file lets move to satisfy constraints
STEP = 1e-6
EXACT, SETTLED = 1e-13, 1e-10  # [m, rad] errors of constraints, and the last step of a coordinate


class Poses:
    """Poses (4, 4) of bodies and frames in ground at values of the coordinates."""

    def __init__(self, branches: list[Branch], values: Values) -> None:
        self.bodies: dict[str, Array] = {GROUND: np.eye(4)}
        for branch in branches:
            self.bodies[branch.body] = self.bodies[branch.parent] @ evaluated(branch.chain, values)

    def frame(self, frame: Frame) -> Array:
        """Return the pose of a frame."""
        return self.bodies[frame.body] @ placed(frame)

    def residual(self, constraint: Constraint) -> Array:
        """Return the errors of a constraint [m, rad], zeros where it holds; none of a coupler."""
        if isinstance(constraint, Coupler):
            return np.zeros(0)
        if isinstance(constraint, PointOnLineConstraint):
            line, point = self.frame(constraint.line), self.frame(constraint.point)
            offset = line[:3, :3].T @ (point[:3, 3] - line[:3, 3])
            return np.array([axis @ offset for axis in self.across(constraint.direction)])
        first, second = self.frame(constraint.first), self.frame(constraint.second)
        if isinstance(constraint, PointConstraint):
            return np.asarray(first[:3, 3] - second[:3, 3], dtype=np.float64)
        if isinstance(constraint, DistanceConstraint):
            return np.array([np.linalg.norm(first[:3, 3] - second[:3, 3]) - constraint.distance])
        return _difference(first, second)

    @staticmethod
    def across(direction: Array) -> list[Array]:
        """Return two unit vectors (3,) that are perpendicular to a direction and to each other."""
        unit = direction / np.linalg.norm(direction)
        first = np.cross(unit, np.eye(3)[int(np.argmin(np.abs(unit)))])
        first = np.asarray(first / np.linalg.norm(first), dtype=np.float64)
        return [first, np.asarray(np.cross(unit, first), dtype=np.float64)]


def _difference(first: Array, second: Array) -> Array:
    """Return the errors (6,) of two poses that have to be equal: position, and the rotation vector between them."""
    turn = first[:3, :3].T @ second[:3, :3]
    quat = quaternion(turn)
    if quat is None:
        return np.concatenate([first[:3, 3] - second[:3, 3], np.zeros(3)])
    sine = float(np.linalg.norm(quat[1:]))
    angle = 2.0 * np.arctan2(sine, abs(quat[0])) * (1.0 if quat[0] >= 0.0 else -1.0)
    return np.concatenate(
        [first[:3, 3] - second[:3, 3], angle / sine * quat[1:] if sine > 0.0 else np.zeros(3)]
    )


def residuals(model: OsimModel, branches: list[Branch], values: Values) -> Array:
    """Return the errors (k,) of all constraints but couplers, and of loops, at values of the coordinates."""
    poses = Poses(branches, values)

    def all_of_them() -> Iterator[Array]:
        for constraint in model.constraints:
            yield poses.residual(constraint)
        for branch in branches:
            if branch.copy_of:
                yield _difference(poses.bodies[branch.copy_of], poses.bodies[branch.body])

    return np.concatenate([np.zeros(0), *all_of_them()])


def worst_residual(model: OsimModel, branches: list[Branch], values: Values) -> float:
    """Return the largest error of all constraints [m or rad]."""
    return float(np.abs(residuals(model, branches, values)).max(initial=0.0))


def assemble(model: OsimModel, branches: list[Branch], drivers: Drivers) -> None:
    """Move the drivers' values to the nearest pose that satisfies all constraints; locked coordinates stay."""
    start = {name: drivers.values[name] for name in drivers.coordinates if name not in drivers.couplers}
    names = [
        name
        for name in start
        if not drivers.coordinates[name].locked and drivers.coordinates[name].prescribed is None
    ]
    if not names or residuals(model, branches, drivers.value).size == 0:
        return
    ease = np.array(
        [FREE if drivers.coordinates[name].free_to_satisfy_constraints else 1.0 for name in names]
    )
    home = np.array([start[name] for name in names])

    def errors(q: Array) -> Array:
        drivers.settle(start | dict(zip(names, map(float, q), strict=True)))
        return residuals(model, branches, drivers.value)

    q: Array = home
    best: Array = home
    smallest = np.inf
    for _ in range(60):
        error = errors(q)
        size = float(np.abs(error).max())
        if size < max(smallest, EXACT):
            best, smallest = q, size
        columns = [(errors(q + step) - errors(q - step)) / (2.0 * STEP) for step in STEP * np.eye(len(q))]
        slopes = np.stack(columns, axis=1)
        wanted, *_ = np.linalg.lstsq(slopes * ease, slopes @ (q - home) - error, rcond=1e-8)
        step = home + ease * wanted - q
        if size < EXACT and float(np.abs(step).max()) < SETTLED:
            break
        largest = float(np.abs(step).max())
        q = np.asarray(q + step * min(1.0, 1.0 / largest if largest > 0.0 else 1.0), dtype=np.float64)
    errors(best)
