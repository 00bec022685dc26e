"""Ligaments and springs along a path: tension, energy and power, by closed formulas and OpenSim's numbers."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from muscle_states import rows
from scipy.integrate import quad

import mjwrap as mw
from mjwrap.kernels.musculotendon import dispatch, tension
from mjwrap.muscles.energetics import Energetics, compute_energetics, metabolic_constants

# OpenSim 4.6's SimmSpline through (0, 0), (1, 0.05), (1.1, 0.3), (1.2, 1): x, value and slope at its last three knots,
# and what its Ligament of 200 N and a resting length of 0.1 m says at lengths [m].
KNOTS = ((1.0, 0.05, 0.587878787878779), (1.1, 0.3, 4.581060606060612), (1.2, 1.0, 9.5878787878788))
PULLS = {
    0.09: 0.0,
    0.1: 0.0,
    0.100001: 10.001176106215508,
    0.115: 117.48295454545439,
    0.12: 200.0,
    0.13: 391.75757575757615,
}
# A curve that dips below zero and rises: x^3 - x^2 about 1, then a straight line.
DIP = (2, 1.5, 1.0, 1.5, 0.0, 0.0, -1.0, 4.0, 0.25, 2.0, 0.0, 0.0)


def spline() -> mw.Ligament:
    """Return a ligament with the pieces of that spline: cubic between two knots, straight after the last."""
    pieces = []
    for (x, y, low), (end, top, high) in itertools.pairwise(KNOTS):
        h, d = end - x, (top - y) / (end - x)
        pieces.append([y, low, (3.0 * d - 2.0 * low - high) / h, (low + high - 2.0 * d) / h**2])
    pieces.append([KNOTS[2][1], KNOTS[2][2], 0.0, 0.0])
    numbers = [3.0, 1.1, 1.2, 1.0, 1.1, 1.2, *(c for piece in pieces for c in piece)]
    return mw.Ligament(200.0, 0.1, numbers)


def pull(law: Any, length: float, speed: float = 0.0) -> float:
    """Return the tension [N] of a law at a length [m] and a lengthening speed [m/s]."""
    code, params = rows([law])
    return tension.tension(code[0], params, 0, 0.7, length, speed)


def books(law: Any, length: Any, speed: Any) -> Energetics:
    """Return the energetics of a law at lengths and speeds, arrays (n,)."""
    n = len(length)
    code, params = rows([law] * n)
    zero = np.zeros(n)
    constants = metabolic_constants(None, code, params)
    return compute_energetics(code, params, zero, zero, length, speed, zero, constants)


def test_a_ligament_pulls_as_opensim_says() -> None:
    law = spline()
    for length, wanted in PULLS.items():
        assert pull(law, length) == pytest.approx(wanted, rel=1e-9, abs=1e-9)


def test_a_ligament_follows_its_pieces_and_does_not_push() -> None:
    law = mw.Ligament(50.0, 0.2, DIP)
    for x in (0.3, 0.999, 1.0, 1.1, 1.2, 1.25, 1.3, 1.49, 1.5, 1.7, 3.0):
        s = x - 1.0
        value = 4.0 * s**3 - s**2 if x < 1.5 else 0.25 + 2.0 * (x - 1.5)
        wanted = 50.0 * max(value, 0.0) if x > 1.0 else 0.0
        assert pull(law, 0.2 * x, 3.0) == pytest.approx(wanted, rel=1e-12, abs=1e-12)


def test_the_energy_of_a_ligament_is_the_integral_of_its_tension() -> None:
    law = mw.Ligament(50.0, 0.2, DIP)
    code, params = rows([law])
    corners = [0.2, 0.25, 0.3]
    for x in np.linspace(0.1, 0.5, 33):
        bounds = [0.1, *(c for c in corners if 0.1 < c < x), x]
        wanted = sum(
            quad(lambda y: pull(law, float(y)), a, b, epsabs=1e-15, epsrel=1e-13)[0]
            for a, b in itertools.pairwise(bounds)
        )
        assert dispatch.fiberless_energy(code[0], params, 0, x) == pytest.approx(wanted, rel=1e-12, abs=1e-13)


def test_a_spring_pulls_as_opensim_says_and_never_pushes() -> None:
    """OpenSim 4.6 gives -3 N at -3 m/s; a string cannot push."""
    law = mw.PathSpring(300.0, 0.1, 0.5)
    told = {(0.09, 0.0): 0.0, (0.100001, 0.0): 3e-4, (0.13, 0.3): 10.35, (0.12, 1.0): 9.0, (0.12, -1.0): 3.0}
    told |= {(0.12, -3.0): 0.0, (0.09, 3.0): 0.0}
    for (length, speed), wanted in told.items():
        assert pull(law, length, speed) == pytest.approx(wanted, rel=1e-12, abs=1e-14)


@pytest.mark.parametrize(
    "law", [mw.PathSpring(300.0, 0.1, 0.5), mw.Ligament(50.0, 0.09, DIP)], ids=["spring", "ligament"]
)
def test_power_is_that_of_the_energy_and_of_the_damping(law: Any) -> None:
    rng = np.random.default_rng(1)
    length, speed = rng.uniform(0.08, 0.2, 200), rng.uniform(-4.0, 4.0, 200)
    e = books(law, length, speed)
    pulls = np.array([pull(law, x, v) for x, v in zip(length, speed, strict=True)])
    assert e.muscle_power == pytest.approx(-pulls * speed, rel=1e-14, abs=1e-14)
    assert e.muscle_power == pytest.approx(e.tendon_power + e.fiber_power, rel=1e-13, abs=1e-12)
    assert np.array_equal(e.fiber_power, e.damping_power)
    assert (e.damping_power <= 1e-12).all()
    h = 1e-6
    slope = (books(law, length + h, speed).tendon_energy - books(law, length - h, speed).tendon_energy) / (
        2.0 * h
    )
    assert e.tendon_power == pytest.approx(-slope * speed, abs=1e-4)
    assert np.ptp(e.tendon_energy) > 0.01
    assert not np.any([e.fiber_energy, e.active_power, e.unbalanced_power, e.metabolic_power])


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: mw.Ligament(0.0, 0.1, DIP), "pcsa_force must be finite and positive"),
        (lambda: mw.Ligament(1.0, -0.1, DIP), "resting_length must be finite and positive"),
        (lambda: mw.Ligament(1.0, 0.1, ()), "must be the number P of pieces"),
        (lambda: mw.Ligament(1.0, 0.1, (2, 1.0, 1.0)), "must be the number P of pieces"),
        (lambda: mw.Ligament(1.0, 0.1, (1, 1.0, 0, 0, 0, 0, 1)), "must be the number P of pieces"),
        (lambda: mw.Ligament(1.0, 0.1, (3, 1.2, 1.1, 0, 0, 0, 1, 1, 1)), "must ascend"),
        (lambda: mw.Ligament(1.0, 0.1, (1, 1.0, np.nan)), "must be a finite number"),
        (lambda: mw.PathSpring(-1.0, 0.1), "stiffness must be finite and positive"),
        (lambda: mw.PathSpring(1.0, -0.1), "resting_length must be finite and >= 0"),
        (lambda: mw.PathSpring(1.0, 0.1, -1.0), "dissipation must be finite and >= 0"),
    ],
)
def test_impossible_parameters_are_refused(make: Any, words: str) -> None:
    with pytest.raises(mw.ModelError, match=words):
        make()
