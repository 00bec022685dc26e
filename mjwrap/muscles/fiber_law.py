"""What muscle laws have in common: their interface, and the base of those with a fibre and a tendon."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Protocol

from mjwrap import validation
from mjwrap.errors import ModelError

TENDONS = ("rigid", "elastic")
# Below this [l_o] an elastic tendon is rigid: at maximum isometric force it would stretch by 5e-6 l_o, which changes
# a fibre's force by about 1e-5 of that, while its stiffness becomes arbitrarily large.
SHORTEST_TENDON = 1e-4
LEAST_COSINE = 0.1  # of the pennation angle, at the shortest fibre length (Millard et al. 2013)
SMALLEST_LIMIT = 1e-3  # [rad] of a limit of the pennation angle


class Law(Protocol):
    """The interface of a muscle law: its code, its name, its numerics in MJCF, and its row of parameters."""

    code: ClassVar[int]
    law: ClassVar[str]
    needs: ClassVar[tuple[str, ...]]  # arguments that a numeric must give
    takes: ClassVar[tuple[str, ...]]  # arguments that a numeric may give
    activated: ClassVar[bool]  # whether it has activation dynamics; else the excitation is the activation

    @property
    def states(self) -> int:
        """Return the number of states, of activation and fibre length in this order: 0, 1 or 2."""
        ...

    @property
    def strength(self) -> float:
        """Return the active tension [N] at full activation, constant length and optimal fibre length."""
        ...

    def row(self) -> tuple[float, ...]:
        """Return the parameters in the order of the kernel."""
        ...


def require(law: Law, good: bool, name: str, value: float, wanted: str) -> None:
    if not good:
        raise ModelError(f"{law.law}: {name} must be {wanted}, not {value!r}")


def positive(law: Law, **values: float) -> None:
    for name, value in values.items():
        validation.positive(value, f"{law.law}: {name}", ModelError)


@dataclass(frozen=True)
class FiberLaw:
    """The common base of laws with a fibre and a tendon: parameters, checks, and the row for the kernels.

    The parameters are described at `DeGrooteFregly2016`. A law adds its code, its name in MJCF and its shortest fibre.
    """

    max_isometric_force: float
    optimal_fiber_length: float
    tendon_slack_length: float
    pennation_angle: float = 0.0
    max_contraction_velocity: float = 10.0
    fiber_damping: float | None = None
    tendon: str = "rigid"
    minimum_activation: float | None = None
    max_pennation: float | None = None
    code: ClassVar[int]
    law: ClassVar[str]
    least: ClassVar[float]  # length of the shortest fibre of the law's curves [l_o]
    needs: ClassVar[tuple[str, ...]] = ("max_isometric_force", "optimal_fiber_length", "tendon_slack_length")
    takes: ClassVar[tuple[str, ...]] = (
        "pennation_angle",
        "max_contraction_velocity",
        "fiber_damping",
        "minimum_activation",
        "max_pennation",
    )
    activated: ClassVar[bool] = True

    def __post_init__(self) -> None:
        positive(
            self,
            max_isometric_force=self.max_isometric_force,
            optimal_fiber_length=self.optimal_fiber_length,
            max_contraction_velocity=self.max_contraction_velocity,
        )
        validation.not_negative(self.tendon_slack_length, f"{self.law}: tendon_slack_length", ModelError, "m")
        angle = f"{self.law}: pennation_angle"
        validation.between(self.pennation_angle, 0.0, 0.5 * math.pi, angle, ModelError, "in [0, pi/2) [rad]")
        validation.choice(self.tendon, TENDONS, f"{self.law}: tendon", ModelError)
        validation.not_negative(self.damping, f"{self.law}: fiber_damping", ModelError)
        if self.minimum_activation is not None:
            name = f"{self.law}: minimum_activation"
            validation.between(self.minimum_activation, 0.0, 1.0, name, ModelError, "in [0, 1)")
        if self.max_pennation is not None:
            name = f"{self.law}: max_pennation"
            least, right = max(self.pennation_angle, SMALLEST_LIMIT), math.nextafter(0.5 * math.pi, 2.0)
            wanted = f"in [{least:.9g}, pi/2] [rad], and not below the pennation angle"
            validation.between(self.max_pennation, least, right, name, ModelError, wanted)

    @property
    def damping(self) -> float:
        """Return the fibre damping: the given one, or the default."""
        if self.fiber_damping is not None:
            return self.fiber_damping
        return 0.1 if self.tendon == "elastic" else 0.0

    @property
    def least_activation(self) -> float:
        """Return the activation that a smaller one counts as: the given one, or zero."""
        return 0.0 if self.minimum_activation is None else self.minimum_activation

    @property
    def largest_sine(self) -> float:
        """Return the sine of the largest pennation angle."""
        if self.max_pennation is None:
            return math.sqrt(1.0 - LEAST_COSINE**2)
        return math.sin(self.max_pennation)

    @property
    def curves(self) -> float:
        """Return the address of curves of the muscle's own in memory; 0 if it has those of the law."""
        return 0.0

    @property
    def shortest(self) -> float:
        """Return the length of the shortest fibre of the muscle's curves [l_o]."""
        return self.least

    @property
    def elastic(self) -> bool:
        """Return whether the tendon is elastic: requested, and not too short."""
        long = self.tendon_slack_length >= SHORTEST_TENDON * self.optimal_fiber_length
        return self.tendon == "elastic" and long

    @property
    def states(self) -> int:
        """Return 1 (activation), or 2 (activation and fibre length) with an elastic tendon."""
        return 2 if self.elastic else 1

    @property
    def strength(self) -> float:
        """Return the maximum isometric force along the tendon [N]."""
        return self.max_isometric_force * math.cos(self.pennation_angle)

    def row(self) -> tuple[float, ...]:
        """Return the parameters in the order of `mjwrap/kernels/musculotendon/fiber.py`."""
        height = self.optimal_fiber_length * math.sin(self.pennation_angle)
        return (
            self.max_isometric_force,
            self.optimal_fiber_length,
            self.tendon_slack_length,
            self.pennation_angle,
            self.max_contraction_velocity,
            self.damping,
            float(self.elastic),
            height,
            max(self.shortest * self.optimal_fiber_length, height / self.largest_sine),
            self.curves,
            self.least_activation,
        )
