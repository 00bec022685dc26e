"""Load models by file or name, and set the states in which runs start."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.errors import ModelError
from mjwrap.mjcf import has_plugin, name_of, names, read_model, read_spec
from mjwrap.mjcf.couplings import CoupledJoints
from mjwrap.runs.angles import check_position
from mjwrap.system.projection import Projection
from mjwrap.text import nearest

INTEGRATORS = {
    "euler": mujoco.mjtIntegrator.mjINT_EULER,
    "rk4": mujoco.mjtIntegrator.mjINT_RK4,
    "implicit": mujoco.mjtIntegrator.mjINT_IMPLICIT,
    "implicitfast": mujoco.mjtIntegrator.mjINT_IMPLICITFAST,
}


def load(source: str) -> mujoco.MjModel:
    """Load an MJCF or MJB file, or a model by name, "mjwrap:NAME" or "myo_sim:NAME"; `ModelError` if that fails.

    A model with the engine plugin is returned without it, as it was before `install`.
    """
    model = read_model(source)
    if has_plugin(model):
        from mjwrap.plugin import without_plugin

        return without_plugin(model)
    return model


def load_spec(source: str) -> mujoco.MjSpec:
    """Return the spec of an MJCF file or of a model by name; `ModelError` for an MJB file, which has no spec."""
    return read_spec(source)


def start_keyframe(model: mujoco.MjModel, name: str | None) -> int:
    """Return the id of a keyframe, -1 for None; `ModelError`, which lists the keyframes, if there is no such one."""
    if name is None:
        return -1
    known = names(model, mujoco.mjtObj.mjOBJ_KEY, model.nkey)
    if name not in known:
        raise ModelError(
            f"no keyframe '{name}'{nearest(name, known)}; keyframes: {', '.join(known) or 'none'}"
        )
    return known.index(name)


def start_state(
    model: mujoco.MjModel, key: int, positions: Mapping[str, float] | None = None
) -> mujoco.MjData:
    """Return new data in the state that `set_state` sets."""
    data = mujoco.MjData(model)
    set_state(model, data, key, positions or {})
    return data


def set_state(model: mujoco.MjModel, data: mujoco.MjData, key: int, positions: Mapping[str, float]) -> None:
    """Reset data to a keyframe (-1: to qpos0), then set hinges and slides to positions [rad, m] by name.

    Joints that follow them, or that other equalities tie to them, and are not given themselves, are set too. Warns if a
    position lies outside its joint's range. Raises `StateError` if no pose with these positions satisfies the
    equalities, `ModelError` for a name that is not a hinge or slide, and for positions that only degrees can explain
    (`check_position`).
    """
    if key >= 0:
        mujoco.mj_resetDataKeyframe(model, data, key)
    given, before = [], data.qpos.copy()
    for name, value in positions.items():
        entry = f"{name}={value:g}"
        joint = find_joint(model, name, entry)
        data.qpos[model.jnt_qposadr[joint]] = value
        check_position(model, joint, value, f"'{entry}'")
        given.append(joint)
    place_followers(model, data, given)
    if given:
        _place_tied(model, data, given, before)


def _place_tied(
    model: mujoco.MjModel, data: mujoco.MjData, joints: list[int], before: NDArray[np.float64]
) -> None:
    """Move joints that equalities other than couplings tie to these joints, which stay where the data have them.

    before (nq,): the pose from which all of them come. Raises `StateError` if no pose satisfies the equalities.
    """
    projection = Projection(model)
    if not projection.equalities.active(data):
        return
    at = model.jnt_qposadr
    given = {joint: float(data.qpos[at[joint]]) for joint in joints}
    data.qpos[:] = before
    free = {joint: value for joint, value in given.items() if joint not in projection.couplings.leader}
    data.qpos[:] = projection.place(data, free)
    data.qpos[at[list(given)]] = list(given.values())


def place_followers(model: mujoco.MjModel, data: mujoco.MjData, joints: Collection[int]) -> None:
    """Set the joints that follow these joints by equalities to their positions and speeds; these joints stay."""
    couplings = CoupledJoints(model)
    qpos, qvel = data.qpos.copy(), data.qvel.copy()
    couplings.place(qpos)
    couplings.spread(qpos, qvel)
    for joint in couplings.leader:
        if joint not in joints and any(head in joints for head in couplings.heads(joint)):
            data.qpos[model.jnt_qposadr[joint]] = qpos[model.jnt_qposadr[joint]]
            data.qvel[model.jnt_dofadr[joint]] = qvel[model.jnt_dofadr[joint]]


def find_joint(model: mujoco.MjModel, name: str, entry: str) -> int:
    """Return the id of a hinge or slide; otherwise `ModelError`, which quotes the entry and lists the joints."""
    fit = single_joints(model)
    if name not in fit:
        raise ModelError(
            f"'{entry}': no hinge or slide '{name}'{nearest(name, fit)}; there are: "
            f"{', '.join(fit) or 'none'}"
        )
    return fit[name]


def single_joints(model: mujoco.MjModel) -> dict[str, int]:
    """Return the ids of all hinges and slides by name."""
    single = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
    return {
        name_of(model, mujoco.mjtObj.mjOBJ_JOINT, j): j
        for j in range(model.njnt)
        if int(model.jnt_type[j]) in single
    }
