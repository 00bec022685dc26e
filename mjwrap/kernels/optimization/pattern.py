"""Which muscles cross which joints."""

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
