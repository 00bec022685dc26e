"""`compare` and `check` judge a model in millimetres as its twin in metres: their thresholds are the model's own."""

from __future__ import annotations

from collections import Counter

import mujoco
import numpy as np
import pytest
from scaled_models import MILLIMETRES, scaled_twins

from mjwrap.checking import check_model
from mjwrap.comparison import compare_poses, verdict

TWINS = 50


@pytest.mark.slow
def test_twins_in_metres_and_millimetres_get_the_same_verdicts() -> None:
    told: Counter[str] = Counter()
    for seed in range(TWINS):
        found, lengths = [], []
        for text in scaled_twins(seed):
            model = mujoco.MjModel.from_xml_string(text)
            compared = compare_poses(model, samples=9, bases=0)
            verdicts = {
                name: verdict(summary, [j for j in compared.jumps if j.muscle == name]).right
                for name, summary in compared.muscles.items()
            }
            counts = {name: dict(summary.counts) for name, summary in compared.muscles.items()}
            jumps = sorted((j.program, j.muscle, j.sweep, j.cause) for j in compared.jumps)
            checks = {check.name: check.verdict for check in check_model(model, poses=2, samples=9).checks}
            found.append((verdicts, counts, jumps, checks))
            lengths.append(model.tendon_length0.copy())
            # an end inside a surface is the model's own; everything else would blame mjwrap
            assert compared.at_fault == 0, seed
            assert {name for name, each in checks.items() if each == "FAIL"} <= {"model"}, seed
        assert found[0] == found[1], seed
        np.testing.assert_allclose(lengths[1], MILLIMETRES * lengths[0], rtol=1e-9)
        told.update(found[0][0].values())
    assert told["both"] > 0.5 * TWINS
    assert told["mjwrap in motion"] + told["mjwrap"] > 5  # models with faults of MuJoCo are among them


@pytest.mark.parametrize("error", [1e-7, 1e-6])
def test_a_wrong_moment_arm_is_found_in_both_units(error: float, monkeypatch: pytest.MonkeyPatch) -> None:
    from mjwrap.system import MuscleSystem

    right = MuscleSystem.length_jacobian
    monkeypatch.setattr(MuscleSystem, "length_jacobian", lambda self, data: right(self, data) * (1.0 + error))
    for text in scaled_twins(0):
        checks = check_model(mujoco.MjModel.from_xml_string(text), poses=2, samples=9)
        assert "moment_arm" in {check.name for check in checks.failed}
        assert compare_poses(mujoco.MjModel.from_xml_string(text), samples=5, bases=0).at_fault > 0
