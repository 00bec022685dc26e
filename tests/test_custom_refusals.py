"""User functions that cannot be a surface are refused, with their name and with advice."""

from __future__ import annotations

import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from custom_shapes import (
    ellipsoid,
    ellipsoid_gradient,
    ellipsoid_hessian,
    torus,
    torus_derivatives,
)

import mjwrap as mw
from mjwrap.errors import GeometryError
from mjwrap.surfaces.user import ImplicitSurface, ParametricSurface

ROOT = Path(mw.__file__).parent.parent
TURN = (0.0, math.tau)
SCALES = [1.0, 2.0]
ARRAY = np.array([0.03, 0.04])


def helper(x, a=2.0):
    return a * x


class Size:
    radius = 0.25


def branching(x, y, z):
    return x * x + y * y - 9e-4 if z > 0.0 else x * x + y * y + z * z - 9e-4


def recursive(x, y, z):
    return recursive(x - 1.0, y, z)


def listing(x, y, z):
    return sum([x, y, z])


def raising(x, y, z):
    if x > 1.0:
        raise ValueError
    return x


def nested(x, y, z):
    def square(w):
        return w * w

    return square(x) + y + z


def undefined(x, y, z):
    return x + radius  # noqa: F821  # pyright: ignore[reportUndefinedVariable]


