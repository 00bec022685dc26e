"""Joint reactions equal Newton-Euler equations by hand and OpenSim's; forces balance on every body."""

from __future__ import annotations

import json
from typing import Any

import mujoco
import numpy as np
import pytest
from inverse_models import EVERY_JOINT, every_joint, swaying
from newton_euler import moved_bodies, rates_of_momentum
from opensim_inverse import DATA
from osim_models import compiled

import mjwrap as mw
from mjwrap.inverse.motion import CompleteMotion

Array = np.ndarray
FRAMES = 7
KINDS = ("hinge", "slide", "ball", "hinge slide", "slide hinge hinge", "", "ball slide")


def numbers(values: Array) -> str:
    return " ".join(f"{value:.17g}" for value in values)


def random_tree(seed: int) -> mujoco.MjModel:
    """Return six bodies with random joints, the first free or not, and four straight muscles between them."""
    rng = np.random.default_rng(seed)
    joined = ["free" if seed % 2 else "hinge", *rng.choice(KINDS, 5)]
    parents = [-1, *(int(rng.integers(-1 if k > 2 else 0, k)) for k in range(1, 6))]
    kept = "gravcomp='.3'" if seed % 3 == 0 else ""

    def body(k: int) -> str:
        inner = "".join(body(i) for i in range(6) if parents[i] == k)
        joints = "".join(
            f"<joint type='free' name='j{k}'/>" if kind == "free" else
            f"<joint name='j{k}_{i}' type='{kind}' axis='{numbers(rng.normal(size=3))}' "
            f"pos='{numbers(0.1 * rng.normal(size=3))}' stiffness='3' damping='.2' armature='.05'/>"
            for i, kind in enumerate(joined[k].split())
        )  # fmt: skip
        return (
            f"<body name='b{k}' pos='{numbers(0.4 * rng.normal(size=3))}' quat='{numbers(rng.normal(size=4))}' "
            f"{kept}>{joints}"
            f"<inertial pos='{numbers(0.1 * rng.normal(size=3))}' mass='{rng.uniform(0.5, 3):.6f}' "
            f"quat='{numbers(rng.normal(size=4))}' diaginertia='{numbers(rng.uniform(0.02, 0.03, 3))}'/>"
            f"<site name='s{k}' pos='{numbers(0.2 * rng.normal(size=3))}'/>{inner}</body>"
        )

    bodies = "".join(body(k) for k in range(6) if parents[k] == -1)
    pairs = [("world", "s5"), ("s0", "s3"), ("s1", "s4"), ("s2", "s5")]
    tendons = "".join(
        f"<spatial name='m{i}'><site site='{a}'/><site site='{b}'/></spatial>"
        for i, (a, b) in enumerate(pairs)
    )
    pulls = "".join(f"<muscle name='m{i}' tendon='m{i}' force='100' lengthrange='.1 3'/>" for i in range(4))
    return mujoco.MjModel.from_xml_string(
        f"<mujoco><option gravity='1 -2 -9'/><compiler inertiafromgeom='false'/><worldbody>"
        f"<site name='world' pos='2 1 1'/>{bodies}</worldbody>"
        f"<tendon>{tendons}</tendon><actuator>{pulls}</actuator></mujoco>"
    )


def random_loads(rng: np.random.Generator) -> mw.ExternalLoads:
    time = np.array([0.0, 1.0])
    force, point, torque = (np.tile(rng.normal(size=3), (2, 1)) for _ in range(3))
    return mw.ExternalLoads([mw.ExternalForce("b4", time, 20 * force, point, 5 * torque, "b3", "b4", "kick")])


