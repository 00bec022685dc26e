"""MuJoCo's own muscle curves: the kernel against MuJoCo's functions, and taken-over models against native ones."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

import mjwrap as mw
from mjwrap.kernels.musculotendon import tension as muscle
from mjwrap.muscles.laws import parameter_row

ROUNDING = 1e-13  # relative to the largest force of the muscle: a dozen operations, some fused
PRM = (0.75, 1.05, 400.0, 200.0, 0.5, 1.6, 1.5, 1.3, 1.2)


def random_prm(rng: np.random.Generator) -> tuple[float, ...]:
    """range (2), force or -1, scale, lmin, lmax, vmax, fpmax, fvmax."""
    low = rng.uniform(0.3, 0.9)
    return (
        low,
        low + rng.uniform(0.1, 0.6),
        rng.choice([-1.0, rng.uniform(50, 2000)]),
        rng.uniform(50, 400),
        rng.uniform(0.2, 0.8),
        rng.uniform(1.2, 1.9),
        rng.uniform(0.8, 12),
        rng.uniform(0.1, 2),
        rng.uniform(1.05, 1.8),
    )


def tension(law: mw.MuJoCoMuscle, a: float, length: float, speed: float) -> float:
    params = np.array([parameter_row(law)])
    return muscle.tension(law.code, params, 0, a, length, speed)


def test_the_kernel_is_mujocos_gain_and_bias() -> None:
    """Over all branches of the curves: lengths past both ends, speeds past both limits; a bias of its own."""
    rng = np.random.default_rng(8)
    branches = set()
    for _ in range(3000):
        other = random_prm(rng)
        prm, gear, acc0 = random_prm(rng), rng.uniform(0.2, 4), rng.uniform(0.1, 30)
        short = rng.uniform(0.05, 0.4) * gear
        bounds = short, short + rng.uniform(0.05, 0.3) * gear
        length = rng.uniform(0.3, 2.0) * float(np.mean(bounds)) / gear
        optimal = (bounds[1] - bounds[0]) / (prm[1] - prm[0])
        speed = rng.uniform(-1.5, 1.5) * optimal * prm[6] / gear
        a = rng.uniform(0, 1)
        given = np.array(bounds), acc0, np.array(prm)
        gain = mujoco.mju_muscleGain(gear * length, gear * speed, *given)
        bias = mujoco.mju_muscleBias(gear * length, *given[:2], np.array(other))
        expected = -gear * (gain * a + bias)
        scale = gear * max(p[2] if p[2] > 0 else p[3] / acc0 for p in (prm, other))
        law = mw.MuJoCoMuscle(prm, bounds, acc0, gear, passive=other)
        assert tension(law, a, length, speed) == pytest.approx(expected, rel=ROUNDING, abs=ROUNDING * scale)
        branches.add((gain == 0.0, bias == 0.0, expected > scale))
    assert branches >= {(False, False, False), (True, True, False), (True, False, True), (False, True, False)}


def test_limits_of_force_clamp_active_and_passive_force_together() -> None:
    free = mw.MuJoCoMuscle(PRM, (0.3, 0.6), 1.0, 2.0)
    limited = mw.MuJoCoMuscle(PRM, (0.3, 0.6), 1.0, 2.0, (-150.0, -5.0))
    for a in np.linspace(0, 1, 11):
        for length in np.linspace(0.1, 0.4, 13):
            expected = float(np.clip(tension(free, a, length, 0.0), 2 * 5.0, 2 * 150.0))
            assert tension(limited, a, length, 0.0) == pytest.approx(expected, rel=1e-15)


def test_a_muscle_never_pushes() -> None:
    """MuJoCo's would, at negative activations (controls of an actuator without dynamics) or limits of force."""
    law = mw.MuJoCoMuscle(PRM, (0.3, 0.6), 1.0)
    assert tension(law, 0.5, 0.4, 0.0) > 0.0
    assert tension(law, -0.5, 0.4, 0.0) == 0.0
    assert tension(mw.MuJoCoMuscle(PRM, (0.3, 0.6), 1.0, 1.0, (10.0, 20.0)), 0.5, 0.4, 0.0) == 0.0


SLIDER = """
<mujoco>
  <option timestep="0.001" gravity="0 0 0"/>
  <worldbody>
    <site name="a" pos="0 0.03 0"/>
    <body pos="0.3 0 0">
      <joint name="x" type="slide" axis="1 0 0"/><joint name="y" type="slide" axis="0 1 0.3"/>
      <geom size="0.03" mass="{mass}" contype="0" conaffinity="0"/> <site name="b"/>
    </body>
  </worldbody>
  <tendon><spatial name="m"><site site="a"/><site site="b"/></spatial></tendon>
  <actuator><muscle name="m" tendon="m" {attributes}/></actuator>
</mujoco>
"""


