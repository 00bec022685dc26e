"""De Groote-Fregly 2016 with a rigid tendon: curves against OpenSim's tables, forces against an obvious twin."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from mjcf_reading import Vector

import mjwrap as mw
from mjwrap.kernels import muscle

HILL = Path(__file__).resolve().parents[2] / "shared" / "reference" / "hill"
PRINTED = (
    5e-15  # relative: the tables have 15 significant digits, so half a unit of the last is at worst this
)
ROUNDING = 1e-15  # of sums of terms near one, where the result is near zero
ULP = 2.3e-16  # of arguments near one: how far a printed one may be from the number that OpenSim used
TWIN = 1e-12  # relative: two ways to write the same formula


def table(name: str) -> dict[str, Vector]:
    """Return the columns of a reference table; skip the test where the reference is not there."""
    path = HILL / f"{name}.csv"
    if not path.exists():
        pytest.skip(
            f"the reference table {path.name} is not there; it is kept beside the repository, not in it"
        )
    head = path.read_text().splitlines()[0].split(",")
    texts = np.loadtxt(path, delimiter=",", skiprows=1, dtype=str)
    return {key: texts[:, i] if key == "params" else texts[:, i].astype(float) for i, key in enumerate(head)}


def values(curve: object, at: Vector) -> Vector:
    assert callable(curve)
    return np.array([curve(float(x)) for x in at])


# -------------------------------------------------------------------------------------------- curves

CURVES = {
    "active": (muscle.dgf_active, "ref_dgf_curves_length", "norm_fiber_length", "fal", "dfal"),
    "passive": (muscle.dgf_passive, "ref_dgf_curves_length", "norm_fiber_length", "fpe", "dfpe"),
    "tendon": (muscle.dgf_tendon, "ref_dgf_curves_tendon", "norm_tendon_length", "fse", "dfse"),
}


@pytest.mark.parametrize("name", CURVES)
def test_curves_are_opensims_to_the_last_printed_digit(name: str) -> None:
    curve, file, x, y, slope = CURVES[name]
    known = table(file)
    error = np.abs(values(curve, known[x]) - known[y])
    assert (error <= 2 * PRINTED * np.abs(known[y]) + ROUNDING + ULP * np.abs(known[slope])).all()


@pytest.mark.parametrize("name", CURVES)
def test_slopes_of_curves_are_opensims(name: str) -> None:
    """Central differences of ours meet its printed slopes, with an error that falls at second order."""
    curve, file, x, _, slope = CURVES[name]
    known = table(file)
    at = known[x]

    def error(h: float) -> float:
        return float(np.abs((values(curve, at + h) - values(curve, at - h)) / (2 * h) - known[slope]).max())

    assert error(1e-3) / error(5e-4) == pytest.approx(4.0, rel=0.02)
    assert error(1e-5) < 1e-6 * float(np.abs(known[slope]).max())


def test_force_velocity_is_opensims_and_so_is_its_inverse() -> None:
    known = table("ref_dgf_curves_velocity")
    v, f = known["norm_fiber_velocity"], values(muscle.dgf_velocity, known["norm_fiber_velocity"])
    assert f == pytest.approx(known["fv"], rel=2 * PRINTED, abs=ROUNDING)
    d1, d2, d3, d4 = -0.3211346127989808, -8.149, -0.374, 0.8825327733249912
    assert (np.sinh((f - d4) / d1) - d3) / d2 == pytest.approx(v, abs=1e-14)

    def error(h: float) -> float:
        slope = d1 * d2 / np.sqrt((d2 * v + d3) ** 2 + 1.0)
        quotient = (values(muscle.dgf_velocity, v + h) - values(muscle.dgf_velocity, v - h)) / (2 * h)
        return float(np.abs(quotient - slope).max())

    assert error(1e-3) / error(5e-4) == pytest.approx(4.0, rel=0.02)


def test_landmarks_of_the_curves() -> None:
    """What the constants were chosen for."""
    assert muscle.dgf_passive(0.2) == 0.0
    assert muscle.dgf_passive(1.6) == pytest.approx(1.0, rel=1e-15)
    assert muscle.dgf_tendon(1.0) == 0.0
    assert muscle.dgf_tendon(1.049) == pytest.approx(1.0, rel=1e-13)
    assert muscle.dgf_velocity(0.0) == pytest.approx(1.0, abs=1e-12)
    assert muscle.dgf_velocity(-1.0) == pytest.approx(0.0, abs=1e-12)
    assert muscle.dgf_active(1.0) == pytest.approx(1.0, abs=1e-3)


def test_the_active_curve_goes_smoothly_through_the_zero_of_a_width() -> None:
    """The second term's width vanishes at 0.1495 optimal lengths, where the term itself is gone to all orders."""
    zero = 0.029947116970696 / 0.200356847296188
    x = zero + np.array([-1e-3, -1e-9, 0.0, 1e-9, 1e-3])
    first = 0.8150671134243542 * np.exp(
        -0.5 * ((x - 1.055033428970575) / (0.162384573599574 + 0.063303448465465 * x)) ** 2
    )
    third = 0.1 * np.exp(-0.5 * ((x - 1) / 0.353553390593274) ** 2)
    assert values(muscle.dgf_active, x) == pytest.approx(first + third, rel=1e-14)


