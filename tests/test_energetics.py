"""Energy of muscles: powers balance, and stored energies are the integrals of the forces."""

from __future__ import annotations

import itertools
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest
from hill_tables import shaped, table
from muscle_states import EACH_LAW, SIZES, Vector, evaluate, random_states, rows
from scipy.integrate import quad, solve_ivp

import mjwrap as mw
from mjwrap.kernels.musculotendon import fiber as fiber_kernel
from mjwrap.kernels.musculotendon import power as kernel
from mjwrap.kernels.musculotendon import tension as muscle_kernel
from mjwrap.kernels.musculotendon import thelen
from mjwrap.kernels.musculotendon.dispatch import curve_set
from mjwrap.muscles.energetics import Energetics, compute_energetics, metabolic_constants

# ------------------------------------------------------------------------------------------------- powers


@EACH_LAW
@pytest.mark.parametrize("sizes", SIZES)
@pytest.mark.parametrize("tendon", ["rigid", "elastic"])
def test_muscle_power_is_fiber_power_and_tendon_power(law: Any, sizes: str, tendon: str) -> None:
    """To 1e-12 of the largest of the powers that cancel. A fibre that pushes on a rigid tendon is the exception."""
    unit = law(*SIZES[sizes], fiber_damping=0.1, tendon=tendon)
    activation, length, speed, fiber = random_states(unit, 300, seed=1)
    e = evaluate(unit, activation, length, speed, fiber)
    parts = [e.active_power, e.passive_power, e.damping_power, e.tendon_power, e.muscle_power]
    rounding = 1e-12 * (np.max(np.abs(parts), axis=0) + unit.max_isometric_force * np.abs(e.fiber_velocity))
    assert np.all(np.abs(e.active_power + e.passive_power + e.damping_power - e.fiber_power) <= rounding)
    assert np.all(np.abs(e.fiber_power + e.tendon_power + e.unbalanced_power - e.muscle_power) <= rounding)
    assert np.all(e.damping_power <= 0.0)
    pulls = e.muscle_power != 0.0
    assert np.count_nonzero(pulls) > 150
    loose = ~pulls if tendon == "rigid" else np.zeros(300, dtype=bool)
    assert np.all(np.abs(e.unbalanced_power[~loose]) <= rounding[~loose])
    if tendon == "rigid":
        assert np.max(np.abs(e.unbalanced_power)) > 1.0
        assert not np.any([e.tendon_power, e.tendon_energy])


@EACH_LAW
def test_powers_are_forces_times_velocities(law: Any) -> None:
    """Against forces of the kernels and a difference quotient of the tendon's length, which rounds to 1e-7."""
    unit = law(*SIZES["soleus"], fiber_damping=0.1, tendon="elastic")
    activation, length, speed, fiber = random_states(unit, 60, seed=2)
    e = evaluate(unit, activation, length, speed, fiber)
    _, params = rows([unit])
    height = unit.optimal_fiber_length * np.sin(unit.pennation_angle)
    step = 1e-7
    for i in range(60):
        now = max(fiber[i], params[0, fiber_kernel.LEAST])
        tension = fiber_kernel.tendon_force(unit.code, params, 0, length[i], now)
        along = fiber_kernel.fiber_force(unit.code, params, 0, activation[i], now, e.fiber_velocity[i])
        ahead, behind = (
            length[i] + s * speed[i] - np.sqrt((now + s * e.fiber_velocity[i]) ** 2 - height**2)
            for s in (step, -step)
        )
        size = unit.max_isometric_force * unit.optimal_fiber_length * 10.0
        cosine = np.sqrt(now**2 - height**2) / now
        assert e.muscle_power[i] == pytest.approx(-tension * speed[i], abs=1e-12 * size)
        assert e.fiber_power[i] == pytest.approx(-along / cosine * e.fiber_velocity[i], abs=1e-12 * size)
        assert e.tendon_power[i] == pytest.approx(
            -tension * (ahead - behind) / (2 * step), rel=1e-7, abs=1e-7 * size
        )


