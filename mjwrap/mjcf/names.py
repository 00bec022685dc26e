"""Names of a model's objects, for messages and for columns of tables."""

from __future__ import annotations

from collections.abc import Iterable

import mujoco

from mjwrap.mjcf.marks import driving_instances


def name_of(model: mujoco.MjModel, kind: mujoco.mjtObj, index: int) -> str:
    """Return an object's name, or #id if it has none."""
    return mujoco.mj_id2name(model, kind, index) or f"#{index}"


def names(model: mujoco.MjModel, kind: mujoco.mjtObj, count: int) -> list[str]:
    """Return the names of the first `count` objects of a kind; with their number as `count`, of all."""
    return [name_of(model, kind, i) for i in range(count)]


def listed(found: Iterable[str]) -> str:
    """Return names for a message: separated by commas, or "none"."""
    return ", ".join(found) or "none"


def has_plugin(model: mujoco.MjModel) -> bool:
    """Return whether mjwrap's engine plugin drives the muscles of a model."""
    return bool(driving_instances(model))


def qpos_names(model: mujoco.MjModel) -> list[str]:
    """Return a name for every entry of qpos: its joint's, with a number if the joint has several."""
    return _joint_names(model, model.jnt_qposadr.tolist(), model.nq)


def dof_names(model: mujoco.MjModel) -> list[str]:
    """Return a name for every entry of qvel, as `qpos_names` does."""
    return _joint_names(model, model.jnt_dofadr.tolist(), model.nv)


def _joint_names(model: mujoco.MjModel, starts: list[int], total: int) -> list[str]:
    ends = [*starts, total][1:]
    joints = (name_of(model, mujoco.mjtObj.mjOBJ_JOINT, j) for j in range(model.njnt))
    pairs = zip(joints, starts, ends, strict=True)
    return [each for name, first, last in pairs for each in _numbered(name, last - first)]


def act_names(model: mujoco.MjModel) -> list[str]:
    """Return a name for every entry of act: its actuator's, with a number if the actuator has several."""
    found: list[str] = []
    for i in range(model.nactuator):
        found += _numbered(name_of(model, mujoco.mjtObj.mjOBJ_ACTUATOR, i), int(model.actuator_actnum[i]))
    return found


def _numbered(name: str, count: int) -> list[str]:
    return [name] if count == 1 else [f"{name}[{i}]" for i in range(count)]
