"""Properties of every muscle with a fibre, for both laws, in realistic and extreme sizes."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest
from hill_tables import EVERY_LAW, LAWS, row
from mjcf_reading import Vector

from mjwrap.kernels.musculotendon import activation_dynamics as dynamics
from mjwrap.kernels.musculotendon import bezier, degroote_fregly, equilibrium, fiber, millard, thelen
from mjwrap.kernels.musculotendon.dispatch import curve_set

# F_max [N], l_o [m], l_s [m], pennation [rad], v_max [l_o/s], damping
MUSCLES = {
    "parallel": (1000.0, 0.10, 0.20, 0.0, 10.0, 0.1),
    "soleus": (3549.0, 0.05, 0.25, math.radians(25), 10.0, 0.1),
    "short tendon": (600.0, 0.12, 0.03, math.radians(8), 10.0, 0.1),
    "long tendon": (1600.0, 0.055, 0.39, math.radians(10), 10.0, 0.1),
}
EXTREMES = {
    "tendon of a hundredth": (500.0, 0.1, 0.001, 0.0, 10.0, 0.1),
    "tendon of twelve": (500.0, 0.03, 0.36, math.radians(20), 10.0, 0.1),
    "pennation 30, little damping": (2000.0, 0.06, 0.18, math.radians(30), 12.0, 0.01),
    "pennation 60": (2000.0, 0.06, 0.06, math.radians(60), 8.0, 0.1),
    "pennation 80, little damping": (2000.0, 0.06, 0.3, math.radians(80), 10.0, 0.01),
    "short tendon, little damping": (800.0, 0.2, 0.01, 0.0, 20.0, 0.01),
}
EACH = pytest.mark.parametrize(("law", "sizes"), [(n, s) for n in EVERY_LAW for s in (*MUSCLES, *EXTREMES)])
# Thelen's force-velocity curve has a corner at rest, so that a rest there has no single rate
SMOOTH_AT_REST = pytest.mark.parametrize(
    ("law", "sizes"), [(n, s) for n in (*LAWS, "shaped") for s in MUSCLES]
)
EACH_MUSCLE = pytest.mark.parametrize(("law", "sizes"), [(n, s) for n in EVERY_LAW for s in MUSCLES])
BALANCE = 1e-8  # [F_max] imbalance of tendon and fibre that the project allows
FASTEST = 99.0  # [v_max l_o] a fibre's velocity is bounded by 100


def make(law: str, sizes: str) -> tuple[int, Vector]:
    """Return the code and the parameters (1, PARAMS) of a muscle with an elastic tendon."""
    values = (MUSCLES | EXTREMES)[sizes]
    made = EVERY_LAW[law](*values[:5], fiber_damping=values[5], tendon="elastic")
    assert made.states == 2
    return made.code, row(made)


def unit_length(params: Vector, x: float, stretch: float) -> float:
    """Return the length [m] of a unit whose fibre is x [m] and whose tendon is `stretch` slack lengths long."""
    return math.sqrt(x * x - params[0, fiber.HEIGHT] ** 2) + stretch * params[0, fiber.SLACK]


def states(params: Vector, count: int, seed: int) -> Iterator[tuple[float, float, float, float]]:
    """Yield activation, fibre length [m], unit's length [m] and step [s]: slack and stretched, slow and fast."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        a = float(np.clip(rng.uniform(-0.1, 1.1), 0.0, 1.0))
        x = max(rng.uniform(0.3, 1.8) * params[0, fiber.OPTIMAL], params[0, fiber.LEAST])
        yield a, float(x), unit_length(params, x, rng.uniform(0.98, 1.06)), float(10.0 ** rng.uniform(-5, -1))


def step(
    code: int,
    params: Vector,
    before: tuple[float, float],
    now: tuple[float, float],
    x: float,
    duration: float,
) -> tuple[float, float, int, int]:
    """Return what `step_fiber` does between two pairs of activation and length, with constant rates between them."""
    rates = [(now[i] - before[i]) / duration for i in (0, 1)]
    return fiber.step_fiber(
        code, params, 0, before[0], now[0], rates[0], before[1], now[1], rates[1], x, duration
    )


