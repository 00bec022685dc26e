"""Simulate a model twice with the same controls, along MuJoCo's tendons and along mjwrap's paths."""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.errors import MjwrapError
from mjwrap.mjcf import dof_names, name_of
from mjwrap.mjcf.tuple_names import declares_muscle
from mjwrap.model.takeover import Takeover
from mjwrap.runs.control_limits import check_levels
from mjwrap.runs.excitation import Excitation
from mjwrap.system import CableSystem, MuscleSystem
from mjwrap.system.pieces import PieceSwitch
from mjwrap.text import counted

Array = NDArray[np.float64]
_HINGE, _SLIDE = (int(x) for x in (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE))
_UNSTABLE = (
    int(mujoco.mjtWarning.mjWARN_BADQPOS),
    int(mujoco.mjtWarning.mjWARN_BADQVEL),
    int(mujoco.mjtWarning.mjWARN_BADQACC),
)


@dataclass
class MotionDifference:
    """Both runs of a comparison, and their difference.

    Attributes:
        time: (T,) [s].
        native: (T, nq) positions with MuJoCo's tendons.
        mjwrap: (T, nq) positions with mjwrap's paths.
        difference: (T, nv) mjwrap minus MuJoCo, by degree of freedom.
        dofs: names of the degrees of freedom.
        places: (nv,) index in qpos of each degree of freedom; for ball and free joints that of the joint's first.
        stopped: why a run ended early, or empty.
        paths: muscles without a path at some steps of mjwrap's run, the reason, and what acted instead; a line each.
        turns: (nv,) whether each degree of freedom is an angle.
        alone: (nv,) whether it is its joint's only one, so that `places` leads to its own position.
    """

    time: Array
    native: Array
    mjwrap: Array
    difference: Array
    dofs: list[str]
    places: list[int]
    stopped: str = ""
    paths: str = ""
    turns: tuple[bool, ...] = ()
    alone: tuple[bool, ...] = ()

    def worst(self) -> tuple[str, float, float]:
        """Return the dof that differs most, by how much [m or rad], and when [s]."""
        if not self.difference.size:
            return "", 0.0, 0.0
        t, d = np.unravel_index(int(np.argmax(np.abs(self.difference))), self.difference.shape)
        return self.dofs[int(d)], float(self.difference[t, d]), float(self.time[t])

    def final(self) -> tuple[str, float]:
        """Return the dof that differs most at the end, and by how much [m or rad]."""
        if not self.difference.size:
            return "", 0.0
        d = int(np.argmax(np.abs(self.difference[-1])))
        return self.dofs[d], float(self.difference[-1, d])

    def unit(self, dof: str) -> str:
        """Return the unit of a degree of freedom: rad or m."""
        return "rad" if self.turns[self.dofs.index(dof)] else "m"


def unstable(data: mujoco.MjData) -> bool:
    """Return whether MuJoCo has reset an unstable state, which it does without an exception."""
    return any(int(data.warning[kind].number) for kind in _UNSTABLE)


def pristine(model: mujoco.MjModel) -> mujoco.MjModel:
    """Return a copy in which every native actuator pulls, even if a `MuscleSystem` drives the original."""
    with Takeover(model).original_limits():
        return copy.copy(model)


def with_native_laws(model: mujoco.MjModel) -> tuple[mujoco.MjModel, list[str]]:
    """Return a copy in which all muscles have MuJoCo's curves, and the names of the muscles that had another law.

    So only the paths differ in both simulations. Muscles whose actuator has no muscle curves keep their law.
    """
    model = pristine(model)
    dropped = (int(mujoco.mjtObj.mjOBJ_NUMERIC), int(mujoco.mjtObj.mjOBJ_TEXT))
    changed: list[str] = []
    for i in range(model.ntuple):
        rows = range(int(model.tuple_adr[i]), int(model.tuple_adr[i]) + int(model.tuple_size[i]))
        actuators = [
            int(model.tuple_objid[r])
            for r in rows
            if int(model.tuple_objtype[r]) == int(mujoco.mjtObj.mjOBJ_ACTUATOR)
        ]
        if not declares_muscle(name_of(model, mujoco.mjtObj.mjOBJ_TUPLE, i)) or not actuators:
            continue
        if int(model.actuator_gaintype[actuators[0]]) != int(mujoco.mjtGain.mjGAIN_MUSCLE):
            continue
        ranges = [r + 1 for r in rows if int(model.tuple_objtype[r]) == int(mujoco.mjtObj.mjOBJ_JOINT)]
        kept = [r for r in rows if int(model.tuple_objtype[r]) not in dropped or r in ranges]
        if len(kept) == len(rows):
            continue
        for field in (model.tuple_objtype, model.tuple_objid, model.tuple_objprm):
            field[rows[0] : rows[0] + len(kept)] = field[kept]
        model.tuple_size[i] = len(kept)
        changed.append(name_of(model, mujoco.mjtObj.mjOBJ_ACTUATOR, actuators[0]))
    return model, changed