# ------------------------------------------------------------------------------- rigid tendon force


def twin(p: mw.DeGrooteFregly2016, a: float, length: float, speed: float) -> float:
    """The slow, obvious version: the equations as printed, in NumPy."""
    b = np.array(
        [
            (0.8150671134243542, 1.055033428970575, 0.162384573599574, 0.063303448465465),
            (0.433004984392647, 0.716775413397760, -0.029947116970696, 0.200356847296188),
            (0.1, 1.0, 0.353553390593274, 0.0),
        ]
    )
    projection = length - p.tendon_slack_length
    if projection <= 0:
        return 0.0
    fibre = np.hypot(projection, p.optimal_fiber_length * np.sin(p.pennation_angle))
    cosine = projection / fibre
    x = fibre / p.optimal_fiber_length
    v = speed * cosine / (p.max_contraction_velocity * p.optimal_fiber_length)
    active = np.sum(b[:, 0] * np.exp(-0.5 * (x - b[:, 1]) ** 2 / (b[:, 2] + b[:, 3] * x) ** 2))
    offset = np.exp(4 * (0.2 - 1) / 0.6)
    passive = (np.exp(4 * (x - 1) / 0.6) - offset) / (np.exp(4) - offset)
    rate = -0.3211346127989808 * np.arcsinh(-8.149 * v - 0.374) + 0.8825327733249912
    return max(p.max_isometric_force * (a * active * rate + passive + p.fiber_damping * v) * cosine, 0.0)


def tension(law: mw.DeGrooteFregly2016 | mw.PathActuator, a: float, length: float, speed: float) -> float:
    params = np.zeros((2, muscle.PARAMS))
    params[1, : len(law.row())] = law.row()
    return muscle.tension(law.code, params, 1, a, length, speed)


def random_muscle(rng: np.random.Generator) -> mw.DeGrooteFregly2016:
    return mw.DeGrooteFregly2016(
        max_isometric_force=rng.uniform(10, 5000),
        optimal_fiber_length=rng.uniform(0.02, 0.3),
        tendon_slack_length=rng.choice([0.0, rng.uniform(0.005, 0.4)]),
        pennation_angle=rng.choice([0.0, rng.uniform(0, 1.2)]),
        max_contraction_velocity=rng.uniform(4, 15),
        fiber_damping=rng.choice([0.0, rng.uniform(0.01, 0.2)]),
    )


