"""Check the state of a simulation: is it finite, has MuJoCo reset it, which sites lie inside surfaces?"""

from __future__ import annotations

import mujoco
import numpy as np

from mjwrap.errors import StateError
from mjwrap.kernels import layout
from mjwrap.kernels.coupling import finite_checks
from mjwrap.kernels.geometry.dispatch import height
from mjwrap.mjcf import MuscleDeclaration, name_of
from mjwrap.mjcf.conditional_points import holds
from mjwrap.model.arrays import kernel_rows

_BADQPOS = int(mujoco.mjtWarning.mjWARN_BADQPOS)
_BADQVEL = int(mujoco.mjtWarning.mjWARN_BADQVEL)
_BADQACC = int(mujoco.mjtWarning.mjWARN_BADQACC)


class ResetWatch:
    """Find out whether MuJoCo resets data because the state is not finite or too large.

    A reset sets MuJoCo's counts of warnings to zero, so that a second one leaves the same counts as the first. So they
    are counted from zero here; `end` adds the earlier ones. time: of the last step that began [s].
    """

    def __init__(self, data: mujoco.MjData) -> None:
        self._data, self.time = data, float(data.time)
        self._warnings = [data.warning[k] for k in (_BADQPOS, _BADQVEL, _BADQACC)]
        self._earlier = [warning.number for warning in self._warnings]
        self._found: bool | None = None  # at the end
        for warning in self._warnings:
            warning.number = 0

    def begin(self) -> None:
        """Note that a step begins."""
        self.time = float(self._data.time)

    @property
    def reset(self) -> bool:
        """Whether MuJoCo has reset the data."""
        return any(warning.number for warning in self._warnings) if self._found is None else self._found

    def end(self) -> None:
        """Restore the earlier counts, unless a reset has cleared them."""
        self._found = self.reset
        if not self._found:
            for warning, number in zip(self._warnings, self._earlier, strict=True):
                warning.number = number

    def error(self) -> StateError:
        """Return the error for a reset."""
        return StateError(
            f"the motion became unstable at about time {self.time:g} s and MuJoCo reset the data; "
            "a smaller time step or more joint damping may help"
        )


def ends_inside(model: mujoco.MjModel, poses: mujoco.MjData, muscle: MuscleDeclaration) -> str:
    """Return as text which sites of a muscle lie inside their neighbouring surfaces at the given poses, or ""."""
    found = []
    for route in (r for r in muscle.routes if holds(model, r.when, poses.qpos)):
        for node, before, after in route.geom_ends():
            if node.inside:
                continue
            for site in dict.fromkeys((before, after)):
                local = poses.geom_xmat[node.geom].reshape(3, 3).T @ (
                    poses.site_xpos[site] - poses.geom_xpos[node.geom]
                )
                row = np.array(kernel_rows(node))
                if height(row, 0, *local.tolist()) < -layout.AS_WRITTEN * row[0, layout.SIZE]:
                    inner = name_of(model, mujoco.mjtObj.mjOBJ_SITE, site)
                    outer = name_of(model, mujoco.mjtObj.mjOBJ_GEOM, node.geom)
                    found.append(f"site '{inner}' is inside geom '{outer}'")
    return "; ".join(found)


def check_state(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Raise `StateError` if a number of the state is not finite; the message names it."""
    for what, values in (
        ("qpos", data.qpos),
        ("qvel", data.qvel),
        ("act", data.act),
        ("ctrl", data.ctrl),
        ("mocap_pos", data.mocap_pos.ravel()),
        ("mocap_quat", data.mocap_quat.ravel()),
    ):
        bad = finite_checks.first_bad(values)
        if bad >= 0:
            raise StateError(f"{what}[{bad}]{_owner(model, what, bad)} is not finite at time {data.time:g} s")


def _owner(model: mujoco.MjModel, what: str, index: int) -> str:
    kinds = mujoco.mjtObj
    if what == "qpos":
        joint = int(np.searchsorted(model.jnt_qposadr, index, side="right")) - 1
        return f" (joint '{name_of(model, kinds.mjOBJ_JOINT, joint)}')"
    if what == "qvel":
        return f" (joint '{name_of(model, kinds.mjOBJ_JOINT, int(model.dof_jntid[index]))}')"
    if what in ("ctrl", "act"):
        first, count = (
            (model.actuator_ctrladr, model.actuator_ctrlnum)
            if what == "ctrl"
            else (model.actuator_actadr, model.actuator_actnum)
        )
        actuator = int(np.flatnonzero((first <= index) & (index < first + count))[0])
        return f" (actuator '{name_of(model, kinds.mjOBJ_ACTUATOR, actuator)}')"
    body = int(np.flatnonzero(model.body_mocapid == index // (3 if what == "mocap_pos" else 4))[0])
    return f" (mocap body '{name_of(model, kinds.mjOBJ_BODY, body)}')"
