"""Wrenches of muscles with given tensions on the bodies, along a motion."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjwrap.errors import PathError
from mjwrap.inverse.kinematics import Kinematics
from mjwrap.inverse.motion import CompleteMotion
from mjwrap.kernels.coupling import path_points
from mjwrap.kernels.inverse.muscle_wrenches import wrench_frames
from mjwrap.paths import Status
from mjwrap.system import MuscleSystem
from mjwrap.system.evaluator import TOLERANCE
from mjwrap.system.state import Evaluation

Array = NDArray[np.float64]


def muscle_wrenches(muscles: MuscleSystem, motion: CompleteMotion, tension: Array) -> Array:
    """Return wrenches (T, nbody, 6) as of `xfrc_applied` of all muscles with tensions (T, n) [N].

    Paths start from those of the frame before; the first as after `reset`. Raises `PathError`, with the muscle and the
    time, where one that pulls has no path.
    """
    model, plan = muscles.model, muscles._plan
    last = Evaluation(plan.n, plan.node.copy(), len(plan.routes))
    wrench = np.zeros((len(motion), model.nbody, 6))
    status = np.zeros(tension.shape, dtype=np.int64)
    points = plan.points.group() if plan.points else None
    names = ("site_xpos", "geom_xpos", "geom_xmat", "cvel", "subtree_com", "xipos")
    kinematics = Kinematics(model, (*names, "xpos", "xmat"))
    for first, end in kinematics.blocks(motion):
        block, some = slice(first, end), kinematics.array
        active = np.ones((end - first, len(plan.routes)), dtype=np.int64)
        if points is not None:
            slopes = np.zeros((end - first, len(points.axes), path_points.SLOPE))
            kinematics.place_points(points, motion.qpos[block], slopes, active)
        given: tuple[Any, ...] = (
            *plan.route_group(), *(some(name) for name in names), muscles._root,
            active, TOLERANCE, *last.paths, tension[block], wrench[block], status[block],
        )  # fmt: skip
        wrench_frames(*given)
    bad = np.argwhere((status != 0) & (tension != 0.0))
    if len(bad):
        t, m = bad[0]
        why = Status(int(status[t, m])).name.lower()
        raise PathError(
            f"muscle '{muscles.names[m]}' at time {motion.time[t]:g} s: no path ({why}), so its force has no place"
        )
    return wrench
