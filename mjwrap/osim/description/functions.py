"""Functions of one variable: piecewise polynomials, as which every function of an .osim file is kept."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Piecewise:
    """A piecewise polynomial y(x): piece i is the sum of coefficients[i, k] (x - origins[i])^k.

    breaks (P - 1,), ascending: piece i holds from breaks[i - 1] to breaks[i]; the first and last have no outer end.
    origins (P,); coefficients (P, degree + 1). kind: the class of the function in the file. error: the largest
    difference from that function where it is no piecewise polynomial, else 0.
    """

    breaks: Array
    origins: Array
    coefficients: Array
    kind: str = "Constant"
    error: float = 0.0

    def piece(self, x: ArrayLike) -> NDArray[np.int64]:
        """Return the index of the piece that holds at x; at a break, the one above it."""
        return np.searchsorted(self.breaks, np.asarray(x, dtype=np.float64), side="right")

    def __call__(self, x: ArrayLike, derivative: int = 0) -> Array:
        """Return y, or a derivative of it, at x, with the shape of x."""
        x = np.asarray(x, dtype=np.float64)
        piece = self.piece(x)
        coefficients = self.coefficients
        for _ in range(derivative):
            coefficients = coefficients[:, 1:] * np.arange(1, coefficients.shape[1])
            if coefficients.shape[1] == 0:
                return np.zeros_like(x)
        step = x - self.origins[piece]
        total = np.zeros_like(x)
        for k in range(coefficients.shape[1] - 1, -1, -1):
            total = total * step + coefficients[piece, k]
        return total

    @property
    def is_constant(self) -> bool:
        """Whether y is the same everywhere."""
        return not self.coefficients[:, 1:].any() and np.unique(self.coefficients[:, 0]).size == 1

    @property
    def is_linear(self) -> bool:
        """Whether y is one straight line."""
        return self.coefficients.shape[0] == 1 and not self.coefficients[:, 2:].any()


def constant(value: float) -> Piecewise:
    """Return the function that has one value everywhere."""
    return Piecewise(np.zeros(0), np.zeros(1), np.array([[float(value)]]))


def linear(slope: float, at_zero: float = 0.0) -> Piecewise:
    """Return the straight line at_zero + slope x."""
    return Piecewise(np.zeros(0), np.zeros(1), np.array([[float(at_zero), float(slope)]]), "LinearFunction")


def clamped(function: Piecewise, low: float, high: float) -> Piecewise:
    """Return the function of x limited to [low, high]: constant, with the values there, beyond both ends.

    At both ends themselves it has the slope from inside, so that a sweep over the whole range has no kink.
    """
    if not low < high or function.is_constant:
        return function
    inside = function.breaks[(function.breaks > low) & (function.breaks < high)]
    chosen = function.piece(np.concatenate([[low], inside]))
    rows = np.zeros((len(chosen) + 2, function.coefficients.shape[1]))
    rows[1:-1] = function.coefficients[chosen]
    rows[[0, -1], 0] = function(low), function(high)
    breaks = np.concatenate([[low], inside, [np.nextafter(high, np.inf)]])
    origins = np.concatenate([[low], function.origins[chosen], [high]])
    return Piecewise(breaks, origins, rows, function.kind, function.error)
