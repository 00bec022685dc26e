"""Check the couplings of joints: MuJoCo's equalities hold where followers are put, and a motion stays close to that."""

from __future__ import annotations

import copy

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.checking.outcome import Check
from mjwrap.errors import StateError
from mjwrap.mjcf import name_of
from mjwrap.mjcf.couplings import CoupledJoints
from mjwrap.poses.sizes import turning_dofs
from mjwrap.system.checks import ResetWatch
from mjwrap.system.pieces import PieceSwitch

Array = NDArray[np.float64]
SECONDS = 0.1  # of the motion
SPEED = 3.0, 0.3  # largest of a hinge [rad/s] and of a slide [m/s]
_JOINT = mujoco.mjtObj.mjOBJ_JOINT
_DISABLED = int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT) | int(mujoco.mjtDisableBit.mjDSBL_EQUALITY)


def check_couplings(model: mujoco.MjModel, start: Array, poses: Array) -> Check | None:
    """Return the check of all couplings at poses (n, nq), with the error in a motion from a pose as a remark.

    None if no joint follows another. In the motion the muscles do not pull.
    """
    couplings = CoupledJoints(model)
    if not couplings.leader:
        return None
    check = Check("couplings", "joints that follow others meet MuJoCo's equalities", 1e-9, "m or rad")
    if int(model.opt.disableflags) & _DISABLED:
        check.skipped = "the model's options switch equalities off"
        return check
    model = copy.copy(model)
    followers = {e: joint for joint, each in couplings.couplings.items() for e in each.equalities}
    data, pieces = mujoco.MjData(model), PieceSwitch(model)
    for k, pose in enumerate(poses):
        data.qpos[:] = pose
        couplings.place(data.qpos)
        pieces.set(data)
        mujoco.mj_fwdPosition(model, data)
        for row in range(data.ne):
            joint = followers.get(int(data.efc_id[row]), -1)
            if joint >= 0:
                where = f"joint '{name_of(model, _JOINT, joint)}', random pose {k}"
                check.see(abs(float(data.efc_pos[row])), where)
    check.remarks.append(_motion(model, couplings, pieces, start))
    return check


def _motion(model: mujoco.MjModel, couplings: CoupledJoints, pieces: PieceSwitch, start: Array) -> str:
    """Return in words how far the followers are from their places in a short motion at the model's time step."""
    data, rng = mujoco.MjData(model), np.random.default_rng(0)
    data.qpos[:] = start
    couplings.place(data.qpos)
    turning = turning_dofs(model)
    speed = np.where(turning, *SPEED) * rng.uniform(-1.0, 1.0, model.nv)
    data.qvel[:] = couplings.matrix(data.qpos) @ speed[couplings.independent]
    watch = ResetWatch(data)
    worst = {False: (0.0, ""), True: (0.0, "")}
    try:
        for _ in range(max(1, round(SECONDS / model.opt.timestep))):
            pieces.step(data)
            for joint, error in couplings.residuals(data.qpos).items():
                turns = bool(turning[model.jnt_dofadr[joint]])
                worst[turns] = max(worst[turns], (abs(error), name_of(model, _JOINT, joint)))
    except StateError as error:
        return f"not seen in a motion: {error}"
    if watch.reset:
        return "not seen in a motion, which became unstable"
    told = [f"{size:.1e} {'rad' if turns else 'm'} ({name})" for turns, (size, name) in worst.items() if name]
    return (
        f"in {SECONDS:g} s of motion, with {1e3 * model.opt.timestep:g} ms a step, joints are up to "
        f"{' and '.join(told)} from where they follow"
    )
