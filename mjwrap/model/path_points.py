"""Build the kernels' arrays of moving and conditional path points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.kernels.coupling import path_points as pp
from mjwrap.kernels.coupling.groups import PathPoints
from mjwrap.kernels.coupling.muscle_paths import L_SITE, R_FROM, R_HI, R_LO, R_TO
from mjwrap.mjcf import MovingAxis, MuscleDeclaration, read_moving_axes

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class PointPlan:
    """The moving sites of a model, and where its muscles' routes pass them or depend on ranges of joints.

    The arrays are those of the kernels' `PathPoints`; dofs: degrees of freedom nv.
    """

    axes: Ints
    numbers: Array
    uses: Ints
    conditions: Ints
    ranges: Array
    routes: int
    dofs: int

    def group(self) -> PathPoints:
        """Return the kernels' group with new memory for its results."""
        return PathPoints(
            self.axes, self.numbers, self.uses, self.conditions, self.ranges,
            np.zeros((len(self.axes), pp.SLOPE)), np.ones(self.routes, dtype=np.int64), np.zeros(self.dofs),
        )  # fmt: skip


def plan_points(
    model: mujoco.MjModel, muscles: Sequence[MuscleDeclaration], routes: Ints, links: Ints
) -> PointPlan | None:
    """Return the moving and conditional points of muscles, None if there are none.

    routes, links: those of the muscles' routes, one row for each, as in `Plan`.
    """
    axes = read_moving_axes(model)
    declared = [route for muscle in muscles for route in muscle.routes]
    if not axes and not any(route.when for route in declared):
        return None
    rows, numbers = _axes(model, axes)
    by_site: dict[int, list[int]] = {}
    for row, axis in enumerate(axes):
        by_site.setdefault(axis.site, []).append(row)
    uses = [
        (c, index, row, int(model.jnt_dofadr[axes[row].joint]))
        for c, route in enumerate(routes)
        for index, site in _sites(route, links)
        for row in by_site.get(site, ())
    ]
    conditions: list[tuple[int, ...]] = []
    ranges: list[tuple[float, float]] = []
    for c, route in enumerate(declared):
        for point, (held, holds) in enumerate(route.when):
            conditions += [(c, point, int(holds), int(model.jnt_qposadr[each.joint])) for each in held]
            ranges += [(each.low, each.high) for each in held]
    return PointPlan(
        rows,
        numbers,
        np.array(uses, dtype=np.int64).reshape(-1, pp.USE),
        np.array(conditions, dtype=np.int64).reshape(-1, pp.CONDITION),
        np.array(ranges, dtype=np.float64).reshape(-1, 2),
        len(routes),
        int(model.nv),
    )


def _axes(model: mujoco.MjModel, axes: list[MovingAxis]) -> tuple[Ints, Array]:
    """Return the rows of moving axes, and the numbers of their functions."""
    rows: list[tuple[int, ...]] = []
    pieces: list[Array] = [np.empty(0)]
    first = 0
    for axis in axes:
        count, terms = axis.coefficients.shape
        joint = axis.joint
        where = int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])
        rows.append((axis.site, int(model.site_bodyid[axis.site]), axis.axis, *where, first, count, terms))
        pieces += [axis.breaks, axis.origins, axis.coefficients.ravel()]
        first += 2 * count - 1 + count * terms
    return np.array(rows, dtype=np.int64).reshape(-1, pp.AXIS), np.concatenate(pieces)


def _sites(route: Ints, links: Ints) -> list[tuple[int, int]]:
    """Return the sites that a route passes, with their index: a node's, one before for the origin, one behind."""
    lo, hi = int(route[R_LO]), int(route[R_HI])
    inner = [(k, int(links[k, L_SITE])) for k in range(lo, hi) if links[k, L_SITE] >= 0]
    return [(lo - 1, int(route[R_FROM])), *inner, (hi, int(route[R_TO]))]
