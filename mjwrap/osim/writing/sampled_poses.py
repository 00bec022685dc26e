"""Random poses of an OpenSim model within the ranges of its coordinates, at which the places of wraps are chosen."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mjwrap.osim.description.bodies import (
    Coordinate,
    Coupler,
    DistanceConstraint,
    Frame,
    PointConstraint,
    PointOnLineConstraint,
    WeldConstraint,
)
from mjwrap.osim.description.model import OsimModel
from mjwrap.osim.kinematics import Pose, body_poses, complete, frame_pose, placing_joints
from mjwrap.osim.writing.segment_scan import Sample

Array = NDArray[np.float64]
WIDEST = {"translational": 0.3}  # [m] largest distance from the default value; of angles see below
WIDEST_ANGLE = 1.5  # [rad]
CLOSED = 1e-4  # [m, rad] a constraint counts as met
STEPS, FRESH = 15, 3  # most steps of Newton's method, and after how many its derivatives are taken anew
DIFFERENCE = 1e-6  # [rad or m] of these derivatives


def sampled_poses(model: OsimModel, count: int, seed: int = 0) -> list[Sample]:
    """Return the default pose and random ones, `count` in all; constraints between bodies are met where they can be.

    Coordinates without a small range stay within 1.5 rad or 0.3 m of their default values; locked ones keep these.
    """
    random = np.random.default_rng(seed)
    free = [c for c in model.coordinates if not c.locked and c.prescribed is None]
    followers = {c.dependent for c in model.constraints if isinstance(c, Coupler)}
    loops = _loops(model)
    inside = {c.name for joint in loops.joints for c in joint.coordinates}
    movable = [c.name for c in free if c.name not in followers and c.name in inside]
    samples: list[Sample] = []
    for k in range(count):
        drawn = {c.name: c.default if k == 0 else _drawn(c, random) for c in free}
        values = complete(model, drawn)
        if movable:
            values = complete(model, _closed(loops, values, movable))
        samples.append(Sample(body_poses(model, values), values))
    return samples


def _drawn(coordinate: Coordinate, random: np.random.Generator) -> float:
    width = WIDEST.get(coordinate.motion, WIDEST_ANGLE)
    low = max(coordinate.range[0], coordinate.default - width)
    high = min(coordinate.range[1], coordinate.default + width)
    return float(random.uniform(low, high)) if low < high else coordinate.default


def _loops(model: OsimModel) -> OsimModel:
    """Return the model with only the joints that carry bodies of constraints."""
    carriers = {
        (joint.parent if backward else joint.child).body: (
            joint,
            (joint.child if backward else joint.parent).body,
        )
        for joint, backward in placing_joints(model.joints)
    }
    waiting = [
        frame.body
        for constraint in model.constraints
        if not isinstance(constraint, Coupler)
        for frame in vars(constraint).values()
        if isinstance(frame, Frame)
    ]
    needed: set[str] = set()
    while waiting:
        body = waiting.pop()
        if body in carriers and carriers[body][0].name not in needed:
            joint, nearer = carriers[body]
            needed.add(joint.name)
            waiting.append(nearer)
    return replace(model, joints=tuple(joint for joint in model.joints if joint.name in needed))


def _closed(model: OsimModel, values: dict[str, float], movable: list[str]) -> dict[str, float]:
    """Return values nearby at which the constraints between bodies are met; the given ones if none are found.

    Newton's method, with Broyden's updates of the derivatives.
    """

    def gap_at(x: Array) -> Array:
        return _gaps(model, body_poses(model, values | dict(zip(movable, map(float, x), strict=True))))

    x = np.array([values[name] for name in movable])
    gap = gap_at(x)
    slopes = np.zeros((len(gap), len(x)))
    for k in range(STEPS):
        if np.abs(gap).max() < CLOSED:
            return values | dict(zip(movable, map(float, x), strict=True))
        if k % FRESH == 0:
            slopes = np.array(
                [(gap_at(x + step) - gap) / DIFFERENCE for step in DIFFERENCE * np.eye(len(x))]
            ).T
        step: Array = np.linalg.lstsq(slopes, -gap, rcond=1e-8)[0].astype(np.float64)
        step *= min(1.0, 0.5 / max(float(np.abs(step).max()), 1e-12))
        square = float(step @ step)
        if not square > 0.0:  # no motion makes it smaller
            return values
        x = x + step
        before, gap = gap, gap_at(x)
        slopes += np.outer(gap - before - slopes @ step, step) / square
    return values


def _gaps(model: OsimModel, poses: Mapping[str, Pose]) -> Array:
    """Return by how much each constraint between bodies is violated [m, rad]."""
    gaps: list[Array] = []
    for constraint in model.constraints:
        match constraint:
            case PointConstraint():
                first, second = frame_pose(poses, constraint.first), frame_pose(poses, constraint.second)
                gaps.append(second.position - first.position)
            case WeldConstraint():
                first, second = frame_pose(poses, constraint.first), frame_pose(poses, constraint.second)
                turn = first.rotation.T @ second.rotation
                skew = 0.5 * (turn - turn.T)
                gaps += [second.position - first.position, skew[[2, 0, 1], [1, 2, 0]]]
            case DistanceConstraint():
                first, second = frame_pose(poses, constraint.first), frame_pose(poses, constraint.second)
                apart = float(np.linalg.norm(second.position - first.position))
                gaps.append(np.array([apart - constraint.distance]))
            case PointOnLineConstraint():
                line, point = frame_pose(poses, constraint.line), frame_pose(poses, constraint.point)
                along = line.rotation @ (constraint.direction / np.linalg.norm(constraint.direction))
                off = point.position - line.position
                gaps.append(off - (off @ along) * along)
            case _:
                pass
    return np.concatenate(gaps) if gaps else np.zeros(0)
