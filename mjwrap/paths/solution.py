"""The result of a single solve: length and contacts, and methods for points, speed and wrenches."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjwrap import html, validation
from mjwrap.errors import GeometryError
from mjwrap.kernels import layout
from mjwrap.kernels.solved import polyline, segments
from mjwrap.kernels.spans import end_inside, hinted_sides
from mjwrap.paths.contact import Contact
from mjwrap.paths.derivatives import Derivatives
from mjwrap.paths.scene import SAVED, Array, Obstacle, Point, ViaPoint
from mjwrap.paths.status import Status

Ints = NDArray[np.int64]


def _kind(obstacle: Obstacle | ViaPoint | None) -> str:
    if obstacle is None:
        return ""
    return "via point" if isinstance(obstacle, ViaPoint) else repr(obstacle.surface)


class PathSolution(Derivatives):
    """The result of `solve_path`: length and contacts, and methods for points, speed and wrenches.

    If no path was found, the length is that of the last iterate, never NaN.

    Attributes:
        length: length of the path [m].
        status: a `Status`.
        converged: whether the status is CONVERGED.
        tangency_error: norm of the residual f over all touched obstacles (30).
        iterations: Newton steps.
        evaluations: evaluations of all residuals at once.
        contacts: one `Contact` per obstacle and via point.
    """

    def __init__(self, origin: Point, insertion: Point, node: Array, owner: Ints, saved: Array) -> None:
        self._owner = owner  # (rows,) the obstacle of each row of `node`
        self._obstacles: tuple[Obstacle | ViaPoint, ...] = ()  # for pictures
        self._origin, self._insertion, self._node, self._saved = origin, insertion, node, saved
        self._ends = (0, len(node), *origin, *insertion)
        self.length = 0.0
        self.status = Status.NOT_CONVERGED
        self.tangency_error = 0.0
        self.iterations = 0
        self.evaluations = 0
        self.contacts: list[Contact] = []
        self._segments = np.zeros((len(node) + 1, segments.SEGMENT))
        self._count = 0

    def _finish(self, info: Array, saved_before: Array) -> None:
        self.length = float(info[layout.I_LENGTH])
        self.status = Status(int(info[layout.I_STATUS]))
        self.tangency_error = float(info[layout.I_ERROR])
        self.iterations = int(info[layout.I_ITERATIONS])
        self.evaluations = int(info[layout.I_EVALUATIONS])
        known = end_inside.has_valid_length(self.status, self.tangency_error)
        self._saved = self._node[:, SAVED].copy() if known else saved_before.copy()
        if self.status == Status.ENDPOINT_INSIDE and not known:
            lost = self._node[:, layout.S_MODE] == layout.LOST
            self._saved[:, 0] = layout.COLD  # the last contact point is unknown
            self._saved[lost] = self._node[lost][:, SAVED]
        stands_in = known and not self.converged
        list_them = end_inside.list_pulling_segments if stands_in else segments.list_segments
        self._count = list_them(*self._ends, self._node, self._segments, 0)
        touches: list[list[Contact]] = []
        for row, k in enumerate(self._owner):
            if k == len(touches):
                touches.append([])
            touches[k] += self._contacts_of_row(row)
        self.contacts = [
            replace(found[0], touches=tuple(found)) if found else Contact(False, None, None, 0.0)
            for found in touches
        ]

    def _contacts_of_row(self, index: int) -> list[Contact]:
        row = self._node[index]
        if row[layout.KIND] == layout.VIA:
            here = row[layout.POS : layout.POS + 3].copy()
            return [Contact(True, here, here.copy(), 0.0)]
        if row[layout.S_MODE] != layout.TOUCHED:
            return []
        base = np.array(self._origin)
        first, last = row[layout.W_P : layout.W_P + 3] + base, row[layout.W_Q : layout.W_Q + 3] + base
        return [Contact(True, first, last, float(row[layout.S_ARC]))]

    @property
    def hints_met(self) -> list[bool]:
        """Whether the path passes each obstacle on the side of its hint; true where there is no hint.

        A path stays CONVERGED where this is false: a string slips off a sphere, or off an ellipsoid past a fold, to
        the other side. All false if the path is not converged.
        """
        if not self.converged:
            return [False] * len(self.contacts)
        node = self._node.copy()
        hinted_sides.mark_unmet_hints(*self._ends, node)
        met = np.ones(len(self.contacts), dtype=np.bool_)
        met[self._owner[node[:, layout.HINT] == layout.UNMET_HINT]] = False
        return [bool(value) for value in met]

    @property
    def converged(self) -> bool:
        """Whether the path was found and certified."""
        return self.status == Status.CONVERGED

    @property
    def branch(self) -> Array:
        """The data of a warm start from this path, a copy: (rows, 11), one row per obstacle, two for one with hollows.

        Columns, in the surface's frame: mode (-1 cold, 0 free, 1 touched), swept angle [rad], P (3) [m], t (3), arc
        length [m], and lengths of the straight segments before P and after Q (2) [m]. For a free surface without a
        closed form, the ends of the straight segment take the place of P and t. `solve_path(start=branch)` at the same
        pose gives exactly the same result, whatever was solved in between.
        """
        return self._saved.copy()

    def __repr__(self) -> str:
        touched = sum(contact.active for contact in self.contacts)
        return (
            f"PathSolution({self.status.name}, length={self.length:.9g} m, {touched} of {len(self.contacts)} touched, "
            f"tangency error {self.tangency_error:.1e})"
        )

    def _repr_html_(self) -> str:
        from mjwrap.paths import pictures

        facts = html.facts(
            [
                ("length", f"{self.length:.9g} m"),
                (
                    "status",
                    self.status.name if self.converged else f"{self.status.name}: {self.status.message}",
                ),
                ("tangency error", f"{self.tangency_error:.1e}"),
                ("iterations", self.iterations),
            ],
            "PathSolution",
        )
        rows = [
            [
                k,
                _kind(obstacle),
                pictures.describe(c.P),
                pictures.describe(c.Q),
                f"{c.arc_length:.5g}" * c.active,
            ]
            for k, (c, obstacle) in enumerate(
                itertools.zip_longest(self.contacts, self._obstacles[: len(self.contacts)])
            )
        ]
        heads = ["", "obstacle", "first contact [m]", "last contact [m]", "arc [m]"]
        found = html.table(heads, rows) if rows else ""
        return facts + found + pictures.svg(self.points(), self.contacts, self._obstacles)

    def plot(self, axes: Any = None) -> Any:
        """Draw the path, its contact points and the surfaces in space, with matplotlib, and return the axes.

        A path that was not found has its status as the title. axes: 3D axes to draw into; None for a new figure. Raises
        `MissingPackageError` without matplotlib, `GeometryError` for other axes.
        """
        from mjwrap.paths import pictures

        told = "" if self.converged else f"{self.status.name}: {self.status.message}"
        return pictures.plot(self.points(), self.contacts, self._obstacles, axes, told)

    def points(self, spacing: float | None = None) -> Array:
        """Return points along the path, (m, 3), world [m], at most `spacing` [m] apart.

        Without a spacing, straight segments have only their end points, and geodesics a point every 0.1 rad of turning.
        """
        step = 0.0 if spacing is None else validation.positive(spacing, "spacing", GeometryError, "m")
        count = polyline.polyline(*self._ends, self._node, step, np.empty((0, 3)), 0)
        out = np.empty((count, 3))
        polyline.polyline(*self._ends, self._node, step, out, 0)
        return out

    def speed(
        self, origin_velocity: ArrayLike, insertion_velocity: ArrayLike, twists: ArrayLike | None = None
    ) -> float:
        """Return the lengthening speed l̇ (17), positive when the path gets longer.

        Args:
            origin_velocity: (3,) velocity of the origin, world [m/s].
            insertion_velocity: (3,) velocity of the insertion, world [m/s].
            twists: (n, 6), one per obstacle or via point: linear velocity of the pose's origin [m/s], then angular
                velocity [rad/s], world; None if no obstacle moves.

        Returns:
            The lengthening speed [m/s].
        """
        pos = np.zeros((len(self._node) + 2, 3))
        pos[0], pos[1:-1], pos[-1] = self._origin, self._node[:, layout.POS : layout.POS + 3], self._insertion
        twist = self._twists(origin_velocity, insertion_velocity, twists)
        twist = twist[np.r_[0, self._owner + 1, len(twist) - 1]]
        return float(segments.lengthening_rate(self._count, self._segments, pos, twist))

    def wrenches(self, tension: float) -> Array:
        """Return the wrenches of the path under `tension` [N] on origin, each obstacle and insertion.

        (n + 2, 6): force [N], then moment about the world origin [N m], world frame. They sum to zero, and their power
        is -tension l̇ ("Velocity and force" in docs/derivation.md).
        """
        validation.require(validation.is_finite(tension), "tension", "finite [N]", tension, GeometryError)
        by_row = np.zeros((len(self._node) + 2, 6))
        segments.add_wrenches(self._count, self._segments, float(tension), by_row)
        wrench = np.zeros((len(self.contacts) + 2, 6))
        wrench[0], wrench[-1] = by_row[0], by_row[-1]
        np.add.at(wrench, self._owner + 1, by_row[1:-1])
        return wrench
