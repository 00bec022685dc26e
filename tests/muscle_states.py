"""Muscles with fibres, random states of them, and their energetics at many states at once."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hill_tables import shaped
from numpy.typing import NDArray

import mjwrap as mw
from mjwrap.muscles.energetics import Energetics, compute_energetics, metabolic_constants
from mjwrap.muscles.laws import parameter_row

Vector = NDArray[np.float64]
EACH_LAW = pytest.mark.parametrize(
    "law",
    [mw.DeGrooteFregly2016, mw.Millard2012, mw.Thelen2003, shaped],
    ids=["DeGrooteFregly2016", "Millard2012", "Thelen2003", "shaped"],
)
SIZES = {  # F_max [N], l_o [m], l_s [m], pennation [rad]
    "parallel": (1000.0, 0.10, 0.20, 0.0),
    "soleus": (3549.0, 0.05, 0.25, 0.436),
    "short_tendon": (600.0, 0.12, 0.03, 0.14),
}


def rows(laws: list[Any]) -> tuple[NDArray[np.int64], Vector]:
    """Laws as the kernels read them: codes (n,) and parameters (n, PARAMS)."""
    return np.array([law.code for law in laws]), np.array([parameter_row(law) for law in laws])


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
