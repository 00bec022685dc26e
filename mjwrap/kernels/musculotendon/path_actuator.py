"""OpenSim's PathActuator, tension only: activation times a force, without fibre and tendon."""

from __future__ import annotations

from mjwrap.kernels.compilation.jit import jit

CODE = 0


@jit
def tension(params, m, activation):
    """Tension = activation x optimal force [N], params column 0."""
    return max(activation * params[m, 0], 0.0)
