"""Where the bodies of an OpenSim model are, from the values of its coordinates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mjwrap.osim.description.bodies import GROUND, Axis, Frame, Joint
from mjwrap.osim.description.model import OsimModel
from mjwrap.osim.description.rotations import about

Array = NDArray[np.float64]


class Pose(NamedTuple):
    """A frame in another one: rotation matrix (3, 3), and position (3,) of its origin [m]."""

    rotation: Array
    position: Array

    def then(self, other: Pose) -> Pose:
        """Return the pose of a frame that is at `other` in this one."""
        return Pose(self.rotation @ other.rotation, self.position + self.rotation @ other.position)

    def inverse(self) -> Pose:
        """Return the pose of the other frame in this one."""
        return Pose(self.rotation.T, -self.rotation.T @ self.position)


def body_poses(model: OsimModel, values: Mapping[str, float]) -> dict[str, Pose]:
    """Return the pose of every body in ground, ground included, at the values of all coordinates (see `complete`).

    A joint of two bodies that others have placed already, which closes a loop, is not regarded: the loop is closed only
    where the values fit.
    """
    poses = {GROUND: Pose(np.eye(3), np.zeros(3))}
    for joint, backward in placing_joints(model.joints):
        motion = joint_motion(joint, values)
        near, far = (joint.child, joint.parent) if backward else (joint.parent, joint.child)
        across = motion.inverse() if backward else motion
        poses[far.body] = frame_pose(poses, near).then(across).then(_within(far).inverse())
    return poses


def placing_joints(joints: Sequence[Joint]) -> list[tuple[Joint, bool]]:
    """Return the joints that place bodies, from ground on, each with whether it leads from its child to its parent."""
    placed, found, waiting = {GROUND}, [], list(joints)
    while (step := _next(waiting, placed)) is not None:
        found.append(step)
        waiting = [other for other in waiting if other is not step[0]]
        placed |= {step[0].parent.body, step[0].child.body}
    return found


def _next(waiting: Sequence[Joint], placed: set[str]) -> tuple[Joint, bool] | None:
    for joint in waiting:
        if joint.parent.body in placed and joint.child.body not in placed:
            return joint, False
    for joint in waiting:
        if joint.child.body in placed and joint.parent.body not in placed:
            return joint, True
    return None


def frame_pose(poses: Mapping[str, Pose], frame: Frame) -> Pose:
    """Return the pose in ground of a frame on a body."""
    return poses[frame.body].then(_within(frame))


def joint_motion(joint: Joint, values: Mapping[str, float]) -> Pose:
    """Return the pose of a joint's child frame in its parent frame."""
    rotation, position = np.eye(3), np.zeros(3)
    for axis in joint.rotations:
        rotation = rotation @ about(axis.axis, axis_value(axis, values))
    for axis in joint.translations:
        position = position + axis.axis * axis_value(axis, values)
    if joint.radii is None:
        return Pose(rotation, position)
    # the origin stays on an ellipsoid, where z is the normal
    on_surface = Pose(rotation, joint.radii * rotation[:, 2])
    if joint.winging_origin is None:
        return on_surface
    origin = np.array([*joint.winging_origin, 0.0])
    axis = np.array([-np.sin(joint.winging_direction), np.cos(joint.winging_direction), 0.0])
    turned = about(axis, values[joint.coordinates[3].name])
    return on_surface.then(Pose(turned, origin - turned @ origin))


def axis_value(axis: Axis, values: Mapping[str, float]) -> float:
    """Return the angle or length of one motion of a joint."""
    return axis.function(values[axis.coordinates[0]] if axis.coordinates else 0.0).item()


def _within(frame: Frame) -> Pose:
    return Pose(frame.rotation, frame.position)
