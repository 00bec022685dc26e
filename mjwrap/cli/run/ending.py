"""What a run says at its end: where it ended, why nothing may have moved, and what it could have saved."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.mjcf import name_of
from mjwrap.mjcf.joint_ranges import joint_range
from mjwrap.runs.excitation import control_names
from mjwrap.runs.simulation import Simulation
from mjwrap.system import kinds
from mjwrap.text import counted

MOST = 6  # joints of which the position is told
LEFT = 0.05  # of its range; limits are soft, and a joint that rests on one is a little outside
STILL = 1e-6  # [rad, m] largest change of the position of a joint that has not moved
UNSAVED = (
    "nothing was saved: --plot FILE.png draws curves, --record FILE.rrd keeps a recording, --video FILE.gif a film, "
    "--out FILE.sto a table"
)


def ended(simulation: Simulation) -> str:
    """Return the time and the positions of the joints at the end, at most `MOST` of them: those that moved most.

    Hinges in degrees, slides in mm, balls by the angle from the reference [degrees], free joints by their place [mm].
    With its range, if a joint has left it by more than `LEFT`.
    """
    model, data = simulation.engine.model, simulation.engine.data
    moved = _changes(model, simulation.start, data.qpos)
    chosen = sorted(sorted(range(model.njnt), key=lambda j: -moved[j])[:MOST])
    parts = [
        f"{name_of(model, mujoco.mjtObj.mjOBJ_JOINT, j)} {_position(model, data.qpos, j)}"
        + _outside(model, data.qpos, j)
        for j in chosen
    ]
    rest = f" (of {counted(model.njnt, 'joint')} those that moved most)" if model.njnt > MOST else ""
    return f"ended at {data.time:.6g} s{' with ' * bool(parts)}{', '.join(parts)}{rest}"


def positions(simulation: Simulation) -> dict[str, list[float]]:
    """Return the position of every joint at the end, as in qpos [rad, m], by name."""
    model, data = simulation.engine.model, simulation.engine.data
    ends = [*model.jnt_qposadr.tolist(), model.nq][1:]
    return {
        name_of(model, mujoco.mjtObj.mjOBJ_JOINT, j): data.qpos[model.jnt_qposadr[j] : ends[j]].tolist()
        for j in range(model.njnt)
    }


def undriven(simulation: Simulation) -> str:
    """Return a sentence if all controls were zero during the whole run, which may be why nothing moved, else ""."""
    excitation = simulation.excitation
    if not excitation.names or simulation.prescribed.joints or simulation.driven:
        return ""
    model, data = simulation.engine.model, simulation.engine.data
    still = not model.njnt or max(_changes(model, simulation.start, data.qpos)) < STILL
    kind = kinds(simulation.muscles)
    pulling = [name for name in excitation.muscle_names if kind.get(name) != "cable"]
    one = (pulling or excitation.names)[0]
    add = f"add --excitation pulses, or for one of them --excitation {one}=constant:0.5"
    if not pulling:
        add = f"add --excitation {one}=constant:{_level(simulation.muscles.model, one):.3g}"
    if held := _set_points(model):
        shown = ", ".join(held[:MOST]) + ", ..." * (len(held) > MOST)
        return f"all controls were zero, which is a set point and not the absence of force for {shown}: {add}"
    if still:
        return f"nothing moved, because all controls are zero: {add}"
    return f"all controls were zero, so that only gravity, springs and passive forces moved it: {add}"


def _set_points(model: mujoco.MjModel) -> list[str]:
    """Return the actuators that act at a control of zero: servos of a position, and those whose range excludes zero."""
    found = []
    for i in range(model.nactuator):
        affine = int(model.actuator_biastype[i]) == int(mujoco.mjtBias.mjBIAS_AFFINE)
        first = int(model.actuator_ctrladr[i])
        limits = (
            model.actuator_ctrlrange[first] if np.ravel(model.actuator_ctrllimited)[first] else (0.0, 0.0)
        )
        if (affine and model.actuator_biasprm[i, :2].any()) or not limits[0] <= 0.0 <= limits[1]:
            found.append(name_of(model, mujoco.mjtObj.mjOBJ_ACTUATOR, i))
    return found


def _level(model: mujoco.MjModel, name: str) -> float:
    """Return a control to try: 0.5, or the middle of the range if this is out of it."""
    names = control_names(model)
    place = names.index(name) if name in names else -1
    if place < 0 or not np.ravel(model.actuator_ctrllimited)[place]:
        return 0.5
    low, high = model.actuator_ctrlrange[place].tolist()
    return 0.5 if low <= 0.5 <= high else 0.5 * (low + high)


def _changes(model: mujoco.MjModel, before: NDArray[np.float64], after: NDArray[np.float64]) -> list[float]:
    """Return by how much each joint has moved [rad or m]; a free joint by the larger of its translation and turn."""
    found = []
    for j in range(model.njnt):
        adr, kind = int(model.jnt_qposadr[j]), int(model.jnt_type[j])
        if kind in (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)):
            found.append(abs(float(after[adr] - before[adr])))
            continue
        free = kind == int(mujoco.mjtJoint.mjJNT_FREE)
        path = float(np.linalg.norm(after[adr : adr + 3] - before[adr : adr + 3])) if free else 0.0
        quat = slice(adr + 3, adr + 7) if free else slice(adr, adr + 4)
        found.append(max(path, _angle(before[quat], after[quat])))
    return found


def _angle(first: NDArray[np.float64], second: NDArray[np.float64]) -> float:
    """Return the angle [rad] between two orientations."""
    turn = np.zeros(3)
    mujoco.mju_subQuat(turn, second, first)
    return float(np.linalg.norm(turn))


def _position(model: mujoco.MjModel, qpos: NDArray[np.float64], joint: int) -> str:
    """Return the position of a joint as text."""
    adr, kind = int(model.jnt_qposadr[joint]), int(model.jnt_type[joint])
    if kind == int(mujoco.mjtJoint.mjJNT_HINGE):
        return f"{_rounded(np.degrees(qpos[adr]), 1)}°"
    if kind == int(mujoco.mjtJoint.mjJNT_SLIDE):
        return f"{_rounded(1e3 * qpos[adr], 2):g} mm"
    if kind == int(mujoco.mjtJoint.mjJNT_BALL):
        return f"{_rounded(np.degrees(_angle(np.array([1.0, 0.0, 0.0, 0.0]), qpos[adr : adr + 4])), 1)}°"
    return f"({', '.join(f'{_rounded(1e3 * x, 1):g}' for x in qpos[adr : adr + 3])}) mm"


def _outside(model: mujoco.MjModel, qpos: NDArray[np.float64], joint: int) -> str:
    """Return a remark on a hinge or slide that is clearly outside its range, else ""."""
    kind, adr = int(model.jnt_type[joint]), int(model.jnt_qposadr[joint])
    if kind not in (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)):
        return ""
    low, high = joint_range(model, joint) or (0.0, 0.0)
    if not max(low - qpos[adr], qpos[adr] - high) > LEFT * (high - low) > 0.0:
        return ""
    ends = np.zeros((2, model.nq))
    ends[:, adr] = low, high
    words = f", outside its range of {' to '.join(_position(model, end, joint) for end in ends)}"
    return words if model.jnt_limited[joint] else words + ", which is no limit"


def _rounded(value: float, digits: int) -> float:
    """Return a number with so many digits behind the point, and zero without a sign."""
    return round(float(value), digits) + 0.0
