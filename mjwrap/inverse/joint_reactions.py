"""Forces and moments in the joints along a motion.

Recursive Newton-Euler, MuJoCo's `mj_rnePostConstraint`: the wrench that crosses the joints of a body is the rate of
momentum of all bodies beyond them, less gravity, muscles and external loads there.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjwrap import validation
from mjwrap.errors import ModelError, StateError
from mjwrap.files import Table
from mjwrap.inverse.coordinates import quaternions, refuse_loops
from mjwrap.inverse.external_loads import GROUND, ExternalLoads, LoadFrames
from mjwrap.inverse.motion import CompleteMotion, Motion
from mjwrap.inverse.muscle_wrenches import muscle_wrenches
from mjwrap.mjcf import has_plugin, name_of, names
from mjwrap.mjcf.names import listed
from mjwrap.system import MuscleSystem
from mjwrap.text import nearest

Array = NDArray[np.float64]
SIDES = ("child", "parent")
PARTS = ("fx", "fy", "fz", "mx", "my", "mz", "px", "py", "pz")
_BODY, _JOINT = mujoco.mjtObj.mjOBJ_BODY, mujoco.mjtObj.mjOBJ_JOINT
_TURNING = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_BALL))
_FREE = int(mujoco.mjtJoint.mjJNT_FREE)
_SPRINGS = (
    "tendon_stiffness",
    "tendon_stiffnesspoly",
    "tendon_damping",
    "tendon_dampingpoly",
    "tendon_armature",
)


@dataclass(frozen=True)
class _Joint:
    """All joints of a body; centre: (3,) in the body, and where that is in the parent with all joints at zero."""

    body: int
    parent: int
    name: str
    in_child: Array
    in_parent: Array


def joint_reactions(
    muscles: MuscleSystem,
    motion: Motion,
    tension: ArrayLike,
    *,
    on: str = "child",
    frame: str = "ground",
    loads: ExternalLoads | None = None,
) -> Table:
    """Return the forces and moments in all joints along a motion, under given muscle tensions and external loads.

    Whatever generalised forces the motion needs besides (reserves, springs, followers' couplings) act along the joints
    and are part of the reactions, as in OpenSim's JointReaction. The joints of a body count as one, called like the
    first; a welded body's is called like the body.

    Args:
        muscles: of the model that moves.
        motion: its motion.
        tension: (T, n) [N] of `muscles.names`, ligaments included.
        on: the body on which they act: "child", or "parent" with the opposite force.
        frame: whose axes: "ground", "child", "parent" or a body's name.
        loads: external forces, None for none.

    Returns:
        A table with nine columns for each body: "knee_on_tibia_in_ground_fx", ..., force [N], moment [N m] about the
        joint's centre, "..._px" the centre [m] in the frame. The centre is that of the first hinge or ball, else of
        the first joint, else the body's origin; on the parent it is where that point is in the parent with the joints
        at zero.

    Raises:
        StateError: motion, tensions or loads do not fit, or side or frame are unknown.
        ModelError: a load acts on an unknown body, or something in the model has forces that a motion does not
            determine: equalities that close loops, tendon springs, fluids, flexes, the engine plugin.
        PathError: a muscle that pulls has no path at some frame.
    """
    validation.of_type(muscles, "MuscleSystem", "muscles", StateError)
    validation.instance(motion, Motion, "motion", StateError, "a mw.Motion")
    validation.choice(on, SIDES, "on", StateError)
    validation.instance(frame, str, "frame", StateError, "a name")
    validation.optional(loads, ExternalLoads, "loads", StateError, "mw.ExternalLoads")
    model = muscles.model
    _refuse(model)
    body = _frame(model, frame)
    whole = motion.completed(model)
    pulls = _tensions(tension, len(whole), muscles.n)
    joints = _joints(model)
    frames = LoadFrames(model, loads or ExternalLoads(()), whole.time)
    found = np.zeros((len(whole), len(joints), 9))
    data = mujoco.MjData(model)
    wrenches = muscle_wrenches(muscles, whole, pulls)
    for k in range(len(whole)):
        _newton_euler(model, data, whole, k, wrenches[k], frames)
        for joint, out in zip(joints, found[k], strict=True):
            axes = {"child": joint.body, "parent": joint.parent}.get(frame, body)
            _write(model, data, joint, on == "child", axes, frame in GROUND, out)
    bad = np.argwhere(~np.isfinite(found))
    if len(bad):
        raise StateError(f"the reactions at time {whole.time[bad[0][0]]:g} s are not finite")
    columns = [
        f"{joint.name}_on_{_called(model, joint.body if on == 'child' else joint.parent)}_in_{frame}_{part}"
        for joint in joints
        for part in PARTS
    ]
    header = {"header": "Joint Reactions", "inDegrees": "no"}
    return Table(whole.time, tuple(columns), found.reshape(len(whole), -1), header)


def _newton_euler(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    motion: CompleteMotion,
    k: int,
    muscles: Array,
    frames: LoadFrames,
) -> None:
    """Write cfrc_int of frame k: the wrench on each body from its parent, about the centre of mass of its tree."""
    data.qpos[:], data.qvel[:], data.qacc[:] = motion.qpos[k], motion.qvel[k], motion.qacc[k]
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_comVel(model, data)
    data.xfrc_applied[:] = muscles
    data.xfrc_applied[:, :3] -= (model.body_gravcomp * model.body_mass)[:, None] * model.opt.gravity
    frames.add_to_bodies(data, k, data.xfrc_applied)
    mujoco.mj_rnePostConstraint(model, data)


def _write(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    joint: _Joint,
    on_child: bool,
    axes: int,
    ground: bool,
    out: Array,
) -> None:
    """Write force, moment about the joint's centre, and the centre, in the axes of a body, to out (9,)."""
    wrench, b = data.cfrc_int[joint.body], joint.body if on_child else joint.parent
    point = data.xpos[b] + data.xmat[b].reshape(3, 3) @ (joint.in_child if on_child else joint.in_parent)
    lever = data.subtree_com[model.body_rootid[joint.body]] - point
    sign = 1.0 if on_child else -1.0
    turn = data.xmat[axes].reshape(3, 3).T
    out[:3] = turn @ (sign * wrench[3:])
    out[3:6] = turn @ (sign * (wrench[:3] + np.cross(lever, wrench[3:])))
    out[6:] = point if ground else turn @ (point - data.xpos[axes])


def _joints(model: mujoco.MjModel) -> list[_Joint]:
    """Return the joints of all bodies, in the order of the bodies."""
    zero = mujoco.MjData(model)
    zero.qpos[:] = 0.0
    for _, place, _ in quaternions(model):
        zero.qpos[place] = 1.0
    mujoco.mj_kinematics(model, zero)
    found = []
    for body in range(1, model.nbody):
        first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
        kinds = {j: int(model.jnt_type[j]) for j in range(first, first + count)}
        turning = [j for j, kind in kinds.items() if kind in _TURNING]
        centre = np.zeros(3)
        if kinds and kinds[first] != _FREE:
            centre = model.jnt_pos[(turning or [first])[0]].copy()
        parent = int(model.body_parentid[body])
        away = zero.xpos[body] + zero.xmat[body].reshape(3, 3) @ centre - zero.xpos[parent]
        name = name_of(model, _JOINT, first) if count else _called(model, body)
        found.append(_Joint(body, parent, name, centre, zero.xmat[parent].reshape(3, 3).T @ away))
    return found


def _called(model: mujoco.MjModel, body: int) -> str:
    return name_of(model, _BODY, body) if body else GROUND[0]


def _frame(model: mujoco.MjModel, frame: str) -> int:
    """Return the body whose axes are asked for; 0 where it is the child or the parent, too."""
    known = names(model, _BODY, model.nbody)
    if frame in (*SIDES, *GROUND):
        return 0
    if frame not in known:
        choices = listed(["ground", *SIDES, *known[1:]])
        raise StateError(f"frame: no body '{frame}'{nearest(frame, known)}; frames: {choices}")
    return known.index(frame)


def _tensions(given: ArrayLike, frames: int, n: int) -> Array:
    values = validation.numbers(given, "tension", StateError)
    if values.shape != (frames, n):
        raise StateError(f"tension must be ({frames}, {n}), a row for each frame, not {values.shape}")
    if not np.isfinite(values).all():
        raise StateError("tension must be finite")
    return np.ascontiguousarray(values)


def _refuse(model: mujoco.MjModel) -> None:
    """Raise `ModelError` where forces on bodies do not follow from motion, tensions and loads."""
    refuse_loops(
        model,
        "its force does not follow from motion and tensions, so the reactions of the loop's joints are not determined",
    )
    if has_plugin(model):
        raise ModelError(
            "the engine plugin drives the muscles of this model; take mjwrap.plugin.without_plugin(model)"
        )
    causes = {
        "springs, dampers or armature of tendons": any(
            np.any(getattr(model, each, 0.0)) for each in _SPRINGS
        ),
        "fluid forces (option density, viscosity)": bool(model.opt.density or model.opt.viscosity),
        "flexes": bool(model.nflex),
        "plugins": bool(model.nplugin),
    }
    for cause, present in causes.items():
        if present:
            raise ModelError(f"joint reactions do not include {cause}, which this model has; take them out")
