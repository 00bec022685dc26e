"""Activations from MuJoCo's states and controls, and mjwrap's own activation dynamics."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest
from declared_models import EXTENSOR, HILL, MUSCLE, compiled, declared, element
from mjcf_reading import Vector
from scipy.integrate import solve_ivp

import mjwrap as mw
from mjwrap.kernels.musculotendon import activation_dynamics
from mjwrap.kernels.musculotendon.activation_dynamics import (
    advance_activation,
    advance_smooth,
    smooth_rate,
    zajac_rate,
)

EXACT = 1e-13  # rounding over one exact step; the reference is integrated to 1e-13
TIMES = (0.01, 0.04)  # [s]


def slow_rate(u: float, a: float, times: tuple[float, float] = TIMES) -> float:
    """The equation as printed."""
    tau = times[0] * (0.5 + 1.5 * a) if u > a else times[1] / (0.5 + 1.5 * a)
    return (u - a) / tau


def reference(a: float, u: float, duration: float, times: tuple[float, float] = TIMES) -> float:
    """Activation after `duration` under a constant excitation, which a never crosses, by a high-order integrator."""
    if duration == 0.0:
        return a
    done = solve_ivp(
        lambda _, y: [slow_rate(u, float(y[0]), times)],
        (0.0, duration),
        [a],
        method="DOP853",
        rtol=1e-13,
        atol=1e-15,
    )
    return float(done.y[0, -1])


# ------------------------------------------------------------------------------------------- kernels


def test_the_rate_is_mujocos() -> None:
    """With hard switching (tausmooth 0); excitations beyond 0 and 1 are clamped, as in MuJoCo."""
    rng = np.random.default_rng(0)
    for _ in range(300):
        u, a, up, down = rng.uniform(-0.3, 1.3), rng.uniform(0, 1), *rng.uniform(0.005, 0.1, 2)
        expected = mujoco.mju_muscleDynamics(u, a, np.array([up, down, 0.0]))
        assert zajac_rate(u, a, up, down) == pytest.approx(expected, rel=1e-14)
        assert expected == pytest.approx(slow_rate(float(np.clip(u, 0, 1)), a, (up, down)), rel=1e-14)


def test_a_step_of_any_size_is_the_exact_solution() -> None:
    rng = np.random.default_rng(1)
    for _ in range(60):
        a, u = rng.uniform(0, 1, 2)
        up, down = (float(x) for x in rng.uniform(0.005, 0.1, 2))
        duration = 10.0 ** rng.uniform(-4, -0.5)
        after = advance_activation(a, u, up, down, duration)
        assert after == pytest.approx(reference(a, u, duration, (up, down)), abs=EXACT)


@pytest.mark.parametrize(("a", "u"), [(0.0, 1.0), (1.0, 0.0), (0.0, 1e-9), (1.0, 1 - 1e-9), (0.4, 0.4)])
def test_the_ends_of_the_range(a: float, u: float) -> None:
    for duration in (0.0, 1e-6, 2e-3, 0.02, 0.3):
        assert advance_activation(a, u, *TIMES, duration) == pytest.approx(
            reference(a, u, duration), abs=EXACT
        )
    assert advance_activation(a, u, *TIMES, 0.0) == pytest.approx(a, abs=1e-15)
    assert advance_activation(a, u, *TIMES, 1e6) == u


def slow_smooth_rate(u: float, a: float, times: tuple[float, float], b: float) -> float:
    """De Groote's equation as printed."""
    g, z = 0.5 * math.tanh(b * (u - a)), 0.5 + 1.5 * a
    return ((g + 0.5) / (times[0] * z) + (0.5 - g) * z / times[1]) * (u - a)


