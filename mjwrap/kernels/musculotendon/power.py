"""Power of fibre, tendon and muscle, and the energy stored in the elastic elements.

Power is positive where it is delivered, as by a fibre or tendon that shortens under tension. With fibre force F_M,
fibre velocity v_M, tension F_T and lengthening speed v of the musculotendon unit,
  fibre     -F_M v_M, the sum of its active, passive elastic and damping parts
  tendon    -F_T (v - v_M / cos α)
  muscle    -F_T v, delivered to the skeleton = fibre + tendon + unbalanced
  unbalanced (F_M - F_T / cos α) v_M: zero, except where fibre and tendon do not balance (see `powers`).
The power of the tendon is minus the rate of its energy; that of the passive element minus the rate of the fibre's
energy.
"""

from __future__ import annotations

import math

from mjwrap.kernels.compilation.jit import from_python, jit
from mjwrap.kernels.musculotendon import fiber
from mjwrap.kernels.musculotendon import tension as muscle
from mjwrap.kernels.musculotendon.dispatch import (
    curve_set,
    fiberless_elastic_tension,
    fiberless_energy,
    has_fiber,
    is_passive,
    length_curves,
    passive_energy,
    tendon_energy,
    velocity_force,
)
from mjwrap.kernels.musculotendon.fiber import DAMPING, ELASTIC, F_MAX, HEIGHT, LEAST, OPTIMAL, SLACK, V_MAX
from mjwrap.kernels.musculotendon.umberger import metabolic_power

# Rows of what `energetics` fills.
FIBER_VELOCITY, ACTIVE, PASSIVE, DAMPED, FIBER, TENDON, MUSCLE, UNBALANCED = range(8)
TENDON_ENERGY, FIBER_ENERGY = 8, 9
ACTIVATION_HEAT, MAINTENANCE_HEAT, SHORTENING_HEAT, RESTING_HEAT, WORK, METABOLIC = range(10, 16)
OUTPUTS = 16


@jit
def fiber_state(law, params, m, activation, length, speed, fiber_length):
    """Return fibre length [m] and velocity [m/s], cosine of the pennation angle, tendon length [m] and tension [N].

    With an elastic tendon the velocity is that at which tendon and fibre balance; a fibre below its shortest length
    counts as having that length. With a rigid one the fibre follows the unit; while the unit is shorter than its
    tendon, the fibre is at rest and as long as its height.
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

    Unbalanced power is listed separately. It occurs with a rigid tendon where the fibre pushes, as the tension is zero
    then, and without damping where no fibre velocity balances a tension outside the range of the force-velocity curve.
    """
    f_max, optimal = params[m, F_MAX], params[m, OPTIMAL]
    now, velocity, cosine, tendon, tension = fiber_state(
        law, params, m, activation, length, speed, fiber_length
    )
    x, v = now / optimal, velocity / (params[m, V_MAX] * optimal)
    curves, activation = curve_set(law, params, m), fiber.held_activation(params, m, activation)
    multiplier, _, passive, _ = length_curves(curves, x)
    rate, _, _ = velocity_force(curves, activation, v)
    active = f_max * activation * multiplier * rate
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
        out[TENDON_ENERGY, m] = f_max * params[m, SLACK] * tendon_energy(curves, tendon / params[m, SLACK])
    out[UNBALANCED, m] = (active + passive + damped - tension / cosine) * velocity
    out[FIBER_ENERGY, m] = f_max * optimal * passive_energy(curves, x)
    started, maintained, shortening, resting, work, total = metabolic_power(
        constants, m, activation, excitation, x, v, multiplier, out[ACTIVE, m]
    )
    out[ACTIVATION_HEAT, m] = started
    out[MAINTENANCE_HEAT, m] = maintained
    out[SHORTENING_HEAT, m] = shortening
    out[RESTING_HEAT, m] = resting
    out[WORK, m] = work
    out[METABOLIC, m] = total


@from_python
def energetics(law, params, activation, excitation, length, speed, fiber_length, constants, out):
    """Fill out (OUTPUTS, n) for all muscles; arrays (n,), params (n, PARAMS), constants (n, CONSTANTS: `umberger.py`).

    Laws without fibres have the power delivered to the skeleton. What springs and ligaments store and deliver stands
    in the rows of the tendon, and what they dissipate in those of the damping and the fibre.
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
            if is_passive(law[m]):
                out[TENDON, m] = -speed[m] * fiberless_elastic_tension(law[m], params, m, length[m])
                out[TENDON_ENERGY, m] = fiberless_energy(law[m], params, m, length[m])
                out[DAMPED, m] = out[FIBER, m] = out[MUSCLE, m] - out[TENDON, m]
