"""Muscles with fibres against OpenSim's tables: curves, forces, equilibria, rates and trajectories."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hill_tables import LAWS, SIZES, elastic, row, table, values
from mjcf_reading import Vector

from mjwrap.kernels.musculotendon import activation_dynamics, degroote_fregly, fiber, millard

PRINTED = (
    5e-15  # relative: the tables have 15 significant digits, so half a unit of the last is at worst this
)
ROUNDING = 1e-15  # of sums of terms near one, where the result is near zero
ULP = 2.3e-16  # of arguments near one: how far a printed one may be from the number that OpenSim used
SPLINE = 1e-12  # Millard's curves, ours and OpenSim's splines of u(x): far below the 1e-6 that is asked
CURVE, FORCE, EQUILIBRIUM, RATE = 1e-9, 1e-12, 1e-8, 1e-9  # relative, as the project asks

LENGTH, SPEED = "norm_fiber_length", "norm_fiber_velocity"
CURVES = {
    "active": ("curves_length", LENGTH, "fal", "dfal"),
    "passive": ("curves_length", LENGTH, "fpe", "dfpe"),
    "velocity": ("curves_velocity", SPEED, "fv", "dfv"),
    "tendon": ("curves_tendon", "norm_tendon_length", "fse", "dfse"),
}
KERNELS: dict[str, Any] = {"dgf": degroote_fregly, "millard": millard}
Rows = dict[str, Vector]


# -------------------------------------------------------------------------------------------- curves


@pytest.mark.parametrize("curve", CURVES)
@pytest.mark.parametrize("law", LAWS)
def test_curves_and_their_slopes(law: str, curve: str) -> None:
    """De Groote-Fregly's to the last printed digit; below slack its tendon curve is negative here, as in the table."""
    file, x, y, slope = CURVES[curve]
    known = table(f"ref_{law}_{file}")
    found = values(getattr(KERNELS[law], curve), known[x])
    if law == "dgf" and curve == "velocity":  # OpenSim's table has its inverse in place of the slope
        assert found[:, 0] == pytest.approx(known[y], rel=2 * PRINTED, abs=ROUNDING)
        back = np.array([degroote_fregly.inverse_velocity(float(f)) for f in found[:, 0]])
        assert back == pytest.approx(known["inv_of_fv"], rel=CURVE, abs=1e-14)
        return
    steep = np.abs(known[slope])
    size = 2 * PRINTED * np.abs(known[y]) + ROUNDING if law == "dgf" else np.full(len(steep), SPLINE)
    assert (np.abs(found[:, 0] - known[y]) <= size + ULP * steep).all()
    # slopes change with x too: by at most 50 times their largest value over a unit of x
    assert (np.abs(found[:, 1] - known[slope]) <= CURVE * steep + 50 * ULP * steep.max()).all()


@pytest.mark.parametrize("law", LAWS)
def test_inverse_of_force_velocity(law: str) -> None:
    curves = KERNELS[law]
    v = np.linspace(-0.99, 0.99, 397)
    back = np.array([curves.inverse_velocity(float(f)) for f in values(curves.velocity, v)[:, 0]])
    assert back == pytest.approx(v, abs=1e-12)


# -------------------------------------------------------------------------- forces, equilibria, rates


def each(law: str, known: Rows) -> list[Vector]:
    """Return the kernels' parameters for each row of a table; without damping where it has no column for it."""
    damping = known.get("damping", np.zeros(len(known["params"])))
    keys = [(str(p), float(d)) for p, d in zip(known["params"], damping, strict=True)]
    made = {key: row(elastic(law, *key)) for key in set(keys)}
    return [made[key] for key in keys]


@pytest.mark.parametrize("law", LAWS)
def test_fibre_force(law: str) -> None:
    known = table(f"ref_{law}_elastic_equilibrium")
    code = LAWS[law].code
    columns = (known[key] for key in ("activation", "fiber_length", "fiber_velocity"))
    rows = zip(each(law, known), *columns, strict=True)
    found = np.array([fiber.fiber_force(code, p, 0, a, l, v) for p, a, l, v in rows])
    assert found == pytest.approx(known["fiber_force_along_tendon"], rel=FORCE, abs=0)


