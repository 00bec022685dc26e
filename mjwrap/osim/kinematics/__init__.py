"""Poses and path points of an OpenSim model in NumPy: slow and plain, to check what is written against it."""

from mjwrap.osim.kinematics.coordinates import complete as complete
from mjwrap.osim.kinematics.paths import path_length as path_length
from mjwrap.osim.kinematics.paths import path_points as path_points
from mjwrap.osim.kinematics.paths import point_position as point_position
from mjwrap.osim.kinematics.poses import Pose as Pose
from mjwrap.osim.kinematics.poses import body_poses as body_poses
from mjwrap.osim.kinematics.poses import frame_pose as frame_pose
from mjwrap.osim.kinematics.poses import joint_motion as joint_motion
from mjwrap.osim.kinematics.poses import placing_joints as placing_joints
