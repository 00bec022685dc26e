"""Coordinates that loops and constraints tie: set, read, and their moment arms, beside OpenSim's frozen ones."""

from __future__ import annotations

import functools
import json

import mujoco
import numpy as np
import pytest
from osim_models import FROZEN, compiled, imported

import mjwrap as mw
from mjwrap.osim.verifying.imported import ImportedModel
from mjwrap.osim.verifying.reference import read_reference
from mjwrap.runs.models import set_state
from mjwrap.runs.state_tables import read_states

OWN = ("tied_point", "tied_distance", "tied_weld")
SHARED = ("ThoracoscapularShoulderModel", "knee_patella_ligament")
SPREAD = {  # of random changes [rad] that stay within reach
    "ThoracoscapularShoulderModel": 0.25, "knee_patella_ligament": 1.0, "tied_point": 0.1, "tied_weld": 0.05,
    "tied_distance": 0.15,
}  # fmt: skip


@functools.cache
def tied(name: str) -> mujoco.MjModel:
    """Return a model of the tests' own or of the shared folder, compiled from its text."""
    if name not in OWN:
        return compiled(name)
    found = mw.import_osim(FROZEN / f"{name}.osim")
    return mujoco.MjModel.from_xml_string(found.xml, found.assets)


def frozen(name: str) -> dict:
    """Return OpenSim's numbers: made by benchmarks/osim/freeze_tied_arms.py."""
    return json.loads((FROZEN / f"{name}.json").read_text())


def residual(model: mujoco.MjModel, data: mujoco.MjData) -> float:
    mujoco.mj_forward(model, data)
    return float(np.abs(data.efc_pos[: data.ne]).max(initial=0.0))


def settable(name: str) -> list[str]:
    """Return the coordinates that follow none by a coupler, without joints that are axes only."""
    model = tied(name)
    marks = ("translation", "rotation")
    names = [n for n in mw.MuscleSystem(model).coordinates if not any(mark in n for mark in marks)]
    return names + [n for n in ("patella_angle", "patella_r_constrained_knee_angle") if n in values(name)]


def values(name: str) -> dict[str, float]:
    return mw.osim.coordinates(tied(name), mujoco.MjData(tied(name)))


@pytest.mark.parametrize("name", OWN)
def test_poses_lengths_and_moment_arms_are_opensims(name: str) -> None:
    """About every coordinate: tied, coupled, locked, and one that is no joint (P eᵢ / Pᵢᵢ)."""
    model, numbers = tied(name), frozen(name)
    muscles, data = mw.MuscleSystem(model), mujoco.MjData(model)
    poses = zip(numbers["values"], numbers["lengths"], numbers["moment_arms"], strict=True)
    moved = []
    for given, lengths, arms in poses:
        mujoco.mj_resetData(model, data)
        mw.osim.set_coordinates(model, data, given)
        assert residual(model, data) < 1e-10
        found = mw.osim.coordinates(model, data)
        assert [found[c] for c in given] == pytest.approx(list(given.values()), abs=1e-12)
        own = muscles.moment_arms(data, list(given))
        assert muscles.length == pytest.approx([lengths[m] for m in muscles.names], abs=1e-12)
        wanted = np.array([[arms[m][c] for c in given] for m in muscles.names])
        np.testing.assert_allclose(own, wanted, rtol=0, atol=1e-11)
        moved.append(wanted)
    assert np.ptp(moved, axis=0).max() > 0.01
    assert np.abs(moved[0]).max(axis=0).min() > 1e-3  # no coordinate is without a moment arm


