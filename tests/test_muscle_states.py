"""Activation and fibre length in a simulation: where they start, how they advance, what carries them."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest
from declared_models import ARM, EXTENSOR, HILL, HOLDER, MUSCLE, ROW, compiled, declared, element
from scipy.integrate import solve_ivp
from scipy.optimize import root_scalar

import mjwrap as mw

ACTUATOR = [element("actuator", "extensor")]
ELASTIC = HILL | {"tendon_slack_length": 0.4, "pennation_angle": 0.2, "fiber_damping": 0.1}
SIZES = (600.0, 0.12, 0.3)  # F_max, l_o, l_s
INTEGRATORS = ["Euler", "RK4", "implicit", "implicitfast"]
STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)


def elastic(
    integrator: str = "Euler", law: str = "degroote_fregly_2016", texts: dict[str, str] | None = None
) -> mujoco.MjModel:
    """Return the arm with one muscle on an elastic tendon, over every surface in a row."""
    texts = {"law": law, "tendon_model": "elastic"} | (texts or {})
    return compiled(
        actuator=HOLDER,
        custom=declared([*ACTUATOR, *ROW], ELASTIC, texts=texts),
        option=f'integrator="{integrator}"',
    )


def start(model: mujoco.MjModel, activation: float = 0.3, control: float = 0.8) -> mujoco.MjData:
    data = mujoco.MjData(model)
    data.qpos[:] = 0.1, 0.05
    data.act[0], data.ctrl[0] = activation, control
    return data


def snapshot(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    state = np.empty(mujoco.mj_stateSize(model, STATE))
    mujoco.mj_getState(model, data, state, STATE)
    return state


def naive_forces(activation: float, length: float, fiber: float, speed: float) -> tuple[float, float]:
    """Return tendon force and fibre force along the tendon [N]: the law of docs/derivation.md once more."""
    strong, optimal, slack = (
        ELASTIC[k] for k in ("max_isometric_force", "optimal_fiber_length", "tendon_slack_length")
    )
    reach = math.sqrt(fiber**2 - (optimal * math.sin(0.2)) ** 2)
    x, v = fiber / optimal, speed / (10.0 * optimal)
    active = sum(
        b1 * math.exp(-0.5 * (x - b2) ** 2 / (b3 + b4 * x) ** 2)
        for b1, b2, b3, b4 in (
            (0.8150671134243542, 1.055033428970575, 0.162384573599574, 0.063303448465465),
            (0.433004984392647, 0.716775413397760, -0.029947116970696, 0.200356847296188),
            (0.1, 1.0, 0.353553390593274, 0.0),
        )
    )
    o = math.exp(4.0 * (0.2 - 1.0) / 0.6)
    passive = (math.exp(4.0 * (x - 1.0) / 0.6) - o) / (math.exp(4.0) - o)
    rate = -0.3211346127989808 * math.asinh(-8.149 * v - 0.374) + 0.8825327733249912
    tendon = 0.2 * math.exp(math.log(6.0) / 0.049 * ((length - reach) / slack - 1.0)) - 0.2
    fibre = (activation * active * rate + passive + 0.1 * v) * reach / fiber
    return strong * max(tendon, 0.0), strong * fibre


@pytest.mark.parametrize("activation", [0.0, 0.3, 1.0])
def test_a_fresh_state_starts_at_static_equilibrium(activation: float) -> None:
    model = elastic()
    muscles, data = mw.MuscleSystem(model), start(model, activation)
    muscles.forward(data)
    tendon, fibre = naive_forces(activation, muscles.length[0], muscles.fiber_length[0], 0.0)
    assert muscles.tension[0] == pytest.approx(tendon, rel=1e-9)
    assert tendon == pytest.approx(fibre, abs=1e-8 * HILL["max_isometric_force"])
    assert tendon > 1.0
    assert data.act.tolist() == [activation, 0.0]  # forward writes nothing


def test_a_given_fibre_length_is_taken_as_it_is() -> None:
    model = elastic()
    muscles, data = mw.MuscleSystem(model), start(model)
    muscles.forward(data)
    data.act[1] = 0.97 * muscles.fiber_length[0]
    muscles.forward(data)
    assert muscles.fiber_length[0] == data.act[1]
    assert muscles.tension[0] == pytest.approx(
        naive_forces(0.3, muscles.length[0], data.act[1], 0.0)[0], rel=1e-9
    )


def test_a_held_arm_follows_the_differential_equation() -> None:
    """With the joints locked, activation and fibre obey two equations that an independent integrator solves."""
    model = elastic()
    model.opt.gravity[:] = 0.0
    model.dof_damping[:] = 1e9  # holds the arm
    muscles, errors = mw.MuscleSystem(model), []
    data = start(model)
    muscles.forward(data)
    length, first = muscles.length[0], muscles.fiber_length[0]

    def rates(_t: float, y: np.ndarray) -> list[float]:
        def balance(speed: float) -> float:
            tendon, fibre = naive_forces(y[0], length, y[1], speed)
            return tendon - fibre

        return [
            (0.8 - y[0]) / (0.01 * (0.5 + 1.5 * y[0])),
            float(root_scalar(balance, bracket=(-10.0, 10.0), xtol=1e-14, rtol=1e-14).root),
        ]

    exact = solve_ivp(rates, (0.0, 0.02), [0.3, first], rtol=1e-10, atol=1e-12, method="LSODA").y[:, -1]
    for steps in (20, 40, 80):
        model.opt.timestep = 0.02 / steps
        data = start(model)
        muscles.reset(data)
        muscles.step(data, nstep=steps)
        assert data.act[0] == pytest.approx(exact[0], abs=1e-8)
        errors.append(abs(data.act[1] - exact[1]))
    assert errors[0] / errors[1] > 6.0  # third order
    assert errors[1] / errors[2] > 6.0
    assert 1e-12 < errors[2] < 1e-6 * HILL["optimal_fiber_length"]
    assert abs(exact[1] - first) > 0.02 * ELASTIC["optimal_fiber_length"]


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_a_motion_converges_with_the_step(integrator: str) -> None:
    def after(steps: int) -> np.ndarray:
        model = elastic(integrator)
        model.opt.timestep = 0.064 / steps
        data = start(model)
        mw.MuscleSystem(model).step(data, nstep=steps)
        return np.concatenate([data.qpos, data.act])

    fine = after(2048)
    errors = [float(np.abs(after(steps) - fine).max()) for steps in (64, 128)]
    assert errors[1] < 0.05  # the wrist swings by 2.4 rad
    ratio = errors[0] / errors[1]
    assert (
        ratio > 6.0 if integrator == "RK4" else 1.7 < ratio < 2.6
    )  # the fibre's third order, or the integrator's first


@pytest.mark.parametrize("law", ["degroote_fregly_2016", "millard_2012"])
@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_a_restored_state_goes_on_with_the_same_bits(integrator: str, law: str) -> None:
    model = elastic(integrator, law)
    muscles, data = mw.MuscleSystem(model), start(model)
    muscles.step(data, nstep=40)
    saved, branch = snapshot(model, data), muscles.branch(data)
    muscles.step(data, nstep=40)
    other = mujoco.MjData(model)
    mujoco.mj_setState(model, other, saved, STATE)
    muscles.set_branch(other, branch)
    muscles.step(other, nstep=40)
    assert np.array_equal(snapshot(model, other), snapshot(model, data))
    assert data.act[1] > 0.0


def test_a_reset_starts_again_with_the_same_bits() -> None:
    model = elastic()
    muscles, data = mw.MuscleSystem(model), start(model)
    muscles.step(data, nstep=40)
    first = snapshot(model, data)
    mujoco.mj_resetData(model, data)
    muscles.reset(data)
    data.qpos[:], data.act[0], data.ctrl[0] = (0.1, 0.05), 0.3, 0.8
    muscles.step(data, nstep=40)
    assert np.array_equal(snapshot(model, data), first)


def test_apply_and_advance_do_what_step_does() -> None:
    model = elastic()
    muscles, stepped, applied = mw.MuscleSystem(model), start(model), start(model)
    for _ in range(30):
        muscles.step(stepped)
        muscles.apply(applied)
        muscles.apply(applied)  # may be repeated
        mujoco.mj_step(model, applied)
        muscles.advance(applied)
    assert applied.qpos == pytest.approx(stepped.qpos, abs=1e-10)
    assert applied.act == pytest.approx(stepped.act, abs=1e-10)
    assert stepped.act[0] > 0.75


def test_a_branch_of_another_model_is_refused() -> None:
    model = elastic()
    muscles, data = mw.MuscleSystem(model), start(model)
    with pytest.raises(mw.StateError, match="branch must have shape"):
        muscles.set_branch(data, muscles.branch(data)[1:])


def test_disabled_muscles_keep_their_states_and_do_not_pull() -> None:
    model = elastic()
    muscles, data = mw.MuscleSystem(model), start(model)
    muscles.step(data, nstep=3)
    held = data.act.copy()
    model.opt.disableactuator = 1  # group 0
    muscles.step(data, nstep=3)
    assert muscles.tension[0] == 0.0
    assert np.array_equal(data.act, held)


def test_the_smooth_activation_dynamics() -> None:
    """De Groote's form against its equation, integrated independently."""
    model = elastic(texts={"activation_dynamics": "degroote_fregly_2016"})
    muscles, data = mw.MuscleSystem(model), start(model)

    def rate(_t: float, y: np.ndarray) -> list[float]:
        a, u = float(y[0]), 0.8
        g, z = 0.5 * math.tanh(10.0 * (u - a)), 0.5 + 1.5 * a
        return [((g + 0.5) / (0.015 * z) + (0.5 - g) * z / 0.060) * (u - a)]

    muscles.step(data, nstep=20)
    exact = solve_ivp(rate, (0.0, 0.04), [0.3], rtol=1e-11, atol=1e-13).y[0, -1]
    assert data.act[0] == pytest.approx(exact, abs=1e-7)


