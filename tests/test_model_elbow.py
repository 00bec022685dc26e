"""models/elbow against published anatomy, and its native wraps against the closed form."""

import csv
import math

import mujoco
import numpy as np
import pytest
from mjcf_reading import MODELS, OBJ, Vector, elements, load, parameters
from naive_tendon import closed_form_length

ELBOW = MODELS / "elbow" / "elbow.xml"
CONSERVATIVE = MODELS / "elbow" / "elbow_conservative.xml"
ELBOW_RANGE = (0.0, 2.26893)  # [rad]


def test_elbow_tendons_are_true_geodesics_over_the_whole_range() -> None:
    for path in (ELBOW, CONSERVATIVE):
        model, data = load(path)
        for angle in np.linspace(*ELBOW_RANGE, 301):
            data.qpos[0] = angle
            mujoco.mj_forward(model, data)
            for tendon in range(model.ntendon):
                expected = closed_form_length(model, data, tendon)
                assert data.ten_length[tendon] == pytest.approx(expected, abs=1e-14)


# Published moment arms [m], positive in flexion, at degrees of flexion, and how far off the model may be.
# The allowance is the spread between published curves (about 4 mm for one muscle), not a tuning knob.
PIGEON_1996_BICEPS = {30: 0.0291, 60: 0.0419, 90: 0.0483, 110: 0.0466, 130: 0.0384}
PIGEON_1996_TRICEPS = {0: -0.0233, 30: -0.0249, 60: -0.0218, 90: -0.0190, 110: -0.0170, 130: -0.0157}
SUGISAKI_2010_TRICEPS = {30: -0.0239, 110: -0.0174}


def moment_arms(muscle: str, degrees: list[float]) -> Vector:
    model, data = load(ELBOW)
    tendon = model.tendon(f"{muscle}_tendon").id
    arms = []
    for angle in np.radians(degrees):
        lengths = []
        for step in (1e-5, -1e-5):
            data.qpos[0] = angle + step
            mujoco.mj_forward(model, data)
            lengths.append(data.ten_length[tendon])
        arms.append(-(lengths[0] - lengths[1]) / 2e-5)
    return np.array(arms)


@pytest.mark.parametrize(
    ("muscle", "published"),
    [
        ("BIClong", PIGEON_1996_BICEPS),
        ("BICshort", PIGEON_1996_BICEPS),
        ("TRIlong", PIGEON_1996_TRICEPS),
        ("TRIlat", PIGEON_1996_TRICEPS),
        ("TRIlat", SUGISAKI_2010_TRICEPS),
        ("TRImed", SUGISAKI_2010_TRICEPS),
    ],
)
def test_elbow_moment_arms_follow_published_curves(muscle: str, published: dict[float, float]) -> None:
    model_arms = moment_arms(muscle, list(published))
    assert model_arms == pytest.approx(list(published.values()), abs=4e-3)


@pytest.mark.parametrize(
    ("file", "published"),
    [
        ("pigeon_1996.csv", {"BIClong": PIGEON_1996_BICEPS, "TRIlat": PIGEON_1996_TRICEPS}),
        ("sugisaki_2010.csv", {"TRIlong": SUGISAKI_2010_TRICEPS}),
    ],
)
def test_the_tables_of_published_moment_arms_hold_the_published_numbers(
    file: str, published: dict[str, dict[float, float]]
) -> None:
    with (ELBOW.parent / file).open(encoding="utf-8") as text:
        rows = list(csv.DictReader(line for line in text if not line.startswith("#")))
    for muscle, curve in published.items():
        found = {float(row["elbow_flexion [deg]"]): 0.01 * float(row[f"{muscle} [cm]"]) for row in rows}
        assert {angle: found[angle] for angle in curve} == pytest.approx(curve)


@pytest.mark.parametrize(
    ("muscle", "low", "high"),
    [
        ("BIClong", 0.040, 0.055),  # Murray 2000: average peak 4.7 cm
        ("BICshort", 0.040, 0.055),
        ("BRA", 0.020, 0.032),  # Ramsay 2009: peak 3.1 cm
        ("BRD", 0.070, 0.084),  # Murray 2000: average peak 7.7 cm
        ("TRIlong", 0.020, 0.026),  # Murray 2000: 2.3 cm
    ],
)
def test_elbow_peak_moment_arms_are_in_the_published_ranges(muscle: str, low: float, high: float) -> None:
    peak = np.abs(moment_arms(muscle, list(range(0, 131, 2)))).max()
    assert low < peak < high


def test_flexors_flex_and_extensors_extend_everywhere() -> None:
    degrees: list[float] = list(range(0, 131, 5))
    for muscle in ("BIClong", "BICshort", "BRA", "BRD"):
        assert (moment_arms(muscle, degrees) > 0.015).all()
    for muscle in ("TRIlong", "TRIlat", "TRImed"):
        assert (moment_arms(muscle, degrees) < -0.015).all()


def test_elbow_fibres_work_between_half_and_one_and_a_half_optimal_lengths() -> None:
    model, data = load(ELBOW)
    for index in range(model.ntuple):
        values = parameters(model, index)
        (tendon,) = [obj for kind, obj, _ in elements(model, index) if kind == OBJ.mjOBJ_TENDON]
        optimal = values["optimal_fiber_length"]
        for angle in np.linspace(*ELBOW_RANGE, 50):
            data.qpos[0] = angle
            mujoco.mj_forward(model, data)
            along = data.ten_length[tendon] - values["tendon_slack_length"]
            fibre = math.hypot(along, optimal * math.sin(values["pennation_angle"])) / optimal
            assert 0.495 < fibre < 1.5


def test_elbow_at_rest_hangs_slightly_flexed() -> None:
    model, data = load(ELBOW)
    data.qpos[0] = 0.5
    while data.time < 5:
        mujoco.mj_step(model, data)
    assert 5 < math.degrees(data.qpos[0]) < 40
    assert abs(data.qvel[0]) < 0.05


def test_conservative_elbow_keeps_its_energy_natively() -> None:
    """Kinetic + potential + tension × length; 1 µJ of about 10 J is what RK4 at 1 ms was measured to leave."""
    model, data = load(CONSERVATIVE)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    energy, angles = [], []
    while data.time < 5:
        mujoco.mj_forward(model, data)
        energy.append(data.energy.sum() + 100 * data.ten_length[0])
        angles.append(math.degrees(data.qpos[0]))
        mujoco.mj_step(model, data)
    assert np.ptp(energy) < 1e-6
    # the swing crosses the angle at which the muscle leaves the cylinder
    assert min(angles) < 50 < 65 < max(angles)
