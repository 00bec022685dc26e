"""Store the results of the muscles of a model at many times, and return them sorted by muscle."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.kernels.coupling import muscle_paths, recorded_frames
from mjwrap.model.arrays import Plan
from mjwrap.system.state import NUMBERS, Evaluation

Array = NDArray[np.float64]
Singles = NDArray[np.float32]
Ints = NDArray[np.int64]


class BufferPool:
    """Arrays by name that are used again: memory that has been allocated once need not be allocated again."""

    def __init__(self) -> None:
        self._held: dict[str, NDArray[Any]] = {}

    def array(self, name: str, shape: tuple[int, ...], kind: type[np.generic] = np.float64) -> NDArray[Any]:
        """Return an uninitialised array; it may share memory with the array that had this name before."""
        size = math.prod(shape)
        if name not in self._held or self._held[name].size < size:
            self._held[name] = np.empty(size, dtype=kind)
        return self._held[name][:size].reshape(shape)


class Store:
    """Rows of numbers, frame after frame, each frame in parts; it grows as needed."""

    def __init__(self, frames: int, parts: int, width: int) -> None:
        self.rows = np.empty((0, width), dtype=np.float32)
        self.starts = np.zeros((frames, parts + 1), dtype=np.int64)  # where each part of a frame begins

    def grow(self, frame: int) -> None:
        """Grow if a frame did not fit: the first frame, or a later one with more to draw."""
        begin, end = int(self.starts[frame, 0]), int(self.starts[frame, -1])
        if end > len(self.rows):
            count = 2 * (
                len(self.rows) + (end - begin) * len(self.starts)
            )  # memory that is never written to costs nothing
            rows = np.empty((count, self.rows.shape[1]), dtype=np.float32)
            rows[:begin] = self.rows[:begin]
            self.rows = rows

    def count(self, frames: int) -> int:
        """Return the number of rows of the first frames."""
        return int(self.starts[frames - 1, -1]) if frames else 0


class History:
    """Storage for `rows` states and as many frames of the muscles of a model and its plan.

    A state has the numbers of every muscle. A frame has what is drawn: poses of the bodies, paths, contact points,
    forces, and the moment arms of pairs of a muscle and a coordinate, given by `muscles` and `dofs` (K,). The first
    axis of returned numbers is time. Points are float32, in arrays of a `BufferPool` if one is given. tree: the last
    dof of every body (nbody,), the parent of every dof (nv,), the root of every body (nbody,). evaluation: a function
    that returns the last evaluation, which is stored.
    """

    def __init__(
        self, model: mujoco.MjModel, plan: Plan, tree: tuple[Ints, Ints, Ints],
        evaluation: Callable[[], Evaluation], rows: int, muscles: Ints | None = None, dofs: Ints | None = None,
    ) -> None:  # fmt: skip
        self._evaluation = evaluation
        self._n = n = plan.n
        routes = len(plan.routes)
        self._numbers = np.zeros((rows, len(NUMBERS), n))
        self._status = np.zeros((rows, n), dtype=np.int64)
        self._iterations = np.zeros((rows, routes))
        none = np.empty(0, dtype=np.int64)
        self._pairs = (none, none) if muscles is None or dofs is None else (muscles, dofs)
        self._arms = np.zeros((rows, len(self._pairs[0])))
        self._jacobian, self._where = np.zeros((n, model.nv)), np.zeros(n, dtype=np.int64)
        self._positions = np.zeros((rows, model.nbody, 3), dtype=np.float32)
        self._quaternions = np.zeros((rows, model.nbody, 4), dtype=np.float32)
        self._points, self._contacts, self._forces = (
            Store(rows, routes, 3), Store(rows, n, 3), Store(rows, n, recorded_frames.FORCE)
        )  # fmt: skip
        self._plan = plan.routes, plan.weights, plan.links
        self._tree, self._uses = tree, plan.uses
        for array in (self._numbers, self._arms, self._positions, self._quaternions):
            array.fill(0.0)  # makes the system allocate the memory now, not during a run

    def put_state(self, row: int) -> None:
        """Store the numbers of the last evaluation as a row."""
        last = self._evaluation()
        kept = self._numbers, self._status, self._iterations
        recorded_frames.put_state(row, last.numbers, last.status, last.info, *kept)

    def put_frame(self, frame: int, poses: mujoco.MjData, spacing: float | None) -> None:
        """Store the paths and forces of the last evaluation; poses: the data with the poses of it (`Results.poses`).

        spacing [m]: as for `Results.polylines`. Frames must be stored in order.
        """
        last = self._evaluation()
        points, contacts, forces = self._points, self._contacts, self._forces
        while not recorded_frames.put_frame(
            *self._plan, last.node, last.segments, last.count, last.info, last.tension, spacing or 0.0, *self._tree,
            poses.cdof, poses.subtree_com, poses.xpos, poses.xquat, *self._pairs, self._jacobian, frame,
            points.rows, points.starts, contacts.rows, contacts.starts, forces.rows, forces.starts, self._arms,
            self._positions, self._quaternions, self._uses, last.slopes,
        ):  # fmt: skip
            for store in (points, contacts, forces):
                store.grow(frame)

    def states(self, rows: int) -> dict[str, Array]:
        """Return the numbers of the first `rows` states, (rows, n) each, by their names in `Results`."""
        found = {name: self._numbers[:rows, i] for i, name in enumerate(NUMBERS)}
        found["status"] = self._status[:rows].astype(np.float64)
        if self._n:
            first = np.searchsorted(self._plan[0][:, muscle_paths.R_MUSCLE], np.arange(self._n))
            found["iterations"] = np.add.reduceat(self._iterations[:rows], first, axis=1)
        else:
            found["iterations"] = self._iterations[:rows]
        return found

    def bodies(self, frames: int) -> tuple[Singles, Singles]:
        """Return positions (frames, nbody, 3) [m] and quaternions (frames, nbody, 4) w-x-y-z of the bodies."""
        return self._positions[:frames], self._quaternions[:frames]

    def polylines(self, frames: int, pool: BufferPool | None = None) -> tuple[Singles, Ints, Ints]:
        """Return the paths of the first frames: points (m, 3) [m], sizes (S,) and counts (n, frames) of strips.

        A pulley divides a muscle's path into several strips. They are sorted by muscle, then by frame. sizes: number of
        points of each strip; counts: number of strips of a muscle in a frame, 0 if no path was found yet.
        """
        store, routes = self._points, self._plan[0]
        out, counts = self._arrays(pool, "points", store, frames)
        sizes = np.empty(len(routes) * frames, dtype=np.int64)
        first = np.searchsorted(
            routes[:, muscle_paths.R_MUSCLE], np.arange(len(counts) + 1)
        )  # route of each muscle
        starts = store.starts[:frames].take(first, axis=1)
        recorded_frames.gather(store.rows, starts, self._where, out, counts)
        count = recorded_frames.list_strips(store.starts, routes, sizes, counts)
        return out, sizes[:count], counts

    def contacts(self, frames: int, pool: BufferPool | None = None) -> tuple[Singles, Ints]:
        """Return contact points, P and Q in turn, by muscle, then frame: points (m, 3) [m], counts (n, frames)."""
        store = self._contacts
        out, counts = self._arrays(pool, "contacts", store, frames)
        recorded_frames.gather(store.rows, store.starts, self._where, out, counts)
        return out, counts

    def arrows(
        self, frames: int, scale: float, pool: BufferPool | None = None
    ) -> tuple[Singles, Singles, Ints]:
        """Return the forces on bodies as arrows, by muscle, then frame: tails, vectors (m, 3) [m], counts (n, frames).

        A vector is `scale` [m/N] times the force, in the world frame. The forces on origin and insertion start there.
        The force on a surface or via point, the sum over the contact, ends midway between the contact points.
        """
        store = self._forces
        tails, counts = self._arrays(pool, "tails", store, frames)
        vectors, _ = self._arrays(pool, "vectors", store, frames)
        recorded_frames.gather_arrows(
            store.rows, store.starts, self._where, float(scale), tails, vectors, counts
        )
        return tails, vectors, counts

    def _arrays(self, pool: BufferPool | None, name: str, store: Store, frames: int) -> tuple[Singles, Ints]:
        """Return arrays for the points of a store's first frames in another order, and for their counts."""
        points = (pool or BufferPool()).array(name, (store.count(frames), 3), np.float32)
        return points, np.empty((self._n, frames), dtype=np.int64)

    def moment_arms(self, frames: int) -> Array:
        """Return −∂l/∂q (frames, K) of the pairs [m], or 1 about a slide."""
        return self._arms[:frames]
