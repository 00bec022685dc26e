"""Wrapping surfaces: frozen, validated descriptions without a pose.

A surface knows its sizes and its row in the kernels' table (`kind`, `dims`); the mathematics is in
`mjwrap/kernels/geodesics.py` and `direct.py`. The axis of revolution is local z, as in MuJoCo.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from mjwrap.errors import GeometryError
from mjwrap.kernels import layout


@dataclass(frozen=True)
class Surface:
    """A smooth closed or unbounded surface in its own frame."""

    kind: ClassVar[int]

    @property
    def dims(self) -> tuple[float, ...]:
        """Sizes in the order of the kernels' DIM columns [m]."""
        raise NotImplementedError(f"{type(self).__name__} has no sizes")


def _positive(surface: Surface, name: str, value: float) -> None:
    try:
        good = math.isfinite(value) and value > 0.0
    except TypeError:
        good = False
    if not good:
        raise GeometryError(
            f"{type(surface).__name__}: {name} must be finite and positive [m], not {value!r}"
        )


@dataclass(frozen=True)
class Cylinder(Surface):
    """An infinite circular cylinder about local z.

    radius [m], finite and positive, else `GeometryError`.
    """

    radius: float
    kind: ClassVar[int] = layout.CYLINDER

    def __post_init__(self) -> None:
        _positive(self, "radius", self.radius)

    @property
    def dims(self) -> tuple[float, ...]:
        """The radius [m]."""
        return (float(self.radius),)


@dataclass(frozen=True)
class Sphere(Surface):
    """A sphere about the local origin.

    radius [m], finite and positive, else `GeometryError`.
    """

    radius: float
    kind: ClassVar[int] = layout.SPHERE

    def __post_init__(self) -> None:
        _positive(self, "radius", self.radius)

    @property
    def dims(self) -> tuple[float, ...]:
        """The radius [m]."""
        return (float(self.radius),)