def random_model(rng: np.random.Generator) -> mujoco.MjModel:
    low, high, force, scale, lmin, lmax, vmax, fpmax, fvmax = random_prm(rng)
    gear = rng.uniform(0.3, 3)
    bounds = rng.uniform(0.1, 0.25) * gear, rng.uniform(0.35, 0.5) * gear
    given = {
        "range": (low, high),
        "force": (force,),
        "scale": (scale,),
        "lmin": (lmin,),
        "lmax": (lmax,),
        "vmax": (vmax,),
        "fpmax": (fpmax,),
        "fvmax": (fvmax,),
        "gear": (gear,),
        "lengthrange": bounds,
        "timeconst": tuple(rng.uniform(0.005, 0.05, 2)),
    }
    if rng.uniform() < 0.5:
        given["forcerange"] = (-rng.uniform(20, 300), rng.choice([0.0, -1.0]))
    attributes = " ".join(
        f'{key}="{" ".join(repr(float(x)) for x in value)}"' for key, value in given.items()
    )
    return mujoco.MjModel.from_xml_string(SLIDER.format(mass=rng.uniform(0.2, 3), attributes=attributes))


def test_taken_over_muscles_pull_as_native_ones() -> None:
    """Random parameters, gears, limits of force and force from scale, at random states."""
    rng = np.random.default_rng(9)
    clamped = 0
    for _ in range(60):
        native = random_model(rng)
        twin = mujoco.MjData(native)
        states = [(rng.uniform(-0.25, 0.25, 2), rng.normal(size=2), rng.uniform(0, 1)) for _ in range(8)]
        expected = []
        for qpos, qvel, act in states:
            twin.qpos[:], twin.qvel[:], twin.act[:] = qpos, qvel, act
            mujoco.mj_forward(native, twin)
            expected.append((twin.actuator_force[0], *twin.qfrc_actuator, *twin.act_dot))
        gear, least = float(native.actuator_gear[0, 0]), float(native.actuator_forcerange[0, 0])
        muscles = mw.MuscleSystem(native)
        data = mujoco.MjData(native)
        for (qpos, qvel, act), (force, *pull, rate) in zip(states, expected, strict=True):
            data.qpos[:], data.qvel[:], data.act[:] = qpos, qvel, act
            muscles.reset(data)
            muscles.forward(data)
            assert muscles.tension[0] == pytest.approx(-gear * force, rel=1e-12, abs=1e-11)
            generalised = -muscles.length_jacobian(data).T @ muscles.tension
            assert generalised == pytest.approx(pull, rel=1e-11, abs=1e-11)
            mujoco.mj_forward(native, data)
            assert data.act_dot[0] == rate
            clamped += force == least
    assert clamped > 20


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"prm": PRM[:8]}, "prm must be 9 numbers"),
        ({"passive": PRM[:8]}, "passive prm must be 9 numbers"),
        ({"passive": (1.05, 0.75, *PRM[2:])}, "passive range must be above 1.05, not 0.75"),
        *(({"prm": (*PRM[:k], math.nan, *PRM[k + 1 :])}, "must be finite, not nan") for k in range(9)),
        ({"prm": (1.05, 0.75, *PRM[2:])}, "range must be above 1.05, not 0.75"),
        ({"prm": (*PRM[:6], 0.0, *PRM[7:])}, "vmax must be finite and positive"),
        ({"length_range": (0.3, 0.3)}, "length range must be increasing: optimal fibre length is zero"),
        ({"length_range": (0.3, math.nan)}, "length range must be increasing"),
        ({"acc0": math.inf}, "acc0 must be a finite number"),
        ({"gear": 0.0}, "gear must be finite and positive"),
        ({"gear": -1.0}, "gear must be finite and positive"),
        ({"force_range": (1.0, -1.0)}, "force range must be at most -1.0, not 1.0"),
        ({"force_range": (math.nan, 0.0)}, "force range must be at most 0.0, not nan"),
    ],
)
def test_curves_without_sense(changes: dict[str, object], message: str) -> None:
    good: dict[str, object] = {"prm": PRM, "length_range": (0.3, 0.6), "acc0": 1.0}
    with pytest.raises(mw.ModelError, match="mujoco: ") as caught:
        mw.MuJoCoMuscle(**(good | changes))  # pyright: ignore[reportArgumentType]
    assert message in str(caught.value)
