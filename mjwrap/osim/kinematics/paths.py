"""Points of paths in ground, moving and conditional ones included, and lengths without wrap objects."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from mjwrap.osim.description.paths import Condition, Path, PathPoint
from mjwrap.osim.kinematics.poses import Pose, frame_pose

Array = NDArray[np.float64]


def holds(condition: Condition | None, values: Mapping[str, float]) -> bool:
    """Return whether a conditional point belongs to its path."""
    if condition is None:
        return True
    low, high = condition.held
    return low <= values[condition.coordinate] <= high


def point_position(point: PathPoint, poses: Mapping[str, Pose], values: Mapping[str, float]) -> Array:
    """Return where a path point is in ground (3,) [m]."""
    frame = frame_pose(poses, point.frame)
    if point.moving is None:
        return frame.position
    pairs = zip(point.moving.functions, point.moving.coordinates, strict=True)
    local = np.array([function(values[name] if name else 0.0).item() for function, name in pairs])
    return frame.position + frame.rotation @ local


def path_points(path: Path, poses: Mapping[str, Pose], values: Mapping[str, float]) -> Array:
    """Return the points (n, 3) [m] of a path in ground, without conditional points that do not belong to it now."""
    points = [point_position(p, poses, values) for p in path.points if holds(p.condition, values)]
    return np.array(points).reshape(-1, 3)


def path_length(path: Path, poses: Mapping[str, Pose], values: Mapping[str, float]) -> float:
    """Return the length [m] of the straight lines between the points of a path; wrap objects are not regarded."""
    points = path_points(path, poses, values)
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