def test_the_smooth_form_and_its_steps() -> None:
    """Against the printed equation, integrated; far from the switch at u = a it is Zajac's."""
    rng = np.random.default_rng(8)
    for k in range(80):
        a, u = (
            (0.0, 1.0)
            if k % 8 == 0
            else (1.0, 0.0)
            if k % 8 == 1
            else (float(x) for x in rng.uniform(0, 1, 2))
        )
        up, down = (float(x) for x in rng.uniform(0.005, 0.1, 2))
        b, duration = float(rng.choice([1.0, 10.0, 100.0])), 10.0 ** rng.uniform(-4, -0.3)
        assert smooth_rate(u, a, up, down, b) == pytest.approx(
            slow_smooth_rate(u, a, (up, down), b), rel=1e-13
        )
        assert smooth_rate(u, a, up, down, 1e6) == pytest.approx(zajac_rate(u, a, up, down), rel=1e-12)
        done = solve_ivp(
            lambda _, y, u=u, times=(up, down), b=b: [slow_smooth_rate(u, float(y[0]), times, b)],
            (0.0, duration),
            [a],
            method="DOP853",
            rtol=1e-13,
            atol=1e-15,
        )
        assert advance_smooth(a, u, up, down, b, duration) == pytest.approx(float(done.y[0, -1]), abs=EXACT)


def test_the_smooth_form_stays_between_activation_and_excitation() -> None:
    for a, u in ((0.0, 1.0), (1.0, 0.0), (0.0, 1e-9), (0.4, 0.4), (0.3, 7.0), (0.3, -7.0)):
        low, high = min(a, max(u, 0.0)), max(a, min(u, 1.0))
        for duration in (0.0, 1e-9, 2e-3, 0.3, 30.0, 1e6):
            assert low <= advance_smooth(a, u, *TIMES, 10.0, duration) <= high
        assert advance_smooth(a, u, *TIMES, 10.0, 0.0) == a
        assert advance_smooth(a, u, *TIMES, 10.0, 1e6) == pytest.approx(min(max(u, 0.0), 1.0), abs=1e-15)


def test_forms_by_their_codes() -> None:
    for form, rate, step in (
        (activation_dynamics.ZAJAC, zajac_rate(0.7, 0.2, *TIMES), advance_activation(0.2, 0.7, *TIMES, 2e-3)),
        (
            activation_dynamics.SMOOTH,
            smooth_rate(0.7, 0.2, *TIMES, 10.0),
            advance_smooth(0.2, 0.7, *TIMES, 10.0, 2e-3),
        ),
    ):
        assert activation_dynamics.rate(form, 0.7, 0.2, *TIMES, 10.0) == rate
        assert activation_dynamics.advance(form, 0.2, 0.7, *TIMES, 10.0, 2e-3) == step


def test_two_half_steps_make_a_whole_one() -> None:
    rng = np.random.default_rng(2)
    for a, u in rng.uniform(0, 1, (100, 2)):
        half = advance_activation(a, u, *TIMES, 0.003)
        whole = advance_activation(a, u, *TIMES, 0.006)
        assert advance_activation(half, u, *TIMES, 0.003) == pytest.approx(whole, abs=1e-14)


def test_activation_goes_towards_excitation_and_never_past_it() -> None:
    rng = np.random.default_rng(3)
    for _ in range(500):
        a, u = rng.uniform(-0.2, 1.2, 2)
        duration = 10.0 ** rng.uniform(-7, 1)
        start, goal = np.clip([a, u], 0.0, 1.0)
        after = advance_activation(a, u, *TIMES, duration)
        assert min(start, goal) <= after <= max(start, goal)


# ---------------------------------------------------------------------- muscles without an actuator


def free_muscle(option: str = "") -> mw.MuscleSystem:
    given = HILL | {"activation_time_constants": (0.015, 0.05)}
    model = compiled(actuator="", custom=declared([element("tendon", "extensor")], given), option=option)
    return mw.MuscleSystem(model)


