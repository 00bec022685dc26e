"""Metabolic power of muscles: OpenSim's probe met over drawn states, parts that add up, bounds kept."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from muscle_states import EACH_LAW, SIZES, Vector, evaluate, random_states, rows

import mjwrap as mw
from mjwrap.errors import ModelError
from mjwrap.muscles.energetics import metabolic_constants

TABLE = Path(__file__).parent / "data" / "umberger2010.csv"


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
    unit = law(*SIZES["soleus"], fiber_damping=0.1, tendon="elastic", minimum_activation=0.0)
    model = mw.Umberger2010()
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
