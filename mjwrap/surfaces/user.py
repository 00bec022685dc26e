"""Wrapping surfaces from a user's own Python functions, which are compiled to machine code like the kernels."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, ClassVar

from mjwrap import validation
from mjwrap.errors import GeometryError
from mjwrap.kernels import layout
from mjwrap.surfaces.codegen import build, library
from mjwrap.surfaces.codegen.parametric import Chart
from mjwrap.surfaces.surface import Surface

Function = Callable[..., Any] | str


class CustomSurface(Surface):
    """A surface compiled from a user's functions; equal to any other with the same source and numbers."""

    kind: ClassVar[int] = layout.CUSTOM
    touches: ClassVar[int] = 2  # it is unknown whether the surface has hollows
    random_starts: ClassVar[bool] = False  # each would need a search with calls of its functions
    _made: build.Made

    def _set(self, made: build.Made) -> None:
        object.__setattr__(self, "_made", made)

    @property
    def dims(self) -> tuple[float, ...]:
        """Radius of a sphere about the origin that contains the surface, or infinite [m]; addresses of its functions.

        The addresses of geodesic, projection and height are valid in this process.
        """
        code = self._made.module
        addresses = (code.geodesic.address, code.project.address, code.height.address)
        return float(code.REACH), *map(float, addresses)

    @property
    def size(self) -> float:
        """About the smallest radius of curvature [m]."""
        return float(self._made.module.SIZE)

    @property
    def source(self) -> str:
        """The text of the module that was made from the user's functions, with all derivatives."""
        return str(self._made.module.TEXT)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, CustomSurface) and self._made.key == other._made.key

    def __hash__(self) -> int:
        return hash(self._made.key)

    def __repr__(self) -> str:
        return f"<{self._made.label}, size {self.size:.6g} m>"

    def __reduce__(self) -> tuple[Any, ...]:
        made = self._made
        return _restored, (type(self), made.label, made.key, library.generator_hash(), self.source)


def _restored(kind: type[CustomSurface], label: str, key: str, generator: str, text: str) -> CustomSurface:
    """Return a pickled surface; its functions need not exist in this process."""
    surface = kind.__new__(kind)
    surface._set(build.remade(label, key, generator, text))
    return surface


class ParametricSurface(CustomSurface):
    """A surface given as a point r for two parameters u and v.

    Args:
        r: a plain Python function of two numbers that returns the tuple (x, y, z) [m], or its source text. It may use
            `math`, numbers from around it and other such functions.
        u_range: (lowest, highest). A range that does not close on itself is a range of validity: a path beyond it is
            found if r continues there, and reported as `OUT_OF_RANGE`.
        v_range: the same for v.
        periodic: whether each range closes on itself; None to find it from the shape.
        derivatives: a function of (u, v) that returns (r_u, r_v, r_uu, r_uv, r_vv), three numbers each; None to derive
            them with SymPy, which cannot handle branches.
        outward: 1 if the outward normal is along r_u x r_v, -1 if against it; None: away from the surface's middle.
        size: about the smallest radius of curvature [m]; None to find it from the shape.
        name: for messages.

    Raises:
        GeometryError: r is not smooth and regular (r_u x r_v = 0, as at a pole), or cannot be compiled.
    """

    def __init__(
        self,
        r: Function,
        u_range: Sequence[float],
        v_range: Sequence[float],
        *,
        periodic: Sequence[bool | None] | None = None,
        derivatives: Function | None = None,
        outward: int | None = None,
        size: float | None = None,
        name: str | None = None,
    ) -> None:
        validation.optional(name, str, "ParametricSurface: name", GeometryError, "a text")
        label = f"ParametricSurface {name or getattr(r, '__name__', 'r')}"
        u_low, u_high = _range(label, "u_range", u_range)
        v_low, v_high = _range(label, "v_range", v_range)
        closed = (None, None) if periodic is None else periodic
        if not isinstance(closed, Sequence) or len(closed) != 2 or not {*closed} <= {None, True, False}:
            raise GeometryError(f"{label}: periodic must be two of True, False, None, not {periodic!r}")
        if outward is not None and not (isinstance(outward, int) and outward in (1, -1)):
            raise GeometryError(f"{label}: outward must be 1, -1 or None, not {outward!r}")
        chart = Chart((u_low, v_low), (u_high, v_high), (closed[0], closed[1]), outward)
        self._set(build.parametric_module(label, r, derivatives, chart, _size(label, size)))


class ImplicitSurface(CustomSurface):
    """A surface given as the points where a function phi is zero.

    Args:
        phi: a plain Python function of three numbers x, y, z [m] that is negative inside and positive outside, or its
            source text. It may use `math`, numbers from around it and other such functions.
        extent: half width of a box about the origin, or three half widths along x, y, z [m]. The box should contain the
            surface and be hardly larger. The surface is sampled and valid within it: a path beyond it is reported as
            `OUT_OF_RANGE`.
        gradient: a function of (x, y, z) that returns (phi_x, phi_y, phi_z); None to derive it with SymPy, which cannot
            handle branches.
        hessian: a function of (x, y, z) that returns
            ((phi_xx, phi_xy, phi_xz), (phi_xy, phi_yy, phi_yz), (phi_xz, phi_yz, phi_zz)), with `gradient` only.
        size: about the smallest radius of curvature [m]; None to find it from the shape.
        name: for messages.

    Raises:
        GeometryError: phi is not smooth, its gradient vanishes on the surface, or it cannot be compiled.
    """

    def __init__(
        self,
        phi: Function,
        extent: float | Sequence[float],
        *,
        gradient: Function | None = None,
        hessian: Function | None = None,
        size: float | None = None,
        name: str | None = None,
    ) -> None:
        validation.optional(name, str, "ImplicitSurface: name", GeometryError, "a text")
        label = f"ImplicitSurface {name or getattr(phi, '__name__', 'phi')}"
        if hessian is not None and gradient is None:
            raise GeometryError(f"{label}: hessian needs gradient too")
        try:
            widths: tuple[Any, ...] = (extent,) * 3 if isinstance(extent, int | float) else tuple(extent)
        except TypeError:
            widths = ()
        if len(widths) != 3:
            raise GeometryError(f"{label}: extent must be one half width or three [m], not {extent!r}")
        box = tuple(validation.positive(width, f"{label}: extent", GeometryError, "m") for width in widths)
        self._set(build.implicit_module(label, phi, gradient, hessian, box, _size(label, size)))


def _range(label: str, name: str, value: Sequence[float]) -> tuple[float, float]:
    try:
        low, high = (float(end) for end in (() if isinstance(value, str | bytes) else value))
        good = math.isfinite(low) and math.isfinite(high) and low < high
    except (TypeError, ValueError):
        low = high = 0.0
        good = False
    if not good:
        raise GeometryError(f"{label}: {name} must be two finite numbers, the lower one first, not {value!r}")
    return low, high


def _size(label: str, value: float | None) -> float | None:
    return None if value is None else validation.positive(value, f"{label}: size", GeometryError, "m")
