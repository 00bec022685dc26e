"""The base class of all wrapping surfaces: sizes, traits, and properties for the kernels, MJCF and pictures.

A built-in surface is a frozen dataclass in `primitives.py` that overrides the defaults here. No other Python module
tests the class of a surface.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from mjwrap import html, validation
from mjwrap.errors import GeometryError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Surface:
    """A smooth closed or unbounded surface in its own frame."""

    kind: ClassVar[int]  # of `mjwrap/kernels/layout.py`

    # ------------------------------------------------------- traits; kernels read them from the surface's row
    closed_form: ClassVar[bool] = (
        False  # whether the wrap between two points has a closed form, in `wraps/single.py`
    )
    branched: ClassVar[bool] = (
        False  # whether the side on which a string passes is topological, given by a swept angle
    )
    touches: ClassVar[int] = 1  # how often a taut string may touch it; more than once if it has hollows
    one_sided: ClassVar[bool] = False  # whether there is at most one stable wrap between two points
    random_starts: ClassVar[bool] = True  # whether a cold start may try strings over it, with random hints
    ellipse_sections: ClassVar[bool] = False  # whether it is a stretched sphere with `columns` as semi-axes
    held_about: ClassVar[float] = 0.0  # ABOUT_POINT or ABOUT_AXIS if a string can be held inside it, else 0
    geom_columns: ClassVar[
        tuple[tuple[int, int], ...]
    ] = ()  # (index of a geom's size, column that contains it)

    # ------------------------------------------------------------- the numeric that declares it in an MJCF file
    numeric: ClassVar[str] = ""  # word in the numeric's name; empty if the surface cannot be declared
    numeric_sizes: ClassVar[str] = ""  # meaning of its values, in order, one word each
    numeric_least: ClassVar[int] = 0  # smallest number of values

    @classmethod
    def from_numeric(cls, *values: float) -> Surface:
        """Return the surface of a numeric's values [m]."""
        return cls(*values)

    # ------------------------------------------------------------------------------------ sizes of an instance

    @property
    def dims(self) -> tuple[float, ...]:
        """Sizes in the order of the class's fields [m]."""
        raise NotImplementedError(f"{type(self).__name__} has no sizes")

    @property
    def columns(self) -> tuple[float, ...]:
        """The contents of the kernels' DIM columns, at most four numbers; by default the sizes."""
        return self.dims

    @property
    def size(self) -> float:
        """A length that limits steps on the surface, about its smallest radius of curvature [m]."""
        return self.dims[0]

    @property
    def z_limit(self) -> float:
        """Largest |z| at which the surface may be touched [m]; infinite if it does not end."""
        return math.inf

    # ---------------------------------------------------------------------------------------------- pictures

    def _repr_html_(self) -> str:
        """Return the surface as a notebook shows it: its sizes, and its outline seen along x, z upwards."""
        try:
            radii, height = self.profile(33, None)
        except GeometryError:
            return html.facts([("surface", repr(self))])
        wide = self.stretch[1] * radii
        sides = [list(zip((sign * wide).tolist(), height.tolist(), strict=True)) for sign in (1.0, -1.0)]
        closed = bool(np.allclose((radii[0], height[0]), (radii[-1], height[-1])))  # a torus
        ends = [] if closed else [[sides[0][k], sides[1][k]] for k in (0, -1)]
        return html.facts([("surface", repr(self))]) + html.drawing([], (), [*sides, *ends])

    def profile(self, count: int, half_length: float | None) -> tuple[Array, Array]:
        """Return radii and heights (count,) [m] of circles about local z with which the surface is drawn.

        half_length [m]: of an infinite surface. Raises `GeometryError` for a surface without such circles.
        """
        raise GeometryError(f"{type(self).__name__} has no grid of points")

    @property
    def stretch(self) -> tuple[float, float]:
        """Factors by which the circles are stretched along local x and y."""
        return 1.0, 1.0


def positive(surface: Surface, name: str, value: Any, unbounded: bool = False) -> float:
    """Return a size as a float; raise `GeometryError` unless it is positive and, if not `unbounded`, finite."""
    return validation.positive(value, f"{type(surface).__name__}: {name}", GeometryError, "m", unbounded)


def axes(surface: Surface, name: str, value: Any, count: int) -> None:
    """Store `count` positive sizes as a tuple of floats; `GeometryError` for anything else."""
    try:
        values = () if isinstance(value, str | bytes) else tuple(value)
    except TypeError:
        values = ()
    if len(values) != count:
        raise GeometryError(f"{type(surface).__name__}: {name} must be {count} sizes [m], not {value!r}")
    object.__setattr__(surface, name, tuple(positive(surface, name, x) for x in values))
