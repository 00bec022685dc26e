"""From functions to text on its own: what a surface may be written with, and its derivatives."""

from __future__ import annotations

import math
from collections.abc import Callable
from math import hypot
from typing import Any

import numba
import numpy as np
import pytest
from custom_shapes import (
    MAKERS,
    ellipsoid,
    ellipsoid_gradient,
    followed,
    random_rows,
    sphere,
    torus,
)

from mjwrap.kernels import layout as lay
from mjwrap.kernels.geometry import user_surface
from mjwrap.surfaces.codegen.source import Source, from_text
from mjwrap.surfaces.codegen.symbols import derive
from mjwrap.surfaces.user import ImplicitSurface, ParametricSurface

TURN = (0.0, math.tau)
LIMIT = -0.03
ARRAY = np.array([0.03, 0.04])


def captured(function: Any, arguments: int = 3) -> Callable[..., Any]:
    """Return a function made from the text that stands for another one on its own."""
    source = Source()
    name = source.add(function, "phi", arguments)
    names: dict[str, Any] = {"math": math}
    exec(source.text, names)
    return names[name]


# --------------------------------------------------------------------------- what it may be written with


def helper(x, a=2.0):
    b: float = a
    b += 1.0
    while b > 3.0:
        b = b - 1.0
    return b * x


def with_everything(x, y, z):
    """A docstring."""
    total = 0.0
    for i in range(3):
        if i == 1:
            continue
        total += (x, y, z)[i] * LIMIT**2
    scale = 1.0 if x > 0.0 and not y > 1.0 else -2.0
    return (
        helper(total) * scale
        + hypot(x, y)
        + math.pi * pow(z, 2)
        + np.pi
        + abs(min(x, y))
        + float(len((1, 2)))
    )


class Size:
    radius = 0.25


def from_around(x, y, z):
    return x * Size.radius + y * ARRAY.size + z


def test_a_functions_text_says_the_same() -> None:
    local = -0.7
    functions = [
        with_everything,
        from_around,
        lambda x, y, z: local**2 * x + y / local - z,
        lambda x, y, z, a=0.5: a * x + y + z,  # two lambdas
        numba.njit(sphere),
        sphere,
    ]
    for function in functions:
        other = captured(function)
        for point in np.random.default_rng(1).normal(size=(20, 3)):
            assert other(*point) == function(*point)


def test_lambdas_on_one_line_are_told_apart() -> None:
    pair = (lambda x, y, z: x + y + z, lambda x, y, z: x - y - z)
    assert [captured(f)(3.0, 2.0, 1.0) for f in pair] == [6.0, 0.0]


def test_helpers_of_the_same_name_do_not_meet() -> None:
    first = from_text("def helper(x):\n    return x\ndef phi(x, y, z):\n    return helper(x)", "phi")

    def phi(x, y, z):
        return first(x, y, z) + helper(y)

    assert captured(phi)(1.0, 10.0, 0.0) == 31.0


def test_numbers_are_those_of_the_moment() -> None:
    radii = []
    for radius in (0.02, 0.03):

        def ball(x, y, z, r=radius):
            return x * x + y * y + z * z - r * r

        radii.append(ImplicitSurface(ball, 0.04).size)
    assert radii == pytest.approx([0.02, 0.03], rel=1e-9)


def test_source_text_where_there_is_no_file() -> None:
    text = """
        R = 0.03
        def square(x):
            return x * x
        def phi(x, y, z):
            return square(x) + square(y) + square(z) - R**2
    """
    surface = ImplicitSurface(text, 0.04, name="ball")
    assert surface.size == pytest.approx(0.03, rel=1e-9)
    assert "ball" in repr(surface)


