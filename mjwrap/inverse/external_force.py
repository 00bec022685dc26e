"""A force and a torque on a body over time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjwrap import validation
from mjwrap.errors import SignalError, StateError

Array = NDArray[np.float64]
INTERPOLATIONS = ("cubic", "linear")
SLACK = (
    1e-6  # [s] a motion may begin earlier and end later than the loads by this: times in files are rounded
)


@dataclass(frozen=True, eq=False)
class ExternalForce:
    """A force and a torque on a body over time, as OpenSim's ExternalForce.

    Args:
        body: name of the body on which it acts.
        time: (S,) times [s], ascending.
        force: (S, 3) [N], or None.
        point: (S, 3) point of application [m], or None for the origin of the body.
        torque: (S, 3) free torque [N m], or None; in the same frame as the force.
        force_frame: name of the body in whose axes force and torque are given, or "ground".
        point_frame: name of the body in whose frame the point is given, or "ground".
        name: for messages.
        interpolation: "cubic", by natural cubic splines as in OpenSim, or "linear".

    Raises:
        SignalError: shapes do not fit each other, numbers are not finite, or neither force nor torque is given.
    """

    body: str
    time: Array
    force: Array | None = None
    point: Array | None = None
    torque: Array | None = None
    force_frame: str = "ground"
    point_frame: str = "ground"
    name: str = ""
    interpolation: str = "cubic"

    def __post_init__(self) -> None:
        for text in ("body", "force_frame", "point_frame", "name"):
            validation.instance(getattr(self, text), str, text, SignalError, "a name")
        validation.choice(self.interpolation, INTERPOLATIONS, "interpolation", SignalError)
        time = _finite(self.time, f"{self.label}: time")
        if time.ndim != 1 or not len(time) or (np.diff(time) <= 0.0).any():
            raise SignalError(f"{self.label}: time must be (S,) and ascend")
        object.__setattr__(self, "time", time)
        if self.force is None and self.torque is None:
            raise SignalError(f"{self.label}: give a force, a torque, or both")
        for what in ("force", "point", "torque"):
            given = getattr(self, what)
            if given is None:
                continue
            values = _finite(given, f"{self.label}: {what}")
            if values.shape != (len(time), 3):
                raise SignalError(f"{self.label}: {what} must be ({len(time)}, 3), not {values.shape}")
            object.__setattr__(self, what, values)

    @property
    def label(self) -> str:
        """The words for it in messages."""
        return f"external force '{self.name or self.body}'"

    def at(self, time: Array) -> tuple[Array, Array | None, Array]:
        """Return force, point (None: the body's origin) and torque (T, 3) at times (T,) in their own frames.

        Raises `StateError` for times that the loads do not cover.
        """
        if time[0] < self.time[0] - SLACK or time[-1] > self.time[-1] + SLACK:
            raise StateError(
                f"{self.label} is known from {self.time[0]:g} to {self.time[-1]:g} s; the motion goes from "
                f"{time[0]:g} to {time[-1]:g} s"
            )
        inside = np.clip(time, self.time[0], self.time[-1])
        found = [
            None if values is None else self._interpolated(inside, values)
            for values in (self.force, self.point, self.torque)
        ]
        none = np.zeros((len(time), 3))
        return (none if found[0] is None else found[0]), found[1], (none if found[2] is None else found[2])

    def _interpolated(self, time: Array, values: Array) -> Array:
        if self.interpolation == "cubic" and len(self.time) > 2:
            from scipy.interpolate import CubicSpline

            return CubicSpline(self.time, values, bc_type="natural")(time)
        return np.column_stack([np.interp(time, self.time, column) for column in values.T])


def _finite(given: ArrayLike, what: str) -> Array:
    values = validation.numbers(given, what, SignalError)
    if not np.isfinite(values).all():
        raise SignalError(f"{what} must be finite")
    return values
