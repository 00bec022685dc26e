"""The results, warm starts and applied forces of one mjData."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.kernels import layout
from mjwrap.kernels.coupling import path_points
from mjwrap.kernels.coupling.groups import Paths
from mjwrap.kernels.musculotendon.groups import MuscleStates, StepStart
from mjwrap.kernels.solved import segments
from mjwrap.model.arrays import Plan
from mjwrap.system.joint_forces import JointForces

NUMBERS = (
    "activation",
    "fiber_length",
    "length",
    "velocity",
    "tension",
)  # the numbers of every muscle, named as in `Results`


class Evaluation:
    """The results of one evaluation of all muscles: paths, states and tensions, as the kernels write them."""

    def __init__(self, n: int, node: NDArray[np.float64], routes: int) -> None:
        self.node = node
        self.segments = np.zeros((len(node) + routes, segments.SEGMENT))
        self.count = np.zeros(routes, dtype=np.int64)
        self.info = np.zeros((routes, layout.INFO))
        self.paths = Paths(node, self.segments, self.count, self.info)
        self.numbers = np.zeros((len(NUMBERS), n))
        self.activation, self.fiber, self.length, self.velocity, self.tension = self.numbers
        self.slopes = np.empty((0, path_points.SLOPE))  # of moving points, as in `PathPoints`
        self.status = np.zeros(n, dtype=np.int64)
        self.failures = np.zeros(n, dtype=np.int64)
        self.last_failure = np.zeros(n, dtype=np.int64)
        self.details = [""] * n  # elements that caused the last failure
        self.time = 0.0
        self.evaluated = False


class State(Evaluation):
    """The state of one mjData: an evaluation, warm starts, and the forces added to its xfrc_applied."""

    def __init__(self, model: mujoco.MjModel, plan: Plan) -> None:
        n = plan.n
        super().__init__(n, plan.node.copy(), len(plan.routes))
        self.start = StepStart(np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n))
        self.next_activation, self.next_fiber = np.zeros(n), np.zeros(n)
        self.found = MuscleStates(
            self.activation, self.fiber, self.length, self.velocity, self.tension,
            self.next_activation, self.next_fiber, self.status,
        )  # fmt: skip
        self.own = np.zeros((n, 2))  # activations and fibre lengths of muscles without an actuator
        self.wrench, self.others, self.mine, self.total = (np.zeros((model.nbody, 6)) for _ in range(4))
        self.written = np.zeros(model.nbody, dtype=np.bool_)
        self.points = plan.points.group() if plan.points else None
        self.joint_forces: JointForces | None = None
        if self.points is not None:
            self.slopes, self.joint_forces = self.points.slopes, JointForces(self.points)
        self.scratch = mujoco.MjData(model)
        self.applied: float | None = None  # time of an `apply` that `advance` has not followed yet
        self.in_scratch = (
            False  # whether the last evaluation took its poses from there, not from the caller's data
        )
        # what acted without a path: numbers of steps at which the last force was kept, and at which there was none yet
        self.kept, self.forceless = np.zeros(n, dtype=np.int64), np.zeros(n, dtype=np.int64)
        self.kept_now, self.forceless_now = np.zeros(n, dtype=np.bool_), np.zeros(n, dtype=np.bool_)
        self.any_held = False  # in this step so far

    def count_held(self) -> None:
        """Count the muscles that kept a force at some evaluation of the step that ends, or had none to keep."""
        if self.any_held:
            self.kept += self.kept_now
            self.forceless += self.forceless_now
            self.forget_held()

    def forget_held(self) -> None:
        """Forget what the evaluations since the last step have kept."""
        if self.any_held:
            self.kept_now[:] = self.forceless_now[:] = False
            self.any_held = False

    def forget(self) -> None:
        """Reset: no branch, no last force, no failures."""
        self.node[:, layout.S_MODE] = layout.COLD
        self.count[:] = 0
        self.numbers[:], self.own[:] = 0.0, 0.0
        self.status[:] = 0
        self.failures[:] = 0
        self.kept[:] = self.forceless[:] = 0
        self.forget_held()
        self.evaluated, self.applied = False, None