class Hand:
    """What acts on each body of a random tree at one frame, by hand, and the rates of momentum that it has to cause."""

    def __init__(
        self, model: mujoco.MjModel, motion: CompleteMotion, k: int, tension: Array, loads: mw.ExternalLoads
    ) -> None:
        self.bodies = moved_bodies(model, motion.qpos[k], motion.qvel[k], motion.qacc[k])
        self.rates = rates_of_momentum(model, self.bodies)
        self.acting: list[list[tuple[Array, Array, Array]]] = [
            [] for _ in self.bodies
        ]  # force, torque, point
        none = np.zeros(3)
        for b, (_, _, centre) in enumerate(self.rates):
            weight = model.body_mass[b] * (1 - model.body_gravcomp[b]) * model.opt.gravity
            self.acting[b].append((weight, none, centre))
        for i, (first, second) in enumerate(((0, 6), (1, 4), (2, 5), (3, 6))):
            ends = [model.site(name).id for name in ("world", "s0", "s1", "s2", "s3", "s4", "s5")]
            sites = ends[first], ends[second]
            places = [self.bodies[model.site_bodyid[s]].at(model.site_pos[s]) for s in sites]
            along = (places[1] - places[0]) / np.linalg.norm(places[1] - places[0])
            for site, place, sign in zip(sites, places, (1, -1), strict=True):
                self.acting[model.site_bodyid[site]].append((sign * tension[i] * along, none, place))
        for load in loads:
            force, point, torque = (
                np.zeros((2, 3)) if x is None else x for x in (load.force, load.point, load.torque)
            )
            turn, on = self.bodies[model.body(load.force_frame).id].turn, model.body(load.body).id
            self.acting[on].append((turn @ force[0], turn @ torque[0], self.bodies[on].at(point[0])))

    def needed(self, b: int, about: Array) -> Array:
        """Return the wrench (6,) about a point that body b needs besides what acts on it."""
        rate, turning, centre = self.rates[b]
        found = np.concatenate([rate, turning + np.cross(centre - about, rate)])
        for force, torque, point in self.acting[b]:
            found -= np.concatenate([force, torque + np.cross(point - about, force)])
        return found

    def crossing(self, model: mujoco.MjModel, b: int, about: Array) -> Array:
        """Return the wrench that body b gets from its parent, about a point."""
        children = np.flatnonzero(model.body_parentid == b)
        return self.needed(b, about) + sum(
            (self.crossing(model, int(child), about) for child in children if child != b), np.zeros(6)
        )


def case(seed: int) -> tuple[mw.MuscleSystem, CompleteMotion, Array, mw.ExternalLoads]:
    model, rng = random_tree(seed), np.random.default_rng(100 + seed)
    motion = swaying(model, FRAMES, seed, 0.5).completed(model)
    return mw.MuscleSystem(model), motion, rng.uniform(0.0, 80.0, (FRAMES, 4)), random_loads(rng)


def blocks(table: mw.Table) -> Array:
    """Return force and moment (T, joints, 6) and place (T, joints, 3) of a table, in one array (T, joints, 9)."""
    return table.values.reshape(len(table.time), -1, 9)


@pytest.mark.parametrize("seed", range(8))
def test_reactions_are_those_of_newton_and_euler_by_hand(seed: int) -> None:
    """Rounding and little more: 1e-8 N and N m of some 100."""
    muscles, motion, tension, loads = case(seed)
    model = muscles.model
    found = blocks(mw.joint_reactions(muscles, motion, tension, loads=loads))
    size = 0.0
    for k in range(FRAMES):
        hand = Hand(model, motion, k, tension[k], loads)
        for b in range(1, model.nbody):
            wanted = hand.crossing(model, b, found[k, b - 1, 6:])
            size = max(size, np.abs(wanted).max())
            np.testing.assert_allclose(found[k, b - 1, :6], wanted, atol=1e-8, rtol=0)
            joints = range(model.body_jntadr[b], model.body_jntadr[b] + model.body_jntnum[b])
            turning = [j for j in joints if model.jnt_type[j] in (1, 3)]
            centre = model.jnt_pos[(turning or list(joints))[0]] if len(joints) else np.zeros(3)
            np.testing.assert_allclose(found[k, b - 1, 6:], hand.bodies[b].at(centre), atol=1e-10)
    assert size > 50.0