@pytest.mark.parametrize("law", LAWS)
def test_rigid_tendon(law: str) -> None:
    """With a rigid tendon as long as OpenSim's stretched one, the fibre is at its length, and pulls as hard."""
    known = table(f"ref_{law}_elastic_equilibrium")
    code = LAWS[law].code
    for i, params in enumerate(each(law, known)):
        params = params.copy()
        params[0, fiber.SLACK] = known["tendon_length"][i]
        speed = float(known["fiber_velocity"][i] / np.cos(known["pennation"][i]))
        found = fiber.rigid_tension(code, params, 0, known["activation"][i], known["mtu_length"][i], speed)
        # the fibre's length is the difference of two printed ones here
        cut = 10 * ULP * known["mtu_length"][i] / params[0, fiber.OPTIMAL] * params[0, fiber.F_MAX]
        assert found == pytest.approx(known["fiber_force_along_tendon"][i], rel=FORCE, abs=cut)


@pytest.mark.parametrize("law", LAWS)
def test_equilibrium(law: str) -> None:
    """OpenSim's fibres still move, at up to 1e-7 of their fastest: ours meet them where they move as fast."""
    known = table(f"ref_{law}_elastic_equilibrium")
    code = LAWS[law].code
    for i, params in enumerate(each(law, known)):
        a, length, there = (float(known[key][i]) for key in ("activation", "mtu_length", "fiber_length"))
        found, count, status = fiber.equilibrium(code, params, 0, a, length)
        assert status == fiber.NORMAL
        assert count < 150
        tension = fiber.tendon_force(code, params, 0, length, found)
        assert fiber.fiber_force(code, params, 0, a, found, 0.0) == pytest.approx(
            tension, rel=1e-9, abs=1e-12
        )
        if law == "dgf":
            params[0, fiber.DAMPING] = 0.0  # OpenSim balances this muscle without it
        assert found == pytest.approx(there, rel=1e-6)
        for _ in range(4):
            rate, *beside = (
                fiber.fiber_rate(code, params, 0, a, length, found + d) for d in (0.0, 1e-9, -1e-9)
            )
            found += (float(known["fiber_velocity"][i]) - rate) * 2e-9 / (beside[0] - beside[1])
        assert found == pytest.approx(there, rel=EQUILIBRIUM)
        here, tension = (fiber.tendon_force(code, params, 0, length, x) for x in (there, found))
        assert here == pytest.approx(known["tendon_force"][i], rel=EQUILIBRIUM)
        left = 2.0 * abs(float(known["residual_norm"][i])) * params[0, fiber.F_MAX]  # of OpenSim's balance
        assert tension == pytest.approx(here, rel=EQUILIBRIUM, abs=left)


def test_damped_rate() -> None:
    """OpenSim's least activation of this muscle is 0.01: its rows for 0 are for that.

    It stops its iteration within about 1e-10 of balance, as its own columns show, which can leave more than 1e-9 of a
    velocity: that much is allowed in those rows, fewer than two in a hundred.
    """
    known = table("ref_millard_damped_rhs")
    loose = 0
    for i, params in enumerate(each("millard", known)):
        a, length, there, v, pull = (
            float(known[key][i])
            for key in ("activation", "mtu_length", "fiber_length", SPEED, "tendon_force")
        )
        a, x = max(a, 0.01), there / params[0, fiber.OPTIMAL]
        assert fiber.tendon_force(millard.CODE, params, 0, length, there) == pytest.approx(
            pull, rel=RATE, abs=1e-10
        )
        assert millard.velocity(v)[0] == pytest.approx(known["fv"][i], abs=SPLINE)
        strength, passive = a * millard.active(x)[0], millard.passive(x)[0]
        cosine = math.sqrt(1.0 - (params[0, fiber.HEIGHT] / there) ** 2)
        off = strength * float(known["fv"][i]) + passive + 0.1 * v - pull / (params[0, fiber.F_MAX] * cosine)
        left = abs(off) / (strength * millard.velocity(v)[1] + 0.1)
        loose += left > RATE * abs(v)
        found = fiber.fiber_rate(millard.CODE, params, 0, a, length, there) / (
            10.0 * params[0, fiber.OPTIMAL]
        )
        assert found == pytest.approx(
            v, rel=RATE, abs=max(1.01 * left if left > RATE * abs(v) else 0.0, 1e-13)
        )
    assert loose < 0.02 * len(known["params"])


