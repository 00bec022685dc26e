"""The functions of an .osim file as piecewise polynomials."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mjwrap.osim.description.functions import Piecewise, constant, linear
from mjwrap.osim.reading.nodes import Node
from mjwrap.osim.reading.splines import natural_spline, simm_spline
from mjwrap.osim.report import APPROXIMATED

Array = NDArray[np.float64]

DENSEST = 400  # points of a spline of degree 5 or 7, whose equations are solved at once
SINE_REACH = 10.0  # a sine is approximated where its variable is at most this far from 0
SINE_PIECE = 0.25  # [rad] length of a piece
SINE_DEGREE = 9


def read_function(node: Node) -> Piecewise:
    """Return the function of one variable that an element describes."""
    reader = _READERS.get(node.tag)
    if reader is None:
        raise node.error(
            f"functions of class {node.tag} cannot be read; classes: {', '.join(sorted(_READERS))}. "
            "Replace it by one of these in OpenSim, or ask for it"
        )
    return reader(node)


def read_property(owner: Node, name: str, default: float | None = None) -> Piecewise:
    """Return the function that a property of an element holds; a constant default where it is missing."""
    node = owner.object(name)
    if node is None:
        # of 2.x files: a TransformAxis whose function stands under its own class
        node = next((child for child in owner.children if child.tag in _READERS), None)
    if node is None:
        if default is None:
            raise owner.error(f"the function <{name}> is missing")
        return constant(default)
    return read_function(node)


def _constant(node: Node) -> Piecewise:
    return constant(node.number("value", default=0.0))


def _linear(node: Node) -> Piecewise:
    coefficients = node.numbers("coefficients") or [1.0, 0.0]
    if len(coefficients) != 2:
        raise node.error(
            f"has {len(coefficients)} coefficients; only slope and value at zero are possible, as for one coordinate"
        )
    return linear(coefficients[0], coefficients[1])


def _polynomial(node: Node) -> Piecewise:
    coefficients = node.numbers("coefficients") or [1.0]
    return Piecewise(np.zeros(0), np.zeros(1), np.array([coefficients[::-1]]), node.tag)


def _knots(node: Node, least: int) -> tuple[Array, Array]:
    x, y = np.array(node.numbers("x")), np.array(node.numbers("y"))
    if x.size != y.size:
        raise node.error(f"has {x.size} values of x and {y.size} of y; they must be as many")
    if x.size < least:
        raise node.error(f"has {x.size} points; at least {least} are needed")
    return x, y


def _ascending(node: Node, x: Array) -> None:
    if np.any(np.diff(x) <= 0.0):
        raise node.error("the values of x must be ascending")


def _simm_spline(node: Node) -> Piecewise:
    x, y = _knots(node, 2)
    _ascending(node, x)
    return simm_spline(x, y)


def _gcv_spline(node: Node) -> Piecewise:
    x, y = _knots(node, 2)
    _ascending(node, x)
    half_order = node.number("half_order", default=0.0)
    if half_order not in (1.0, 2.0, 3.0, 4.0):
        raise node.error(f"half_order must be 1, 2, 3 or 4, not {half_order:g}")
    if node.number("error_variance", default=0.0) != 0.0:
        raise node.error(
            "smooths its points (error_variance is not 0), which cannot be read; set error_variance to 0"
        )
    if x.size < 2 * half_order:
        raise node.error(f"has {x.size} points; a spline of this degree needs at least {2 * int(half_order)}")
    if half_order > 2 and x.size > DENSEST:
        raise node.error(f"has {x.size} points; a spline of this degree may have at most {DENSEST}")
    return natural_spline(x, y, int(half_order))


def _piecewise_linear(node: Node) -> Piecewise:
    x, y = _knots(node, 1)
    _ascending(node, x)
    if x.size == 1:
        return replace(constant(y[0]), kind=node.tag)
    coefficients = np.column_stack((y[:-1], np.diff(y) / np.diff(x)))
    return Piecewise(x[1:-1].copy(), x[:-1].copy(), coefficients, node.tag)


def _piecewise_constant(node: Node) -> Piecewise:
    x, y = _knots(node, 1)
    _ascending(node, x)
    return Piecewise(x[1:].copy(), x.copy(), y[:, None].copy(), node.tag)


def _step(node: Node) -> Piecewise:
    start = node.number("transition_start_time", "start_time", default=0.99)
    end = node.number("transition_end_time", "end_time", default=1.01)
    low, high = node.number("start_value", default=0.0), node.number("end_value", default=1.0)
    if not end > start:
        raise node.error("the end of the transition must be after its start")
    quintic = np.array([0.0, 0.0, 0.0, 10.0, -15.0, 6.0]) * (high - low) / (end - start) ** np.arange(6.0)
    quintic[0] = low
    flat = np.zeros(6)
    return Piecewise(
        np.array([start, end]),
        np.array([start, start, end]),
        np.array([[low, *flat[1:]], quintic, [high, *flat[1:]]]),
        node.tag,
    )


def _sine(node: Node) -> Piecewise:
    amplitude, omega = node.number("amplitude", default=1.0), node.number("omega", default=1.0)
    phase, offset = node.number("phase", default=0.0), node.number("offset", default=0.0)
    if omega == 0.0 or amplitude == 0.0:
        return replace(constant(amplitude * math.sin(phase) + offset), kind=node.tag)
    pieces = math.ceil(2.0 * SINE_REACH * abs(omega) / SINE_PIECE)
    if pieces > 100_000:
        raise node.error(f"omega = {omega:g} is too fast for a sum of polynomials")
    edges = np.linspace(-SINE_REACH, SINE_REACH, pieces + 1)
    origins = 0.5 * (edges[:-1] + edges[1:])
    orders = np.arange(SINE_DEGREE + 1)
    factorials = np.array([math.factorial(k) for k in orders])
    angle = omega * origins[:, None] + phase + 0.5 * math.pi * orders
    coefficients = amplitude * omega**orders * np.sin(angle) / factorials
    coefficients[:, 0] += offset
    half = 0.5 * (edges[1] - edges[0]) * abs(omega)
    rounding = np.finfo(np.float64).eps * (abs(omega) * SINE_REACH + abs(phase) + 2.0)
    error = abs(amplitude) * float(rounding + half ** (SINE_DEGREE + 1) / math.factorial(SINE_DEGREE + 1))
    node.note(
        f"is kept as {pieces} polynomials, {error:.1e} from the sine while its variable lies within ±{SINE_REACH:g}",
        APPROXIMATED,
    )
    return Piecewise(edges[1:-1].copy(), origins, coefficients, node.tag, error)


def _multiplier(node: Node) -> Piecewise:
    inner = node.object("function")
    if inner is None:
        inner = next((child for child in node.children if child.tag in _READERS), None)
    if inner is None:
        raise node.error("the function that it multiplies is missing")
    function = read_function(inner)
    scale = node.number("scale", default=1.0)
    coefficients, error = scale * function.coefficients, abs(scale) * function.error
    return replace(function, coefficients=coefficients, error=error, kind=node.tag)


_READERS: dict[str, Callable[[Node], Piecewise]] = {
    "Constant": _constant,
    "LinearFunction": _linear,
    "PolynomialFunction": _polynomial,
    "SimmSpline": _simm_spline,
    "NaturalCubicSpline": _simm_spline,
    "natCubicSpline": _simm_spline,
    "GCVSpline": _gcv_spline,
    "PiecewiseLinearFunction": _piecewise_linear,
    "PiecewiseConstantFunction": _piecewise_constant,
    "MultiplierFunction": _multiplier,
    "Sine": _sine,
    "StepFunction": _step,
}
