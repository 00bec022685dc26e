"""What the muscles of a model were at many times: gathered raw, which costs little, and worked out together."""

from __future__ import annotations

from typing import TYPE_CHECKING

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.kernels import coupling, drawing, layout, segments
from mjwrap.system.state import NUMBERS

if TYPE_CHECKING:
    from mjwrap.system.results import Results

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


class History:
    """Room for `rows` states, and as many frames, of the muscles whose results are given.

    A state is what every muscle has, a frame what is needed to draw it: paths, forces and bodies. Time goes along the
    first axis of all that is read.
    """

    def __init__(self, results: Results, rows: int) -> None:
        self._results = results
        plan, model = results._plan, results.model
        n, routes = plan.n, len(plan.routes)
        self._numbers = np.zeros((rows, len(NUMBERS), n))
        self._status = np.zeros((rows, n), dtype=np.int64)
        self._iterations = np.zeros((rows, routes))
        self._segments = np.zeros((rows, len(plan.node) + routes, segments.SEGMENT))
        self._counts = np.zeros((rows, routes), dtype=np.int64)
        self._tension = np.zeros((rows, n))
        self._cdof = np.zeros((rows, model.nv, 6))
        self._subtree_com = np.zeros((rows, model.nbody, 3))
        # points of all paths, muscle after muscle, frame after frame, and those of one frame; both grow
        self._points, self._frame = np.empty((rows, 3), dtype=np.float32), np.zeros((1, 3))
        self._starts = np.zeros(
            (rows, n + 1), dtype=np.int64
        )  # where each muscle's points begin within its frame
        self._begins = np.zeros(rows + 1, dtype=np.int64)  # where each frame's points begin
        # room for what is drawn at most: two contact points a node, an arrow a node and two a route
        self._contacts = np.zeros((2 * rows * len(plan.node), 3))
        self._arrows = np.zeros((rows * (len(plan.node) + 2 * routes), 6))
        for array in (self._numbers, self._segments, self._contacts, self._arrows):
            array.fill(0.0)  # has the system find the memory now, and not in the course of a run

    def put_state(self, row: int) -> None:
        """Keep the last evaluation's numbers as a row."""
        last = self._results._evaluation()
        self._numbers[row] = last.numbers
        self._status[row] = last.status
        self._iterations[row] = last.info[:, layout.I_ITERATIONS]

    def put_frame(self, frame: int, poses: mujoco.MjData, spacing: float | None) -> None:
        """Keep the last evaluation's paths and forces; poses: the data whose kinematics it saw, as `poses` returns.

        spacing [m]: as for `Results.polylines`. Frames are put in order.
        """
        last = self._results._evaluation()
        self._segments[frame] = last.segments
        self._counts[frame] = last.count
        self._tension[frame] = last.tension
        self._cdof[frame] = poses.cdof
        self._subtree_com[frame] = poses.subtree_com
        plan, begin, starts = self._results._plan, int(self._begins[frame]), self._starts[frame]
        given = (plan.routes, last.node, last.segments, last.count, last.info, spacing or 0.0, -1)
        count = drawing.polylines(*given, self._frame, starts)
        if count > len(self._frame):
            self._frame = np.zeros((2 * count, 3))
            drawing.polylines(*given, self._frame, starts)
        if begin + count > len(
            self._points
        ):  # at the first frame, and where the paths have more points later
            points = np.empty((2 * len(self._points) + count * len(self._starts), 3), dtype=np.float32)
            points[:begin] = self._points[:begin]
            self._points = points
        self._points[begin : begin + count] = self._frame[:count]
        self._begins[frame + 1] = begin + count

    def states(self, rows: int) -> dict[str, Array]:
        """Return what the first `rows` states were, (rows, n) each, by the names that `Results` has for them."""
        found = {name: self._numbers[:rows, i] for i, name in enumerate(NUMBERS)}
        found["status"] = self._status[:rows].astype(np.float64)
        if self._results.n:
            first = np.searchsorted(
                self._results._plan.routes[:, coupling.R_MUSCLE], np.arange(self._results.n)
            )
            found["iterations"] = np.add.reduceat(self._iterations[:rows], first, axis=1)
        else:
            found["iterations"] = self._iterations[:rows]
        return found

    def polylines(self, frames: int) -> tuple[NDArray[np.float32], Ints]:
        """Return the paths of the first `frames` frames, muscle after muscle: points (m, 3) [m], counts (n, frames)."""
        starts, begins = self._starts[:frames], self._begins[:frames]
        counts = np.diff(starts, axis=1).T
        first = (starts[:, :-1] + begins[:, np.newaxis]).T.ravel()  # of a muscle in a frame
        ends = np.cumsum(counts)
        order = np.arange(counts.sum()) + np.repeat(first - ends + counts.ravel(), counts.ravel())
        return self._points.take(order, axis=0), counts

    def contacts(self, frames: int) -> tuple[Array, Ints]:
        """Return the contact points, P and Q in turn, as `polylines` does the paths; valid until the next call."""
        plan, last = self._results._plan, self._results._evaluation()
        counts = np.empty((plan.n, frames), dtype=np.int64)
        given = (plan.routes, last.node, self._segments[:frames], self._counts[:frames])
        return self._contacts[: drawing.contacts_over(*given, self._contacts, counts)], counts

    def arrows(self, frames: int, scale: float) -> tuple[Array, Ints]:
        """Return the forces on bodies as arrows (m, 2, 3), as `polylines` does the paths; valid until the next call.

        An arrow is its tail [m] and its vector, `scale` [m/N] times the force, world frame. Pulls start at the origin
        and at the insertion; what presses a surface or a via point, the sum over the contact, ends midway between the
        contact points.
        """
        plan = self._results._plan
        counts = np.empty((plan.n, frames), dtype=np.int64)
        count = drawing.arrows_over(
            plan.routes, plan.weights, self._segments[:frames], self._counts[:frames], self._tension[:frames],
            float(scale), self._arrows, counts,
        )  # fmt: skip
        return self._arrows[:count].reshape(-1, 2, 3), counts

    def moment_arms(self, frames: int, muscles: Ints, dofs: Ints) -> Array:
        """Return −∂l/∂q (frames, K) of K pairs of a muscle and a coordinate, (K,) each [m], or 1 about a slide."""
        results, plan = self._results, self._results._plan
        out = np.empty((frames, len(muscles)))
        drawing.moment_arms_over(
            plan.routes, plan.weights, plan.links, self._segments[:frames], self._counts[:frames], results._last_dof,
            results._dofs[2], results._root, self._cdof[:frames], self._subtree_com[:frames], muscles, dofs,
            np.empty((plan.n, results.model.nv)), out,
        )  # fmt: skip
        return out
