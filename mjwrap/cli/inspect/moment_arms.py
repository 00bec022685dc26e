"""The moment arms of all muscles at the reference pose, as values and as a table."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap import MuscleSystem
from mjwrap.mjcf.couplings import CoupledJoints
from mjwrap.model.kinematic_tree import crossed_dofs
from mjwrap.runs.models import single_joints
from mjwrap.text import aligned

Arms = dict[str, dict[str, float]]  # by muscle and coordinate; NaN without a path


def moment_arms(muscles: MuscleSystem, rest: NDArray[np.float64]) -> Arms:
    """Return the moment arms [m] about the independent joints that each muscle crosses, about a slide [-].

    A ball or free joint has one for each of its degrees of freedom, called JOINT[0] and so on.
    """
    model, data = muscles.model, mujoco.MjData(muscles.model)
    data.qpos[:] = rest
    couplings = CoupledJoints(model)
    names, columns = _coordinates(model, couplings)
    found = muscles.moment_arms(data, names)
    found[muscles.status != 0] = np.nan
    matrix = np.abs(couplings.matrix(data.qpos))
    moved = (crossed_dofs(model, muscles.declarations).astype(np.float64) @ matrix) > 0.0
    return {
        muscle: {columns[k]: float(found[i, k]) for k in np.flatnonzero(moved[i])}
        for i, muscle in enumerate(muscles.names)
    }


def _coordinates(model: mujoco.MjModel, couplings: CoupledJoints) -> tuple[list[str], list[str]]:
    """Return the names of all independent joints, and of their degrees of freedom, in the model's order."""
    joints = sorted({int(model.dof_jntid[d]) for d in couplings.independent})
    counts = {j: int((model.dof_jntid == j).sum()) for j in joints}
    names = {j: model.joint(j).name or f"#{j}" for j in joints}
    columns = [f"{names[j]}[{k}]" if counts[j] > 1 else names[j] for j in joints for k in range(counts[j])]
    return list(names.values()), columns


def arms_table(model: mujoco.MjModel, arms: Arms) -> str:
    """Return a line for each muscle: the joints that it crosses, with its moment arms in mm."""
    slides = {n for n, j in single_joints(model).items() if model.jnt_type[j] == mujoco.mjtJoint.mjJNT_SLIDE}
    free = np.flatnonzero(model.jnt_type == int(mujoco.mjtJoint.mjJNT_FREE)).tolist()
    slides |= {f"{model.joint(j).name or f'#{j}'}[{k}]" for j in free for k in range(3)}
    rows = []
    for muscle, values in arms.items():
        cells = [f"{name} {_value(arm, name in slides)}" for name, arm in values.items()]
        rows.append((f"  {muscle}", ", ".join(cells) or "crosses no joint"))
    head = (
        "moment arms at the reference pose, in mm (about a slide without unit), + drives the coordinate up:"
    )
    return "\n".join([head, *aligned(rows, (0, 1))]) if rows else ""


def _value(arm: float, slide: bool) -> str:
    if not np.isfinite(arm):
        return "no path"
    value = f"{arm if slide else 1e3 * arm:+.3g}"
    return value if abs(arm) >= 1e-12 else "0"