@pytest.mark.parametrize("name", SHARED)
def test_imported_models_have_opensims_poses_masses_and_moment_arms(name: str) -> None:
    """Of unwrapped paths, about OpenSim's speeds; masses with the file's inertias, which MuJoCo's compiler refuses."""
    found = imported(name)
    model = mujoco.MjModel.from_xml_string(found.xml, found.assets)
    mw.osim.restore_inertias(model)
    reference = read_reference(FROZEN / f"verify_{name}.json")
    compared, arms = ImportedModel(model), []
    for pose in reference.poses:
        ours = compared.at(pose, reference.independent, [])
        for body, place in pose.bodies.items():
            assert ours.bodies[body] == pytest.approx(place, abs=1e-9)
        theirs = np.array(pose.mass)
        scale = np.sqrt(np.outer(np.diag(theirs), np.diag(theirs)))
        assert ours.mass is not None
        assert (np.abs(ours.mass - theirs) / scale).max() < 2e-9
        for muscle, about in pose.moment_arms.items():
            if ours.touched[muscle] or muscle in pose.wraps or muscle in ours.statuses:
                continue
            for coordinate, arm in about.items():
                moving = muscle.startswith("LatissimusDorsi") and coordinate == "shoulder_elv"
                if not moving:  # OpenSim leaves out that its points move with the coordinate
                    arms.append(abs(ours.moment_arms[muscle][coordinate] - arm))
    assert max(arms, default=0.0) < 1e-9
    assert len(arms) > 900 or name == "knee_patella_ligament"  # which has no paths


@pytest.mark.parametrize("name", [*OWN, *SHARED])
def test_what_is_set_is_read_and_the_constraints_hold(name: str) -> None:
    model, rng = tied(name), np.random.default_rng(1)
    start, names = values(name), settable(name)
    for _ in range(12):
        data = mujoco.MjData(model)
        chosen = [str(n) for n in rng.permutation(names)[: rng.integers(1, 3)]]
        if name in ("knee_patella_ligament", "tied_distance", "tied_point"):
            chosen = chosen[:1]  # two values may be out of reach
        slides = [n for n in chosen if n in ("block_slide", "p_x", "p_y", "p_z")]
        given = {
            n: start[n] + (0.1 if n in slides else 1.0) * SPREAD[name] * float(rng.uniform(-1, 0))
            for n in chosen
        }
        mw.osim.set_coordinates(model, data, given)
        assert residual(model, data) < 1e-10
        found = mw.osim.coordinates(model, data)
        assert [found[n] for n in given] == pytest.approx(list(given.values()), abs=1e-12)
        again = mujoco.MjData(model)
        mw.osim.set_coordinates(model, again, {n: found[n] for n in names})
        np.testing.assert_allclose(again.qpos, data.qpos, rtol=0, atol=1e-8)


@pytest.mark.parametrize("name", [*OWN, "ThoracoscapularShoulderModel"])
def test_moment_arms_are_slopes_of_the_lengths_along_the_projected_motion(name: str) -> None:
    """The error of central differences falls with the square of the step."""
    model, rng = tied(name), np.random.default_rng(2)
    muscles, data, twin = mw.MuscleSystem(model), mujoco.MjData(model), mujoco.MjData(model)
    start, names = values(name), settable(name)
    first = str(rng.choice(names))
    mw.osim.set_coordinates(model, data, {first: start[first] - 0.02})
    here = mw.osim.coordinates(model, data)
    muscles.forward(data)
    straight = [i for i in range(muscles.n) if not len(muscles.contact_points(i)) and not muscles.status[i]]
    errors = {}
    for coordinate in names:
        arms = muscles.moment_arms(data, coordinate)[straight, 0]
        for step in (4e-4, 2e-4):
            lengths = []
            for sign in (1.0, -1.0):
                twin.qpos[:] = data.qpos
                mw.osim.set_coordinates(model, twin, {coordinate: here[coordinate] + sign * step})
                muscles.forward(twin)
                lengths.append(muscles.length[straight])
            slope = (lengths[0] - lengths[1]) / (2.0 * step)
            errors[coordinate, step] = float(np.abs(arms + slope).max())
    coarse = np.array([errors[c, 4e-4] for c in names])
    fine = np.array([errors[c, 2e-4] for c in names])
    assert fine.max() < 1e-5
    seen = coarse > 1e-9
    assert seen.any()
    assert (coarse[seen] / fine[seen]).min() > 3.5


