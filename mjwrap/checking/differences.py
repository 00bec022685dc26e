"""Differences of lengths around a pose, to test the derivatives l̇ and ∂l/∂q."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.mjcf.conditional_points import routes_that_hold
from mjwrap.poses.sizes import turning_dofs
from mjwrap.system import MuscleSystem

Array = NDArray[np.float64]
WIDTHS = tuple(
    2.0**-k for k in range(8, 14)
)  # widths of central differences [rad; relative to the muscles' lengths for slides]
ENOUGH = (
    2.0**-6
)  # shortest piece of a path, as a share of the muscles' lengths, for which WIDTHS are narrow enough
MOST_FURTHER = 8  # narrower widths; rounding dominates beyond them


class Neighbourhood:
    """The lengths of all muscles around a pose, on the branches of that pose."""

    def __init__(self, muscles: MuscleSystem, data: mujoco.MjData) -> None:
        self._muscles, self._data = muscles, data
        self._qpos = data.qpos.copy()
        muscles.forward(data)
        self._branch = muscles.branch(data)
        self._touched = self._contacts()
        self._bad = muscles.status != 0
        self._units = np.where(turning_dofs(muscles.model), 1.0, float(np.median(muscles.length)))
        self._widths = _widths(muscles)

    def _contacts(self) -> NDArray[np.int64]:
        return np.diff(self._muscles.contacts()[1])

    def _switched(self) -> NDArray[np.bool_]:
        """Return which muscles (n,) have other conditional points than at the pose itself."""
        declared, model = self._muscles.declarations, self._muscles.model
        before = routes_that_hold(model, declared, self._qpos)
        after = routes_that_hold(model, declared, self._data.qpos)
        return np.array([before.get(i) != after.get(i) for i in range(len(declared))])

    def _length(self, direction: Array, step: float) -> Array:
        """Return lengths (n,) a step away; NaN if the path has other surfaces or points there, or is not found."""
        muscles, data = self._muscles, self._data
        data.qpos[:] = self._qpos
        mujoco.mj_integratePos(muscles.model, data.qpos, direction, step)
        muscles.set_branch(data, self._branch)
        muscles.forward(data)
        other = self._bad | (muscles.status != 0) | (self._contacts() != self._touched) | self._switched()
        return np.where(other, np.nan, muscles.length)

    def central(self, direction: Array) -> Array:
        """Return central differences (widths, n) of the lengths along a direction (nv,).

        The widths are those of the joint that moves farthest: in rad, along slides relative to the muscles' lengths.
        """
        fastest = float((np.abs(direction) / self._units).max(initial=0.0))
        widths = [h / (fastest or 1.0) for h in self._widths]
        found = [(self._length(direction, h) - self._length(direction, -h)) / (2.0 * h) for h in widths]
        self._data.qpos[:] = self._qpos
        self._muscles.set_branch(self._data, self._branch)
        return np.array(found)


def _widths(muscles: MuscleSystem) -> tuple[float, ...]:
    """Return `WIDTHS`, continued by narrower ones if a path has pieces that are short beside these.

    The length changes its course within the shortest piece of a path: between two via points, or on a small surface.
    """
    points, starts = muscles.polylines()
    pieces = np.linalg.norm(np.diff(points, axis=0), axis=1)
    between = (
        starts[1:-1] - 1
    )  # from the end of one muscle to the start of the next; a muscle may have no points
    pieces[between[(between >= 0) & (between < len(pieces))]] = np.inf
    shortest = float(
        pieces[pieces > 0.0].min(initial=np.inf)
    )  # NaN between the parts of a muscle is left out, too
    if not 0.0 < shortest < np.inf:
        return WIDTHS
    share = shortest / float(np.median(muscles.length))
    further = int(np.clip(np.ceil(np.log2(ENOUGH / share)), 0, MOST_FURTHER))
    return (*WIDTHS, *(WIDTHS[-1] * 2.0 ** -(k + 1) for k in range(further)))


def extrapolated_error(central: Array, claimed: Array) -> Array:
    """Return the smallest error (n,) of a derivative against extrapolated differences; NaN if there are none.

    central (widths, n): their error is c h² + d h⁴ + rounding / h, so the best width differs between muscles. A wrong
    derivative is wrong at all widths.
    """
    errors = np.abs((4.0 * central[1:] - central[:-1]) / 3.0 - claimed)
    worst = np.where(np.isnan(errors), np.inf, errors).min(axis=0)
    return np.where(np.isinf(worst), np.nan, worst)


def orders(central: Array, claimed: Array, scale: Array) -> Array:
    """Return log2 of the ratio of errors at neighbouring widths, where these errors are much larger than rounding."""
    errors = np.abs(central - claimed) / scale
    with np.errstate(divide="ignore", invalid="ignore"):
        found = np.log2(errors[:-1] / errors[1:])
    return found[(errors[1:] > 1e-9) & (errors[:-1] < 1e-3) & np.isfinite(found)]
