"""The splines of OpenSim as piecewise polynomials: SIMM's cubic one, and natural splines of every odd degree."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mjwrap.osim.description.functions import Piecewise

Array = NDArray[np.float64]


def simm_spline(x: Array, y: Array) -> Piecewise:
    """Return the cubic spline of SIMM through (n,) knots, n at least 2, x ascending.

    The third derivative at each end is that of the cubic through the four knots there (Forsythe, Malcolm, Moler 1977,
    section 4.4); with three knots it has no curvature at the ends; outside the knots it is straight.
    """
    count = x.size
    step = np.diff(x)
    slope = np.diff(y) / step
    if count == 2:
        return Piecewise(np.zeros(0), x[:1].copy(), np.array([[y[0], slope[0]]]), "SimmSpline")
    diagonal, right = -step[[0, -1]], np.zeros(2)
    if count > 3:
        bend = np.diff(slope)
        start = (bend[1] / (x[3] - x[1]) - bend[0] / (x[2] - x[0])) / (x[3] - x[0])
        end = (bend[-1] / (x[-1] - x[-3]) - bend[-2] / (x[-2] - x[-4])) / (x[-1] - x[-4])
        right[:] = step[0] ** 2 * start, -(step[-1] ** 2) * end
    sixth = _curvatures(step, slope, diagonal, step[[0, -1]], right)
    return _straight_outside(x, y, step, slope, sixth, "SimmSpline")


def _straight_outside(x: Array, y: Array, step: Array, slope: Array, sixth: Array, kind: str) -> Piecewise:
    """Return the cubic spline with these values of y'' / 6 at the knots, and straight lines outside."""
    at_start = slope - step * (sixth[1:] + 2.0 * sixth[:-1])
    inner = np.column_stack((y[:-1], at_start, 3.0 * sixth[:-1], np.diff(sixth) / step))
    end_slope = slope[-1] + step[-1] * (sixth[-2] + 2.0 * sixth[-1])
    coefficients = np.vstack(([y[0], at_start[0], 0.0, 0.0], inner, [y[-1], end_slope, 0.0, 0.0]))
    return Piecewise(x.copy(), np.concatenate((x[:1], x)), coefficients, "SimmSpline")


def _curvatures(step: Array, slope: Array, ends: Array, beside: Array, right_ends: Array) -> Array:
    """Return y'' / 6 at the knots (n,), so that the first derivative has no jumps.

    The first and last equation are ends[i] * (value at the end) + beside[i] * (value beside it) = right_ends[i].
    """
    count = step.size + 1
    diagonal, lower, upper, right = np.zeros(count), step.copy(), step.copy(), np.zeros(count)
    diagonal[1:-1] = 2.0 * (step[:-1] + step[1:])
    right[1:-1] = np.diff(slope)
    diagonal[[0, -1]], right[[0, -1]] = ends, right_ends
    upper[0], lower[-1] = beside
    for i in range(1, count):
        factor = lower[i - 1] / diagonal[i - 1]
        diagonal[i] -= factor * upper[i - 1]
        right[i] -= factor * right[i - 1]
    result = np.zeros(count)
    result[-1] = right[-1] / diagonal[-1]
    for i in range(count - 2, -1, -1):
        result[i] = (right[i] - upper[i] * result[i + 1]) / diagonal[i]
    return result


def natural_spline(x: Array, y: Array, half_order: int) -> Piecewise:
    """Return the natural spline of degree 2 half_order - 1 through (n,) knots, n at least 2 half_order, x ascending.

    Its derivatives from half_order on vanish at the ends, so it is a polynomial of degree half_order - 1 outside.
    """
    degree = 2 * half_order - 1
    if half_order == 2:
        step = np.diff(x)
        slope = np.diff(y) / step
        sixth = _curvatures(step, slope, np.ones(2), np.zeros(2), np.zeros(2))
        return _straight_outside(x, y, step, slope, sixth, "GCVSpline")
    pieces = x.size - 1
    terms = degree + 1
    scale = (x[-1] - x[0]) / pieces  # unknowns of about one size
    step = np.diff(x) / scale
    size = pieces * terms
    matrix, right = np.zeros((size, size)), np.zeros(size)
    row = 0
    for i in range(pieces):
        matrix[row, i * terms] = 1.0
        right[row] = y[i]
        matrix[row + 1, i * terms : (i + 1) * terms] = step[i] ** np.arange(terms)
        right[row + 1] = y[i + 1]
        row += 2
    for i in range(pieces - 1):
        for d in range(1, degree):
            matrix[row, i * terms : (i + 1) * terms] = _taylor_row(step[i], d, terms)
            matrix[row, (i + 1) * terms + d] = -1.0
            row += 1
    for d in range(half_order, degree):
        matrix[row, d] = 1.0
        matrix[row + 1, (pieces - 1) * terms :] = _taylor_row(step[-1], d, terms)
        row += 2
    solution = np.linalg.solve(matrix, right)
    for _ in range(2):  # residuals in longer numbers, as the equations of high degrees are badly conditioned
        residual = right - matrix.astype(np.longdouble) @ solution.astype(np.longdouble)
        solution = solution + np.linalg.solve(matrix, residual.astype(np.float64))
    scaled = solution.reshape(pieces, terms)
    last = np.array([_taylor_row(step[-1], d, terms) @ scaled[-1] for d in range(terms)])
    first = scaled[0].copy()
    first[half_order:], last[half_order:] = 0.0, 0.0
    coefficients = np.vstack((first, scaled, last)) / scale ** np.arange(terms)
    return Piecewise(x.copy(), np.concatenate((x[:1], x)), coefficients, "GCVSpline")


def _taylor_row(step: float, derivative: int, terms: int) -> Array:
    """Return the row that takes coefficients to the scaled derivative, y^(d) / d!, a step further."""
    row = np.zeros(terms)
    factor = 1.0
    for k in range(derivative, terms):
        row[k] = factor * step ** (k - derivative)
        factor *= (k + 1) / (k + 1 - derivative)
    return row
