"""Energy of muscles: powers balance, energies are the integrals of forces, metabolism meets OpenSim's probe."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import mjwrap as mw
from mjwrap.energetics import Energetics, compute_energetics, metabolic_constants
from mjwrap.errors import ModelError
from mjwrap.kernels import fiber as fiber_kernel
from mjwrap.kernels import muscle as muscle_kernel

Vector = NDArray[np.float64]
TABLE = Path(__file__).parent / "data" / "umberger2010.csv"
EACH_LAW = pytest.mark.parametrize("law", [mw.DeGrooteFregly2016, mw.Millard2012])
SIZES = {  # F_max [N], l_o [m], l_s [m], pennation [rad]
    "parallel": (1000.0, 0.10, 0.20, 0.0),
    "soleus": (3549.0, 0.05, 0.25, 0.436),
    "short_tendon": (600.0, 0.12, 0.03, 0.14),
}


def rows(laws: list[Any]) -> tuple[NDArray[np.int64], Vector]:
    """Laws as the kernels read them: codes (n,) and parameters (n, PARAMS)."""
    params = np.zeros((len(laws), muscle_kernel.PARAMS))
    for m, law in enumerate(laws):
        params[m, : len(law.row())] = law.row()
    return np.array([law.code for law in laws]), params


def evaluate(
    law: Any, activation: Any, length: Any, velocity: Any, fiber: Any = 0.0, **given: Any
) -> Energetics:
    """Energetics of one muscle at many states, each of them given as a number or an array (n,)."""
    excitation, model = given.get("excitation", activation), given.get("model")
    states = np.stack(np.broadcast_arrays(*np.atleast_1d(activation, excitation, length, velocity, fiber)))
    states = states.astype(float)
    code, params = rows([law])
    code, params = np.repeat(code, len(states[0])), np.repeat(params, len(states[0]), axis=0)
    constants = metabolic_constants(model, code, params)
    return compute_energetics(code, params, states[0], states[1], states[2], states[3], states[4], constants)


def random_states(law: Any, count: int, seed: int) -> tuple[Vector, Vector, Vector, Vector]:
    """Activation, length, speed and fibre length: fibres of 0.3 to 1.7 l_o, tendons from slack to 6 % of strain."""
    rng = np.random.default_rng(seed)
    optimal, height = law.optimal_fiber_length, law.optimal_fiber_length * np.sin(law.pennation_angle)
    fiber = rng.uniform(max(0.3, 1.05 * height / optimal), 1.7, count) * optimal
    tendon = law.tendon_slack_length * (1.0 + rng.uniform(-0.02, 0.06, count))
    activation = rng.uniform(0.0, 1.0, count) * (rng.random(count) > 0.1)
    speed = rng.uniform(-8.0, 8.0, count) * optimal
    return activation, np.sqrt(fiber**2 - height**2) + tendon, speed, fiber


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
    slack = evaluate(unit, 0.5, 0.8 * unit.tendon_slack_length, -0.1, 1.2 * unit.optimal_fiber_length)
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
    unit = law(1000.0, 0.1, 0.2, 0.0, tendon="elastic")
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


# -------------------------------------------------------------------------------------------- metabolism


def read_table() -> dict[str, Vector]:
    """OpenSim's probe over drawn states, see tests/umberger_table.py."""
    lines = [line for line in TABLE.read_text().splitlines() if not line.startswith("#")]
    values = np.array([[float(word) for word in line.split(",")] for line in lines[1:]])
    return dict(zip(lines[0].split(","), values.T, strict=True))


def test_metabolic_power_meets_opensim() -> None:
    """From activation, excitation, length and speed on; 1e-9 of the largest of the parts that cancel in a sum."""
    table = read_table()
    count = len(table["total"])
    cancelling = 0
    for i in range(count):
        t = {name: float(column[i]) for name, column in table.items()}
        unit = mw.DeGrooteFregly2016(
            t["max_isometric_force"], t["optimal_fiber_length"], t["tendon_slack_length"], t["pennation"],
            t["max_velocity"], t["damping"],
        )  # fmt: skip
        model = mw.Umberger2010(
            t["slow_twitch_ratio"], aerobic_factor=t["aerobic_factor"], effort=t["effort"],
            recruitment=bool(t["recruitment"]), negative_work=bool(t["negative_work"]),
            forbid_negative_power=bool(t["forbid"]), minimum_heat_rate=t["minimum"],
            mass=None if np.isnan(t["mass"]) else t["mass"],
        )  # fmt: skip
        e = evaluate(
            unit, t["activation"], t["length"], t["velocity"], excitation=t["excitation"], model=model
        )
        both = e.activation_heat[0] + e.maintenance_heat[0]
        rounding = 1e-9 * (both + abs(t["shortening"]) + abs(t["work"]))
        assert e.fiber_velocity[0] == pytest.approx(t["fiber_velocity"], rel=1e-12)
        assert both == pytest.approx(t["activation_maintenance"], rel=1e-9)
        assert e.shortening_heat[0] == pytest.approx(t["shortening"], abs=rounding)
        assert e.mechanical_work[0] == pytest.approx(t["work"], rel=1e-9, abs=1e-30)
        assert e.metabolic_power[0] == pytest.approx(t["total"], abs=rounding)
        cancelling += abs(t["total"]) < 1e-6 * abs(t["work"])
    assert count == 240
    assert cancelling > 5