@EACH_LAW
def test_where_a_law_clamps_the_missing_power_is_explicit(law: Any) -> None:
    """A fibre at its minimum length and a slack tendon deliver nothing; without damping a fast pull is unbalanced."""
    unit = law(*SIZES["parallel"], fiber_damping=0.1, tendon="elastic")
    _, params = rows([unit])
    least = params[0, fiber_kernel.LEAST]
    at_least = evaluate(unit, 1.0, 1.0001 * unit.tendon_slack_length + least, -0.1, [least, 0.5 * least])
    assert np.all(at_least.tendon_power > 0.0)
    if law is mw.DeGrooteFregly2016:  # Millard's fibre has no active force there, and yields to any tension
        assert np.array_equal(at_least.tendon_power, at_least.muscle_power)
        assert not np.any([at_least.fiber_power, at_least.unbalanced_power])

    unit = law(*SIZES["soleus"], fiber_damping=0.1, tendon="elastic")
    # a shaped fibre of 1.2 optimal lengths would shorten faster than v_max, without active power
    now = (1.0 if law is shaped else 1.2) * unit.optimal_fiber_length
    slack = evaluate(unit, 0.5, 0.8 * unit.tendon_slack_length, -0.1, now)
    assert not np.any([slack.muscle_power, slack.tendon_power, slack.tendon_energy])
    assert slack.active_power[0] > 0.0
    assert abs(slack.fiber_power[0]) < 1e-12 * slack.active_power[0]
    rigid = replace(unit, tendon="rigid")
    short = evaluate(rigid, 0.5, 0.9 * unit.tendon_slack_length, -0.1)
    for field in fields(short):
        if field.name != "fiber_energy":
            assert not np.any(getattr(short, field.name)), field.name

    bare = replace(unit, fiber_damping=0.0)
    fiber = np.array([0.9 * unit.optimal_fiber_length])
    height = unit.optimal_fiber_length * np.sin(unit.pennation_angle)
    strained = 1.06 * unit.tendon_slack_length + np.sqrt(fiber**2 - height**2)
    fast = evaluate(bare, 1e-3, strained, 0.2, fiber)
    assert abs(fast.unbalanced_power[0]) > 1.0
    assert fast.fiber_power[0] + fast.tendon_power[0] + fast.unbalanced_power[0] == pytest.approx(
        fast.muscle_power[0], rel=1e-12
    )


def test_muscles_without_fibers_have_the_power_at_their_ends_only() -> None:
    """Tension of a path actuator is its activation times its force; a muscle of MuJoCo's has the kernel's tension."""
    prm = (0.75, 1.05, 800.0, 200.0, 0.5, 1.6, 1.5, 1.3, 1.2)
    laws = [mw.PathActuator(200.0), mw.MuJoCoMuscle(prm, (0.2, 0.35), acc0=1.0)]
    code, params = rows(laws)
    length, speed, activation = np.array([0.3, 0.3]), np.array([-0.2, 0.1]), np.array([0.5, 0.5])
    constants = metabolic_constants(mw.Umberger2010(), code, params)
    e = compute_energetics(code, params, activation, activation, length, speed, np.zeros(2), constants)
    pull = muscle_kernel.tension(code[1], params, 1, 0.5, 0.3, 0.1)
    assert pull > 0.0
    assert e.muscle_power == pytest.approx([0.5 * 200.0 * 0.2, -0.1 * pull], rel=1e-15)
    for field in fields(e):
        assert field.name == "muscle_power" or not np.any(getattr(e, field.name)), field.name


# ---------------------------------------------------------------------------------------- stored energies


@EACH_LAW
def test_energies_have_the_forces_as_slopes(law: Any) -> None:
    """The error of central differences falls 4 times when the step is halved, over toe, corners and straight parts."""
    unit = law(1000.0, 0.1, 0.2, 0.0, tendon="elastic", minimum_activation=0.0)
    _, params = rows([unit])
    strain = np.array([-0.03, -0.01, 0.004, 0.011, 0.02, 0.03, 0.06, 0.2])
    fiber = 0.1 * np.array([0.5, 0.8, 1.02, 1.2, 1.5, 1.65, 1.9, 2.5])
    pull = [fiber_kernel.tendon_force(unit.code, params, 0, 0.2 * (1.0 + s) + 0.05, 0.05) for s in strain]
    passive = [fiber_kernel.fiber_force(unit.code, params, 0, 0.0, f, 0.0) for f in fiber]

    def tendon_energy(x: Vector) -> Vector:
        return evaluate(unit, 0.0, 0.05 + x, 0.0, 0.05).tendon_energy

    def fiber_energy(x: Vector) -> Vector:
        return evaluate(unit, 0.0, 0.3, 0.0, x).fiber_energy

    for energy, x, force, steps in (
        (tendon_energy, 0.2 * (1.0 + strain), np.array(pull), (2e-5, 1e-5)),
        (fiber_energy, fiber, np.array(passive), (2e-4, 1e-4)),
    ):
        coarse, fine = (np.abs((energy(x + h) - energy(x - h)) / (2.0 * h) - force) for h in steps)
        rounding = 1e-9 * unit.max_isometric_force
        assert np.all(fine <= np.maximum(coarse / 3.5, rounding))
        assert np.all(coarse <= 1e-4 * force + 1e-5 * unit.max_isometric_force)
        assert coarse.max() > 10.0 * rounding
        assert np.all(energy(x) >= 0.0)
        assert not np.any(energy(x)[force == 0.0])


