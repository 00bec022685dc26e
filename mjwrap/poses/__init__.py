"""Make poses of a model, follow muscles' paths from pose to pose, and find jumps of their lengths."""

from mjwrap.poses.joint_curves import QUANTITIES, JointCurves, curves

__all__ = ["QUANTITIES", "JointCurves", "curves"]