@EACH_LAW
def test_heats_and_work_add_up_and_keep_their_bounds(law: Any) -> None:
    """The parts are the whole; no muscle wins energy, nor gives less heat than the least rate, 1 W/kg of muscle."""
    unit, model = law(*SIZES["soleus"], fiber_damping=0.1, tendon="elastic"), mw.Umberger2010()
    activation, length, speed, fiber = random_states(unit, 300, seed=3)
    excitation = np.random.default_rng(4).uniform(0.0, 1.0, 300) * (activation > 0.0)
    e = evaluate(unit, activation, length, speed, fiber, excitation=excitation, model=model)
    heat = e.activation_heat + e.maintenance_heat + e.shortening_heat + e.resting_heat
    mass = model.muscle_mass(unit.max_isometric_force, unit.optimal_fiber_length)
    assert mass == pytest.approx(3549.0 / 0.25e6 * 1059.7 * 0.05, rel=1e-15)
    rounding = 1e-13 * (np.abs(e.active_power) + heat)
    assert np.all(np.abs(heat + e.mechanical_work - e.metabolic_power) <= rounding)
    assert np.all(e.metabolic_power >= -rounding)
    assert np.all(heat >= mass * (1.0 - 1e-12))
    idle = (activation == 0.0) & (excitation == 0.0)
    assert np.any(idle)
    assert e.metabolic_power[idle] == pytest.approx(mass, rel=1e-12)
    assert np.any(e.mechanical_work < 0.0)
    assert np.any(e.resting_heat > 0.0)


def test_power_scales_as_its_units_say() -> None:
    """k times the lengths and the speeds: k times the powers [N m/s], energies [N m], and mass; force alike."""
    small = mw.Millard2012(*SIZES["soleus"], tendon="elastic")
    large = replace(
        small,
        max_isometric_force=3.0 * small.max_isometric_force,
        optimal_fiber_length=2.0 * small.optimal_fiber_length,
        tendon_slack_length=2.0 * small.tendon_slack_length,
    )
    activation, length, speed, fiber = random_states(small, 100, seed=5)
    one = evaluate(small, activation, length, speed, fiber, model=mw.Umberger2010())
    six = evaluate(large, activation, 2.0 * length, 2.0 * speed, 2.0 * fiber, model=mw.Umberger2010())
    for field in fields(one):
        factor = 2.0 if field.name == "fiber_velocity" else 6.0
        got, wanted = getattr(six, field.name), factor * getattr(one, field.name)
        assert got == pytest.approx(wanted, rel=1e-9, abs=1e-9 * np.max(np.abs(wanted), initial=1.0)), (
            field.name
        )


def test_one_metabolic_model_for_all_or_one_each() -> None:
    """Named mistakes: a ratio beyond one, a mass of zero, models that are not as many as muscles."""
    code, params = rows([mw.DeGrooteFregly2016(*SIZES["parallel"])] * 2)
    some = metabolic_constants([None, mw.Umberger2010(mass=0.3)], code, params)
    assert not np.any(some[0])
    assert some[1, 0] == 0.3
    with pytest.raises(ModelError, match="1 metabolic models were given for 2 muscles"):
        metabolic_constants([None], code, params)
    mistakes: list[dict[str, Any]] = [
        {"slow_twitch_ratio": 1.1},
        {"mass": 0.0},
        {"effort": np.nan},
        {"density": -1.0},
    ]
    for wrong in mistakes:
        with pytest.raises(ModelError, match=next(iter(wrong))):
            mw.Umberger2010(**wrong)
    assert mw.basal_power(75.0) == pytest.approx(90.0)