def test_laws_and_tendons_mix_in_one_model() -> None:
    actuators = "".join(MUSCLE.replace('name="extensor"', f'name="{name}"') for name in "abcd")
    spec = mujoco.MjSpec.from_string(ARM.format(tendon=EXTENSOR, actuator=actuators, custom="", option=""))
    mw.set_laws(
        spec,
        {
            "b": mw.DeGrooteFregly2016(*SIZES),
            "c": mw.DeGrooteFregly2016(*SIZES, tendon="elastic"),
            "d": mw.Millard2012(*SIZES, tendon="elastic"),
        },
    )
    again = mujoco.MjSpec.from_string(spec.to_xml())
    parent = mujoco.MjSpec()
    parent.attach(again.copy(), prefix="left_", frame=parent.worldbody.add_frame())
    for model, prefix in ((spec.compile(), ""), (again.compile(), ""), (parent.compile(), "left_")):
        muscles, data = mw.MuscleSystem(model), mujoco.MjData(model)
        assert muscles.names == [prefix + name for name in "abcd"]
        laws = [m.law for m in muscles.declarations]
        assert laws == ["mujoco", "degroote_fregly_2016", "degroote_fregly_2016", "millard_2012"]
        assert model.na == 6
        data.ctrl[:] = 0.5
        muscles.step(data, nstep=50)
        assert (muscles.status == 0).all()
        assert (muscles.fiber_length[1:] > 0.05).all()
        # the time constants of the native muscles went along
        assert muscles.activation[2] == pytest.approx(muscles.activation[0], abs=5e-3)


