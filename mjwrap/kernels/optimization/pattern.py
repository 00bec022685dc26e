"""Which muscles cross which joints, and what forces on them leave to do."""

from __future__ import annotations

from mjwrap.kernels.compilation.jit import from_python


@from_python
def mark_used(moment_arms, used):
    """Set `used` (n, k) where moment arms (T, n, k) differ from zero in any frame."""
    for t in range(moment_arms.shape[0]):
        for m in range(moment_arms.shape[1]):
            for i in range(moment_arms.shape[2]):
                if moment_arms[t, m, i] != 0.0:
                    used[m, i] = True


@from_python
def subtract_forces(pattern, moment_arms, force, wanted):
    """Subtract the moments of forces (T, n) [N] from `wanted` (T, k), which is in the order of elimination."""
    for t in range(wanted.shape[0]):
        for m in range(force.shape[1]):
            if force[t, m] != 0.0:
                for e in range(pattern.start[m], pattern.start[m + 1]):
                    wanted[t, pattern.row[e]] -= moment_arms[t, m, pattern.column[e]] * force[t, m]
