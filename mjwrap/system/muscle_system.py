"""MuscleSystem: the only reader and writer of mjData.

Forces belong to the state at which they act, at every stage of the integrator. So `step` evaluates the muscles between
MuJoCo's position and acceleration stages, and under RK4 in a control callback that lives only as long as the step.
"""

from __future__ import annotations

import weakref

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjwrap.errors import ModelError, PathError, StateError
from mjwrap.kernels import coupling, evaluation, readiness
from mjwrap.mjcf import read_declarations
from mjwrap.paths import Status
from mjwrap.plan import build_plan
from mjwrap.system.callback import control_callback
from mjwrap.system.checks import check_state, ends_inside, resets
from mjwrap.system.derivatives import length_jacobian_rate
from mjwrap.system.results import Array, Results
from mjwrap.system.state import State
from mjwrap.takeover import Takeover

_RK4 = int(mujoco.mjtIntegrator.mjINT_RK4)
_DISABLE_ACTUATION = int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
TOLERANCE = 1e-10  # largest tangency error of a path


class MuscleSystem(Results):
    """Every muscle that a model declares, driven along geodesic paths.

    model: an `MjModel`; its muscle actuators that mjwrap takes over keep their activation dynamics but pull no more
    (`actuator_forcerange` is set to zero until `release`). strict: raise `PathError` where a path cannot be found,
    instead of holding the muscle's last good force for that step. Raises `ModelError` for declarations that cannot be
    understood. Results (`length`, `velocity`, `tension`, `activation`, `status`, each (n,)) are those of the last
    `forward`, `apply` or `step`, at the state at which its forces acted. SI units; lengthening and tension positive.
    """

    def __init__(self, model: mujoco.MjModel, *, strict: bool = False) -> None:
        if not isinstance(model, mujoco.MjModel):
            raise ModelError(
                f"expected an MjModel (of an MjSpec: spec.compile()), not {type(model).__name__}"
            )
        self.model = model
        self.strict = strict
        self._takeover = Takeover(model)
        with self._takeover.suspended():
            found = read_declarations(model)
        super().__init__(found, build_plan(model, found.muscles), model)
        self._takeover.silence([muscle.actuator for muscle in found.muscles if muscle.actuator >= 0])
        self._states: dict[int, State] = {}
        self._groups_off = 0
        self._off = np.zeros(self._plan.n, dtype=np.bool_)
        self.excitation: Array = np.zeros(self._plan.n)
        self._root = np.asarray(model.body_rootid, dtype=np.int64)
        self._parent = np.asarray(model.body_parentid, dtype=np.int64)
        self._dofs = tuple(
            np.asarray(a, dtype=np.int64) for a in (model.body_dofadr, model.body_dofnum, model.dof_parentid)
        )

    # ----------------------------------------------------------------------------------- evaluation

    def _state(self, data: mujoco.MjData) -> State:
        if self._takeover.lost():
            raise ModelError(
                "the actuators of this model pull by themselves again (release); build a new MuscleSystem to go on"
            )
        if not isinstance(data, mujoco.MjData):
            raise StateError(f"expected an MjData, not {type(data).__name__}")
        if data.model._address != self.model._address:
            raise StateError("this MjData belongs to another model than this MuscleSystem")
        key = id(data)
        if key not in self._states:
            self._states[key] = State(self.model, self._plan)
            weakref.finalize(data, self._states.pop, key, None)
        return self._states[key]

    def _check(self, data: mujoco.MjData) -> None:
        """Raise `StateError` naming what is not finite."""
        if readiness.all_finite(
            data.qpos, data.qvel, data.act, data.ctrl, data.mocap_pos, data.mocap_quat, self.excitation
        ):
            return
        check_state(self.model, data)
        bad = readiness.first_bad(self.excitation)
        raise StateError(f"excitation of muscle '{self.names[bad]}' is not finite at time {data.time:g} s")

    def _evaluate(self, state: State, poses: mujoco.MjData, data: mujoco.MjData) -> None:
        """Paths, activations and tensions from the poses and velocities of `poses`; wrenches into state.wrench."""
        plan = self._plan
        failed = evaluation.evaluate(
            plan.routes, plan.weights, plan.links, plan.law, plan.params,
            plan.source, plan.source_index, plan.ctrl_low, plan.ctrl_high, self._disabled(), self._root,
            poses.site_xpos, poses.geom_xpos, poses.geom_xmat, poses.cvel, poses.subtree_com, poses.xipos,
            data.act, data.ctrl, state.own_now, self.excitation, TOLERANCE,
            state.node, state.segments, state.count, state.info,
            state.activation, state.length, state.velocity, state.tension, state.status, state.wrench,
        )  # fmt: skip
        self._last = state
        state.time = data.time
        state.in_scratch = poses is state.scratch
        if failed:
            self._failed(state, poses, data)

    def _disabled(self) -> NDArray[np.bool_]:
        """Return which muscles (n,) belong to an actuator group that the model's options switch off."""
        off = int(self.model.opt.disableactuator)
        if off != self._groups_off:
            actuators = [muscle.actuator for muscle in self.declarations]
            groups = [int(self.model.actuator_group[a]) if a >= 0 else -1 for a in actuators]
            self._off = np.array([group >= 0 and bool(off >> group & 1) for group in groups], dtype=np.bool_)
            self._groups_off = off
        return self._off

    def _failed(self, state: State, poses: mujoco.MjData, data: mujoco.MjData) -> None:
        """Note which muscles have no path; raise where the user asked for that."""
        bad = np.flatnonzero(state.status)
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
        """Return scratch data with the kinematics of the present qpos and qvel; `data` may lag by a step."""
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

    def forward(self, data: mujoco.MjData) -> None:
        """Compute paths, lengths, velocities and tensions of the present qpos, qvel, act and ctrl.

        Writes nothing to `data`, and needs no derived quantity of it to be up to date.
        """
        state = self._state(data)
        state.own_now[:] = state.own
        self._evaluate(state, self._refresh(state, data), data)

    def poses(self, data: mujoco.MjData) -> mujoco.MjData:
        """Return the data whose `xpos` and `xquat` the results belong to.

        That is `data` itself after `step`, and a copy of ours after `forward` and `apply`, where `data` may lag.
        """
        state = self._state(data)
        return state.scratch if state.in_scratch else data

    def apply(self, data: mujoco.MjData) -> None:
        """Do `forward`, then put the wrenches into `data.xfrc_applied`, beside what others have there.

        The last call's contribution is taken back first. Right for one following `mj_step` with an Euler or implicit
        integrator; under RK4 use `step`, which evaluates at every stage. Others may add to `xfrc_applied` or set all
        of it between calls; who assigns changing forces to single rows should use `step`, which leaves theirs alone.
        """
        self.forward(data)
        state = self._last
        state.failures += state.status != 0
        coupling.put(data.xfrc_applied, state.others, state.mine, state.total, state.written, state.wrench)

    def length_jacobian(self, data: mujoco.MjData) -> Array:
        """Return ∂l/∂q (n, nv), the sign of MuJoCo's ten_J, at the present qpos; does a `forward` first."""
        self.forward(data)
        state, plan = self._last, self._plan
        jacobian = np.zeros((plan.n, self.model.nv))
        coupling.length_jacobian(
            plan.routes, plan.weights, plan.links, state.segments, state.count, self._dofs,
            self._parent, self._root, state.scratch.cdof, state.scratch.subtree_com, jacobian,
        )  # fmt: skip
        return jacobian

    def length_jacobian_rate(self, data: mujoco.MjData, direction: ArrayLike | None = None) -> Array:
        """Return the rate of ∂l/∂q (n, nv) as q moves along `direction` (nv,), or along qvel where None.

        Times qvel it is what the acceleration of the lengths has beside ∂l/∂q qacc. Does a `forward` first. Raises
        `PathError` naming a muscle without a path, `GeometryError` where the path has no second derivative.
        """
        self.forward(data)
        return length_jacobian_rate(self, self._last, direction)

    # -------------------------------------------------------------------------------------- stepping

    def step(self, data: mujoco.MjData, nstep: int = 1) -> None:
        """Advance the simulation by `nstep` time steps with the muscles' forces at every stage of the integrator.

        Works for every integrator of MuJoCo. Afterwards `data.xfrc_applied` holds other people's contributions only.
        Raises `StateError` for a state that is not finite, and where MuJoCo finds the motion unstable and resets it.
        """
        if nstep < 0:
            raise StateError(f"nstep must not be negative, got {nstep}")
        state = self._state(data)
        before = resets(data)
        runge_kutta = int(self.model.opt.integrator) == _RK4
        silent = bool(int(self.model.opt.disableflags) & _DISABLE_ACTUATION)
        try:
            if runge_kutta:
                self._step_stages(state, data, nstep)
            else:
                for _ in range(nstep):
                    self._check(data)
                    mujoco.mj_step1(self.model, data)
                    if not silent:
                        self._act(state, data)
                        state.failures += state.status != 0
                    mujoco.mj_step2(self.model, data)
                    self._take_back(state, data)
                    self._advance_own(state, self.model.opt.timestep)
        finally:
            self._take_back(state, data)
        if resets(data) > before:
            raise StateError(
                f"the motion became unstable at about time {state.time:g} s and MuJoCo reset the data; "
                f"a smaller time step or more joint damping may help"
            )

    def _act(self, state: State, data: mujoco.MjData) -> None:
        """Evaluate at the present stage of `data`, whose kinematics are fresh, and put the wrenches in."""
        self._evaluate(state, data, data)
        coupling.put(data.xfrc_applied, state.others, state.mine, state.total, state.written, state.wrench)

    def _advance_own(self, state: State, duration: float) -> None:
        plan = self._plan
        if plan.has_own:
            readiness.advance_own(
                plan.source, self.excitation, plan.times, duration, state.own, state.own_now
            )
            state.own[:] = state.own_now

    def _take_back(self, state: State, data: mujoco.MjData) -> None:
        coupling.take_back(data.xfrc_applied, state.others, state.mine, state.total, state.written)

    def _step_stages(self, state: State, data: mujoco.MjData, nstep: int) -> None:
        """Runge-Kutta: act in MuJoCo's control callback, which it calls at every stage."""
        plan = self._plan
        start = data.time
        failed = np.zeros(plan.n, dtype=np.bool_)
        caught: list[Exception] = []

        def act() -> None:
            if caught:
                return
            try:
                if plan.has_own:
                    since = max(data.time - start, 0.0)
                    readiness.advance_own(
                        plan.source, self.excitation, plan.times, since, state.own, state.own_now
                    )
                self._act(state, data)
                np.logical_or(failed, state.status != 0, out=failed)
            except Exception as error:  # an exception must not cross MuJoCo's C frames; it is raised below
                caught.append(error)

        with control_callback(data, act, lambda: self._take_back(state, data)):
            for _ in range(nstep):
                self._check(data)
                start = data.time
                failed[:] = False
                mujoco.mj_step(self.model, data)
                if caught:
                    raise caught[0]
                state.failures += failed
                self._advance_own(state, self.model.opt.timestep)

    def reset(self, data: mujoco.MjData | None = None) -> None:
        """Forget branches, warm starts and last forces, after `mj_resetData` or a jump of qpos.

        What mjwrap had put into `data.xfrc_applied` and is still there is taken out. None resets all known data.
        """
        if data is None:
            for state in self._states.values():
                state.forget()
                state.written[:] = False
        else:
            self._last = self._state(data)
            self._take_back(self._last, data)
        self._last.forget()

    def release(self) -> None:
        """Give the native actuators their forces back, as they were; this MuscleSystem can evaluate no more."""
        self._takeover.release()