def random_length(rng: np.random.Generator, p: mw.DeGrooteFregly2016) -> float:
    return p.tendon_slack_length + p.optimal_fiber_length * rng.uniform(-0.1, 1.7)


def random_speed(rng: np.random.Generator, p: mw.DeGrooteFregly2016, most: float = 1.3) -> float:
    return p.optimal_fiber_length * p.max_contraction_velocity * rng.uniform(-most, most)


def test_tension_is_the_twins() -> None:
    rng = np.random.default_rng(5)
    pulling = 0
    for _ in range(2000):
        p = random_muscle(rng)
        a, length, speed = rng.uniform(0, 1), random_length(rng, p), random_speed(rng, p)
        expected = twin(p, a, length, speed)
        assert tension(p, a, length, speed) == pytest.approx(
            expected, rel=TWIN, abs=ROUNDING * p.max_isometric_force
        )
        pulling += expected > 0
    assert pulling > 1500


def test_tension_is_opensims_fibre_force_at_its_equilibria() -> None:
    """With the tendon as long as OpenSim's stretched one, the fibre is at its length, and pulls as hard."""
    known = table("ref_dgf_elastic_equilibrium")
    sizes = {"P1_parallel": (1000, 0.10, 0.20, 0), "P2_pennate_soleuslike": (3549, 0.05, 0.25, 25)}
    sizes["P3_shorttendon"] = (600, 0.12, 0.03, 8)
    checked = 0
    for i, name in enumerate(known["params"]):
        force, optimal, _, angle = sizes[name]
        damping = float(known["damping"][i])
        p = mw.DeGrooteFregly2016(
            force, optimal, float(known["tendon_length"][i]), math.radians(angle), 10.0, damping
        )
        speed = float(known["fiber_velocity"][i] / np.cos(known["pennation"][i]))
        expected = float(known["fiber_force_along_tendon"][i])
        found = tension(p, float(known["activation"][i]), float(known["mtu_length"][i]), speed)
        # lengths printed with 15 digits; their difference, the fibre, is short in some rows
        assert found == pytest.approx(max(expected, 0.0), rel=1e-11, abs=1e-11 * force)
        checked += expected > 0.01 * force
    assert checked > 500


def test_a_slack_unit_does_not_pull() -> None:
    for p in (mw.DeGrooteFregly2016(1000, 0.1, 0.2), mw.DeGrooteFregly2016(1000, 0.1, 0.2, 0.5)):
        for length in (0.0, 0.1, 0.2 - 1e-12, 0.2):
            for speed in (-2.0, 0.0, 2.0):
                assert tension(p, 1.0, length, speed) == 0.0


def test_tension_is_never_negative_and_always_finite() -> None:
    rng = np.random.default_rng(6)
    zero = 0
    for _ in range(2000):
        p = random_muscle(rng)
        a = rng.choice([0.0, rng.uniform(0, 1)])
        found = tension(p, a, random_length(rng, p), random_speed(rng, p, 4.0))
        assert 0.0 <= found < math.inf
        zero += found == 0.0
    assert zero > 100


def test_more_activation_never_pulls_less() -> None:
    """As long as the fibre shortens slower than its maximum, where the force-velocity curve is zero."""
    rng = np.random.default_rng(7)
    grew = 0
    for _ in range(500):
        p = random_muscle(rng)
        length, speed = random_length(rng, p), random_speed(rng, p, 0.99)
        found = [tension(p, a, length, speed) for a in np.linspace(0, 1, 6)]
        assert (np.diff(found) >= 0).all()
        grew += found[-1] > found[0]
    assert grew > 400


def test_activation_is_clamped() -> None:
    p = mw.DeGrooteFregly2016(1000, 0.1, 0.2)
    assert tension(p, 1.5, 0.3, 0.0) == tension(p, 1.0, 0.3, 0.0)
    assert tension(p, -0.5, 0.3, 0.0) == tension(p, 0.0, 0.3, 0.0)


