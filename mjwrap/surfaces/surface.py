"""What all wrapping surfaces have in common: sizes, traits and what the kernels, MJCF and pictures take from a class.

A built-in surface is a frozen dataclass in `primitives.py` that overrides what differs from the defaults here. No other
Python module asks of which class a surface is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from mjwrap import validation
from mjwrap.errors import GeometryError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Surface:
    """A smooth closed or unbounded surface in its own frame."""

    kind: ClassVar[int]  # of `mjwrap/kernels/layout.py`

    # ------------------------------------------------------- traits; kernels read them from the surface's row
    closed_form: ClassVar[bool] = False  # the wrap between two points has a formula, in `wraps/single.py`
    branched: ClassVar[bool] = False  # which side a string passes is topological, told by a swept angle
    touches: ClassVar[int] = 1  # how often a taut string may touch it; more often than once: it has hollows
    one_sided: ClassVar[bool] = False  # two points have one stable wrap between them at most
    random_starts: ClassVar[bool] = True  # a cold start may throw strings over it, with hints drawn by chance
    ellipse_sections: ClassVar[bool] = False  # a stretched sphere with `columns` for its semi-axes
    held_about: ClassVar[float] = (
        0.0  # ABOUT_POINT or ABOUT_AXIS: a string can be held inside it; 0: it cannot
    )
    geom_columns: ClassVar[
        tuple[tuple[int, int], ...]
    ] = ()  # (size of a geom of its type, column that copies it)

    # ------------------------------------------------------------- the numeric that declares it in an MJCF file
    numeric: ClassVar[str] = ""  # what the numeric's name contains; empty: it cannot be declared
    numeric_sizes: ClassVar[str] = ""  # what its values mean, in order, a word each
    numeric_least: ClassVar[int] = 0  # fewest values

    @classmethod
    def from_numeric(cls, *values: float) -> Surface:
        """Return the surface of a numeric's values [m]."""
        return cls(*values)

    # ------------------------------------------------------------------------------------ sizes of an instance

    @property
    def dims(self) -> tuple[float, ...]:
        """Sizes in the order in which they are listed [m]."""
        raise NotImplementedError(f"{type(self).__name__} has no sizes")

    @property
    def columns(self) -> tuple[float, ...]:
        """What stands in the kernels' DIM columns, four numbers at most; the sizes where nothing else is said."""
        return self.dims

    @property
    def size(self) -> float:
        """A length by which steps on the surface are limited, about its smallest radius of curvature [m]."""
        return self.dims[0]

    @property
    def z_limit(self) -> float:
        """How far along local z, to both sides, the surface may be touched [m]; infinite where it does not end."""
        return math.inf

    # ---------------------------------------------------------------------------------------------- pictures

    def profile(self, count: int, half_length: float | None) -> tuple[Array, Array]:
        """Return radii and heights (count,) [m] of circles about local z that make a picture of the surface.

        half_length [m]: where to end if it does not end itself. `GeometryError` for a surface that has no such circles.
        """
        raise GeometryError(f"{type(self).__name__} has no grid of points")

    @property
    def stretch(self) -> tuple[float, float]:
        """By how much the circles are stretched along local x and y."""
        return 1.0, 1.0


def positive(surface: Surface, name: str, value: Any, unbounded: bool = False) -> float:
    """Return a size as a float; raise `GeometryError` unless it is positive and, if not `unbounded`, finite."""
    return validation.positive(value, f"{type(surface).__name__}: {name}", GeometryError, "m", unbounded)


def axes(surface: Surface, name: str, value: Any, count: int) -> None:
    """Store a row of `count` positive sizes as a tuple of floats; `GeometryError` for anything else."""
    try:
        values = tuple(value)
    except TypeError:
        values = ()
    if len(values) != count:
        raise GeometryError(f"{type(surface).__name__}: {name} must be {count} sizes [m], not {value!r}")
    object.__setattr__(surface, name, tuple(positive(surface, name, x) for x in values))
