"""The muscles of a model at one pose, evaluated without a trace in the MuscleSystem."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.kernels import layout
from mjwrap.kernels.coupling import muscle_paths
from mjwrap.kernels.solved import segments
from mjwrap.mjcf import MuscleDeclaration
from mjwrap.mjcf.conditional_points import holds
from mjwrap.mjcf.couplings import CoupledJoints
from mjwrap.model.kinematic_tree import crossed_dofs
from mjwrap.poses.sizes import LEAST, turning_dofs
from mjwrap.system import MuscleSystem

Array = NDArray[np.float64]


class Posed:
    """The muscles at a pose; data is evaluated only here, in a new MjData.

    sizes (n,): of the muscles [m], the distances of their stops added up. crossed (n, nv): the degrees of freedom that
    each muscle crosses. found (n,) whether it has a path.
    """

    def __init__(self, muscles: MuscleSystem, qpos: Array) -> None:
        self.muscles, self.model = muscles, muscles.model
        self.data = mujoco.MjData(self.model)
        self.data.qpos[:] = qpos
        muscles.forward(self.data)
        self.poses = muscles.poses(self.data)
        self.found = muscles.status == 0
        self.sizes = np.array([_size(self.model, self.poses, m) for m in muscles.declarations])
        self.crossed = crossed_dofs(self.model, muscles.declarations)
        self.couplings = CoupledJoints(self.model)
        self.turning = turning_dofs(self.model)
        self.touched = self._touched()
        self._straights = self._all_straights()

    def _touched(self) -> list[list[bool]]:
        """Return for each muscle, by its geoms in order, whether its path touches them."""
        node, plan = self.muscles._evaluation().node, self.muscles._plan
        found: list[list[bool]] = [[] for _ in range(self.muscles.n)]
        for c in range(len(plan.routes)):
            row = plan.routes[c]
            for k in range(int(row[muscle_paths.R_LO]), int(row[muscle_paths.R_HI])):
                if plan.links[k, muscle_paths.L_GEOM] >= 0:
                    touched = int(node[k, layout.S_MODE]) == layout.TOUCHED
                    found[int(row[muscle_paths.R_MUSCLE])].append(touched)
        return found

    def straights(self, i: int) -> Array:
        """Return the straight segments of muscle i, (m, 2, 3) world [m], as evaluated at the pose.

        Read from the evaluation itself: a drawing of the path would have to be compiled.
        """
        return self._straights[i]

    def _all_straights(self) -> list[Array]:
        state, plan = self.muscles._evaluation(), self.muscles._plan
        found: list[Array] = [np.empty((0, 2, 3)) for _ in range(self.muscles.n)]
        for c, row in enumerate(plan.routes):
            first, i = int(row[muscle_paths.R_LO]) + c, int(row[muscle_paths.R_MUSCLE])
            rows = state.segments[first : first + int(state.count[c])]
            ends = [rows[:, column : column + 3] for column in (segments.G_A, segments.G_B)]
            found[i] = np.concatenate([found[i], np.stack(ends, axis=1)])
        return found

    def slopes(self, qpos: Array, tangent: Array) -> Array:
        """Return the slopes (n,) of the lengths along a tangent (nv,) at a pose (nq,); NaN without a path.

        A slope is the rate of a length, which every evaluation gives: nothing more is compiled.
        """
        self.data.qpos[:], self.data.qvel[:] = qpos, tangent
        self.muscles.forward(self.data)
        self.data.qvel[:] = 0.0
        return np.where(self.muscles.status == 0, self.muscles.velocity, np.nan)


def _size(model: mujoco.MjModel, poses: mujoco.MjData, muscle: MuscleDeclaration) -> float:
    """Return the distances of a muscle's stops added up [m]: unlike `muscle_size`, whatever its surfaces' sizes are."""
    total = 0.0
    for route in (r for r in muscle.routes if holds(model, r.when, poses.qpos)):
        steps = np.diff(poses.site_xpos[route.sites], axis=0)
        total += route.weight * float(np.linalg.norm(steps, axis=1).sum())
    return max(total, LEAST * float(model.stat.extent), 1e-300)


@contextmanager
def evaluated(muscles: MuscleSystem, qpos: Array) -> Iterator[Posed]:
    """Give the muscles at a pose (nq,) inside a with block, and restore their last results after it."""
    last, strict = muscles._last, muscles.strict
    muscles.strict = False
    try:
        yield Posed(muscles, qpos)
    finally:
        muscles._last, muscles.strict = last, strict