def test_explicit_rate_without_damping() -> None:
    known = table("ref_dgf_explicit_rhs")
    assert len(known["params"]) > 1000
    for i, params in enumerate(each("dgf", known)):
        slack = params[0, fiber.SLACK]
        force, length, speed = (
            float(known[key][i]) for key in ("norm_tendon_force", "mtu_length", "mtu_velocity")
        )
        stretch = 1.0 + math.log((force + 0.2) / 0.2) / degroote_fregly.TENDON_STIFFNESS
        along = length - slack * stretch
        here = math.hypot(along, params[0, fiber.HEIGHT])
        rate = fiber.fiber_rate(degroote_fregly.CODE, params, 0, known["activation"][i], length, here)
        slope = degroote_fregly.tendon(stretch)[1]
        found = slope * (speed - rate * here / along) / slack
        assert rate / (10.0 * params[0, fiber.OPTIMAL]) == pytest.approx(known[SPEED][i], rel=RATE)
        assert found == pytest.approx(known["dnorm_tendon_force_dt"][i], rel=RATE)


# -------------------------------------------------------------------------------------- trajectories

ONSET = (
    0.1 + 5.0031e-5
)  # [s] when the excitation of `ref_traj_millard_step` went up: its activation says so, to 1e-8
STEPS = (0.25e-3, 0.5e-3, 1e-3, 2e-3)  # [s]
Signal = Callable[[float], tuple[float, float, float, float]]


def held(time: float, start: float) -> tuple[float, float, float, float]:
    """Return activation, its rate, length and speed of `ref_traj_millard_step`: fixed ends, stepped excitation."""
    if time <= ONSET:
        return 0.05, 0.0, start, 0.0
    a = activation_dynamics.advance_activation(0.05, 0.8, 0.01, 0.04, time - ONSET)
    return a, activation_dynamics.zajac_rate(0.8, a, 0.01, 0.04), start, 0.0


def shaken(time: float, start: float, optimal: float) -> tuple[float, float, float, float]:
    """Return the same of `ref_traj_dgf_sine`."""
    turn = 4.0 * math.pi
    return (
        0.4,
        0.0,
        start + 0.25 * optimal * math.sin(turn * time),
        0.25 * optimal * turn * math.cos(turn * time),
    )


def follow(law: str, sizes: str, duration: float, third: bool) -> float:
    """Return the largest error of tension [F_max] on the way along a trajectory."""
    known = table("ref_traj_dgf_sine" if law == "dgf" else "ref_traj_millard_step")
    mine = known["params"] == sizes
    here: Rows = {key: column[mine] for key, column in known.items()}
    params, code = row(elastic(law, sizes, 0.0 if law == "dgf" else 0.1)), LAWS[law].code
    start, optimal = float(here["mtu_length"][0]), SIZES[sizes][1]
    length = float(here[LENGTH][0]) * optimal
    every, before, error = round(2e-3 / duration), (float(here["activation"][0]), 0.0, start, 0.0), 0.0
    for k in range(1, every * (len(here["time"]) - 1) + 1):
        now = held(k * duration, start) if law == "millard" else shaken(k * duration, start, optimal)
        a, rate, l, speed = now
        if third:
            length, tension, count, status = fiber.step_fiber(
                code, params, 0, before[0], a, rate, before[2], l, speed, length, duration
            )
        else:
            length, tension, count, status = fiber.advance_fiber(code, params, 0, a, l, length, duration)
        assert status == fiber.NORMAL
        assert count <= 10
        if k % every == 0:
            assert a == pytest.approx(here["activation"][k // every], abs=1e-8)
            assert l == pytest.approx(here["mtu_length"][k // every], abs=1e-10)
            error = max(error, abs(tension - float(here["tendon_force"][k // every])) / SIZES[sizes][0])
        before = now
    return error


@pytest.mark.parametrize("sizes", SIZES)
def test_shaken_trajectories(sizes: str) -> None:
    """Third order until the table's own accuracy, about 3e-7 of the maximum force; backward Euler is of first order."""
    errors = [follow("dgf", sizes, h, True) for h in STEPS]
    assert errors[2] < 1e-5
    assert errors[3] / errors[2] > 6.0
    errors = [follow("dgf", sizes, h, False) for h in STEPS]
    assert errors[2] < 2e-3
    assert np.diff(np.log2(errors)) == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("sizes", SIZES)
def test_trajectories_after_a_step_of_excitation(sizes: str) -> None:
    """At 1 ms within 1e-3; the onset lies inside a step, so the order shows only over the whole range."""
    errors = [follow("millard", sizes, h, True) for h in STEPS]
    assert errors[2] < 1e-3
    assert errors[0] < 1e-4
    assert math.log2(errors[3] / errors[0]) / 3 > 1.5
    errors = [follow("millard", sizes, h, False) for h in STEPS]
    assert errors[2] < 6e-3
    assert math.log2(errors[3] / errors[0]) / 3 > 0.75