@pytest.mark.parametrize("seed", range(4))
def test_all_forces_on_each_body_cause_its_acceleration(seed: int) -> None:
    """The reaction on the child, those of its children on it, muscles, loads and weight: sum zero with its inertia."""
    muscles, motion, tension, loads = case(seed)
    model = muscles.model
    child, parent = (
        blocks(mw.joint_reactions(muscles, motion, tension, on=on, loads=loads)) for on in ("child", "parent")
    )
    for k in range(FRAMES):
        hand = Hand(model, motion, k, tension[k], loads)
        for b in range(1, model.nbody):
            total = -hand.needed(b, np.zeros(3))
            acting = [child[k, b - 1]] + [
                parent[k, c - 1] for c in range(1, model.nbody) if model.body_parentid[c] == b
            ]
            for wrench in acting:
                force, moment, place = wrench[:3], wrench[3:6], wrench[6:]
                total += np.concatenate([force, moment + np.cross(place, force)])
            np.testing.assert_allclose(total, 0.0, atol=1e-8)


def test_action_is_reaction() -> None:
    """The forces are opposite, and so are the moments once taken about the same point."""
    muscles, motion, tension, loads = case(3)
    child, parent = (
        blocks(mw.joint_reactions(muscles, motion, tension, on=on, loads=loads)) for on in ("child", "parent")
    )
    np.testing.assert_array_equal(parent[..., :3], -child[..., :3])
    arm = parent[..., 6:] - child[..., 6:]
    assert np.abs(arm).max() > 0.05
    np.testing.assert_allclose(
        parent[..., 3:6] + np.cross(arm, parent[..., :3]), -child[..., 3:6], atol=1e-10
    )


def test_frames_turn_the_same_vectors() -> None:
    muscles, motion, tension, _ = case(1)
    model, data = muscles.model, mujoco.MjData(muscles.model)
    ground = blocks(mw.joint_reactions(muscles, motion, tension))
    for frame in ("child", "parent", "b2", "world"):
        found = blocks(mw.joint_reactions(muscles, motion, tension, frame=frame))
        for k in range(FRAMES):
            data.qpos[:] = motion.qpos[k]
            mujoco.mj_kinematics(model, data)
            for b in range(1, model.nbody):
                body = {"child": b, "parent": model.body_parentid[b], "b2": model.body("b2").id, "world": 0}[
                    frame
                ]
                turn, place = data.xmat[body].reshape(3, 3), data.xpos[body]
                force, moment, centre = found[k, b - 1].reshape(3, 3) @ turn.T
                back = np.concatenate([force, moment, place + centre])
                np.testing.assert_allclose(back, ground[k, b - 1], atol=1e-11)


def test_columns_have_opensims_names() -> None:
    model = every_joint()
    motion = swaying(model, 7, 0)
    muscles = mw.MuscleSystem(model)
    table = mw.joint_reactions(muscles, motion, np.ones((7, 3)), on="parent", frame="child")
    assert table.names[0] == "root_on_ground_in_child_fx"
    assert table.names[18:27] == tuple(
        f"knee_on_thigh_in_child_{p}" for p in ["fx", "fy", "fz", "mx", "my", "mz", "px", "py", "pz"]
    )
    assert table.names[27].startswith("ankle_on_shank_in_child")