# ------------------------------------------------------------------------------------- any finite input


@EACH
def test_finite_input_gives_a_finite_tension_that_pulls(law: str, sizes: str) -> None:
    """Also without any sense: units shorter than nothing, fibres of no length, steps of a year."""
    code, params = make(law, sizes)
    rng = np.random.default_rng(1)
    odd = np.array([-1e6, -1.0, 0.0, 1e-12, 0.03, 0.2, 1.0, 1e6])
    for _ in range(2000):
        a, a_before = rng.uniform(-1.0, 2.0, 2)
        length, length_before, x = (float(v) for v in rng.choice(odd, 3))
        rate, speed = (float(v) for v in rng.normal(size=2) * 10.0 ** rng.uniform(-3, 5, 2))
        duration = float(10.0 ** rng.uniform(-9, 7.5)) * bool(rng.random() < 0.95)
        for new, tension, _, status in (
            fiber.step_fiber(code, params, 0, a_before, a, rate, length_before, length, speed, x, duration),
            fiber.advance_fiber(code, params, 0, a, length, x, duration),
        ):
            assert math.isfinite(new)
            assert 0.0 <= tension < math.inf
            assert status != equilibrium.NOT_CONVERGED
        new, _, status = fiber.equilibrium(code, params, 0, a, length)
        assert math.isfinite(new)
        assert status != equilibrium.NOT_CONVERGED
        assert math.isfinite(fiber.fiber_rate(code, params, 0, a, length, max(x, 1e-12)))
        assert 0.0 <= fiber.rigid_tension(code, params, 0, a, length, speed) < math.inf


@pytest.mark.parametrize("law", EVERY_LAW)
def test_no_tendon_at_all(law: str) -> None:
    """With a slack length of zero the tendon is rigid, and the unit is the fibre."""
    made = EVERY_LAW[law](500.0, 0.1, 0.0, 0.3, fiber_damping=0.1, tendon="elastic")
    params = row(made)
    height = 0.1 * math.sin(0.3)
    for a, x, length, duration in states(params, 200, 2):
        speed = (length - 0.9 * length) / duration
        new, tension, _, _ = step(made.code, params, (a, 0.9 * length), (a, length), x, duration)
        assert new == pytest.approx(math.hypot(length, height), rel=1e-15)
        v = (new - x) / duration
        wanted = max(fiber.fiber_force(made.code, params, 0, a, new, v), 0.0)
        assert tension == pytest.approx(wanted, rel=1e-14)
        rigid = max(fiber.fiber_force(made.code, params, 0, a, new, speed * length / new), 0.0)
        assert fiber.rigid_tension(made.code, params, 0, a, length, speed) == pytest.approx(rigid, rel=1e-12)


# --------------------------------------------------------------------------------------------- balance


@EACH
def test_tendon_and_fibre_balance_at_rest(law: str, sizes: str) -> None:
    """At 20 activations and 40 lengths, from a slack tendon to a fibre of 1.6 optimal lengths."""
    code, params = make(law, sizes)
    limit = BALANCE * params[0, fiber.F_MAX]
    low, high = max(0.45 * params[0, fiber.OPTIMAL], params[0, fiber.LEAST]), 1.6 * params[0, fiber.OPTIMAL]
    at_minimum = 0
    for length in np.linspace(unit_length(params, low, 0.95), unit_length(params, high, 1.02), 40):
        for a in np.linspace(0.0, 1.0, 20):
            x, _, status = fiber.equilibrium(code, params, 0, float(a), float(length))
            tension = fiber.tendon_force(code, params, 0, float(length), x)
            force = fiber.fiber_force(code, params, 0, float(a), x, 0.0)
            if status == fiber.AT_MINIMUM:
                at_minimum += 1
                assert x == pytest.approx(params[0, fiber.LEAST], rel=1e-14)
                assert force >= tension - limit
            else:
                assert abs(tension - force) <= limit
    assert at_minimum < 500


