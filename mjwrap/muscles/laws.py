"""Musculotendon parameters: one frozen, validated dataclass per law, and the list of laws.

A law gives one row of the kernels' parameter table (`mjwrap/kernels/musculotendon/dispatch.py`). docs/adding_laws.md
explains how to add a law.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Protocol

from mjwrap import validation
from mjwrap.errors import ModelError
from mjwrap.kernels.musculotendon import degroote_fregly, dispatch, millard
from mjwrap.kernels.musculotendon.mujoco_muscle import MINVAL

TENDONS = ("rigid", "elastic")
# Below this [l_o] an elastic tendon is rigid: at maximum isometric force it would stretch by 5e-6 l_o, which changes
# a fibre's force by about 1e-5 of that, while its stiffness becomes arbitrarily large.
SHORTEST_TENDON = 1e-4
LEAST_COSINE = 0.1  # of the pennation angle, at the shortest fibre length (Millard et al. 2013)


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


def _require(law: Law, good: bool, name: str, value: float, wanted: str) -> None:
    if not good:
        raise ModelError(f"{law.law}: {name} must be {wanted}, not {value!r}")


def _positive(law: Law, **values: float) -> None:
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
    code: ClassVar[int]
    law: ClassVar[str]
    least: ClassVar[float]  # length of the shortest fibre of the law's curves [l_o]
    needs: ClassVar[tuple[str, ...]] = ("max_isometric_force", "optimal_fiber_length", "tendon_slack_length")
    takes: ClassVar[tuple[str, ...]] = ("pennation_angle", "max_contraction_velocity", "fiber_damping")
    activated: ClassVar[bool] = True

    def __post_init__(self) -> None:
        _positive(
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

    @property
    def damping(self) -> float:
        """Return the fibre damping: the given one, or the default."""
        if self.fiber_damping is not None:
            return self.fiber_damping
        return 0.1 if self.tendon == "elastic" else 0.0

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
            max(self.least * self.optimal_fiber_length, height / math.sqrt(1.0 - LEAST_COSINE**2)),
        )


@dataclass(frozen=True)
class DeGrooteFregly2016(FiberLaw):
    """The muscle of De Groote et al. 2016 (doi 10.1007/s10439-016-1591-9) with pennation, rigid or elastic tendon.

    Args:
        max_isometric_force: [N], positive.
        optimal_fiber_length: [m], positive.
        tendon_slack_length: [m], not negative.
        pennation_angle: at optimal fibre length [rad], in [0, pi/2).
        max_contraction_velocity: [optimal fibre lengths/s].
        fiber_damping: not negative [max isometric forces per max contraction velocity]; None for 0 with a rigid tendon
            and 0.1 with an elastic one, so that the fibre's velocity is unique at every activation.
        tendon: "rigid" or "elastic". A tendon shorter than 1e-4 optimal fibre lengths is always rigid.

    Raises:
        ModelError: a value is not possible.
    """

    code: ClassVar[int] = degroote_fregly.CODE
    law: ClassVar[str] = "degroote_fregly_2016"
    least: ClassVar[float] = degroote_fregly.LEAST


@dataclass(frozen=True)
class Millard2012(FiberLaw):
    """The damped muscle of Millard et al. 2013 (doi 10.1115/1.4023390, OpenSim's Millard2012EquilibriumMuscle).

    Curves have OpenSim's default shapes.

    Args:
        max_isometric_force: [N], positive.
        optimal_fiber_length: [m], positive.
        tendon_slack_length: [m], not negative.
        pennation_angle: at optimal fibre length [rad], in [0, pi/2).
        max_contraction_velocity: [optimal fibre lengths/s].
        fiber_damping: not negative [max isometric forces per max contraction velocity], with either tendon.
        tendon: "rigid" or "elastic". A tendon shorter than 1e-4 optimal fibre lengths is always rigid.

    Raises:
        ModelError: a value is not possible.
    """

    fiber_damping: float = 0.1
    code: ClassVar[int] = millard.CODE
    law: ClassVar[str] = "millard_2012"
    least: ClassVar[float] = millard.LEAST


_PRM = ("range[0]", "range[1]", "force", "scale", "lmin", "lmax", "vmax", "fpmax", "fvmax")


@dataclass(frozen=True)
class MuJoCoMuscle:
    """The curves of MuJoCo's own `<muscle>`, for comparisons with a native model.

    Args:
        prm: (9,) range (2), force [N], scale, lmin, lmax, vmax, fpmax, fvmax, as in `actuator_gainprm`.
        length_range: (2,) length range of the actuator [m times gear].
        acc0: as in `actuator_acc0`.
        gear: as in `actuator_gear`.
        force_range: (2,) [N].
        passive: (9,) parameters of the passive force, as in `actuator_biasprm`; None if they are those of `prm`.

    Raises:
        ModelError: the curves are undefined.
    """

    prm: tuple[float, ...]
    length_range: tuple[float, float]
    acc0: float
    gear: float = 1.0
    force_range: tuple[float, float] = (-math.inf, math.inf)
    passive: tuple[float, ...] | None = None
    code: ClassVar[int] = dispatch.MUJOCO
    law: ClassVar[str] = "mujoco"
    needs: ClassVar[tuple[str, ...]] = ()
    takes: ClassVar[tuple[str, ...]] = ()
    activated: ClassVar[bool] = True

    def __post_init__(self) -> None:
        both = (("", self.prm), ("passive ", self.prm if self.passive is None else self.passive))
        for what, given in both:
            prm = validation.several(given, 9, f"{self.law}: {what}prm", ModelError)
            for name, value in zip(_PRM, prm, strict=True):
                _require(self, math.isfinite(value), what + name, value, "finite")
            _require(self, prm[1] > prm[0], f"{what}range", prm[1], f"above {prm[0]}")
            validation.positive(prm[5], f"{self.law}: {what}lmax", ModelError)
        validation.finite(self.acc0, f"{self.law}: acc0", ModelError)
        _positive(self, gear=self.gear)
        low, high = validation.several(self.length_range, 2, f"{self.law}: length_range", ModelError)
        _require(
            self, high > low, "length range", low - high, "increasing: optimal fibre length is zero otherwise"
        )
        _positive(self, vmax=self.prm[6])
        least, most = validation.several(self.force_range, 2, f"{self.law}: force_range", ModelError)
        _require(self, least <= most, "force range", least, f"at most {most}")

    @property
    def states(self) -> int:
        """Return 1: activation."""
        return 1

    @property
    def strength(self) -> float:
        """Return the peak active force [N], along the path: MuJoCo's `force`, or `scale / acc0`, times gear."""
        force, scale = self.prm[2:4]
        return self.gear * (force if force >= 0.0 else scale / max(MINVAL, self.acc0))

    def row(self) -> tuple[float, ...]:
        """Return the parameters in the order of `mjwrap/kernels/musculotendon/mujoco_muscle.py`."""
        range0, range1, force, scale, _, lmax, _, fpmax, _ = self.passive or self.prm
        passive = (range0, range1, force, scale, lmax, fpmax)
        return (*self.prm, *self.length_range, self.acc0, self.gear, *self.force_range, *passive)


@dataclass(frozen=True)
class ActuatorForce:
    """The force that MuJoCo computes for an actuator of any kind along mjwrap's path; mjwrap computes no tension."""

    code: ClassVar[int] = dispatch.PATH_ACTUATOR
    law: ClassVar[str] = "mujoco"
    needs: ClassVar[tuple[str, ...]] = ()
    takes: ClassVar[tuple[str, ...]] = ()
    activated: ClassVar[bool] = False

    @property
    def states(self) -> int:
        """Return 0: MuJoCo keeps its states."""
        return 0

    @property
    def strength(self) -> float:
        """Return infinity: the largest force is not known to mjwrap."""
        return math.inf

    def row(self) -> tuple[float, ...]:
        """Return the parameter of `mjwrap/kernels/musculotendon/path_actuator.py`: no force."""
        return (0.0,)


@dataclass(frozen=True)
class PathActuator:
    """Tension = activation x optimal force, without any dynamics (OpenSim's PathActuator, tension only).

    optimal_force [N], finite and positive, else `ModelError`.
    """

    optimal_force: float
    code: ClassVar[int] = dispatch.PATH_ACTUATOR
    law: ClassVar[str] = "path_actuator"
    needs: ClassVar[tuple[str, ...]] = ("optimal_force",)
    takes: ClassVar[tuple[str, ...]] = ()
    activated: ClassVar[bool] = False

    def __post_init__(self) -> None:
        _positive(self, optimal_force=self.optimal_force)

    @property
    def states(self) -> int:
        """Return 0: its activation is the excitation."""
        return 0

    @property
    def strength(self) -> float:
        """Return the optimal force [N]."""
        return self.optimal_force

    def row(self) -> tuple[float, ...]:
        """Return the parameter of `mjwrap/kernels/musculotendon/path_actuator.py`."""
        return (self.optimal_force,)


# Every law that a declaration can name, used by MJCF, `set_laws` and tests. If a declaration names no law, it has the
# first one whose required numerics are given.
LAWS: dict[str, type[Law]] = {
    law.law: law for law in (DeGrooteFregly2016, Millard2012, MuJoCoMuscle, PathActuator)
}


def parameter_row(law: Law) -> tuple[float, ...]:
    """Return a law's parameters, padded to the kernels' columns; `ModelError` for an unknown code."""
    if not dispatch.is_law_code(law.code):
        raise ModelError(f"{law.law}: the kernels have no law of code {law.code!r}")
    row = law.row()
    return (*row, *[0.0] * (dispatch.PARAMS - len(row)))