def test_a_law_can_be_replaced() -> None:
    spec = mujoco.MjSpec.from_string(
        ARM.format(tendon=EXTENSOR, actuator=MUSCLE, custom=declared([*ACTUATOR, *ROW], HILL), option="")
    )
    mw.set_laws(spec, {"extensor": mw.Millard2012(77.0, 0.12, 0.3, tendon="elastic")})
    muscle = mw.MuscleSystem(spec.compile()).declarations[0]
    assert (muscle.law, muscle.parameters.row()[0], len(muscle.geoms)) == ("millard_2012", 77.0, 3)


def test_a_law_for_a_muscle_that_is_not_there() -> None:
    spec = mujoco.MjSpec.from_string(ARM.format(tendon=EXTENSOR, actuator=MUSCLE, custom="", option=""))
    before = spec.to_xml()
    laws = {"extensor": mw.DeGrooteFregly2016(*SIZES), "flexor": mw.DeGrooteFregly2016(*SIZES)}
    with pytest.raises(mw.ModelError, match="no muscle flexor; actuators: extensor"):
        mw.set_laws(spec, laws)
    assert spec.to_xml() == before


WRONG = {
    "no place for a fibre": (MUSCLE, {"tendon_model": "elastic"}, {}, "dyntype='user' actdim='2'"),
    "no such tendon": (HOLDER, {"tendon_model": "stretchy"}, {}, "rigid, elastic"),
    "no such dynamics": (HOLDER, {"activation_dynamics": "fast"}, {}, "there are: zajac, degroote_fregly_2016"),
    "dynamics of the actuator": (MUSCLE, {"activation_dynamics": "zajac"}, {}, "the dynamics of its actuator"),
    "smoothing": (HOLDER, {}, {"activation_smoothing": 0.0}, "smoothing must be finite and positive"),
    "limited states": (
        HOLDER.replace("actdim", 'actlimited="true" actrange="0 1" actdim'), {}, {}, "would limit the fibre"
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", WRONG)
def test_wrong_declarations_are_named(case: str) -> None:
    actuator, texts, values, words = WRONG[case]
    model = compiled(actuator=actuator, custom=declared([*ACTUATOR, *ROW], HILL | values, texts=texts))
    with pytest.raises(mw.ModelError, match="muscle 'extensor'") as caught:
        mw.MuscleSystem(model)
    assert words in str(caught.value)


def test_a_law_without_a_tendon_takes_none() -> None:
    custom = declared([*ACTUATOR, *ROW], {"optimal_force": 5.0}, texts={"tendon_model": "rigid"})
    with pytest.raises(mw.ModelError, match="law 'path_actuator' has no tendon"):
        mw.MuscleSystem(compiled(custom=custom))


def test_energetics_of_a_simulation() -> None:
    """Powers balance at every state, and the tension times speed is what reaches the skeleton."""
    model = elastic()
    muscles, data = mw.MuscleSystem(model), start(model)
    for _ in range(20):
        muscles.step(data, nstep=5)
        muscles.forward(data)
        found = muscles.energetics(mw.Umberger2010())
        assert found.muscle_power == pytest.approx(-muscles.tension * muscles.velocity, rel=1e-12, abs=1e-12)
        assert found.muscle_power == pytest.approx(
            found.fiber_power + found.tendon_power, rel=1e-7, abs=1e-7 * abs(found.fiber_power[0])
        )
        assert found.metabolic_power[0] > 0.0
    assert muscles.energetics().metabolic_power[0] == 0.0


def test_the_excitation_of_a_native_muscle_reaches_its_metabolism() -> None:
    model = compiled(custom=declared([*ACTUATOR, *ROW], HILL))
    muscles, data = mw.MuscleSystem(model), mujoco.MjData(model)
    heats = []
    for control in (0.1, 0.9):
        data.act[0], data.ctrl[0] = 0.3, control
        muscles.forward(data)
        heats.append(muscles.energetics(mw.Umberger2010()).activation_heat[0])
    assert heats[1] > 1.2 * heats[0]


def pair(name: str, extra: str = "") -> str:
    return MUSCLE.replace('name="extensor"', f'name="{name}" {extra}')


def test_keyframes_keep_their_activations_when_a_fibre_length_comes_in() -> None:
    key = '<keyframe><key name="k" act="0.3 0.9" ctrl="0.1 0.2"/></keyframe>'
    xml = ARM.format(tendon=EXTENSOR, actuator=pair("a") + pair("b"), custom="", option="")
    spec = mujoco.MjSpec.from_string(xml.replace("</mujoco>", key + "</mujoco>"))
    mw.set_laws(spec, {"a": mw.DeGrooteFregly2016(*SIZES, tendon="elastic")})
    mw.set_laws(spec, {"a": mw.Millard2012(*SIZES, tendon="elastic")})  # has its place by now
    assert spec.compile().key_act.tolist() == [[0.3, 0.0, 0.9]]


def test_time_constants_stay_when_the_law_is_replaced() -> None:
    actuator = pair("a", 'timeconst="0.02 0.07"')
    spec = mujoco.MjSpec.from_string(ARM.format(tendon=EXTENSOR, actuator=actuator, custom="", option=""))
    for law in (mw.DeGrooteFregly2016(*SIZES, tendon="elastic"), mw.Millard2012(*SIZES)):
        mw.set_laws(spec, {"a": law})
        assert mw.MuscleSystem(spec.compile()).declarations[0].activation.row()[:2] == (0.02, 0.07)


@pytest.mark.parametrize(
    ("actuator", "law", "words"),
    [
        (
            pair("a"),
            mw.PathActuator(3.0),
            "must be DeGrooteFregly2016 or Millard2012 or Thelen2003, not PathActuator",
        ),
        ('<muscle name="a" joint="elbow" lengthrange="-1 1"/>', None, "pulls no tendon"),
        (pair("a", 'gear="-1"'), None, "not positive, so it pushes"),
    ],
)
def test_a_law_that_a_muscle_cannot_have_changes_nothing(actuator: str, law: object, words: str) -> None:
    spec = mujoco.MjSpec.from_string(ARM.format(tendon=EXTENSOR, actuator=actuator, custom="", option=""))
    before = spec.to_xml()
    laws: dict = {"a": law or mw.DeGrooteFregly2016(*SIZES, tendon="elastic")}
    with pytest.raises(mw.ModelError, match=words):
        mw.set_laws(spec, laws)
    assert spec.to_xml() == before


def test_what_does_not_pull_has_no_energetics() -> None:
    model = elastic()
    muscles, data = mw.MuscleSystem(model), start(model)
    with pytest.raises(mw.StateError, match="call forward, apply or step first"):
        muscles.energetics()
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
    data.qvel[0] = 2.0
    muscles.apply(data)
    assert not data.xfrc_applied.any()
    assert muscles.tension[0] == 0.0
    assert muscles.energetics(mw.Umberger2010()).metabolic_power[0] == 0.0
    assert muscles.energetics().muscle_power[0] == 0.0


def test_states_advance_only_after_an_applied_step() -> None:
    model = elastic()
    muscles, data = mw.MuscleSystem(model), start(model)
    with pytest.raises(mw.StateError, match="no step to advance"):
        muscles.advance(data)
    muscles.step(data, nstep=3)
    muscles.apply(data)
    mujoco.mj_resetData(model, data)
    with pytest.raises(mw.StateError, match="no step to advance"):
        muscles.advance(data)
    assert not data.act.any()


def test_excitations_of_another_shape_are_refused() -> None:
    model = compiled(actuator="", custom=declared([element("tendon", "extensor")], HILL))
    muscles = mw.MuscleSystem(model)
    for wrong in (np.zeros(0), np.zeros(5), 0.5):
        with pytest.raises(mw.StateError, match=r"shape \(1,\)"):
            muscles.excitation = wrong  # pyright: ignore[reportAttributeAccessIssue]
    muscles.excitation = np.array([0.4])
    assert muscles.excitation[0] == 0.4


def test_trials_refuse_what_is_no_muscle() -> None:
    law, time = mw.DeGrooteFregly2016(*SIZES, tendon="elastic"), np.linspace(0.0, 0.1, 11)
    for given in (
        {"initial_fiber_length": math.nan},
        {"initial_fiber_length": -1.0},
        {"initial_activation": math.nan},
        {"length": -0.4},
        {"time": 0.3},
    ):
        values: dict = {"time": time, "length": 0.42} | given
        with pytest.raises(mw.StateError):
            mw.simulate_muscle(law, values.pop("time"), values.pop("length"), excitation=0.5, **values)
    one = mw.simulate_muscle(law, [0.0], 0.42, activation=0.5)
    assert one.tension[0] > 1.0
    assert one.fiber_length[0] > 0.05
