"""Muscles against OpenSim 4.6 at frozen random states: Millard's with the curves of files and of our own, Thelen's.

`benchmarks/osim/freeze_muscles.py` made tests/data/osim/muscles.json; it says how.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mjcf_reading import Vector

from mjwrap.kernels.musculotendon import activation_dynamics, fiber
from mjwrap.muscles.laws import LAWS, parameter_row

FROZEN = json.loads((Path(__file__).parent / "data" / "osim" / "muscles.json").read_text())
CLOSE = 1e-7  # [F_max], and of velocities [v_max l_o]
BOUND = 100.0  # [v_max l_o] of a fibre's velocity; OpenSim has none
each_set = pytest.mark.parametrize("name", FROZEN["sets"])


def cases(name: str, tendon: str) -> list[tuple[int, Vector, Vector, Vector, list[float]]]:
    """Return code, parameters (1, PARAMS), states (n, 5), results (n, 5) and time constants of a set's muscles."""
    found = []
    for muscle in FROZEN["sets"][name]:
        given = dict(muscle["parameters"])
        times = given.pop("times")
        kind: Any = LAWS[muscle["law"]]
        law = kind(**given, tendon=tendon)
        states, results = np.array(muscle["states"]), np.array(muscle["results"], dtype=float)
        found.append((law.code, np.array([parameter_row(law)]), states, results, times))
    return found


@each_set
def test_tension_with_a_rigid_tendon(name: str) -> None:
    """OpenSim's may push, where the fibre shortens faster than v_max; a tendon does not.

    OpenSim has no rigid tendon for Thelen's muscle: there the fibre has length and velocity of one with a balanced
    elastic tendon, so that the tension is that one's.
    """
    for code, params, states, results, _ in cases(name, "rigid"):
        if np.isnan(results[:, 0]).all():
            height, slack = params[0, fiber.HEIGHT], params[0, fiber.SLACK]
            along = np.sqrt(states[:, 4] ** 2 - height**2)
            speed = results[:, 3] * states[:, 4] / along
            states, results = states.copy(), results[:, [2]]
            states[:, 2], states[:, 3] = along + slack, speed
        found = [fiber.rigid_tension(code, params, 0, a, length, v) for a, _, length, v, _ in states]
        wanted = np.maximum(results[:, 0], 0.0)
        assert np.isfinite(wanted).all()
        assert np.array(found) / params[0, fiber.F_MAX] == pytest.approx(wanted, abs=CLOSE)


@each_set
def test_tension_at_equilibrium(name: str) -> None:
    told = 0
    for code, params, states, results, _ in cases(name, "elastic"):
        for (a, _, length, _, _), wanted in zip(states, results[:, 1], strict=True):
            x, _, status = fiber.equilibrium(code, params, 0, a, length)
            if np.isnan(wanted) or status == fiber.AT_MINIMUM:
                continue
            told += 1
            found = fiber.tendon_force(code, params, 0, length, x) / params[0, fiber.F_MAX]
            assert found == pytest.approx(wanted, abs=CLOSE)
    assert told > 100


@each_set
def test_tension_and_velocity_at_a_fibre_length(name: str) -> None:
    told = 0
    for code, params, states, results, _ in cases(name, "elastic"):
        fastest = params[0, fiber.V_MAX] * params[0, fiber.OPTIMAL]
        for (a, _, length, _, x), (_, _, tension, velocity, _) in zip(states, results, strict=True):
            if np.isnan(tension):
                continue
            told += 1
            found = fiber.tendon_force(code, params, 0, length, x) / params[0, fiber.F_MAX]
            assert found == pytest.approx(tension, abs=CLOSE)
            v = fiber.fiber_rate(code, params, 0, a, length, x) / fastest
            wanted = np.clip(velocity / fastest, -BOUND, BOUND)
            assert v == pytest.approx(wanted, rel=CLOSE, abs=CLOSE)
    assert told > 150


@each_set
def test_rate_of_activation(name: str) -> None:
    for _, params, states, results, times in cases(name, "elastic"):
        constants, least = np.array([[*times, 10.0]]), params[0, fiber.MIN_ACTIVATION]
        for (a, u, *_), wanted in zip(states, results[:, 4], strict=True):
            if np.isfinite(wanted):
                found = activation_dynamics.rate_above(activation_dynamics.ZAJAC, u, a, constants, 0, least)
                assert found == pytest.approx(wanted, rel=1e-9, abs=1e-9)
