"""Evaluate the muscles of a MuscleSystem at a state that `muscle_system.py` chooses."""

from __future__ import annotations

import weakref

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjwrap import validation
from mjwrap.errors import ModelError, PathError, StateError
from mjwrap.kernels.coupling import finite_checks, from_python
from mjwrap.mjcf import Declarations, has_plugin, read_declarations
from mjwrap.model.arrays import build_plan
from mjwrap.model.takeover import Takeover
from mjwrap.muscles.laws import ActuatorForce
from mjwrap.paths import Status
from mjwrap.system.checks import check_state, ends_inside
from mjwrap.system.pieces import PieceSwitch
from mjwrap.system.results import Array, Results
from mjwrap.system.state import State

_DISABLE_ACTUATION = int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
TOLERANCE = 1e-10  # largest tangency error of a path


class Evaluator(Results):
    """The muscles of a model, the state of each mjData, and the evaluation of all paths, states and tensions."""

    _last: State

    def __init__(self, model: mujoco.MjModel, *, strict: bool = False, side_rule: int | None = None) -> None:
        if not isinstance(model, mujoco.MjModel):
            validation.of_type(model, "MjModel", "model", ModelError)
        validation.flag(strict, "strict", ModelError)
        if has_plugin(model):
            raise ModelError(
                "the engine plugin already drives the muscles of this model (install): mj_step moves it, and "
                "mjwrap.plugin.read(data) reads it; for a MuscleSystem use mjwrap.plugin.without_plugin(model)"
            )
        self.strict = strict
        self._takeover = Takeover(model)
        with self._takeover.original_limits():
            found = self._declarations(model, side_rule)
        plan = build_plan(model, found.muscles)
        self._pieces = PieceSwitch(model)
        super().__init__(found, plan, model, State(model, plan))
        self._takeover.disable(
            [
                muscle.actuator
                for muscle in found.muscles
                if muscle.actuator >= 0 and not isinstance(muscle.parameters, ActuatorForce)
            ]
        )
        self._states: dict[int, State] = {}
        self._groups_off = 0
        self._off: NDArray[np.bool_] = np.zeros(plan.n, dtype=np.bool_)
        self._routes, self._muscles = plan.route_group(), plan.muscle_group(self._off)
        self._excitation: Array = np.zeros(self._plan.n)

    def _declarations(self, model: mujoco.MjModel, side_rule: int | None) -> Declarations:
        """Return the muscles to drive."""
        return read_declarations(model, side_rule=side_rule)

    @property
    def excitation(self) -> Array:
        """Excitations (n,) of muscles without an actuator: set single ones, or all; `StateError` for a wrong shape."""
        return self._excitation

    @excitation.setter
    def excitation(self, values: ArrayLike) -> None:
        given = validation.numbers(values, "excitation", StateError)
        if given.shape != self._excitation.shape:
            wanted = self._excitation.shape
            raise StateError(f"excitation must have shape {wanted}, one for each muscle, not {given.shape}")
        self._excitation[:] = given

    def _state(self, data: mujoco.MjData) -> State:
        if self._takeover.was_released():
            raise ModelError(
                "this MuscleSystem has released its actuators to MuJoCo; build a new MuscleSystem to go on"
            )
        if not isinstance(data, mujoco.MjData):
            validation.of_type(data, "MjData", "data", StateError)
        if data.model._address != self.model._address:
            raise StateError("this MjData belongs to a different model than this MuscleSystem")
        key = id(data)
        if key not in self._states:
            self._states[key] = State(self.model, self._plan)
            weakref.finalize(data, self._states.pop, key, None)
        return self._states[key]

    def _check(self, data: mujoco.MjData) -> None:
        """Raise `StateError` if a number of the state is not finite; the message names it."""
        if finite_checks.all_finite(
            data.qpos, data.qvel, data.act, data.ctrl, data.mocap_pos, data.mocap_quat, self._excitation
        ):
            return
        check_state(self.model, data)
        bad = finite_checks.first_bad(self._excitation)
        raise StateError(f"excitation of muscle '{self.names[bad]}' is not finite at time {data.time:g} s")

    def _evaluate(
        self, state: State, poses: mujoco.MjData, data: mujoco.MjData, since: float = 0.0, ahead: float = 0.0
    ) -> None:
        """Compute paths, activations, tensions and (state.wrench) wrenches at the poses and velocities of `poses`.

        since [s]: age of the states in `data`; ahead [s]: time for which the tensions will act.
        """
        self._switch_off()
        evaluate, points = from_python.evaluate, ()
        if state.points is not None:
            evaluate = from_python.evaluate_with_points
            points = (
                *state.points, poses.qpos, poses.qvel, poses.xpos, poses.xmat, self.model.site_pos,
            )  # fmt: skip
        failed = evaluate(
            *self._routes, *self._muscles,
            poses.site_xpos, poses.geom_xpos, poses.geom_xmat, poses.cvel, poses.subtree_com, poses.xipos, self._root,
            data.act, data.ctrl, state.own, self._excitation,
            since, ahead, self.model.opt.timestep,
            TOLERANCE,
            *state.paths, *state.start, *state.found,
            state.wrench, *points,
        )  # fmt: skip
        self._last = state
        state.time, state.evaluated = data.time, True
        state.in_scratch = poses is state.scratch
        if failed:
            self._failed(state, poses, data)

    def _write_jacobian(self, state: State, poses: mujoco.MjData, jacobian: Array) -> None:
        """Write dl/dq (n, nv) of the last evaluation, which took its poses from `poses`."""
        from_python.length_jacobian(
            *self._routes, *state.paths,
            self._last_dof, self._dofs[2], self._root, poses.cdof, poses.subtree_com,
            jacobian,
        )  # fmt: skip
        if self._plan.points is not None:
            uses, slopes = self._plan.points.uses, state.slopes
            from_python.add_point_columns(*self._routes, *state.paths, uses, slopes, jacobian)

    def _switch_off(self) -> None:
        """Note which muscles are switched off by the model's options: all, or those of an actuator group."""
        everything = bool(int(self.model.opt.disableflags) & _DISABLE_ACTUATION)
        off = -1 if everything else int(self.model.opt.disableactuator)
        if off != self._groups_off:
            actuators = [muscle.actuator for muscle in self.declarations]
            groups = [int(self.model.actuator_group[a]) if a >= 0 else -1 for a in actuators]
            self._off[:] = [everything or (g >= 0 and bool(off >> g & 1)) for g in groups]
            self._groups_off = off

    def _failed(self, state: State, poses: mujoco.MjData, data: mujoco.MjData) -> None:
        """Note which muscles have no path, and what acts instead; raise `PathError` if `strict` was given."""
        bad = np.flatnonzero(state.status)
        held = self.held
        if held.any():
            state.any_held = True
            state.kept_now |= held & (state.length > 0.0)
            state.forceless_now |= held & (state.length == 0.0)
        for i in bad:
            if state.last_failure[i] != state.status[i]:
                inside = state.status[i] == Status.ENDPOINT_INSIDE
                state.details[i] = ends_inside(self.model, poses, self.declarations[i]) if inside else ""
            state.last_failure[i] = state.status[i]
        first = int(bad[0])
        if (state.status == Status.NON_FINITE).any():
            first = int(np.flatnonzero(state.status == Status.NON_FINITE)[0])
            raise StateError(
                f"muscle '{self.names[first]}': a pose or force is not finite at time {data.time:g} s"
            )
        if self.strict:
            raise PathError(f"muscle '{self.names[first]}' at time {data.time:g} s: {self.reason(first)}")

    def _refresh(self, state: State, data: mujoco.MjData) -> mujoco.MjData:
        """Return scratch data with the kinematics of the present qpos and qvel: those in `data` may be one step old."""
        self._check(data)
        model, scratch = self.model, state.scratch
        scratch.qpos[:] = data.qpos
        scratch.qvel[:] = data.qvel
        scratch.mocap_pos[:] = data.mocap_pos
        scratch.mocap_quat[:] = data.mocap_quat
        mujoco.mj_kinematics(model, scratch)
        mujoco.mj_comPos(model, scratch)
        mujoco.mj_comVel(model, scratch)
        return scratch
