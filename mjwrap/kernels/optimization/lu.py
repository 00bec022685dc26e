"""The linear system of a Newton step where H is too ill-conditioned to factorise: free muscles and dual together.

With g = c / √w the system [I, −Gᵀ; G, I] has singular values √(1 + σ²), whose squares are those of H = I + G Gᵀ: it
loses half as many digits as H. Gauss elimination with partial pivoting.
"""

from __future__ import annotations

import math

from mjwrap.kernels.compilation.jit import jit


@jit
def solve_augmented(pattern, scaled, weights, free, count, right, matrix, solution):
    """Write the solution (k,) of H x = right over the muscles free[:count]; return whether there is one."""
    start, row, rows = pattern.start, pattern.row, right.shape[0]
    size = count + rows
    for i in range(size):
        for j in range(size + 1):
            matrix[i, j] = 0.0
        matrix[i, i] = 1.0
    for f in range(count):
        m = free[f]
        root = math.sqrt(weights[m])
        for e in range(start[m], start[m + 1]):
            matrix[count + row[e], f] = scaled[e] / root
            matrix[f, count + row[e]] = -scaled[e] / root
    for i in range(rows):
        matrix[count + i, size] = right[i]
    if not _eliminate(matrix, size):
        return False
    for i in range(size - 1, -1, -1):
        total = matrix[i, size]
        for j in range(i + 1, size):
            total -= matrix[i, j] * matrix[j, size]
        matrix[i, size] = total / matrix[i, i]
    for i in range(rows):
        solution[i] = matrix[count + i, size]
    return True


@jit
def _eliminate(matrix, size):
    """Bring `size` columns to upper triangular form, and the right-hand side behind them; False if singular."""
    for k in range(size):
        best = k
        for i in range(k + 1, size):
            if abs(matrix[i, k]) > abs(matrix[best, k]):
                best = i
        if not abs(matrix[best, k]) > 0.0:
            return False
        if best != k:
            for j in range(k, size + 1):
                matrix[k, j], matrix[best, j] = matrix[best, j], matrix[k, j]
        for i in range(k + 1, size):
            if matrix[i, k] != 0.0:
                share = matrix[i, k] / matrix[k, k]
                for j in range(k + 1, size + 1):
                    matrix[i, j] -= share * matrix[k, j]
    return True
