"""De Groote-Fregly 2016 with a rigid tendon: landmarks of the curves, forces against an obvious twin; refusals."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hill_tables import row, values

import mjwrap as mw
from mjwrap.kernels.musculotendon import degroote_fregly as curves
from mjwrap.kernels.musculotendon import tension as muscle

ROUNDING = 1e-15  # of sums of terms near one, where the result is near zero
TWIN = 1e-12  # relative: two ways to write the same formula


# -------------------------------------------------------------------------------------------- curves


def test_landmarks_of_the_curves() -> None:
    """What the constants were chosen for."""
    assert curves.passive(0.2)[0] == 0.0
    assert curves.passive(1.6)[0] == pytest.approx(1.0, rel=1e-15)
    assert curves.tendon(1.0)[0] == 0.0
    assert curves.tendon(1.049)[0] == pytest.approx(1.0, rel=1e-13)
    assert curves.velocity(0.0)[0] == pytest.approx(1.0, abs=1e-12)
    assert curves.velocity(-1.0)[0] == pytest.approx(0.0, abs=1e-12)
    assert curves.active(1.0)[0] == pytest.approx(1.0, abs=1e-3)


def test_the_active_curve_goes_smoothly_through_the_zero_of_a_width() -> None:
    """The second term's width vanishes at 0.1495 optimal lengths, where the term itself is gone to all orders."""
    zero = 0.029947116970696 / 0.200356847296188
    x = zero + np.array([-1e-3, -1e-9, 0.0, 1e-9, 1e-3])
    first = 0.8150671134243542 * np.exp(
        -0.5 * ((x - 1.055033428970575) / (0.162384573599574 + 0.063303448465465 * x)) ** 2
    )
    third = 0.1 * np.exp(-0.5 * ((x - 1) / 0.353553390593274) ** 2)
    assert values(curves.active, x)[:, 0] == pytest.approx(first + third, rel=1e-14)


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
    return max(p.max_isometric_force * (a * active * rate + passive + p.damping * v) * cosine, 0.0)


def tension(law: mw.DeGrooteFregly2016 | mw.PathActuator, a: float, length: float, speed: float) -> float:
    return muscle.tension(law.code, row(mw.PathActuator(1.0), law), 1, a, length, speed)


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


GOOD: dict[str, Any] = {"max_isometric_force": 500.0, "optimal_fiber_length": 0.1, "tendon_slack_length": 0.2}
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


@pytest.mark.parametrize("law", [mw.DeGrooteFregly2016, mw.Millard2012])
@pytest.mark.parametrize(("key", "value", "wanted"), REFUSED)
def test_sizes_without_sense(key: str, value: float, wanted: str, law: type[mw.DeGrooteFregly2016]) -> None:
    given: dict[str, Any] = {**GOOD, key: value}
    with pytest.raises(mw.ModelError) as caught:
        law(**given)
    assert str(caught.value).startswith(f"{law.law}: {key} must be {wanted}")
    assert str(caught.value).endswith(f"not {value!r}")


def test_sizes_at_the_limits() -> None:
    law = mw.DeGrooteFregly2016(
        max_isometric_force=500.0, optimal_fiber_length=0.1, tendon_slack_length=0.0, fiber_damping=0.0
    )
    assert law.row() == (500.0, 0.1, 0.0, 0.0, 10.0, 0.0, 0.0, 0.0, 0.1 * 0.2, 0.0, 0.0)


@pytest.mark.parametrize("law", [mw.DeGrooteFregly2016, mw.Millard2012])
def test_tendons(law: type[mw.DeGrooteFregly2016]) -> None:
    """Elastic where asked, but not where there is next to none; damping where an elastic one needs it."""
    assert law(**GOOD) == law(**GOOD, tendon="rigid")
    assert (law(**GOOD).states, law(**GOOD, tendon="elastic").states) == (1, 2)
    assert law(**GOOD, tendon="elastic").row()[5:7] == (0.1, 1.0)
    assert law(**GOOD, fiber_damping=0.0, tendon="elastic").row()[5] == 0.0
    for slack, elastic in ((0.0, False), (0.99e-5, False), (1.01e-5, True)):
        short = law(**(GOOD | {"tendon_slack_length": slack}), tendon="elastic")
        assert (short.states, short.row()[6]) == ((2, 1.0) if elastic else (1, 0.0))
    with pytest.raises(mw.ModelError, match="tendon must be one of rigid, elastic, not 'stiff'"):
        law(**GOOD, tendon="stiff")


@pytest.mark.parametrize("value", NOT_POSITIVE)
def test_path_actuators_without_sense(value: float) -> None:
    with pytest.raises(mw.ModelError, match="path_actuator: optimal_force must be finite and positive"):
        mw.PathActuator(value)