@EACH_LAW
def test_energies_are_the_integrals_of_the_curves(law: Any) -> None:
    """To rounding, against SciPy's quadrature of the force curves, piece by piece where Millard's are (1e-14 of 1)."""
    code, params = rows([law(1000.0, 0.1, 0.2)])
    code, strain = curve_set(code[0], params, 0), np.linspace(0.0, 0.15, 31)
    free, breaks, tendon_breaks = {
        mw.DeGrooteFregly2016: (0.2, [], []),
        mw.Millard2012: (1.0, [1.035, 1.7], [1.02, 1.04]),
        mw.Thelen2003: (1.0, [], [1.0 + thelen.tendon_constants(0.04)[0]]),
        shaped: (0.95, [0.97, 1.55], [1.0225, 1.05]),
    }[law]
    for energy, curve, start, ends, corners in (
        (
            kernel.passive_energy,
            lambda x: fiber_kernel.length_curves(code, x)[2],
            free,
            free + 8.0 * strain,
            breaks,
        ),
        (
            kernel.tendon_energy,
            lambda x: fiber_kernel.tendon_curve(code, x)[0],
            1.0,
            1.0 + strain,
            tendon_breaks,
        ),
    ):
        for x in ends:
            bounds = [start, *(c for c in corners if c < x), x]
            pieces = [
                quad(curve, a, b, epsabs=1e-15, epsrel=1e-13, limit=200)[0]
                for a, b in itertools.pairwise(bounds)
            ]
            assert energy(code, x) == pytest.approx(sum(pieces), rel=1e-12, abs=1e-14)


def test_energies_meet_opensim() -> None:
    """De Groote-Fregly only, whose integrals OpenSim has in closed form too; they cancel to 1e-15 near their zeros."""
    passive, tendon = table("ref_dgf_curves_length"), table("ref_dgf_curves_tendon")
    code = mw.DeGrooteFregly2016.code
    for x, wanted in zip(passive["norm_fiber_length"], passive["int_fpe"], strict=True):
        assert kernel.passive_energy(code, x) == pytest.approx(wanted, rel=1e-12, abs=1e-14)
    for x, wanted in zip(tendon["norm_tendon_length"], tendon["int_fse"], strict=True):
        assert kernel.tendon_energy(code, x) == pytest.approx(
            wanted if x > 1.0 else 0.0, rel=1e-11, abs=1e-14
        )


@EACH_LAW
@pytest.mark.parametrize("sizes", SIZES)
def test_work_over_a_cycle_balances(law: Any, sizes: str) -> None:
    """Integrals of the powers against the energies, within 1e-6 of the work done: a sine of the length, always active.

    The fibre length and five integrals are one system for an explicit integrator with error control.
    """
    unit = law(*SIZES[sizes], fiber_damping=0.1, tendon="elastic")
    code, params = rows([unit])
    optimal, slack = unit.optimal_fiber_length, unit.tendon_slack_length
    constants = metabolic_constants(None, code, params)
    swing, pulse = 0.3 * optimal, 2.0 * np.pi * 2.0
    middle = slack * 1.02 + optimal * np.cos(unit.pennation_angle)

    def inputs(t: float) -> tuple[float, float, float]:
        activation = 0.5 + 0.4 * np.sin(pulse * t + 1.0)
        return activation, middle + swing * np.sin(pulse * t), swing * pulse * np.cos(pulse * t)

    def at(t: float, fiber: float) -> Energetics:
        activation, length, speed = (np.array([value]) for value in inputs(t))
        return compute_energetics(
            code, params, activation, activation, length, speed, np.array([fiber]), constants
        )

    def rates(t: float, state: Vector) -> list[float]:
        e = at(t, state[0])
        activation, length, speed = inputs(t)
        velocity = fiber_kernel.fiber_rate(unit.code, params, 0, activation, length, state[0])
        pull = fiber_kernel.tendon_force(unit.code, params, 0, length, state[0])
        powers = (e.active_power, e.passive_power, e.damping_power, e.tendon_power)
        return [velocity, -pull * speed, *(power[0] for power in powers)]

    start, _, _ = fiber_kernel.equilibrium(unit.code, params, 0, inputs(0.0)[0], middle)
    scale = unit.max_isometric_force * optimal
    run = solve_ivp(
        rates, (0.0, 0.5), [start, 0.0, 0.0, 0.0, 0.0, 0.0], method="RK45", rtol=1e-10,
        atol=1e-10 * np.array([optimal, *[scale] * 5]), max_step=0.01,
    )  # fmt: skip
    fiber, muscle, active, passive, damping, tendon = run.y
    first, last = at(0.0, fiber[0]), at(0.5, fiber[-1])
    tendon_energy = np.array([at(t, f).tendon_energy[0] for t, f in zip(run.t, fiber, strict=True)])
    fiber_energy = np.array([at(t, f).fiber_energy[0] for t, f in zip(run.t, fiber, strict=True)])
    work = 1e-6 * max(np.ptp(muscle), np.ptp(active))
    assert np.all(np.abs(tendon + tendon_energy - first.tendon_energy) < work)
    assert np.all(np.abs(passive + fiber_energy - first.fiber_energy) < work)
    assert np.all(np.abs(muscle - active - passive - damping - tendon) < work)
    stored = last.tendon_energy + last.fiber_energy - first.tendon_energy - first.fiber_energy
    assert muscle[-1] + stored[0] == pytest.approx(active[-1] + damping[-1], abs=work)
    assert np.ptp(tendon_energy) > 0.01 * scale * slack / (slack + optimal)  # springs took part
    assert np.ptp(fiber_energy) > 1e-3 * scale
    assert damping[-1] < 0.0