@EACH
def test_tendon_and_fibre_balance_after_a_step(law: str, sizes: str) -> None:
    """Backward Euler's fibre with its own velocity; either method's with the velocity that `fiber_rate` gives."""
    code, params = make(law, sizes)
    limit, scale = BALANCE * params[0, fiber.F_MAX], params[0, fiber.V_MAX] * params[0, fiber.OPTIMAL]
    rng = np.random.default_rng(3)
    balanced = 0
    for a, x, length, duration in states(params, 1500, 4):
        a_before = float(np.clip(a + rng.normal(0.0, 0.1), 0.0, 1.0))
        before = length + float(rng.uniform(-5.0, 5.0)) * params[0, fiber.OPTIMAL] * duration
        third = step(code, params, (a_before, before), (a, length), x, duration)
        euler = fiber.advance_fiber(code, params, 0, a, length, x, duration)
        for new, tension, _, status in (third, euler):
            assert abs(tension - fiber.tendon_force(code, params, 0, length, new)) <= limit
            assert new >= params[0, fiber.LEAST] * (1.0 - 1e-15)
            v = fiber.fiber_rate(code, params, 0, a, length, new)
            if status != fiber.AT_MINIMUM and abs(v) < FASTEST * scale:
                balanced += 1
                assert abs(tension - fiber.fiber_force(code, params, 0, a, new, v)) <= limit
        new, tension, _, status = euler
        if status != fiber.AT_MINIMUM:
            force = fiber.fiber_force(code, params, 0, a, new, (new - x) / duration)
            assert abs(tension - force) <= limit
    assert balanced > 1500


@EACH_MUSCLE
@pytest.mark.parametrize("duration", [2e-3, 5e-3])
def test_evaluations_of_a_simulation(law: str, sizes: str, duration: float) -> None:
    """At most ten a step under excitations that jump at random, and fibres driven over their range."""
    code, params = make(law, sizes)
    rng = np.random.default_rng(5)
    optimal, u, a, count = params[0, fiber.OPTIMAL], 0.5, 0.5, []
    phases = rng.uniform(0.0, 2.0 * math.pi, 3)

    def length_at(time: float) -> float:
        waves = sum(math.sin((2.0 + 4.0 * i) * time + phases[i]) / (1 + i) for i in range(3))
        return unit_length(params, optimal * (0.9 + 0.2 * waves), 1.02)

    x, _, _ = fiber.equilibrium(code, params, 0, a, length_at(0.0))
    for k in range(2000):
        if rng.random() < 0.03:
            u = float(rng.choice([0.0, 1.0, rng.random()]))
        new = dynamics.advance_activation(a, u, 0.01, 0.04, duration)
        rate = dynamics.zajac_rate(u, new, 0.01, 0.04)
        ends = length_at(k * duration), length_at((k + 1) * duration)
        speed = (length_at((k + 1) * duration + 1e-6) - length_at((k + 1) * duration - 1e-6)) / 2e-6
        x, _, evaluations, status = fiber.step_fiber(
            code, params, 0, a, new, rate, ends[0], ends[1], speed, x, duration
        )
        assert status != equilibrium.NOT_CONVERGED
        count.append(evaluations)
        a = new
    assert max(count) <= 10
    assert np.mean(count) < 3.5


# -------------------------------------------------------------------------------- monotone in activation