REFUSED: dict[str, tuple[Any, str]] = {
    "numpy": (lambda x, y, z: np.cos(x) + y + z, r"np\.cos cannot be used in a surface; use math\.cos"),
    "arccos": (lambda x, y, z: np.arccos(x) + y + z, r"use math\.acos"),
    "list": (lambda x, y, z: x * SCALES[0] + y + z, r"SCALES, which is a list,.*a, b, c = SCALES"),
    "array": (lambda x, y, z: (ARRAY * x).sum() + y + z, r"\(ARRAY \* x\)\.sum"),
    "builtin": (lambda x, y, z: sorted((x, y, z))[0], "sorted cannot be used"),
    "by name": (lambda x, y, z: helper(x=x) + y + z, "an argument given by name"),
    "text": (lambda x, y, z: x if "a" == "b" else y + z, "'a', which is a str"),
    "a list inside": (listing, r"test_custom_refusals.py, line \d+\): a list cannot be used"),
    "raise": (raising, "raise cannot be used"),
    "itself": (recursive, "calls itself; write it as a loop"),
    "nested": (nested, "a function inside a function cannot be used"),
    "undefined": (undefined, "radius cannot be used in a surface; it is not defined"),
    "no function": (3.0, "phi must be a plain Python function, not 3.0"),
    "a class": (Size, "phi must be a plain Python function"),
    "arguments": (lambda x, y: x + y, r"phi is called with 3 numbers, but <lambda> takes \(x, y\)"),
    "no source": (
        eval("lambda x, y, z: x + y + z"),
        "was not found.*Write the function in a file, or give its source as text",
    ),
    "no text": ("x + y", "defines no function|does not run"),
    "wrong text": ("def phi(x, y, z) return x", "does not run"),
    "branches": (branching, "it contains a branch that depends on its arguments.*write them yourself"),
    "min": (lambda x, y, z: min(x, y, z), "min is not differentiable everywhere"),
    "floor": (lambda x, y, z: math.floor(x) + y + z, r"math\.floor is not differentiable everywhere"),
    "crease": (lambda x, y, z: abs(x) + y * y + z * z - 1e-3, "has a crease at x = 0"),
    "complex": (lambda x, y, z: x**2.5 + y + z, "power of a negative number"),
    "tuple": (lambda x, y, z: (x, y, z), "phi must return 1 number, not 3"),
    "not finite": (lambda x, y, z: math.log(x) + y + z, "phi is not finite at"),
    "positive": (
        lambda x, y, z: x * x + y * y + z * z + 1.0,
        "phi is positive in the whole box.*choose `extent`",
    ),
    "vanishing": (lambda x, y, z: (x * x + y * y + z * z - 9e-4) ** 3, "gradient"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_a_level_set_is_refused_by_name(name: str) -> None:
    function, message = REFUSED[name]
    with pytest.raises(GeometryError, match=f"(?s)ImplicitSurface .*{message}"):
        ImplicitSurface(function, 0.05)


def pole(u, v):
    return 0.03 * math.cos(u) * math.cos(v), 0.03 * math.sin(u) * math.cos(v), 0.03 * math.sin(v)


CHARTS: dict[str, tuple[Any, Any, Any, dict[str, Any], str]] = {
    "pole": (pole, TURN, (-math.pi / 2, 0.0), {}, "r_u x r_v vanishes.*v = -1.57.*ImplicitSurface"),
    "two numbers": (lambda u, v: (u, v), TURN, TURN, {}, "r must return 3 numbers, not 2"),
    "nan": (lambda u, v: (u, v, math.sqrt(u - 1.0)), TURN, TURN, {}, "r is not finite at u = 0"),
    "nearly closed": (torus, (0.0, 6.28), TURN, {}, "the ends of u_range are nearly the same.*math.tau"),
    "not closed": (torus, (0.0, 3.0), TURN, {"periodic": (True, True)}, "r is not periodic in u"),
    "flat": (
        lambda u, v: (u, v, u * v),
        (-0.01, 0.01),
        (-0.01, 0.01),
        {},
        "outer side cannot be found.*outward=1",
    ),
    "branches": (
        lambda u, v: (u, v, 0.0 if u > 0.0 else u**4),
        (-1, 1),
        (-1, 1),
        {},
        "branch that depends on its arguments",
    ),
    "range": (torus, (1.0, 0.0), TURN, {}, "u_range must be two finite numbers, the lower one first"),
    "infinite": (torus, (0.0, math.inf), TURN, {}, "u_range must be two finite numbers"),
    "periodic": (torus, TURN, TURN, {"periodic": True}, "periodic"),
    "outward": (torus, TURN, TURN, {"outward": 0}, "outward must be 1, -1 or None"),
    "size": (torus, TURN, TURN, {"size": -1.0}, "size must be finite and positive"),
}


@pytest.mark.parametrize("name", CHARTS)
def test_what_cannot_be_a_chart_is_refused_by_name(name: str) -> None:
    r, u_range, v_range, options, message = CHARTS[name]
    with pytest.raises(GeometryError, match=f"(?s)ParametricSurface .*{message}"):
        ParametricSurface(r, u_range, v_range, **options)


def test_a_wrong_derivative_is_named() -> None:
    """Each number of a gradient, Hessian and chart in turn, wrong by one part in a thousand."""
    nested_names = [f"d2 phi/d{a}d{b}" for a in "xyz" for b in "xyz"]
    for place, name in enumerate(["d phi/dx", "d phi/dy", "d phi/dz"]):
        wrong = f"""
            from custom_shapes import ellipsoid_gradient as right
            def gradient(x, y, z):
                a, b, c = right(x, y, z)
                return {", ".join(f"{1.001 if i == place else 1.0} * {letter}" for i, letter in enumerate("abc"))}
        """
        with pytest.raises(GeometryError, match=f"{name} is .*differences give"):
            ImplicitSurface(ellipsoid, (0.06, 0.04, 0.03), gradient=wrong, hessian=ellipsoid_hessian)
    for place in (0, 4, 8):
        wrong = f"""
            from custom_shapes import ellipsoid_hessian as right
            def hessian(x, y, z):
                (a, b, c), (d, e, f), (g, h, i) = right(x, y, z)
                {"abcdefghi"[place]} *= 1.001
                return (a, b, c), (d, e, f), (g, h, i)
        """
        with pytest.raises(GeometryError, match=nested_names[place]):
            ImplicitSurface(ellipsoid, (0.06, 0.04, 0.03), gradient=ellipsoid_gradient, hessian=wrong)
    for place, name in enumerate(["r_u", "r_v", "r_uu", "r_uv", "r_vv"]):
        wrong = f"""
            from custom_shapes import torus_derivatives as right
            def derivatives(u, v):
                d = right(u, v)
                x, y, z = d[{place}]
                wrong = (1.001 * x, y, z)
                return {", ".join("wrong" if i == place else f"d[{i}]" for i in range(5))}
        """
        with pytest.raises(GeometryError, match=f"x of {name} is .*differences give"):
            ParametricSurface(torus, TURN, TURN, derivatives=wrong)
    assert torus_derivatives(0.0, 0.0)[0] == pytest.approx((0.0, 0.052, 0.0))


def test_a_hessian_needs_a_gradient() -> None:
    with pytest.raises(GeometryError, match="hessian needs gradient"):
        ImplicitSurface(ellipsoid, 0.06, hessian=ellipsoid_hessian)
    with pytest.raises(GeometryError, match="extent must be one half width or three"):
        ImplicitSurface(ellipsoid, (0.06, 0.04))
    with pytest.raises(GeometryError, match="extent must be finite and positive"):
        ImplicitSurface(ellipsoid, math.inf)


def test_a_source_that_has_changed_is_noticed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "shape_of_today.py"
    file.write_text("def phi(x, y, z):\n    return x * x + y * y + z * z - 0.03**2\n")
    monkeypatch.syspath_prepend(tmp_path)
    phi = __import__("shape_of_today").phi
    file.write_text("def phi(x, y, z):\n    return x * x + y * y + z * z - 0.04**2\n")
    with pytest.raises(GeometryError, match="changed since it was loaded"):
        ImplicitSurface(phi, 0.05)


def test_whole_numbers_that_grow_too_large_are_noticed() -> None:
    """They have 64 bits in machine code, and any number of them in Python."""

    def phi(x, y, z):
        large = 1
        for _ in range(30):
            large *= 10
        return x * x + y * y + z * z - 9e-4 * (large / 1e30)

    gradient = "def gradient(x, y, z): return 2.0 * x, 2.0 * y, 2.0 * z"
    hessian = "def hessian(x, y, z): return (2.0, 0.0, 0.0), (0.0, 2.0, 0.0), (0.0, 0.0, 2.0)"
    with pytest.raises(GeometryError, match="compiled, it gives different numbers"):
        ImplicitSurface(phi, 0.05, gradient=gradient, hessian=hessian)


def test_a_program_on_the_command_line_is_told_what_to_do() -> None:
    """`python -c` has no source to read."""
    program = "import mjwrap as mw; mw.ImplicitSurface(lambda x, y, z: x, 0.1)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=ROOT)
    assert "GeometryError" in done.stderr
    assert "give its source as text" in done.stderr
