"""Muscle analysis: arms are differences along the coupled motion, and OpenSim's; all else as of `MuscleSystem`."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest
from coupling_models import knee
from inverse_models import every_joint, moved, swaying
from opensim_inverse import frozen
from osim_models import compiled

import mjwrap as mw
from mjwrap.kernels.musculotendon.tension import force_parts, tension
from mjwrap.mjcf.couplings import CoupledJoints
from mjwrap.muscles.laws import parameter_row

Array = np.ndarray
FIELDS = ("length", "velocity", "moment_arm", "active_force", "passive_force", "status")
UNWRAPPED = ("gait10dof18musc", "gait2392_millard", "leg6dof9musc", "Rajagopal2015_right_leg_9musc", "arm26")


def lengths(muscles: mw.MuscleSystem, data: mujoco.MjData, qpos: Array) -> Array:
    data.qpos[:] = qpos
    muscles.forward(data)
    return muscles.length


@pytest.mark.parametrize("name", ["every joint", "gait10dof18musc", "Rajagopal2015_right_leg_9musc", "arm26"])
def test_moment_arms_are_differences_of_length_along_the_coupled_motion(name: str) -> None:
    """Differences of fourth order, where two steps give the same."""
    model = every_joint() if name == "every joint" else compiled(name)
    muscles = mw.MuscleSystem(model)
    motion = swaying(model, 12, 21, size=0.1)
    found = mw.muscle_analysis(muscles, motion)
    dofs = CoupledJoints(model).independent.tolist()
    data, off, rough = mujoco.MjData(model), [], 0

    def slopes(qpos: Array, dof: int, h: float) -> Array:
        at = {s: lengths(muscles, data, moved(model, qpos, dof, s * h)) for s in (-2, -1, 1, 2)}
        return (8 * (at[1] - at[-1]) - (at[2] - at[-2])) / (12 * h)

    for k in (0, 4, 8, 11):
        for i, dof in enumerate(dofs):
            slope = slopes(motion.qpos[k], dof, 4e-4)
            # elsewhere a touchdown, a conditional point or a knot of a spline is within the step
            smooth = np.abs(slope - slopes(motion.qpos[k], dof, 8e-4)) < 5e-9
            off.append(np.abs(found.moment_arm[k, :, i] + slope)[smooth].max())
            rough += int((~smooth).sum())
    assert max(off) < 1e-8
    assert rough <= 0.03 * 4 * len(dofs) * muscles.n


@pytest.mark.parametrize("name", UNWRAPPED)
def test_moment_arms_of_paths_without_wrapping_are_opensims(name: str) -> None:
    """OpenSim computes them by the forces of a unit tension along couplings; benchmarks/inverse/freeze_inverse.py."""
    case = frozen(name)
    found = mw.muscle_analysis(mw.MuscleSystem(case.model), case.motion)
    free = case.record["free"]
    compared = 0
    for muscle, rows in case.record["arms"].items():
        m = found.names.index(muscle)
        for k, row in zip(case.record["frames"], rows, strict=True):
            mine = [found.moment_arm[k, m, found.coordinates.index(coordinate)] for coordinate in free]
            np.testing.assert_allclose(mine, row, rtol=0, atol=5e-7, err_msg=f"{muscle} {k}")
            compared += len(row)
    assert compared > 20 or name == "arm26"


@pytest.mark.parametrize("name", ["every joint", "knee", "gait10dof18musc"])
def test_frames_are_those_of_a_muscle_system_that_goes_through_the_motion(name: str) -> None:
    models = {"every joint": every_joint, "knee": lambda: knee(3).model}
    model = models[name]() if name in models else compiled(name)
    motion = swaying(model, 300, 7, size=0.15).completed(model)
    muscles = mw.MuscleSystem(model)
    found = mw.muscle_analysis(muscles, motion)
    data = mujoco.MjData(model)
    for k in range(len(motion)):
        data.qpos[:], data.qvel[:] = motion.qpos[k], motion.qvel[k]
        arms = muscles.moment_arms(data)
        shown = [found.coordinates.index(name) for name in muscles.coordinates]
        np.testing.assert_allclose(found.length[k], muscles.length, rtol=0, atol=1e-15)
        np.testing.assert_allclose(
            found.velocity[k], muscles.velocity, rtol=0, atol=1e-15
        )  # other machine code
        np.testing.assert_array_equal(found.status[k], muscles.status)
        np.testing.assert_allclose(found.moment_arm[k][:, shown], arms, rtol=0, atol=1e-15)


@pytest.mark.parametrize("jobs", [2, 3, 50])
def test_results_do_not_depend_on_the_number_of_threads(jobs: int) -> None:
    for model in (every_joint(), compiled("gait10dof18musc")):
        muscles = mw.MuscleSystem(model)
        motion = swaying(model, 260, 3, size=0.15)
        one, several = mw.muscle_analysis(muscles, motion), mw.muscle_analysis(muscles, motion, jobs=jobs)
        for field in FIELDS:
            np.testing.assert_array_equal(getattr(one, field), getattr(several, field))


def test_velocities_are_those_of_the_coordinates_times_the_arms() -> None:
    for model in (every_joint(), compiled("gait2392_millard")):
        motion = swaying(model, 20, 5, size=0.1).completed(model)
        found = mw.muscle_analysis(mw.MuscleSystem(model), motion)
        speeds = motion.qvel[:, CoupledJoints(model).independent]
        rate = -np.einsum("tnk,tk->tn", found.moment_arm, speeds)
        np.testing.assert_allclose(found.velocity, rate, rtol=0, atol=1e-12)


LAWS = (
    mw.Millard2012(1000.0, 0.09, 0.2, pennation_angle=0.3, max_contraction_velocity=10.0, tendon="rigid"),
    mw.DeGrooteFregly2016(800.0, 0.1, 0.15, pennation_angle=0.1, max_contraction_velocity=10.0, tendon="rigid"),
    mw.Thelen2003(500.0, 0.12, 0.2, pennation_angle=0.2, tendon="rigid"),
    mw.PathActuator(300.0),
    mw.PathSpring(2000.0, 0.25, 0.1),
    mw.MuJoCoMuscle((0.75, 1.05, 900.0, 200.0, 0.5, 1.6, 1.5, 1.3, 1.2), (0.2, 0.4), 1.0),
)  # fmt: skip


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.law)
def test_tension_is_the_sum_of_both_forces_where_that_pulls(law: object) -> None:
    rng = np.random.default_rng(4)
    params = np.zeros((1, 21))
    params[0] = parameter_row(law)  # pyright: ignore[reportArgumentType]
    code = law.code  # pyright: ignore[reportAttributeAccessIssue]
    pushed = 0
    for _ in range(300):
        a, length, speed = rng.uniform(0.0, 1.0), rng.uniform(0.15, 0.45), rng.normal(0.0, 0.6)
        active, passive = force_parts(code, params, 0, a, length, speed)
        assert math.isclose(
            tension(code, params, 0, a, length, speed),
            max(active + passive, 0.0),
            rel_tol=1e-13,
            abs_tol=1e-10,
        )
        # what does not depend on the activation is the passive force
        assert force_parts(code, params, 0, 0.5, length, speed)[1] == passive
        pushed += active + passive < 0.0
    damped = getattr(law, "damping", 0.0) or getattr(law, "fiber_damping", 0.0)
    assert pushed > 0 or not damped


def test_forces_of_a_motion_are_those_of_its_muscles() -> None:
    model = compiled("gait2392_millard")
    muscles = mw.MuscleSystem(model)
    motion = swaying(model, 6, 5, size=0.1)
    drive = np.random.default_rng(0).uniform(0.1, 1.0, (6, muscles.n))
    found = mw.muscle_analysis(muscles, motion, activation=drive)
    for k, m in ((0, 3), (5, 40), (3, 91)):
        row = np.array([parameter_row(muscles.declarations[m].parameters)])
        code = muscles.declarations[m].parameters.code
        given = drive[k, m], found.length[k, m], found.velocity[k, m]
        np.testing.assert_array_equal(
            (found.active_force[k, m], found.passive_force[k, m]), force_parts(code, row, 0, *given)
        )


def test_tables_have_opensims_names() -> None:
    model = every_joint()
    muscles = mw.MuscleSystem(model)
    found = mw.muscle_analysis(muscles, swaying(model, 4, 1))
    tables = found.tables()
    assert list(tables)[:2] == ["Length", "LengtheningSpeed"]
    np.testing.assert_array_equal(
        tables["MomentArm_knee"]["rectus"], found.moment_arm[:, 0, found.coordinates.index("knee")]
    )
    assert all(table.names == tuple(muscles.names) for table in tables.values())


def test_a_model_without_muscles_has_an_empty_analysis() -> None:
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><worldbody><body><joint/><geom size=".1"/></body></worldbody></mujoco>'
    )
    found = mw.muscle_analysis(mw.MuscleSystem(model), mw.Motion([0.0, 1.0], [[0.0], [1.0]]))
    assert found.length.shape == (2, 0)
    assert found.moment_arm.shape == (2, 0, 1)


def test_what_does_not_fit_is_named() -> None:
    model = every_joint()
    muscles, motion = mw.MuscleSystem(model), swaying(every_joint(), 4, 1)
    with pytest.raises(mw.StateError, match=r"activation must be one number, \(3,\) or \(4, 3\), not \(2,\)"):
        mw.muscle_analysis(muscles, motion, activation=[0.1, 0.2])
    with pytest.raises(mw.StateError, match="activation must be within 0 and 1"):
        mw.muscle_analysis(muscles, motion, activation=math.nan)
    with pytest.raises(mw.StateError, match="jobs must be a whole number"):
        mw.muscle_analysis(muscles, motion, jobs=0)
    with pytest.raises(mw.StateError, match=r"motion must be a mw.Motion, not"):
        mw.muscle_analysis(muscles, motion.qpos)  # pyright: ignore[reportArgumentType]
    with pytest.raises(mw.StateError, match="expected a MuscleSystem, not an MjModel; make one"):
        mw.muscle_analysis(model, motion)  # pyright: ignore[reportArgumentType]


def test_a_muscle_without_a_path_is_told_by_its_status_and_by_a_strict_system() -> None:
    """A ball moves until the string's origin is at its centre, and back."""
    xml = """<mujoco><worldbody><site name="a"/><site name="b" pos="0 0 .5"/>
    <body pos=".2 0 .1"><joint name="slide" type="slide" axis="1 0 .5"/><geom name="ball" size=".1" mass="1"/></body>
    </worldbody><tendon><spatial name="s"><site site="a"/><geom geom="ball"/><site site="b"/></spatial></tendon>
    <actuator><muscle name="stuck" tendon="s" lengthrange=".1 2"/></actuator></mujoco>"""
    model = mujoco.MjModel.from_xml_string(xml)
    centre = -math.hypot(0.2, 0.1)
    motion = mw.Motion([0.0, 1.0, 2.0], [[0.0], [centre], [0.0]])
    found = mw.muscle_analysis(mw.MuscleSystem(model), motion)
    assert found.status.ravel().tolist() == [0, mw.Status.ENDPOINT_INSIDE, 0]
    assert all(np.isfinite(getattr(found, field)).all() for field in FIELDS)
    with pytest.raises(mw.PathError, match=r"muscle 'stuck' at time 1 s: no path \(endpoint_inside\)"):
        mw.muscle_analysis(mw.MuscleSystem(model, strict=True), motion)