@pytest.mark.parametrize("name", [*OWN, "ThoracoscapularShoulderModel"])
def test_untied_coordinates_stay(name: str) -> None:
    model, data = tied(name), mujoco.MjData(tied(name))
    alone = {
        "tied_point": ("crank_angle", "foot_angle"), "tied_distance": ("knee_angle", ""),
        "tied_weld": ("q1", "arm_angle"), "ThoracoscapularShoulderModel": ("clav_prot", "shoulder_elv"),
    }[name]  # fmt: skip
    before = mw.osim.coordinates(model, data)
    mw.osim.set_coordinates(model, data, {alone[0]: before[alone[0]] - 0.03})
    after = mw.osim.coordinates(model, data)
    assert after[alone[0]] == pytest.approx(before[alone[0]] - 0.03, abs=1e-12)
    if alone[1]:
        assert after[alone[1]] == before[alone[1]]
    changed = [n for n in before if abs(after[n] - before[n]) > 1e-6]
    assert len(changed) >= 2  # what is tied has moved


def test_values_out_of_reach_are_refused_and_nothing_is_written() -> None:
    model, data = tied("tied_distance"), mujoco.MjData(tied("tied_distance"))
    mw.osim.set_coordinates(model, data, {"knee_angle": -0.5})
    before = data.qpos.copy(), data.eq_active.copy()
    with pytest.raises(mw.StateError, match=r"equality 'ligament' \(tendon\) is off by 0\.\d+ m or rad"):
        mw.osim.set_coordinates(model, data, {"knee_angle": -1.2, "block_slide": 0.0, "patella_angle": -0.1})
    np.testing.assert_array_equal(data.qpos, before[0])
    np.testing.assert_array_equal(data.eq_active, before[1])


def test_a_coordinate_that_equalities_hold_has_no_moment_arm() -> None:
    model = mujoco.MjModel.from_xml_string(
        """<mujoco><worldbody><site name="o" pos="0 0 1"/><body name="b"><joint name="q" axis="0 1 0"/>
        <geom size=".1"/><site name="s" pos=".3 0 0"/></body></worldbody>
        <equality><weld name="fixed" body1="b"/></equality>
        <custom><numeric name="optimal_force" data="9"/><tuple name="mjwrap_m"><element objtype="site" objname="o"/>
        <element objtype="site" objname="s"/><element objtype="numeric" objname="optimal_force"/></tuple></custom>
        </mujoco>"""
    )
    muscles, data = mw.MuscleSystem(model), mujoco.MjData(model)
    with pytest.raises(
        mw.GeometryError, match="'q' cannot move at this pose: equalities of the model hold it"
    ):
        muscles.moment_arms(data, "q")
    data.eq_active[:] = 0
    assert abs(muscles.moment_arms(data, "q")[0, 0]) > 0.1


@pytest.mark.parametrize("degrees", [False, True])
@pytest.mark.parametrize("name", ["tied_distance", "ThoracoscapularShoulderModel"])
def test_a_motion_of_opensims_coordinates_alone_is_a_motion_of_the_model(name: str, degrees: bool) -> None:
    """Axes of an ellipsoid, and joints of a coordinate that no joint shows, follow from the constraints."""
    model, data = tied(name), mujoco.MjData(tied(name))
    start, names, rows = values(name), settable(name), []
    for t in np.linspace(0.0, 1.0, 5):
        mw.osim.set_coordinates(model, data, {names[0]: start[names[0]] - 0.2 * np.sin(3.0 * t)})
        rows.append(data.qpos.copy())
    time = np.linspace(0.0, 0.4, 5)
    whole = mw.osim.motion_table(model, time, rows)
    kept = [n for n in names if n in whole.names]
    given = np.column_stack([whole[n] for n in kept])
    if degrees:
        stay = np.array(
            [n in ("block_slide", "patella_angle") for n in kept]
        )  # OpenSim calls the latter coupled
        given[:, ~stay] = np.degrees(given[:, ~stay])
    table = mw.Table(time, tuple(kept), given, {"inDegrees": "yes" if degrees else "no"})
    found = read_states(model, mw.MuscleSystem(model), mujoco.MjData(model), table)
    np.testing.assert_allclose(found.qpos, rows, rtol=0, atol=1e-9)


def test_a_start_closes_the_loops() -> None:
    model, data = tied("tied_weld"), mujoco.MjData(tied("tied_weld"))
    set_state(model, data, -1, {"q1": 0.2})
    assert data.qpos[model.joint("q1").qposadr[0]] == 0.2
    assert residual(model, data) < 1e-10
    with pytest.raises(mw.StateError, match="equality 'weld' \\(weld\\) is off by"):
        set_state(model, data, -1, {"q1": 0.2, "p_x": 0.29})
