"""The methods by name, and their options."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from mjwrap.errors import GeometryError
from mjwrap.methods.bfgs import Bfgs
from mjwrap.methods.broyden import Broyden
from mjwrap.methods.iteration import Solver
from mjwrap.methods.newton_raphson import NewtonRaphson

METHODS: dict[str, type[NewtonRaphson] | type[Bfgs] | type[Broyden]] = {
    "nr": NewtonRaphson,
    "bfgs": Bfgs,
    "broyden": Broyden,
}


def make_solver(method: str, **options: Any) -> Solver[Any]:
    """Return a solver by its name in `METHODS` with its options; `GeometryError`, which lists them, if unknown."""
    if method not in METHODS:
        raise GeometryError(f"method must be one of {', '.join(METHODS)}, not {method!r}")
    kind = METHODS[method]
    known = [field.name for field in dataclasses.fields(kind)]
    for name, value in options.items():
        if name not in known:
            raise GeometryError(
                f"method {method!r} has no option {name!r}; options: {', '.join(known)}, residual"
            )
        _check(method, name, value, getattr(kind, name))
    return kind(**options)


def _check(method: str, name: str, value: Any, default: Any) -> None:
    if isinstance(value, str) and value == default:
        return
    if (
        isinstance(value, (int, float))
        and not isinstance(value, bool)
        and np.isfinite(value)
        and (value > 0 or (value == 0 and name == "lam"))
    ):
        return
    words = f"{default!r} or " if isinstance(default, str) else ""
    raise GeometryError(f"method {method!r}: {name} must be {words}a finite positive number, not {value!r}")