@EACH
def test_more_activation_pulls_harder(law: str, sizes: str) -> None:
    """At rest everywhere; moving where the fibre shortens slower than v_max, from where De Groote's f_v is negative.

    Thelen's only from the least activation's v_max to rest: its curve is narrower at less activation, so that a fast
    stretch can pull harder.
    """
    slowest, most = {"thelen": (-0.24, 0.0)}.get(law, (-0.95, 1.0))  # [v_max l_o]
    code, params = make(law, sizes)
    fastest = params[0, fiber.V_MAX] * params[0, fiber.OPTIMAL]
    activations = [float(a) for a in np.linspace(0.0, 1.0, 12)]
    rng = np.random.default_rng(6)
    rounding = 1e-12 * params[0, fiber.F_MAX]
    for _, x, length, duration in states(params, 60, 7):
        speed = float(rng.uniform(slowest, most)) * fastest
        rigid = [fiber.rigid_tension(code, params, 0, a, length, speed) for a in activations]
        assert np.diff(rigid).min() >= -rounding
        rest = [fiber.equilibrium(code, params, 0, a, length)[0] for a in activations]
        assert np.diff([fiber.tendon_force(code, params, 0, length, r) for r in rest]).min() >= -rounding
        after = [fiber.advance_fiber(code, params, 0, a, length, x, duration) for a in activations]
        speeds = [(one[0] - x) / duration / fastest for one in after]
        slow = [
            one
            for one, v in zip(after, speeds, strict=True)
            if slowest < v and (v <= most or law != "thelen")
        ]
        assert len(slow) < 2 or np.diff([one[1] for one in slow]).min() >= -BALANCE * params[0, fiber.F_MAX]


# -------------------------------------------------------------------------------------------- derivatives


@pytest.mark.parametrize("curve", ["active", "passive", "velocity", "tendon"])
@pytest.mark.parametrize("law", LAWS)
def test_slopes_of_curves(law: str, curve: str) -> None:
    """Differences come to the slope at second order; Millard's pieces meet in value and slope."""
    function = getattr({"dgf": degroote_fregly, "millard": millard}[law], curve)
    low, high = {"velocity": (-0.99, 0.99), "tendon": (1.0005, 1.06)}.get(curve, (0.46, 1.7))
    spread = high - low
    at = np.random.default_rng(8).uniform(low + 0.01 * spread, high - 0.01 * spread, 400)

    def off(h: float) -> list[float]:
        return [
            (function(x + h)[0] - function(x - h)[0]) / (2.0 * h) - function(x)[1] for x in map(float, at)
        ]

    coarse, fine = (np.abs(off(h)) for h in (2e-3 * spread, 1e-3 * spread))
    telling = coarse > 1e-9
    assert telling.sum() > 50
    assert np.median(coarse[telling] / fine[telling]) == pytest.approx(4.0, rel=0.02)


@pytest.mark.parametrize("curve", ["ACTIVE", "VELOCITY", "PASSIVE", "TENDON"])
def test_tables_of_bezier_curves(curve: str) -> None:
    """The polynomials against x(u) inverted by bisection, also where two of them meet; the straight lines outside."""
    corners, pieces, cells = (getattr(millard, f"_{curve}{part}") for part in ("", "_PIECES", "_CELLS"))
    ends = pieces[1:-1, bezier.MIDDLE, None] + np.array([-1.0, 1.0]) / pieces[1:-1, bezier.SCALE, None]
    assert ends[1:, 0] == pytest.approx(ends[:-1, 1], rel=0, abs=4e-16 * np.abs(ends).max())
    low, high = ends[0, 0], ends[-1, 1]
    tips = ends.ravel()[1:-1]
    at = np.concatenate([np.random.default_rng(12).uniform(low, high, 500), tips, np.nextafter(tips, low)])
    for x in map(float, at):
        corner = corners[max(np.searchsorted(corners[:, bezier.X0], x, side="right") - 1, 0)]
        below, above = 0.0, 1.0
        for _ in range(60):
            u = 0.5 * (below + above)
            part = bezier.blend(corner[bezier.XQ], corner[bezier.XR], u)[0]
            below, above = (u, above) if corner[bezier.X0] + corner[bezier.DX] * part < x else (below, u)
        y, up = bezier.blend(corner[bezier.YQ], corner[bezier.YR], u)
        across = bezier.blend(corner[bezier.XQ], corner[bezier.XR], u)[1]
        slope = corner[bezier.DY] * up / (corner[bezier.DX] * across)
        found = bezier.evaluate(pieces, cells, x)
        assert found[0] == pytest.approx(corner[bezier.Y0] + corner[bezier.DY] * y, rel=0, abs=1e-12)
        assert found[1] == pytest.approx(slope, rel=1e-9, abs=1e-12)
    for x, end in ((low, low - 0.3), (high, high + 0.3)):
        there, beyond = bezier.evaluate(pieces, cells, x), bezier.evaluate(pieces, cells, end)
        assert beyond[0] == pytest.approx(there[0] + there[1] * (end - x), abs=1e-13)
        assert beyond[1] == pytest.approx(there[1], abs=1e-13)


