"""The linear system of a Newton step on the dual: H = I + Σ c cᵀ / w over the free muscles, factorised in its envelope.

A row of a factor L of H = L Lᵀ has no entries to the left of the first one of H, so those left of `first` are never
visited.
"""

from __future__ import annotations

import math

from mjwrap.kernels.compilation.jit import jit


@jit
def assemble(pattern, scaled, weights, free, count, hessian):
    """Write the lower half of H over the muscles free[:count] within its envelope."""
    start, row, first = pattern.start, pattern.row, pattern.first
    for i in range(first.shape[0]):
        for j in range(first[i], i):
            hessian[i, j] = 0.0
        hessian[i, i] = 1.0
    for f in range(count):
        m = free[f]
        for e in range(start[m], start[m + 1]):
            share = scaled[e] / weights[m]
            for other in range(start[m], e + 1):
                hessian[row[e], row[other]] += share * scaled[other]


@jit
def factorize(first, hessian):
    """Replace H by its factor L; return the smallest pivot over the diagonal element that it came from.

    A share near the rounding error says that the factor is useless; 0 or less, that there is none.
    """
    least = 1.0
    for i in range(first.shape[0]):
        begin = first[i]
        for j in range(begin, i):
            total = hessian[i, j]
            for l in range(max(begin, first[j]), j):
                total -= hessian[i, l] * hessian[j, l]
            hessian[i, j] = total / hessian[j, j]
        pivot = hessian[i, i]
        for j in range(begin, i):
            pivot -= hessian[i, j] * hessian[i, j]
        least = min(least, pivot / hessian[i, i])
        if not pivot > 0.0:
            return 0.0
        hessian[i, i] = math.sqrt(pivot)
    return least


@jit
def solve(first, factor, right, solution):
    """Write the solution of L Lᵀ x = right."""
    rows = first.shape[0]
    for i in range(rows):
        total = right[i]
        for j in range(first[i], i):
            total -= factor[i, j] * solution[j]
        solution[i] = total / factor[i, i]
    for i in range(rows - 1, -1, -1):
        solution[i] /= factor[i, i]
        for j in range(first[i], i):
            solution[j] -= factor[i, j] * solution[i]