def test_pennation() -> None:
    """At optimal fibre length the fibres stand at their angle; a right angle is never passed, and pulls nothing."""
    angle = 0.4
    p, straight = mw.DeGrooteFregly2016(1000, 0.1, 0.2, angle), mw.DeGrooteFregly2016(1000, 0.1, 0.2)
    at_optimum = tension(p, 1.0, 0.2 + 0.1 * math.cos(angle), 0.0)
    assert at_optimum == pytest.approx(math.cos(angle) * tension(straight, 1.0, 0.3, 0.0), rel=1e-14)
    steep = mw.DeGrooteFregly2016(1000, 0.1, 0.2, math.pi / 2 - 1e-9)
    lengths = 0.2 + np.array([1e-15, 1e-9, 1e-6, 1e-3])
    found = [tension(steep, 1.0, float(length), 0.0) for length in lengths]
    # fibres as long as their height, so almost at optimal length; all that is left is the cosine
    assert found == pytest.approx(
        1000 * (lengths - 0.2) / 0.1 * tension(straight, 1, 0.3, 0) / 1000, rel=1e-4
    )


def test_tension_rises_continuously_from_slack_where_fibres_are_pennate() -> None:
    p = mw.DeGrooteFregly2016(1000, 0.1, 0.2, 0.3)
    steps = [tension(p, 1.0, 0.2 + d, 0.0) for d in (0.0, 1e-9, 1e-6, 1e-3)]
    assert steps[0] == 0.0
    assert steps[1] < 1e-5
    assert (np.diff(steps) > 0).all()


# ------------------------------------------------------------------------------ path actuator, sizes


def test_a_path_actuator_pulls_by_its_activation_alone() -> None:
    law = mw.PathActuator(250.0)
    for length, speed in ((0.0, 0.0), (1.0, -3.0)):
        assert [tension(law, a, length, speed) for a in (-1.0, 0.0, 0.5, 1.0, 2.0)] == [0, 0, 125, 250, 500]


GOOD = {"max_isometric_force": 500.0, "optimal_fiber_length": 0.1, "tendon_slack_length": 0.2}
NOT_POSITIVE = (0.0, -1.0, math.nan, math.inf)
REFUSED = [
    *(
        (key, value, "finite and positive")
        for key in ("max_isometric_force", "optimal_fiber_length")
        for value in NOT_POSITIVE
    ),
    *(("max_contraction_velocity", value, "finite and positive") for value in NOT_POSITIVE),
    *(("tendon_slack_length", value, "finite and >= 0") for value in NOT_POSITIVE[1:]),
    *(("fiber_damping", value, "finite and >= 0") for value in NOT_POSITIVE[1:]),
    *(("pennation_angle", value, "in [0, pi/2)") for value in (-0.1, math.pi / 2, 2.0, math.nan, math.inf)),
]


@pytest.mark.parametrize(("key", "value", "wanted"), REFUSED)
def test_sizes_without_sense(key: str, value: float, wanted: str) -> None:
    with pytest.raises(mw.ModelError) as caught:
        mw.DeGrooteFregly2016(**(GOOD | {key: value}))
    assert str(caught.value).startswith(f"degroote_fregly_2016: {key} must be {wanted}")
    assert str(caught.value).endswith(f"not {value!r}")


def test_sizes_at_the_limits() -> None:
    law = mw.DeGrooteFregly2016(
        **(GOOD | {"tendon_slack_length": 0.0, "fiber_damping": 0.0, "pennation_angle": 0.0})
    )
    assert law.row() == (500.0, 0.1, 0.0, 0.0, 10.0, 0.0)


@pytest.mark.parametrize("value", NOT_POSITIVE)
def test_path_actuators_without_sense(value: float) -> None:
    with pytest.raises(mw.ModelError, match="path_actuator: optimal_force must be finite and positive"):
        mw.PathActuator(value)