@EACH
def test_slopes_of_the_balance(law: str, sizes: str) -> None:
    code, params = make(law, sizes)
    curves = curve_set(code, params, 0)
    optimal, slack = params[0, fiber.OPTIMAL], params[0, fiber.SLACK]
    height, ratio, damping = params[0, fiber.HEIGHT] / optimal, optimal / slack, params[0, fiber.DAMPING]
    rng = np.random.default_rng(9)
    ratios = []
    for _ in range(100):
        a, v = float(rng.uniform(0.05, 0.95)), float(rng.uniform(-0.8, 0.8))
        x = float(rng.uniform(max(0.6, 1.02 * height, params[0, fiber.LEAST] / optimal + 0.01), 1.5))
        stretch = float(rng.uniform(1.005, 1.05))
        if law == "thelen" and (
            abs(v) < 1e-3 or abs(stretch - thelen.tendon_constants(0.04)[0] - 1.0) < 1e-3
        ):
            continue  # its curves have a corner, or a jump of their second derivative, there
        reach = stretch + ratio * math.sqrt(x * x - height * height)
        at = np.array([reach, x, a, v])

        def both(at: Vector) -> Vector:
            found = equilibrium.forces(curves, at[2], damping, height, ratio, at[0], at[1], at[3])
            return np.array([found[0], found[2]])

        _, d_pull, _, d_force, stiffness, strength, drag = equilibrium.forces(
            curves, a, damping, height, ratio, reach, x, v
        )
        known = np.array([[stiffness, 0.0], [d_pull, d_force], [0.0, strength], [0.0, drag]])
        off = []
        for h in (2e-4, 1e-4):
            found = []
            for i in range(4):
                move = np.zeros(4)
                move[i] = h * min(1.0, 1.0 / ratio if i == 1 else 1.0)
                found.append((both(at + move) - both(at - move)) / (2.0 * move[i]))
            off.append(np.abs(np.array(found) - known))
        assert off[1].max() <= 1e-3 * (1.0 + np.abs(known).max())
        telling = off[0] > 1e-8 * (1.0 + np.abs(known))
        ratios += list((off[0][telling] / off[1][telling]).ravel())
    assert len(ratios) > 100
    assert np.median(ratios) == pytest.approx(4.0, rel=0.02)


# -------------------------------------------------------------------------------------- the step of the fibre


@EACH
def test_long_steps_end_at_rest(law: str, sizes: str) -> None:
    """Step by step and at once, from any fibre: below 1.1 optimal lengths there is one equilibrium."""
    code, params = make(law, sizes)
    force, optimal = params[0, fiber.F_MAX], params[0, fiber.OPTIMAL]
    rng = np.random.default_rng(10)
    tested = 0
    for a, x, _, _ in states(params, 60, 11):
        a = 0.1 + 0.9 * a
        low = max(0.5 * optimal, params[0, fiber.LEAST])
        length = unit_length(params, float(rng.uniform(low, max(1.1 * optimal, 1.05 * low))), 1.03)
        rest, _, status = fiber.equilibrium(code, params, 0, a, length)
        if status != fiber.NORMAL or rest > 1.1 * optimal:
            continue
        tested += 1
        tension = fiber.tendon_force(code, params, 0, length, rest)
        at_once = step(code, params, (a, length), (a, length), x, 1e6)
        assert abs(at_once[1] - tension) <= 1e-5 * force
        for _ in range(60):
            x, pull, _, _ = step(code, params, (a, length), (a, length), x, 0.1)
        assert abs(pull - tension) <= 1e-6 * force
    assert tested > 10


