"""Musculotendon parameters: one frozen, validated dataclass per law; the forces are in `mjwrap/kernels/muscle.py`.

A law fills one row of the kernels' parameter table. To add one: a section here, a section and a row there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Protocol

from mjwrap.errors import ModelError
from mjwrap.kernels import muscle


class Law(Protocol):
    """What the solver needs of a muscle law: its code, its name and its row of parameters."""

    code: ClassVar[int]
    law: ClassVar[str]

    def row(self) -> tuple[float, ...]:
        """Return the parameters in the order of the kernel's section."""
        ...


def _require(law: Law, good: bool, name: str, value: float, wanted: str) -> None:
    if not good:
        raise ModelError(f"{law.law}: {name} must be {wanted}, not {value!r}")


def _positive(law: Law, **values: float) -> None:
    for name, value in values.items():
        _require(law, math.isfinite(value) and value > 0.0, name, value, "finite and positive")


@dataclass(frozen=True)
class DeGrooteFregly2016:
    """The muscle of De Groote et al. 2016 (doi 10.1007/s10439-016-1591-9) with a rigid tendon and pennation.

    max_isometric_force [N], optimal_fiber_length [m] > 0; tendon_slack_length [m] >= 0; pennation_angle at optimal
    fibre length [rad] in [0, pi/2); max_contraction_velocity [optimal lengths/s]; fiber_damping >= 0 [max isometric
    forces per max contraction velocity]. `ModelError` otherwise.
    """

    max_isometric_force: float
    optimal_fiber_length: float
    tendon_slack_length: float
    pennation_angle: float = 0.0
    max_contraction_velocity: float = 10.0
    fiber_damping: float = 0.0
    code: ClassVar[int] = muscle.DEGROOTE_FREGLY
    law: ClassVar[str] = "degroote_fregly_2016"

    def __post_init__(self) -> None:
        _positive(
            self,
            max_isometric_force=self.max_isometric_force,
            optimal_fiber_length=self.optimal_fiber_length,
            max_contraction_velocity=self.max_contraction_velocity,
        )
        slack, angle, damping = self.tendon_slack_length, self.pennation_angle, self.fiber_damping
        _require(
            self, math.isfinite(slack) and slack >= 0.0, "tendon_slack_length", slack, "finite and >= 0 [m]"
        )
        _require(self, 0.0 <= angle < 0.5 * math.pi, "pennation_angle", angle, "in [0, pi/2) [rad]")
        _require(self, math.isfinite(damping) and damping >= 0.0, "fiber_damping", damping, "finite and >= 0")

    def row(self) -> tuple[float, ...]:
        """Return the parameters in the order of the kernel's section."""
        return (
            self.max_isometric_force,
            self.optimal_fiber_length,
            self.tendon_slack_length,
            self.pennation_angle,
            self.max_contraction_velocity,
            self.fiber_damping,
        )


_PRM = ("range[0]", "range[1]", "force", "scale", "lmin", "lmax", "vmax", "fpmax", "fvmax")


@dataclass(frozen=True)
class MuJoCoMuscle:
    """MuJoCo's own `<muscle>` curves, so that a native model can be compared like for like.

    prm (9,): range (2), force [N], scale, lmin, lmax, vmax, fpmax, fvmax, as in `actuator_gainprm`; length_range (2,)
    of the actuator [m times gear]; acc0; gear; force_range (2,) [N]. `ModelError` where the curves are undefined.
    """

    prm: tuple[float, ...]
    length_range: tuple[float, float]
    acc0: float
    gear: float = 1.0
    force_range: tuple[float, float] = (-math.inf, math.inf)
    code: ClassVar[int] = muscle.MUJOCO
    law: ClassVar[str] = "mujoco"

    def __post_init__(self) -> None:
        _require(self, len(self.prm) == 9, "prm", len(self.prm), "nine numbers")
        for name, value in zip(_PRM, self.prm, strict=True):
            _require(self, math.isfinite(value), name, value, "finite")
        _require(self, math.isfinite(self.acc0), "acc0", self.acc0, "finite")
        _require(self, math.isfinite(self.gear) and self.gear > 0.0, "gear", self.gear, "finite and positive")
        low, high = self.length_range
        _require(
            self, high > low, "length range", low - high, "increasing: optimal fibre length is zero otherwise"
        )
        _require(self, self.prm[1] > self.prm[0], "range", self.prm[1], f"above {self.prm[0]}")
        _positive(self, vmax=self.prm[6], lmax=self.prm[5])
        least, most = self.force_range
        _require(self, least <= most, "force range", least, f"at most {most}")

    def row(self) -> tuple[float, ...]:
        """Return the parameters in the order of the kernel's section."""
        return (*self.prm, *self.length_range, self.acc0, self.gear, *self.force_range)


@dataclass(frozen=True)
class PathActuator:
    """Tension = activation x optimal force, without any dynamics (OpenSim's PathActuator, tension only).

    optimal_force [N], finite and positive, else `ModelError`.
    """

    optimal_force: float
    code: ClassVar[int] = muscle.PATH_ACTUATOR
    law: ClassVar[str] = "path_actuator"

    def __post_init__(self) -> None:
        _positive(self, optimal_force=self.optimal_force)

    def row(self) -> tuple[float, ...]:
        """Return the parameters in the order of the kernel's section."""
        return (self.optimal_force,)
