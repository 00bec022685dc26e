"""Spectral projected gradient ascent (Birgin, Martínez, Raydan 2000, doi 10.1137/S1052623497330963), step by step.

The caller evaluates the function, so that searches that move different joints can share each evaluation of a model.
"""

from __future__ import annotations

from collections.abc import Callable, Generator

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Ascent = Generator[Array, tuple[float, Array], None]
_HALVINGS = 20
_SUFFICIENT = 1e-4  # Armijo's share of the gain that the gradient predicts
_FAR = 1e9
_MEMORY = 8  # number of steps: a value must exceed the smallest of the last so many values


def ascend(start: Array, project: Callable[[Array], Array], tolerance: float, iterations: int) -> Ascent:
    """Yield variables (k,) to evaluate; send back the value, NaN if there is none, and its gradient (k,).

    project: projects onto the allowed set. The ascent ends when the gradient predicts a gain of less than `tolerance`
    within the allowed set, when no step along it gains, or after `iterations` steps.
    """
    x = project(start)
    value, gradient = yield x
    if not np.isfinite(value):
        return
    last = [value]
    step = 0.25 / max(float(np.abs(gradient).max(initial=0.0)), 1e-300)
    for _ in range(iterations):
        size = float(np.abs(gradient).max(initial=0.0))
        if size == 0.0 or float(gradient @ (project(x + gradient * (_FAR / size)) - x)) <= tolerance:
            return
        along = project(x + step * gradient) - x
        slope = float(gradient @ along)
        share = 1.0
        for _ in range(_HALVINGS):
            trial = x + share * along
            new_value, new_gradient = yield trial
            if new_value >= min(last) + _SUFFICIENT * share * slope:  # false for NaN
                break
            share *= 0.5
        else:
            return
        moved, bent = trial - x, gradient - new_gradient
        curvature = float(moved @ bent)
        x, gradient = trial, new_gradient
        last = [*last[1 - _MEMORY :], new_value]
        step = float(moved @ moved) / curvature if curvature > 0.0 else _FAR / max(size, 1e-300)