def compare_motion(
    model: mujoco.MjModel,
    entries: Sequence[str],
    duration: float,
    *,
    key: int = -1,
    qpos: Array | None = None,
    seed: int = 0,
    side_rule: int | None = None,
    progress: Callable[[int], object] | None = None,
) -> MotionDifference:
    """Simulate a model twice from the same state, along MuJoCo's tendons and along mjwrap's paths.

    Args:
        model: the model; it is not changed.
        entries: excitations, as `Excitation` takes them.
        duration: of the run [s].
        key: a keyframe to start from, or -1.
        qpos: (nq,) a start position, in place of a keyframe.
        seed: for random excitations.
        side_rule: of mjwrap's paths, as for `MuscleSystem`.
        progress: called after every step.

    Returns:
        Both motions and their difference.
    """
    native_model, driven_model = pristine(model), pristine(model)
    muscles = CableSystem(driven_model, side_rule=side_rule)
    excitation, pieces = Excitation(muscles, entries, seed), PieceSwitch(native_model)
    check_levels(muscles, excitation)
    native, driven = mujoco.MjData(native_model), mujoco.MjData(driven_model)
    for each, data in ((native_model, native), (driven_model, driven)):
        if key >= 0:
            mujoco.mj_resetDataKeyframe(each, data, key)
        if qpos is not None:
            data.qpos[:] = qpos
    times, theirs, ours, stopped = [0.0], [native.qpos.copy()], [driven.qpos.copy()], ""
    for _ in range(round(duration / float(model.opt.timestep))):
        excitation.write(native, own=False)
        excitation.write(driven)
        pieces.step(native)
        try:
            if unstable(native):
                stopped = f"MuJoCo's own run became unstable at {times[-1]:g} s"
            muscles.step(driven)
        except MjwrapError as error:
            stopped = f"{stopped}; " * bool(stopped) + f"mjwrap's run stopped: {error}"
        if stopped:
            break
        times.append(float(native.time))
        theirs.append(native.qpos.copy())
        ours.append(driven.qpos.copy())
        if progress is not None:
            progress(1)
    gap = np.zeros((len(times), model.nv))
    for row, a, b in zip(gap, theirs, ours, strict=True):
        mujoco.mj_differentiatePos(model, row, 1.0, a, b)
    runs = np.array(times), np.array(theirs), np.array(ours)
    kinds = model.jnt_type[model.dof_jntid]
    turns = [_turns(model, d, int(kind)) for d, kind in enumerate(kinds)]
    alone = [int(kind) in (_HINGE, _SLIDE) for kind in kinds]
    return MotionDifference(
        *runs, gap, dof_names(model), _places(model), stopped, _paths(muscles), tuple(turns), tuple(alone)
    )


def _turns(model: mujoco.MjModel, dof: int, kind: int) -> bool:
    """Return whether a degree of freedom of a kind of joint is an angle."""
    axis = dof - int(model.jnt_dofadr[model.dof_jntid[dof]])
    return kind != _SLIDE and (kind != int(mujoco.mjtJoint.mjJNT_FREE) or axis > 2)


def _paths(muscles: MuscleSystem) -> str:
    """Return a line for each muscle without a path at some steps: how many, the last reason, and what acted instead."""
    state = muscles._last
    lines = muscles.report().splitlines()
    failed = [i for i, count in enumerate(muscles.failures) if count]
    told = []
    for line, i in zip(lines, failed, strict=True):
        steps = int(muscles.failures[i])
        acted = [
            (int(state.kept[i]), "its last valid force was kept"),
            (int(state.forceless[i]), "it had no force, because it had had no path before"),
        ]
        # under Runge-Kutta a step may have several of these, at its stages
        continued = steps - min(steps, sum(count for count, _ in acted))
        acted.append((continued, "its length was continued from the surface"))
        acted = [(count, what) for count, what in acted if count]
        words = [what if count == steps else f"{what} at {counted(count, 'step')}" for count, what in acted]
        told.append(f"{line}; {', '.join(words)}")
    return "\n".join(told)


def _places(model: mujoco.MjModel) -> list[int]:
    return [int(model.jnt_qposadr[int(model.dof_jntid[d])]) for d in range(model.nv)]
