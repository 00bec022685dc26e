"""Tension near an activation as an affine function of it: value and slope, for optimisations.

With an elastic tendon the tension is that at which fibre and tendon balance while the tendon keeps its length, so that
the fibre takes all of the unit's lengthening speed: an optimisation of single frames does not know the rate of the
tendon's length. With a rigid tendon both are those of `tension.force_parts`, which may push.
"""

from __future__ import annotations

import math

from mjwrap.kernels.compilation.jit import from_python, jit
from mjwrap.kernels.musculotendon.dispatch import curve_set, has_fiber, length_curves, velocity_force
from mjwrap.kernels.musculotendon.equilibrium import MAX_EVALUATIONS, forces
from mjwrap.kernels.musculotendon.fiber import (
    DAMPING,
    ELASTIC,
    F_MAX,
    HEIGHT,
    LEAST,
    OPTIMAL,
    ROOT_SPACING,
    SINGLE_ROOT,
    SLACK,
    V_MAX,
    held_activation,
    rigid_fiber,
)
from mjwrap.kernels.musculotendon.tension import force_parts


@from_python
def tangents(law, params, activation, length, speed, intercept, slope):
    """Write tension = intercept + slope a [N] (T, n) near activations (T, n), for all muscles of all frames."""
    for t in range(activation.shape[0]):
        for m in range(law.shape[0]):
            a = activation[t, m]
            value, growth = tangent(law[m], params, m, a, length[t, m], speed[t, m])
            intercept[t, m], slope[t, m] = value - growth * a, growth


@from_python
def tangent(law, params, m, activation, length, speed):
    """Return the tension of muscle m [N] at an activation, and its slope there; negative where it would push."""
    if not has_fiber(law):
        active, passive = force_parts(law, params, m, 1.0, length, speed)
        return passive + activation * active, active
    if length <= params[m, SLACK]:
        return 0.0, 0.0
    if params[m, ELASTIC] == 0.0:
        return _rigid_tangent(law, params, m, activation, length, speed)
    return _elastic_tangent(law, params, m, activation, length, speed)


@jit
def _rigid_tangent(law, params, m, activation, length, speed):
    """Return `tangent` with a rigid tendon; a force-velocity curve may change with the activation."""
    active, passive = force_parts(law, params, m, activation, length, speed)
    activation = held_activation(params, m, activation)
    fiber, optimal = rigid_fiber(params, m, length), params[m, OPTIMAL]
    cosine = (length - params[m, SLACK]) / fiber
    curves = curve_set(law, params, m)
    reach, _, _, _ = length_curves(curves, fiber / optimal)
    force, _, growth = velocity_force(curves, activation, speed * cosine / (params[m, V_MAX] * optimal))
    return active + passive, params[m, F_MAX] * cosine * reach * (force + activation * growth)


@jit
def _elastic_tangent(law, params, m, activation, length, speed):
    """Return `tangent` with an elastic tendon, stretched beyond its slack length or not."""
    optimal, slack, force = params[m, OPTIMAL], params[m, SLACK], params[m, F_MAX]
    height, low = params[m, HEIGHT] / optimal, params[m, LEAST] / optimal
    unit = (
        curve_set(law, params, m), held_activation(params, m, activation), params[m, DAMPING], height,
        optimal / slack, length / slack, speed / (params[m, V_MAX] * optimal),
    )  # fmt: skip
    high = max(rigid_fiber(params, m, length) / optimal, low)
    pull, _, push, _, _ = _imbalance(unit, low)
    if pull <= push:
        return force * pull, 0.0  # the shortest fibre: its tendon alone holds
    new = low
    while new < high:
        new = min(low + ROOT_SPACING, high) if low < SINGLE_ROOT else high
        pull, _, push, _, growth = _imbalance(unit, new)
        if pull <= push:
            return _balanced(unit, force, low, new)
        low = new
    return force * push, force * growth  # a fibre that would push a slack tendon


@jit
def _balanced(unit, force, low, high):
    """Return `tangent` at the fibre length in [low, high] at which the tendon pulls as the fibre does."""
    x = 0.5 * (low + high)
    pull, slope = 0.0, 0.0
    for _ in range(MAX_EVALUATIONS):
        pull, d_pull, push, d_push, growth = _imbalance(unit, x)
        slope = d_pull * growth / (d_pull - d_push)
        off = pull - push
        if off > 0.0:
            low = x
        else:
            high = x
        new = x - off / (d_pull - d_push)
        if not low <= new <= high:
            new = 0.5 * (low + high)
        if abs(new - x) <= 1e-15 * x:
            break
        x = new
    return force * pull, force * slope


@jit
def _imbalance(unit, x):
    """Return tendon force and its slope in fibre length x [l_o]; fibre force, its slopes in x and activation [F_max].

    unit: curves, activation, damping, fibre height [l_o], l_o / l_s, length [l_s] and speed [v_max l_o] of the unit.
    """
    law, activation, damping, height, ratio, length, speed = unit
    along = math.sqrt(x * x - height * height)
    v = speed * along / x
    pull, d_pull, push, d_push, _, growth, drag = forces(
        law, activation, damping, height, ratio, length, x, v
    )
    # `forces` gives the drag along the tendon per fibre velocity, which changes with x by the pennation
    return pull, d_pull, push, d_push + drag * speed * height * height / (x * x * along), growth
