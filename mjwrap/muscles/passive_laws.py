"""Laws that pull without a muscle: ligaments and springs along a path. They have no states and no activation."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from mjwrap import validation
from mjwrap.errors import ModelError
from mjwrap.kernels.musculotendon import ligament, path_spring
from mjwrap.muscles import curve_sets
from mjwrap.muscles.fiber_law import positive

LARGEST_DEGREE = 3


@dataclass(frozen=True)
class Ligament:
    """A passive ligament: force times a curve of its length in resting lengths (OpenSim's Ligament); it pulls only.

    Args:
        pcsa_force: [N], positive.
        resting_length: [m], positive; up to here there is no tension.
        ligament_curve: a curve of cubic pieces in length / resting length: the number P of pieces, the P - 1 places
            between them, ascending, the P origins, and then for each piece the coefficients of a polynomial of at most
            third degree in (x - origin), the constant first. The first and the last piece have no ends. Negative parts
            count as zero.

    Raises:
        ModelError: a value is not possible.
    """

    pcsa_force: float
    resting_length: float
    ligament_curve: Sequence[float]
    code: ClassVar[int] = ligament.CODE
    law: ClassVar[str] = "ligament"
    needs: ClassVar[tuple[str, ...]] = ("pcsa_force", "resting_length", "ligament_curve")
    takes: ClassVar[tuple[str, ...]] = ()
    activated: ClassVar[bool] = False

    def __post_init__(self) -> None:
        positive(self, pcsa_force=self.pcsa_force, resting_length=self.resting_length)
        self._pieces()
        object.__setattr__(self, "ligament_curve", tuple(float(x) for x in self.ligament_curve))

    def _pieces(self) -> tuple[list[float], list[float], list[list[float]]]:
        """Return places between pieces, origins and coefficients (P, 4)."""
        what = f"{self.law}: ligament_curve"
        validation.sequence(self.ligament_curve, what, ModelError, "a list of numbers")
        values = [validation.finite(value, what, ModelError) for value in self.ligament_curve]
        count = int(values[0]) if values and values[0] == int(values[0]) and values[0] >= 1.0 else 0
        left = len(values) - 2 * count
        width = left // count if count else 0
        if not count or width * count != left or not 1 <= width <= LARGEST_DEGREE + 1:
            raise ModelError(
                f"{what} must be the number P of pieces, P - 1 places between them, P origins and P times 1 to "
                f"{LARGEST_DEGREE + 1} coefficients; it has {len(values)} numbers"
            )
        breaks, origins = values[1:count], values[count : 2 * count]
        if any(later <= earlier for earlier, later in itertools.pairwise(breaks)):
            raise ModelError(f"{what}: the places between pieces must ascend: {breaks}")
        rest = values[2 * count :]
        rows = [rest[width * k : width * (k + 1)] + [0.0] * (4 - width) for k in range(count)]
        return breaks, origins, rows

    @property
    def states(self) -> int:
        """Return 0."""
        return 0

    @property
    def strength(self) -> float:
        """Return the force by which the curve is multiplied [N]."""
        return self.pcsa_force

    def row(self) -> tuple[float, ...]:
        """Return the parameters in the order of `mjwrap/kernels/musculotendon/ligament.py`."""
        return (self.pcsa_force, self.resting_length, curve_sets.ligament_curve(*self._pieces()))


@dataclass(frozen=True)
class PathSpring:
    """A spring along a path: stiffness x stretch x (1 + dissipation x speed), never negative (OpenSim's PathSpring).

    Args:
        stiffness: [N/m], positive.
        resting_length: [m], not negative; up to here there is no tension.
        dissipation: [s/m], not negative.

    Raises:
        ModelError: a value is not possible.
    """

    stiffness: float
    resting_length: float
    dissipation: float = 0.0
    code: ClassVar[int] = path_spring.CODE
    law: ClassVar[str] = "path_spring"
    needs: ClassVar[tuple[str, ...]] = ("stiffness", "resting_length")
    takes: ClassVar[tuple[str, ...]] = ("dissipation",)
    activated: ClassVar[bool] = False

    def __post_init__(self) -> None:
        positive(self, stiffness=self.stiffness)
        validation.not_negative(self.resting_length, f"{self.law}: resting_length", ModelError, "m")
        validation.not_negative(self.dissipation, f"{self.law}: dissipation", ModelError, "s/m")

    @property
    def states(self) -> int:
        """Return 0."""
        return 0

    @property
    def strength(self) -> float:
        """Return infinity: a spring has no largest force."""
        return math.inf

    def row(self) -> tuple[float, ...]:
        """Return the parameters in the order of `mjwrap/kernels/musculotendon/path_spring.py`."""
        return (self.stiffness, self.resting_length, self.dissipation)