def excitation(k: int) -> float:
    """Held for ten steps at a time, beyond 0 and 1 now and then."""
    return float(np.round(1.2 * np.sin(0.7 * (k // 10)), 3))


@pytest.mark.parametrize("integrator", ["Euler", "RK4", "implicit", "implicitfast"])
def test_own_activation_dynamics_in_a_simulation(integrator: str) -> None:
    muscles = free_muscle(f'integrator="{integrator}"')
    data = mujoco.MjData(muscles.model)
    step, expected = muscles.model.opt.timestep, 0.0
    for k in range(80):
        u = excitation(k)
        muscles.excitation[0] = u
        muscles.step(data)
        before, expected = expected, reference(expected, float(np.clip(u, 0, 1)), step, (0.015, 0.05))
        # the forces of an RK4 step were last evaluated at its end, those of the others at its beginning
        assert muscles.activation[0] == pytest.approx(
            expected if integrator == "RK4" else before, abs=80 * EXACT
        )
        muscles.forward(data)
        assert muscles.activation[0] == pytest.approx(expected, abs=80 * EXACT)


def test_own_activation_belongs_to_its_data_and_ends_with_a_reset() -> None:
    muscles = free_muscle()
    first, second = mujoco.MjData(muscles.model), mujoco.MjData(muscles.model)
    muscles.excitation[0] = 1.0
    muscles.step(first, nstep=20)
    muscles.forward(first)
    risen = muscles.activation[0]
    assert risen == pytest.approx(
        reference(0.0, 1.0, 20 * muscles.model.opt.timestep, (0.015, 0.05)), abs=1e-12
    )
    muscles.forward(second)
    assert muscles.activation[0] == 0.0
    muscles.forward(first)
    assert muscles.activation[0] == risen
    mujoco.mj_resetData(muscles.model, first)
    muscles.reset(first)
    muscles.forward(first)
    assert muscles.activation[0] == 0.0


def test_forward_and_apply_do_not_advance_the_activation() -> None:
    muscles = free_muscle()
    data = mujoco.MjData(muscles.model)
    muscles.excitation[0] = 1.0
    muscles.step(data, nstep=5)
    muscles.forward(data)
    here = muscles.activation[0]
    for _ in range(3):
        muscles.forward(data)
        muscles.apply(data)
    assert muscles.activation[0] == here


def test_a_motion_converges_at_fourth_order_under_rk4() -> None:
    """A muscle with own dynamics along a straight line: its activation counts at every stage of the integrator."""
    values = HILL | {"max_isometric_force": 60.0, "tendon_slack_length": 0.25}
    custom = declared([element("site", "origin"), element("site", "insertion")], values)

    def after(steps: int) -> Vector:
        muscles = mw.MuscleSystem(compiled(actuator="", custom=custom, option='integrator="RK4"'))
        muscles.model.opt.timestep = 0.064 / steps
        data = mujoco.MjData(muscles.model)
        data.qpos[:] = 0.2, 0.1
        muscles.excitation[0] = 0.6
        muscles.step(data, nstep=steps)
        return np.concatenate([data.qpos, data.qvel])

    fine = after(1024)
    errors = [float(np.abs(after(steps) - fine).max()) for steps in (64, 128)]
    assert errors[0] < 1e-6
    assert errors[0] / errors[1] > 13  # 14.4 here, 16 in the limit


# -------------------------------------------------------------------- actuators of different kinds

ROPE = {"optimal_force": 80.0}
SOURCES = {
    "motor": ('<motor name="x" tendon="extensor"/>', 0.7, 0.7),
    "motor beyond one": ('<motor name="x" tendon="extensor"/>', 1.7, 1.7),
    "motor that would push": ('<motor name="x" tendon="extensor"/>', -0.5, -0.5),
    "limited motor": ('<motor name="x" tendon="extensor" ctrlrange="0.1 0.6"/>', 0.7, 0.6),
    "limited from below": ('<motor name="x" tendon="extensor" ctrlrange="0.1 0.6"/>', 0.0, 0.1),
    "general": ('<general name="x" tendon="extensor" gainprm="3"/>', 0.4, 0.4),
    "on a joint": ('<motor name="x" joint="elbow"/>', 0.3, 0.3),
}


@pytest.mark.parametrize("case", SOURCES)
def test_a_path_actuator_takes_the_control_of_a_stateless_actuator(case: str) -> None:
    actuator, control, activation_dynamics = SOURCES[case]
    custom = declared([element("actuator", "x"), element("tendon", "extensor")], ROPE)
    muscles = mw.MuscleSystem(compiled(actuator=MUSCLE + actuator, custom=custom))
    data = mujoco.MjData(muscles.model)
    data.ctrl[:] = 0.0, control
    muscles.forward(data)
    x = muscles.index("x")
    assert muscles.activation[x] == activation_dynamics
    assert muscles.tension[x] == pytest.approx(max(activation_dynamics, 0.0) * 80.0, rel=1e-15)
    muscles.step(data)
    assert data.actuator("x").force[0] == 0.0


STATEFUL = {
    "filter": '<general name="x" tendon="extensor" dyntype="filter" dynprm="0.05"/>',
    "exact filter": '<general name="x" tendon="extensor" dyntype="filterexact" dynprm="0.05"/>',
    "integrator": '<general name="x" tendon="extensor" dyntype="integrator" actrange="0 0.2"/>',
    "delayed filter": '<general name="x" tendon="extensor" dyntype="filter" dynprm="0.05" delay="0.01" nsample="9"/>',
}


@pytest.mark.parametrize("case", STATEFUL)
def test_a_path_actuator_takes_the_state_of_an_actuator_that_has_one(case: str) -> None:
    custom = declared([element("actuator", "x")], ROPE)
    muscles = mw.MuscleSystem(compiled(actuator=MUSCLE + STATEFUL[case], custom=custom))
    data = mujoco.MjData(muscles.model)
    data.ctrl[:] = 0.0, 0.9
    for _ in range(20):
        muscles.step(data)
        muscles.forward(data)
        assert muscles.activation[muscles.index("x")] == data.act[1]
    assert 0.0 < muscles.activation[1] < 0.9
    assert muscles.tension[1] == data.act[1] * 80.0


def test_a_path_actuator_without_an_actuator_takes_its_excitation() -> None:
    custom = declared([element("tendon", "extensor")], ROPE)
    muscles = mw.MuscleSystem(compiled(actuator="", custom=custom))
    data = mujoco.MjData(muscles.model)
    for u in (0.0, 0.4, 1.0):
        muscles.excitation[0] = u
        muscles.step(data)
        assert muscles.activation[0] == u
        assert muscles.tension[0] == 80.0 * u


def test_a_muscle_without_an_activation_state_takes_its_control() -> None:
    """MuJoCo's curves on a general actuator without dynamics, clamped like the native one."""
    curves = 'gainprm="0.75 1.05 500 200 0.5 1.6 1.5 1.3 1.2" lengthrange="0.3 0.6"'
    actuator = f'<general name="x" tendon="extensor" gaintype="muscle" ctrlrange="0 0.8" {curves}/>'
    model, native = compiled(actuator=actuator), compiled(actuator=actuator)
    muscles, data, twin = mw.MuscleSystem(model), mujoco.MjData(model), mujoco.MjData(native)
    for control in (-0.5, 0.0, 0.3, 0.8, 2.0):
        twin.ctrl[0] = data.ctrl[0] = control
        twin.qvel[:] = data.qvel[:] = 0.3
        mujoco.mj_forward(native, twin)
        muscles.forward(data)
        assert muscles.activation[0] == np.clip(control, 0.0, 0.8)
        assert muscles.tension == pytest.approx(-twin.actuator_force, rel=1e-11)


@pytest.mark.parametrize("law", ["degroote_fregly_2016", "mujoco", "path_actuator"])
def test_every_law_on_one_native_muscle(law: str) -> None:
    """The activation is the muscle's own state, whatever the law."""
    values = {"degroote_fregly_2016": HILL, "mujoco": {}, "path_actuator": ROPE}[law]
    custom = declared([element("actuator", "extensor")], values, law)
    muscles = mw.MuscleSystem(compiled(tendon=EXTENSOR, custom=custom))
    data = mujoco.MjData(muscles.model)
    data.qpos[:], data.act[0], data.ctrl[0] = 0.3, 0.35, 0.9
    muscles.forward(data)
    assert muscles.activation[0] == 0.35
    assert muscles.tension[0] > 0.0


def test_excitations_and_controls_that_are_not_finite() -> None:
    muscles = free_muscle()
    data = mujoco.MjData(muscles.model)
    muscles.excitation[0] = np.nan
    for call in (muscles.forward, muscles.apply, muscles.step):
        with pytest.raises(mw.StateError, match="excitation of muscle 'extensor' is not finite"):
            call(data)
    assert not data.xfrc_applied.any()
    muscles = mw.MuscleSystem(compiled())
    data = mujoco.MjData(muscles.model)
    data.ctrl[0] = np.inf
    with pytest.raises(mw.StateError, match=r"ctrl\[0\] \(actuator 'extensor'\) is not finite"):
        muscles.step(data)
