"""Check a surface's derivatives against differences, when the surface is made."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from mjwrap.errors import GeometryError

Array = NDArray[np.float64]
Function = Callable[[Array], Array]
TOLERANCE = 1e-5  # error of a derivative, relative to the largest of its kind at the same point
ROUNDING = 1e-8  # error of the value itself, over the length that the caller gives
_STEP = 1e-4  # step of the differences, relative to the step that the caller gives


def check(
    value: Function, derivative: Function, places: Sequence[Array], steps: Sequence[float], names: list[str]
) -> None:
    """Raise `GeometryError` if a derivative differs from fourth-order differences of the value.

    value (m,), derivative (n, m): functions of a place (n,), the latter by each of the n arguments; steps (n,): lengths
    over which the value changes; names (n * m): names of the derivative's numbers, row by row.
    """
    for place in places:
        given = derivative(place)
        expected = np.array([_difference(value, place, i, _STEP * step) for i, step in enumerate(steps)])
        over = np.array(steps)[:, None]
        allowed = TOLERANCE * (over * np.abs(expected)).max() + ROUNDING * np.abs(value(place)).max()
        wrong = over * np.abs(given - expected) > allowed
        if wrong.any() or not np.isfinite(given).all():
            i = int(np.argmax((wrong | ~np.isfinite(given)).ravel()))
            at = ", ".join(f"{number:.6g}" for number in place)
            raise GeometryError(
                f"{names[i]} is {given.ravel()[i]:.9g} at ({at}), but differences give {expected.ravel()[i]:.9g}: "
                "the derivative is wrong, or the surface is not smooth there"
            )


def _difference(value: Function, place: Array, i: int, step: float) -> Array:
    """Return the derivative by argument i, by central differences of fourth order."""
    ahead = np.zeros_like(place)
    ahead[i] = step
    near, far = (
        value(place + ahead) - value(place - ahead),
        value(place + 2 * ahead) - value(place - 2 * ahead),
    )
    return (8.0 * near - far) / (12.0 * step)
