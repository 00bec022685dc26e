"""Where the power of a musculotendon unit comes from and goes to, and the energy that its springs hold.

Power is positive where it is delivered: a fibre or tendon that shortens under tension delivers it. With the fibre's
force F_M and velocity v_M, the tension F_T and the unit's lengthening speed v,
  fibre     -F_M v_M, the sum of its active, passive elastic and damping parts
  tendon    -F_T (v - v_M / cos α)
  muscle    -F_T v, what reaches the skeleton = fibre + tendon + unbalanced
  unbalanced (F_M - F_T / cos α) v_M: zero but where a law holds a fibre or tendon off its balance (see `powers`).
The tendon's power is minus the rate of its energy, the passive elastic one minus that of the fibre's energy.
"""

from __future__ import annotations

import math

from mjwrap.kernels.compilation.jit import jit
from mjwrap.kernels.musculotendon import fiber
from mjwrap.kernels.musculotendon import tension as muscle
from mjwrap.kernels.musculotendon.dispatch import (
    has_fiber,
    length_curves,
    passive_energy,
    tendon_energy,
    velocity_curve,
)
from mjwrap.kernels.musculotendon.fiber import DAMPING, ELASTIC, F_MAX, HEIGHT, LEAST, OPTIMAL, SLACK, V_MAX
from mjwrap.kernels.musculotendon.umberger import metabolic_power

# Rows of what `energetics` fills.
FIBER_VELOCITY, ACTIVE, PASSIVE, DAMPED, FIBER, TENDON, MUSCLE, UNBALANCED, TENDON_ENERGY, FIBER_ENERGY = (
    range(10)
)
ACTIVATION_HEAT, MAINTENANCE_HEAT, SHORTENING_HEAT, RESTING_HEAT, WORK, METABOLIC = range(10, 16)
OUTPUTS = 16


@jit
def fiber_state(law, params, m, activation, length, speed, fiber_length):
    """Return fibre length [m] and velocity [m/s], cosine of the pennation angle, tendon length [m] and tension [N].

    With an elastic tendon the velocity is that at which tendon and fibre balance, and a fibre below its shortest length
    is taken to be there. With a rigid one it follows the unit; while that is shorter than its tendon, the fibre is
    at rest at its height.
    """
    slack, height = params[m, SLACK], params[m, HEIGHT]
    if params[m, ELASTIC] == 0.0:
        now = fiber.rigid_fiber(params, m, length)
        along = length - slack
        if along <= 0.0:
            return now, 0.0, 1.0, slack, 0.0
        cosine = along / now
        tension = fiber.rigid_tension(law, params, m, activation, length, speed)
        return now, speed * cosine, cosine, slack, tension
    now = max(fiber_length, params[m, LEAST])
    along = math.sqrt(now * now - height * height)
    velocity = fiber.fiber_rate(law, params, m, activation, length, now)
    return now, velocity, along / now, length - along, fiber.tendon_force(law, params, m, length, now)


@jit
def powers(law, params, m, activation, length, speed, fiber_length, constants, excitation, out):
    """Fill column m of out (OUTPUTS, n) for a law with a fibre [W, J, m/s].

    Unbalanced power is explicit: a rigid tendon beside a fibre that pushes has no tension; and without damping no fibre
    velocity balances a tension beyond the range of the force-velocity curve.
    """
    f_max, optimal = params[m, F_MAX], params[m, OPTIMAL]
    now, velocity, cosine, tendon, tension = fiber_state(
        law, params, m, activation, length, speed, fiber_length
    )
    x, v = now / optimal, velocity / (params[m, V_MAX] * optimal)
    multiplier, _, passive, _ = length_curves(law, x)
    rate, _ = velocity_curve(law, v)
    active = f_max * min(max(activation, 0.0), 1.0) * multiplier * rate
    passive *= f_max
    damped = f_max * params[m, DAMPING] * v

    out[FIBER_VELOCITY, m] = velocity
    out[ACTIVE, m] = -active * velocity
    out[PASSIVE, m] = -passive * velocity
    out[DAMPED, m] = -damped * velocity
    out[FIBER, m] = -(active + passive + damped) * velocity
    out[MUSCLE, m] = -tension * speed
    if params[m, ELASTIC] != 0.0:
        out[TENDON, m] = -tension * (speed - velocity / cosine)
        out[TENDON_ENERGY, m] = f_max * params[m, SLACK] * tendon_energy(law, tendon / params[m, SLACK])
    out[UNBALANCED, m] = (active + passive + damped - tension / cosine) * velocity
    out[FIBER_ENERGY, m] = f_max * optimal * passive_energy(law, x)
    started, maintained, shortening, resting, work, total = metabolic_power(
        constants, m, activation, excitation, x, v, multiplier, out[ACTIVE, m]
    )
    out[ACTIVATION_HEAT, m] = started
    out[MAINTENANCE_HEAT, m] = maintained
    out[SHORTENING_HEAT, m] = shortening
    out[RESTING_HEAT, m] = resting
    out[WORK, m] = work
    out[METABOLIC, m] = total


@jit
def energetics(law, params, activation, excitation, length, speed, fiber_length, constants, out):
    """Fill out (OUTPUTS, n) for all muscles: arrays (n,), params (n, PARAMS), constants (n, CONSTANTS) of the heats.

    Laws without fibres (MuJoCo's muscle, the path actuator) have the power that reaches the skeleton only.
    """
    out[:] = 0.0
    for m in range(law.shape[0]):
        if has_fiber(law[m]):
            powers(
                law[m], params, m, activation[m], length[m], speed[m], fiber_length[m],
                constants, excitation[m], out,
            )  # fmt: skip
        else:
            out[MUSCLE, m] = -speed[m] * muscle.tension(law[m], params, m, activation[m], length[m], speed[m])
