"""Musculotendon parameters: one frozen, validated dataclass per law, and the list of laws.

A law gives one row of the kernels' parameter table (`mjwrap/kernels/musculotendon/dispatch.py`). docs/adding_laws.md
explains how to add a law.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from mjwrap import validation
from mjwrap.errors import ModelError
from mjwrap.kernels.musculotendon import dispatch
from mjwrap.kernels.musculotendon.mujoco_muscle import MINVAL
from mjwrap.muscles import millard_curves
from mjwrap.muscles.fiber_law import TENDONS, FiberLaw, Law, positive, require
from mjwrap.muscles.hill_laws import DeGrooteFregly2016, Millard2012, Thelen2003
from mjwrap.muscles.passive_laws import Ligament, PathSpring

__all__ = [
    "LAWS",
    "PASSIVE_LAWS",
    "REFUSED",
    "SEVERAL",
    "TENDONS",
    "ActuatorForce",
    "DeGrooteFregly2016",
    "FiberLaw",
    "Law",
    "Ligament",
    "Millard2012",
    "MuJoCoMuscle",
    "PathActuator",
    "PathSpring",
    "Thelen2003",
    "parameter_row",
]

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
                require(self, math.isfinite(value), what + name, value, "finite")
            require(self, prm[1] > prm[0], f"{what}range", prm[1], f"above {prm[0]}")
            validation.positive(prm[5], f"{self.law}: {what}lmax", ModelError)
        validation.finite(self.acc0, f"{self.law}: acc0", ModelError)
        positive(self, gear=self.gear)
        low, high = validation.several(self.length_range, 2, f"{self.law}: length_range", ModelError)
        require(
            self, high > low, "length range", low - high, "increasing: optimal fibre length is zero otherwise"
        )
        positive(self, vmax=self.prm[6])
        least, most = validation.several(self.force_range, 2, f"{self.law}: force_range", ModelError)
        require(self, least <= most, "force range", least, f"at most {most}")

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
        positive(self, optimal_force=self.optimal_force)

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


# Laws of other programs that mjwrap does not have, and why.
REFUSED: dict[str, str] = {
    "schutte_1993": (
        "OpenSim's Schutte1993Muscle_Deprecated has curves that are splines in its file, a time scale in place of "
        "time constants, and an implicit force-velocity relation with its own damping, which mjwrap does not compute; "
        "Thelen's and Millard's muscles take its forces and lengths"
    )
}
PASSIVE_LAWS: tuple[type[Law], ...] = (Ligament, PathSpring)  # no activation changes their tension
# Parameters that are lists of numbers, and how many they may have; nothing said: the law checks it.
SEVERAL: dict[str, tuple[int, ...]] = {**millard_curves.COUNTS, "ligament_curve": ()}

# Every law that a declaration can name, used by MJCF, `set_laws` and tests. If a declaration names no law, it has the
# first one whose required numerics are given.
LAWS: dict[str, type[Law]] = {
    law.law: law
    for law in (
        DeGrooteFregly2016,
        Millard2012,
        MuJoCoMuscle,
        PathActuator,
        Thelen2003,
        Ligament,
        PathSpring,
    )
}


def parameter_row(law: Law) -> tuple[float, ...]:
    """Return a law's parameters, padded to the kernels' columns; `ModelError` for an unknown code."""
    if not dispatch.is_law_code(law.code):
        raise ModelError(f"{law.law}: the kernels have no law of code {law.code!r}")
    row = law.row()
    return (*row, *[0.0] * (dispatch.PARAMS - len(row)))
