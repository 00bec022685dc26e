"""Tension as an affine function of activation near one: balance of elastic tendons, slopes, limits."""

from typing import Any

import numpy as np
import pytest

import mjwrap as mw
from mjwrap.kernels.musculotendon import fiber
from mjwrap.kernels.musculotendon.tangent import tangent, tangents
from mjwrap.kernels.musculotendon.tension import force_parts, tension

HILL: Any = {"max_isometric_force": 900.0, "optimal_fiber_length": 0.05, "tendon_slack_length": 0.2}
LAWS = {
    "millard": mw.Millard2012(**HILL, pennation_angle=0.4, tendon="elastic"),
    "straight millard": mw.Millard2012(**HILL, tendon="elastic", fiber_damping=0.02),
    "undamped millard": mw.Millard2012(**HILL, pennation_angle=0.2, tendon="elastic", fiber_damping=0.0),
    "degroote": mw.DeGrooteFregly2016(**HILL, pennation_angle=0.3, tendon="elastic"),
    "thelen": mw.Thelen2003(**HILL, pennation_angle=0.3, tendon="elastic"),
}


def rows(law):
    """Return code and parameters (1, PARAMS) of a law."""
    return law.code, np.array([law.row()])


def rigid(law):
    kind = type(law)
    more = {"fiber_damping": law.fiber_damping} if isinstance(law, mw.Millard2012) else {}
    return kind(**HILL, pennation_angle=law.pennation_angle, tendon="rigid", **more)


def states(seed, count=40):
    """Return activations, lengths [m] and speeds [m/s] of a muscle with the sizes of HILL."""
    rng = np.random.default_rng(seed)
    lengths = 0.2 + 0.05 * rng.uniform(0.6, 1.4, count)
    return zip(rng.uniform(0.05, 0.95, count), lengths, rng.uniform(-0.1, 0.1, count), strict=True)


@pytest.mark.parametrize("name", LAWS)
def test_elastic_tendon_balances_a_fibre_that_takes_all_the_speed(name):
    """At the fibre length that the tension implies, found by bisection of the tendon alone, the fibre pulls as much."""
    law, params = rows(LAWS[name])
    pulling = 0
    for a, length, speed in states(1):
        pull, _ = tangent(law, params, 0, a, length, speed)
        if pull <= 0.0:
            continue
        pulling += 1
        low, high = float(params[0, fiber.LEAST]), float(fiber.rigid_fiber(params, 0, length))
        for _ in range(200):
            middle = 0.5 * (low + high)
            if fiber.tendon_force(law, params, 0, length, middle) > pull:
                low = middle
            else:
                high = middle
        height = params[0, fiber.HEIGHT]
        cosine = np.sqrt(max(middle**2 - height**2, 0.0)) / middle
        held = fiber.fiber_force(law, params, 0, a, middle, speed * cosine)
        assert held == pytest.approx(pull, abs=1e-7 * HILL["max_isometric_force"])
    assert pulling > 30


@pytest.mark.parametrize("name", LAWS)
def test_at_rest_it_is_the_static_equilibrium(name):
    law, params = rows(LAWS[name])
    for a, length, _ in states(2):
        at, _, _ = fiber.equilibrium(law, params, 0, a, length)
        expected = fiber.tendon_force(law, params, 0, length, at)
        assert tangent(law, params, 0, a, length, 0.0)[0] == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("stretch", ["elastic", "rigid"])
@pytest.mark.parametrize("name", LAWS)
def test_slope_equals_differences_at_second_order(name, stretch):
    law, params = rows(LAWS[name] if stretch == "elastic" else rigid(LAWS[name]))
    errors = []
    for h in (1e-2, 1e-3):
        found = []
        for a, length, speed in states(3, 60):
            value, slope = tangent(law, params, 0, a, length, speed)
            ends = [tangent(law, params, 0, a + s * h, length, speed)[0] for s in (-1, 1)]
            if min(ends) > 1.0 and value > 1.0:  # the slope jumps where a tendon gets slack
                found.append(abs((ends[1] - ends[0]) / (2 * h) - slope))
        errors.append((np.median(found), max(found)))
    scale = HILL["max_isometric_force"]
    assert errors[1][1] <= 2e-4 * scale  # near a knot of a curve, where the order is lower
    assert errors[1][0] <= errors[0][0] / 50 or errors[1][0] <= 1e-8 * scale


def test_a_stiff_tendon_is_a_rigid_one():
    """The tension tends to that with a rigid tendon as the tendon's strain at F_max goes to zero, at first order."""
    hard = mw.Millard2012(**HILL, pennation_angle=0.3, tendon="rigid")
    errors = []
    for strain in (1e-3, 1e-4):
        law = mw.Millard2012(
            **HILL, pennation_angle=0.3, tendon="elastic", tendon_force_length_curve=(strain,)
        )
        off = [
            abs(
                max(tangent(*rows(law), 0, *state)[0], 0.0)
                - tension(*rows(hard), 0, *state)
            )
            for state in states(4)
        ]  # fmt: skip
        errors.append(max(off))
    assert errors[1] < 0.15 * errors[0]
    assert errors[1] < 0.01 * HILL["max_isometric_force"]


@pytest.mark.parametrize("name", ["millard", "degroote", "thelen"])
def test_rigid_tendon_has_the_parts_of_its_force(name):
    law, params = rows(rigid(LAWS[name]))
    for a, length, speed in states(5):
        value, slope = tangent(law, params, 0, a, length, speed)
        active, passive = force_parts(law, params, 0, a, length, speed)
        assert value == pytest.approx(active + passive, rel=1e-12)
        if name != "thelen":
            assert slope == pytest.approx(active / a, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("name", LAWS)
def test_a_unit_shorter_than_its_tendon_has_no_force(name):
    assert tangent(*rows(LAWS[name]), 0, 0.5, 0.19, 0.0) == (0.0, 0.0)


def test_affine_laws_are_exact():
    law, params = rows(mw.PathActuator(optimal_force=300.0))
    params = np.pad(params, ((0, 0), (0, 21 - params.shape[1])))
    assert tangent(law, params, 0, 0.4, 0.3, 0.0) == (120.0, 300.0)
    law, params = rows(mw.PathSpring(resting_length=0.2, stiffness=1000.0, dissipation=0.0))
    params = np.pad(params, ((0, 0), (0, 21 - params.shape[1])))
    assert tangent(law, params, 0, 0.4, 0.22, 0.0) == (pytest.approx(20.0), 0.0)


def test_frames_equal_single_calls():
    found = [rows(law) for law in LAWS.values()]
    law, params = np.array([code for code, _ in found]), np.vstack([row for _, row in found])
    a, length, speed = (np.array(x).reshape(8, 5) for x in zip(*states(6), strict=True))
    intercept, slope = np.empty((8, 5)), np.empty((8, 5))
    tangents(law, params, a, length, speed, intercept, slope)
    for t in range(8):
        for m in range(5):
            value, growth = tangent(law[m], params, m, a[t, m], length[t, m], speed[t, m])
            assert slope[t, m] == growth
            assert intercept[t, m] == pytest.approx(value - growth * a[t, m], rel=1e-13, abs=1e-10)