@SMOOTH_AT_REST
def test_the_factor_of_a_small_disturbance(law: str, sizes: str) -> None:
    """(1 + z/3) / (1 − 2z/3 + z²/6), z = λ duration, of a fibre 1e-6 optimal lengths from rest; λ by differences."""
    code, params = make(law, sizes)
    optimal, a = params[0, fiber.OPTIMAL], 0.4
    length = unit_length(params, 0.8 * optimal, 1.03)
    rest, _, _ = fiber.equilibrium(code, params, 0, a, length)
    apart = 1e-6 * optimal
    beside = [fiber.fiber_rate(code, params, 0, a, length, rest + s) for s in (apart, -apart)]
    growth = (beside[0] - beside[1]) / (2.0 * apart)
    assert growth < 0.0
    for z in (-0.1, -1.0, -3.0, -10.0, -100.0, -1e4):
        news = [
            step(code, params, (a, length), (a, length), rest + s, z / growth)[0] for s in (apart, -apart)
        ]
        factor = (1.0 + z / 3.0) / (1.0 - 2.0 * z / 3.0 + z * z / 6.0)
        assert (news[0] - news[1]) / (2.0 * apart) == pytest.approx(factor, abs=1e-4)


@pytest.mark.parametrize("law", EVERY_LAW)
@pytest.mark.parametrize("sizes", ["parallel", "soleus"])
def test_order_of_the_step(law: str, sizes: str) -> None:
    """Against Runge and Kutta's classic method on `fiber_rate` at 10 us, which knows no step of ours."""
    code, params = make(law, sizes)
    optimal, end = params[0, fiber.OPTIMAL], 0.096

    def signals(time: float) -> tuple[float, float, float, float]:
        turn = 2.0 * math.pi * 3.0
        a, rate = 0.45 + 0.3 * math.sin(turn * time), 0.3 * turn * math.cos(turn * time)
        start = unit_length(params, 0.9 * optimal, 1.03)
        return (
            a,
            rate,
            start + 0.1 * optimal * math.sin(turn * time),
            0.1 * optimal * turn * math.cos(turn * time),
        )

    rest, _, _ = fiber.equilibrium(code, params, 0, signals(0.0)[0], signals(0.0)[2])

    def slope(time: float, x: float) -> float:
        a, _, length, _ = signals(time)
        return fiber.fiber_rate(code, params, 0, a, length, x)

    x, h = rest, 1e-5
    for k in range(round(end / h)):
        t = k * h
        k1 = slope(t, x)
        k2 = slope(t + 0.5 * h, x + 0.5 * h * k1)
        k3 = slope(t + 0.5 * h, x + 0.5 * h * k2)
        x += h / 6.0 * (k1 + 2.0 * (k2 + k3) + slope(t + h, x + h * k3))
    errors = []
    for duration in (4e-3, 2e-3, 1e-3, 0.5e-3):
        third = euler = rest
        for k in range(round(end / duration)):
            a_before, _, before, _ = signals(k * duration)
            a, rate, length, speed = signals((k + 1) * duration)
            third, _, _, _ = fiber.step_fiber(
                code, params, 0, a_before, a, rate, before, length, speed, third, duration
            )
            euler, _, _, _ = fiber.advance_fiber(code, params, 0, a, length, euler, duration)
        errors.append((abs(third - x), abs(euler - x)))
    orders = -np.diff(np.log2(np.array(errors)), axis=0)
    if law == "shaped":  # the errors of its shortest steps are those of the balance, 1e-9 optimal lengths
        orders = orders[np.array(errors)[1:, 0] > 2e-9 * optimal]
    assert len(orders) >= 2
    assert orders[:, 0].mean() > 2.6
    assert (
        law in ("millard", "shaped") or orders[:, 0].min() > 2.75
    )  # Millard's curves have two continuous derivatives
    assert orders[1:, 1] == pytest.approx(1.0, abs=0.1)
