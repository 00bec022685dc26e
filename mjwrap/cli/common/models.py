"""Models by name, start states, and joints that are named on the command line."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from typing import Any

import mujoco

from mjwrap.cli.common.errors import UserError
from mjwrap.mjcf import name_of, names, read_model

INTEGRATORS = {
    "euler": mujoco.mjtIntegrator.mjINT_EULER,
    "rk4": mujoco.mjtIntegrator.mjINT_RK4,
    "implicit": mujoco.mjtIntegrator.mjINT_IMPLICIT,
    "implicitfast": mujoco.mjtIntegrator.mjINT_IMPLICITFAST,
}
_MYO = "myo_sim:"


def load(source: str) -> mujoco.MjModel:
    """Load an MJCF or MJB file, or "myo_sim:NAME", a model that the myo_sim package composes."""
    return load_spec(source).compile() if source.startswith(_MYO) else read_model(source)


def load_spec(source: str) -> mujoco.MjSpec:
    """Return the spec of an MJCF file or of "myo_sim:NAME"; `UserError` for an MJB file, which has none."""
    if not source.startswith(_MYO):
        read_model(source)  # says what is wrong with it
        if source.lower().endswith(".mjb"):
            raise UserError(f"'{source}' is an MJB file, which cannot be changed; give its XML instead")
        return mujoco.MjSpec.from_file(source)
    name = source.removeprefix(_MYO)
    try:
        import myo_sim
    except ImportError:
        raise UserError(f"'{source}' needs the myo-sim package: pip install 'mjwrap[myo]'") from None
    known = sorted({*myo_sim.REGISTRY, *myo_sim._composed_models()})
    if name not in known:
        raise UserError(f"myo_sim has no model '{name}'; it has: {', '.join(known)}")
    postures = {"postures": True} if myo_sim.list_postures(name) else None
    spec: Any = myo_sim.load_spec(name, build_kwargs=postures)
    return spec


def start_keyframe(model: mujoco.MjModel, name: str | None) -> int:
    """Return the id of a keyframe, -1 for None."""
    if name is None:
        return -1
    known = names(model, mujoco.mjtObj.mjOBJ_KEY, model.nkey)
    if name not in known:
        raise UserError(f"no keyframe '{name}'; keyframes: {', '.join(known) or 'none'}")
    return known.index(name)


def start_state(model: mujoco.MjModel, key: int, positions: Sequence[str] = ()) -> mujoco.MjData:
    """Return data at a keyframe (-1: qpos0) with single joints at given positions ("name=value", rad or m)."""
    data = mujoco.MjData(model)
    set_state(model, data, key, positions)
    return data


def set_state(model: mujoco.MjModel, data: mujoco.MjData, key: int, positions: Sequence[str]) -> None:
    """Put data where `start_state` begins; warn of positions outside a joint's range."""
    if key >= 0:
        mujoco.mj_resetDataKeyframe(model, data, key)
    for entry in positions:
        name, equals, text = entry.rpartition("=")
        if not equals:
            raise UserError(f"--qpos '{entry}': write JOINT=VALUE, such as {entry}=0.5 [rad or m]")
        joint = find_joint(model, name, entry)
        value = number(text, f"'{entry}'")
        data.qpos[model.jnt_qposadr[joint]] = value
        low, high = model.jnt_range[joint]
        if model.jnt_limited[joint] and not low <= value <= high:
            unit = "m" if model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_SLIDE else "rad"
            warnings.warn(
                f"'{entry}' lies outside the joint's range, {low:g} to {high:g} {unit}", stacklevel=2
            )


def find_joint(model: mujoco.MjModel, name: str, entry: str) -> int:
    """Return the id of a hinge or slide."""
    fit = single_joints(model)
    if name not in fit:
        raise UserError(f"'{entry}': no hinge or slide '{name}'; there are: {', '.join(fit) or 'none'}")
    return fit[name]


def single_joints(model: mujoco.MjModel) -> dict[str, int]:
    """Return the ids of all hinges and slides by name."""
    single = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
    return {
        name_of(model, mujoco.mjtObj.mjOBJ_JOINT, j): j
        for j in range(model.njnt)
        if int(model.jnt_type[j]) in single
    }


def number(text: str, where: str) -> float:
    """Return a finite number, or say where it is not one."""
    try:
        value = float(text)
    except ValueError:
        raise UserError(f"{where}: {text!r} is not a number") from None
    if not math.isfinite(value):
        raise UserError(f"{where}: {text} is not finite")
    return value