def test_derivatives_by_hand_and_derived_are_the_same() -> None:
    rng = np.random.default_rng(2)
    pairs = [
        (MAKERS["implicit ellipsoid"](), MAKERS["implicit ellipsoid by hand"]()),
        (
            MAKERS["implicit ellipsoid"](),
            ImplicitSurface(ellipsoid, (0.06, 0.04, 0.03), gradient=ellipsoid_gradient),
        ),
        (MAKERS["parametric torus"](), MAKERS["parametric torus by hand"]()),
    ]
    for derived, by_hand in pairs:
        assert derived != by_hand
        assert by_hand.size == pytest.approx(derived.size, rel=1e-12)
        node = random_rows(derived, 30, rng)
        other = node.copy()
        other[:, lay.DIM : lay.DIM + 4] = by_hand.dims
        both = followed(node)[:, lay.W_P : lay.W_BP] - followed(other)[:, lay.W_P : lay.W_BP]
        assert np.abs(both).max() < 2e-12


@pytest.mark.parametrize(
    ("text", "at"),
    [
        ("math.exp(-x) * math.log(y) + math.tan(z)", (0.3, 0.7, 0.2)),
        ("math.atan2(y, x) + math.asinh(z) * math.sqrt(x)", (0.3, 0.7, 0.2)),
        ("abs(x) ** 2.5 * y ** -2 + math.tanh(z) / math.cosh(x)", (-0.3, 0.7, 0.2)),
        ("math.fabs(x) ** 3.5 + math.hypot(x, y, z) + math.log1p(x) + math.expm1(y)", (0.3, 0.7, -0.2)),
        (
            "(x * x + y * y) ** 1.5 + math.radians(x) * math.tau + math.erf(z) + math.pow(x, 3)",
            (0.3, 0.7, -0.2),
        ),
        (
            "math.acos(x) * math.asin(y) + math.atan(z) + math.sinh(x) * math.log2(y) + 1e-3 * x / 3",
            (0.3, 0.7, 0.2),
        ),
    ],
)
def test_derived_derivatives_against_differences(text: str, at: tuple[float, ...]) -> None:
    source = Source()
    entry = source.add(f"def phi(x, y, z): return {text}", "phi", 3)
    wanted = {f"d{by}": (0, by) for by in ("", "x", "y", "z", "xx", "xy", "yz", "zz")}
    (lines,) = derive(source.text, entry, "xyz", 1, [wanted], "phi")

    def value(name: str, *point: float) -> float:
        names: dict[str, Any] = {"math": math, **dict(zip("xyz", point, strict=True))}
        for target, expression in lines:
            names[target] = eval(expression, names)
        return names[name]

    phi = from_text(f"import math\ndef phi(x, y, z): return {text}", "phi")
    assert value("d", *at) == pytest.approx(phi(*at), rel=1e-14)
    for name in [name for name in wanted if len(name) > 1]:
        axis = "xyz".index(name[-1])
        step = 1e-5 * np.eye(3)[axis]
        ahead, behind = (value(name[:-1], *(np.array(at) + sign * step)) for sign in (1.0, -1.0))
        assert value(name, *at) == pytest.approx((ahead - behind) / 2e-5, rel=1e-7, abs=1e-7)


# ------------------------------------------------------------------------------------------ sides and sizes


def test_outside_is_away_from_the_middle_unless_it_is_said() -> None:
    for surface, outside in (
        (MAKERS["parametric torus"](), 1.0),
        (ParametricSurface(lambda v, u: torus(u, v), TURN, TURN), 1.0),
        (ParametricSurface(torus, TURN, TURN, outward=-1), -1.0),
    ):
        node = random_rows(surface, 1, np.random.default_rng(3))
        assert user_surface.custom_height(0, node, 1.0, 0.0, 0.0) * outside > 0.0


def test_equal_sources_make_equal_surfaces() -> None:
    one, other = MAKERS["bean"](), MAKERS["bean"]()
    assert one == other
    assert hash(one) == hash(other)
    assert one.dims == other.dims
    assert one != MAKERS["waist"]()
    assert one != ImplicitSurface(ellipsoid, (0.06, 0.04, 0.03), size=0.01)
    assert ImplicitSurface(ellipsoid, (0.06, 0.04, 0.03), size=0.01).size == 0.01