@pytest.mark.parametrize("name", ["arm26", "leg6dof9musc", "gait10dof18musc"])
def test_they_are_opensims(name: str) -> None:
    """Accelerations and tensions are OpenSim's; a parabola through each state has its rates exactly."""
    record = json.loads((DATA / f"reactions_{name}.json").read_text())
    model = compiled(name)
    muscles = mw.MuscleSystem(model)
    size = 0.0
    for state in record["states"]:
        time = np.linspace(-0.03, 0.03, 7)
        q, u, a = (np.array(state[key]) for key in ("values", "speeds", "accelerations"))
        values = q + np.outer(time, u) + 0.5 * np.outer(time**2, a)
        motion = mw.Motion.from_table(model, mw.Table(time, tuple(record["coordinates"]), values))
        tension = np.zeros((7, muscles.n))
        for muscle, pull in zip(record["muscles"], state["tension"], strict=True):
            tension[:, muscles.names.index(muscle)] = pull
        found = [mw.joint_reactions(muscles, motion, tension, on=on) for on in ("child", "parent")]
        for joint, child in record["joints"].items():
            body = model.body(child).id
            if not model.body_jntnum[body] and not model.body_mass[body] and model.body_parentid[body]:
                continue  # the import adds the mass of welded toes to the foot
            loads = state["reactions"][joint]
            for table, wrench, place in zip(found, loads[:2], loads[2:], strict=True):
                mine = blocks(table)[3, body - 1]
                np.testing.assert_allclose(mine[6:], place, atol=1e-7, rtol=0)
                moment = mine[3:6] + np.cross(
                    mine[6:] - place, mine[:3]
                )  # about the origin of OpenSim's frame
                np.testing.assert_allclose(mine[:3], wrench[:3], atol=1e-5, rtol=0)
                np.testing.assert_allclose(moment, wrench[3:], atol=1e-5, rtol=0)
                size = max(size, np.abs(wrench).max())
    assert size > 100.0


def test_wrong_input_is_named() -> None:
    muscles, motion, tension, loads = case(1)
    for changed, words in (
        ({"on": "both"}, "on"),
        ({"frame": "b9"}, "no body 'b9'.*frames: ground, child, parent, b0"),
        ({"tension": tension[:-1]}, r"tension must be \(7, 4\), a row for each frame, not \(6, 4\)"),
        ({"tension": tension * np.nan}, "tension must be finite"),
        ({"loads": 3}, "ExternalLoads"),
        ({"motion": "walk.mot"}, r"mw\.Motion"),
    ):
        given: dict[str, Any] = {"motion": motion, "tension": tension, "loads": loads} | changed
        with pytest.raises(mw.StateError, match=words):
            mw.joint_reactions(muscles, **given)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("<option density='1.2'/>", "fluid forces"),
        (
            "<equality><connect name='pin' body1='foot' body2='trunk' anchor='0 0 0'/></equality>",
            "equality 'pin'",
        ),
        (
            "<tendon><spatial stiffness='9'><site site='heel'/><site site='anchor'/></spatial></tendon>",
            "of tendons",
        ),
    ],
)
def test_forces_that_a_motion_does_not_determine_are_refused(change: str, words: str) -> None:
    model = mujoco.MjModel.from_xml_string(EVERY_JOINT.replace("</mujoco>", change + "</mujoco>"))
    muscles, motion = mw.MuscleSystem(model), swaying(model, 7, 0)
    with pytest.raises(mw.ModelError, match=words):
        mw.joint_reactions(muscles, motion, np.ones((7, 3)))


THROUGH = """<mujoco><worldbody><site name="a"/><site name="b" pos="0 0 .5"/><body name="ball" pos=".2 0 .1">
<joint name="slide" type="slide" axis="1 0 .5"/><geom name="ball" size=".1" mass="1"/></body></worldbody>
<tendon><spatial name="s"><site site="a"/><geom geom="ball"/><site site="b"/></spatial></tendon>
<actuator><muscle name="stuck" tendon="s" lengthrange=".1 2"/></actuator></mujoco>"""


def test_a_muscle_that_pulls_without_a_path_is_named() -> None:
    """A ball moves until the string's origin is at its centre; a muscle that does not pull then needs none."""
    model = mujoco.MjModel.from_xml_string(THROUGH)
    muscles = mw.MuscleSystem(model)
    motion = mw.Motion([0.0, 1.0, 2.0], [[0.0], [-np.hypot(0.2, 0.1)], [0.0]])
    found = mw.joint_reactions(muscles, motion, [[1.0], [0.0], [1.0]])
    assert np.isfinite(found.values).all()
    with pytest.raises(mw.PathError, match=r"muscle 'stuck' at time 1 s: no path \(endpoint_inside\)"):
        mw.joint_reactions(muscles, motion, np.ones((3, 1)))
