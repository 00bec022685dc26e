"""Derivatives of a solved path with respect to the poses: gradient and Hessian of its length, sliding of contacts.

Poses move by twists (n + 2, 6), one per slot: origin, every obstacle and via point, insertion; velocity (or small
translation) of the pose's origin, then angular velocity (or small rotation vector), world frame. Turning the origin,
the insertion or a via point has no effect.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjwrap import validation
from mjwrap.errors import GeometryError, PathError
from mjwrap.kernels import layout
from mjwrap.kernels.solved import contact_rates, hessian
from mjwrap.paths.contact import Contact
from mjwrap.paths.scene import Array, Point, vector
from mjwrap.paths.status import Status

FAULTS = {
    hessian.VANISHING: "the straight segment that leaves {0} has zero length, so its direction has no derivative",
    hessian.MARGINAL: "its contact with {0} could slip sideways without a change of length",
    hessian.FLAT: "the surface of {0} is flat along the path at the contact, so the contact point is not unique",
}


@dataclass(frozen=True)
class ContactVelocity:
    """The velocity of a `Contact`; its fields are the rates of the contact's fields.

    Attributes:
        active: whether the obstacle is touched.
        P: (3,) velocity of the first contact point, world [m/s]; None if not active. It is the sum of the obstacle's
            motion and of sliding on the obstacle.
        Q: (3,) velocity of the last contact point, in the same way.
        arc_length: rate of the arc length [m/s].
        second: rates of the second touch of the same surface.
    """

    active: bool
    P: Array | None
    Q: Array | None
    arc_length: float
    second: ContactVelocity | None = None


class Derivatives:
    """Derivatives of a `PathSolution` by the implicit function theorem, without another solve.

    Their error is of the order of the tangency error. Raises `PathError` if the path was not found, and `GeometryError`
    if the derivative does not exist.
    """

    status: Status
    _origin: Point
    _insertion: Point
    _ends: tuple[int, int, float, float, float, float, float, float]
    _node: Array
    _owner: NDArray[np.int64]
    contacts: list[Contact]

    def _twists(
        self, origin_velocity: ArrayLike, insertion_velocity: ArrayLike, twists: ArrayLike | None
    ) -> Array:
        """Return the checked twists (n + 2, 6) of all slots; zeros for the obstacles if `twists` is None."""
        n = len(self.contacts)
        twist = np.zeros((n + 2, 6))
        twist[0, :3] = vector(origin_velocity, 3, "origin_velocity")
        twist[-1, :3] = vector(insertion_velocity, 3, "insertion_velocity")
        if twists is not None:
            given = validation.numbers(twists, "twists", GeometryError)
            if given.size or n:
                if given.shape != (n, 6):
                    raise GeometryError(f"twists must have shape ({n}, 6), not {given.shape}")
                twist[1:-1] = given
        if not np.isfinite(twist).all():
            raise GeometryError("twists must be finite")
        return twist

    def _slot(self, slot: int) -> str:
        """Return the name of a slot."""
        if slot == 0:
            return "the origin"
        if slot > len(self.contacts):
            return "the insertion"
        via = self._node[np.argmax(self._owner == slot - 1), layout.KIND] == layout.VIA
        return f"{'via point' if via else 'obstacle'} {slot - 1}"

    def _raise(self, what: str, fault: int, slot: int) -> None:
        if fault != hessian.NO_FAULT:
            raise GeometryError(f"the path has no {what} here: {FAULTS[fault].format(self._slot(slot))}")

    def _path_points(self, what: str, strict: bool = True) -> tuple[int, Array]:
        """Return the number of path points and their rows; raises if there is no path or, if strict, for a fault."""
        if self.status != Status.CONVERGED:
            raise PathError(f"the path has no {what}: {self.status.message}")
        points = np.empty((len(self._node) + 2, hessian.POINT_ROW))
        count, fault, slot = hessian.list_path_points(*self._ends, self._node, self._owner, points)
        if strict:
            self._raise(what, fault, slot)
        return count, points

    def gradient(self) -> Array:
        """Return ∂l/∂x (n + 2, 6): force [-], then moment about the pose's origin [m], of every slot, world frame.

        Its product with twists is l̇. Tension F pulls with -F times this; `wrenches` has moments about the world
        origin. If a segment vanishes on a surface, the direction is that of the geodesic.
        """
        count, points = self._path_points("gradient", strict=False)
        out = np.zeros((len(self.contacts) + 2, 6))
        hessian.add_gradient(count, points, out)
        return out

    def stiffness(self) -> Array:
        """Return ∂²l/∂x² (6 (n + 2), 6 (n + 2)), symmetric: the stiffness of the path under unit tension.

        x: for every slot the translation of the pose's origin [m], then the rotation vector [rad] of its turn, world
        axes, in the order of `gradient().ravel()`; rows and columns of untouched obstacles are zero. The rate of the
        gradient along twists d is `stiffness() @ d` minus m × ω / 2 in every moment, with the moment m of `gradient()`
        and the angular velocity ω: rotations do not commute, so this rate is not symmetric. Raises `GeometryError` if a
        segment has zero length (an end point on a surface) or a contact is about to slip.
        """
        count, points = self._path_points("stiffness")
        slots = len(self.contacts) + 2
        twist, out, matrix = np.empty((slots, 6)), np.empty((slots, 6)), np.empty((6 * slots, 6 * slots))
        hessian.stiffness(count, points, twist, out, matrix)
        return matrix

    def stiffness_times(self, direction: ArrayLike) -> Array:
        """Return `stiffness()` times a direction (n + 2, 6) as (n + 2, 6); its cost is proportional to n, not to n².

        Raises `GeometryError` as `stiffness` does, and for a direction with a wrong shape or that is not finite.
        """
        count, points = self._path_points("stiffness")
        given = validation.numbers(direction, "direction", GeometryError).copy()
        shape = (len(self.contacts) + 2, 6)
        if given.shape != shape or not np.isfinite(given).all():
            raise GeometryError(f"direction must be finite and have shape {shape}, not {given.shape}")
        out = np.zeros(shape)
        hessian.add_stiffness_times(count, given, points, out)
        return out

    def contact_velocities(
        self, origin_velocity: ArrayLike, insertion_velocity: ArrayLike, twists: ArrayLike | None = None
    ) -> list[ContactVelocity]:
        """Return one `ContactVelocity` per obstacle, for the motion of `speed`'s arguments.

        At touchdown (arc length zero) it is the velocity of the touching path. Raises `GeometryError` as `stiffness`
        does, and if the surface is flat along the path, because the contact point is not unique there.
        """
        count, points = self._path_points("contact velocities")
        twist = self._twists(origin_velocity, insertion_velocity, twists)
        rates = np.zeros((len(self._node), 7))
        size = np.ascontiguousarray(self._node[:, layout.SIZE])
        self._raise("contact velocities", *contact_rates.contact_rates(count, twist, size, points, rates))
        found: list[ContactVelocity] = []
        for row, k in enumerate(self._owner):
            one = self._contact_velocity(row, twist[k + 1], rates[row])
            if k == len(found):
                found.append(one)
            elif one.active:
                found[k] = replace(found[k], second=one) if found[k].active else one
        return found

    def _contact_velocity(self, index: int, twist: Array, rate: Array) -> ContactVelocity:
        row = self._node[index]
        if row[layout.KIND] == layout.VIA:
            return ContactVelocity(True, twist[:3].copy(), twist[:3].copy(), 0.0)
        if row[layout.S_MODE] != layout.TOUCHED:
            return ContactVelocity(False, None, None, 0.0)
        return ContactVelocity(True, rate[:3].copy(), rate[3:6].copy(), float(rate[6]))
