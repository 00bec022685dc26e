"""Pieces of random .osim files: XML, numbers, frames, and functions of all classes."""

from __future__ import annotations

from xml.sax.saxutils import escape, quoteattr

import numpy as np

FUNCTIONS = (
    "Constant",
    "LinearFunction",
    "PolynomialFunction",
    "SimmSpline",
    "GCVSpline",
    "PiecewiseLinearFunction",
    "MultiplierFunction",
    "Sine",
    "StepFunction",
)


def element(tag: str, *inside: str, name: str | None = None, **children: object) -> str:
    """Return an element with a name, children by tag (numbers, words, or sequences of numbers), and others."""
    body = "".join(f"<{key}>{text(value)}</{key}>" for key, value in children.items())
    title = "" if name is None else f" name={quoteattr(name)}"
    return f"<{tag}{title}>{body}{''.join(inside)}</{tag}>\n"


def text(value: object) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str | int):
        return escape(str(value))
    return " ".join(repr(float(x)) for x in np.atleast_1d(np.asarray(value, dtype=np.float64)))


def listed(tag: str, members: list[str]) -> str:
    """Return a set of objects."""
    return f"<{tag}><objects>\n{''.join(members)}</objects></{tag}>\n" if members else ""


def place(rng: np.random.Generator, size: float = 0.1) -> dict[str, object]:
    """Return translation and orientation of a random offset frame."""
    turn = rng.uniform(-1.2, 1.2, 3) if rng.random() < 0.7 else np.zeros(3)
    return {"translation": rng.normal(0.0, size, 3), "orientation": turn}


def offset_frame(rng: np.random.Generator, name: str, parent: str, size: float = 0.1) -> str:
    return element("PhysicalOffsetFrame", name=name, socket_parent=parent, **place(rng, size))


def function(rng: np.random.Generator, kind: str | None = None, size: float = 0.3, reach: float = 1.5) -> str:
    """Return a random function whose values are about `size` where its variable is within `reach`."""
    kind = kind or str(rng.choice(FUNCTIONS))
    knots = np.sort(rng.uniform(-reach, reach, rng.integers(4, 9)))
    knots = knots[0] + np.cumsum(np.maximum(np.diff(knots, prepend=knots[0]), 0.05))
    values = rng.normal(0.0, size, knots.size)
    match kind:
        case "Constant":
            return element(kind, value=values[0])
        case "LinearFunction":
            return element(kind, coefficients=values[:2])
        case "PolynomialFunction":
            return element(kind, coefficients=values[: rng.integers(1, 4)])
        case "SimmSpline" | "PiecewiseLinearFunction" | "PiecewiseConstantFunction":
            return element(kind, x=knots, y=values)
        case "GCVSpline":
            return element(kind, half_order=2, error_variance=0, x=knots, y=values)
        case "MultiplierFunction":
            inner = function(rng, str(rng.choice(("Constant", "LinearFunction", "SimmSpline"))), size, reach)
            return element(kind, f"<function>{inner}</function>", scale=rng.normal())
        case "Sine":
            numbers = dict(zip(("omega", "phase", "offset"), rng.normal(size=3), strict=True))
            return element(kind, amplitude=values[0], **numbers)
        case "StepFunction":
            start = rng.uniform(-reach, 0.5 * reach)
            return element(
                kind,
                transition_start_time=start,
                transition_end_time=start + rng.uniform(0.2, 1.0),
                start_value=values[0],
                end_value=values[1],
            )
    raise ValueError(kind)


def rising(rng: np.random.Generator, low: float, high: float) -> str:
    """Return a spline that rises all along a range."""
    x = np.linspace(low - 0.5, high + 0.5, 6)
    return element("SimmSpline", x=x, y=np.cumsum(rng.uniform(0.2, 0.6, 6)))
