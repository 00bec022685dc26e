"""`MuscleSystem`: drives the muscles of a model step by step.

Forces must belong to the state at which they act, at every stage of the integrator. So `step` evaluates the muscles
between MuJoCo's position and acceleration stages, and under RK4 in a control callback that is set only during the step.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from mjwrap import validation
from mjwrap.errors import StateError
from mjwrap.kernels import layout
from mjwrap.kernels.coupling import wrenches
from mjwrap.kernels.musculotendon import dynamics
from mjwrap.kernels.musculotendon.dispatch import PATH_ACTUATOR
from mjwrap.mjcf.couplings import CoupledJoints
from mjwrap.muscles.energetics import Energetics, Umberger2010, compute_energetics, metabolic_constants
from mjwrap.muscles.fibers import FiberState, fiber_state
from mjwrap.system.callback import control_callback
from mjwrap.system.checks import ResetWatch
from mjwrap.system.derivatives import length_jacobian_rate
from mjwrap.system.evaluator import Evaluator
from mjwrap.system.moment_arms import CoordinateMotions
from mjwrap.system.results import Array
from mjwrap.system.state import State

_RK4 = int(mujoco.mjtIntegrator.mjINT_RK4)


class MuscleSystem(Evaluator):
    """Drive every muscle that a model declares along its geodesic path.

    The results `length`, `velocity`, `tension`, `activation` and `status`, each (n,), are those of the last `forward`,
    `apply` or `step`, at the state at which the forces acted. SI units; lengthening and tension are positive.

    Args:
        model: an `MjModel`. Muscle actuators that mjwrap takes over keep their activation dynamics but no longer pull:
            their `actuator_forcerange` is zero until `release`.
        strict: raise `PathError` if a path cannot be found; otherwise its length is continued from the surface, or its
            last valid force is kept (`held`).
        side_rule: whose rule picks, at the model's reference pose, the way round a cylinder that the side site of a
            tendon means: 3 for MuJoCo 3's, 4 for MuJoCo 4's; None for the running MuJoCo's, or for that of the
            `install` before `without_plugin`. Paths that start at other poses, or after `reset`, go round as if they
            had come from the reference pose.

    Raises:
        ModelError: a declaration is wrong, or there is no such rule.
    """

    def forward(self, data: mujoco.MjData) -> None:
        """Compute paths, lengths, velocities and tensions at the present qpos, qvel, act and ctrl.

        Writes nothing to `data`; its derived quantities need not be up to date. A fibre length of 0, as after
        `mj_resetData`, means static equilibrium.
        """
        state = self._state(data)
        self._evaluate(state, self._refresh(state, data), data)
        state.forget_held()  # this is no step

    def poses(self, data: mujoco.MjData) -> mujoco.MjData:
        """Return the data with the `xpos` and `xquat` at which the results were computed.

        That is `data` itself after `step`. After `forward` and `apply` it is an internal copy, because the derived
        quantities of `data` may be one step old.
        """
        state = self._state(data)
        return state.scratch if state.in_scratch else data

    def apply(self, data: mujoco.MjData) -> None:
        """Call `forward`, then add the muscles' wrenches to `data.xfrc_applied`.

        The forces on joints that move path points are added to `data.qfrc_applied` in the same way.
        The wrenches that the previous call added are removed first. Call it once before each `mj_step` with an Euler or
        implicit integrator; under RK4 use `step`, which evaluates the muscles at every stage. Between calls other code
        may add forces to `xfrc_applied` or set the whole array; code that assigns changing forces to single rows should
        use `step`, which does not touch them. The tensions are those for the coming time step (with an elastic tendon:
        at its end). Couplings of several pieces are switched for that step, in `data.eq_active`. The states that mjwrap
        integrates itself do not change: `advance` integrates them.
        """
        state = self._state(data)
        self._pieces.set(data)
        self._evaluate(state, self._refresh(state, data), data, ahead=self.model.opt.timestep)
        state.applied = data.time
        state.failures += state.status != 0
        state.count_held()
        wrenches.add_to_xfrc(
            data.xfrc_applied, state.others, state.mine, state.total, state.written, state.wrench
        )
        if state.joint_forces is not None:
            state.joint_forces.add(data)

    def advance(self, data: mujoco.MjData) -> None:
        """Integrate the states that mjwrap keeps to the end of the step for which `apply` computed the forces.

        For loops of `apply`, `mj_step` and `advance`; `step` does all three. These states are the activation and fibre
        length in `data.act` of actuators with dyntype="user" actdim="2", and those of muscles without an actuator.
        Raises `StateError` unless `apply` and `mj_step` came before, or if MuJoCo reset the data in that step.
        """
        state = self._state(data)
        if state.applied is not None and data.time < state.applied:
            raise StateError(
                f"no step to advance: the time went back from {state.applied:g} s to {data.time:g} s: the data were "
                "reset, as MuJoCo does when a motion becomes unstable; call reset, apply, mj_step, then advance"
            )
        if state.applied is None or not data.time > state.applied:
            raise StateError("no step to advance: call apply, then mj_step, then advance")
        self._store(state, data)

    def _store(self, state: State, data: mujoco.MjData) -> None:
        plan = self._plan
        state.applied = None
        dynamics.write_states(
            plan.source, plan.index, state.next_activation, state.next_fiber, data.act, state.own
        )

    def length_jacobian(self, data: mujoco.MjData) -> Array:
        """Return ∂l/∂q (n, nv) at the present qpos, with the sign of MuJoCo's ten_J; calls `forward` first."""
        self.forward(data)
        state, plan = self._last, self._plan
        jacobian = np.zeros((plan.n, self.model.nv))
        self._write_jacobian(state, state.scratch, jacobian)
        return jacobian

    @property
    def coordinates(self) -> list[str]:
        """Names of the independent hinges and slides, in the model's order: the columns of `moment_arms`.

        A joint that follows another by an equality of the model (`<equality><joint polycoef>`) is not independent.
        """
        return self._motions.independent

    @cached_property
    def _motions(self) -> CoordinateMotions:
        return CoordinateMotions(self.model, CoupledJoints(self.model))

    def moment_arms(self, data: mujoco.MjData, coordinates: Iterable[str] | None = None) -> Array:
        """Return moment arms (n, k) about coordinates at the present qpos [m], about a slide [-].

        A column is the negative slope of the lengths along a motion N in which the coordinate has the rate 1: −J N,
        with J = ∂l/∂q of `length_jacobian`, which is called first. Joints that follow the coordinate by an equality of
        the model move with it. Where other active equalities (loops, points, welds, distances) tie coordinates, N is
        OpenSim's: of all motions that satisfy them, the one with the least sum of squares of the rates of all
        coordinates, N = P eᵢ / Pᵢᵢ with the projector P on those motions. So it is for one that follows others,
        too; a locked one moves as if its lock were open and those of others closed. Couplings of joints are those that
        are active at the model's start, in the pieces that hold at qpos, and other equalities those that are active in
        `data`; qpos should satisfy them (`mw.osim.set_coordinates`). Writes nothing to `data`. Positive, as in OpenSim,
        if the muscle's pull drives the coordinate up. A muscle without a path has the moment arms of its last valid
        path, 0 before it had one.

        Args:
            data: the state; only poses and `eq_active` are used.
            coordinates: the name of a joint, or of a coordinate of an imported model, or several, whose columns are
                returned in this order; by default all of the property `coordinates`. A ball joint has three columns
                (rotations about the axes of its body), a free joint six (translations in the world, then rotations
                about the body's axes), as in qvel; they are returned only if they are named.

        Raises:
            GeometryError: no such joint, or equalities hold it where it is.
        """
        jacobian = self.length_jacobian(data)
        return -jacobian @ self._motions.columns(data, coordinates)

    def length_jacobian_rate(self, data: mujoco.MjData, direction: ArrayLike | None = None) -> Array:
        """Return the rate of ∂l/∂q (n, nv) as q moves along `direction` (nv,), by default along qvel.

        The acceleration of the lengths is this rate times qvel, plus ∂l/∂q qacc. Calls `forward` first. Raises
        `PathError` if a muscle has no path, `GeometryError` if a path has no second derivative.
        """
        self.forward(data)
        return length_jacobian_rate(self, self._last, direction)

    def energetics(
        self, metabolism: Umberger2010 | Sequence[Umberger2010 | None] | None = None
    ) -> Energetics:
        """Return power, stored energy and, with `metabolism`, metabolic cost of all muscles at the last evaluation.

        metabolism: one model for all muscles, or one for each. The values are zero for muscles that are `held` or
        switched off. With an elastic tendon they belong to the state at the start of the step, but `tension` to its
        end; the two tendon forces differ in proportion to the time step. Raises `StateError` before the first
        evaluation.
        """
        plan, state = self._plan, self._last
        if not state.evaluated:
            raise StateError("no muscle has been evaluated yet: call forward, apply or step first")
        self._switch_off()
        idle = self.held | self._off
        constants = metabolic_constants(metabolism, plan.law, plan.params)
        return compute_energetics(
            np.where(idle, PATH_ACTUATOR, plan.law), plan.params, np.where(idle, 0.0, state.activation),
            state.start.drive, state.length, np.where(idle, 0.0, state.velocity), state.fiber, constants,
        )  # fmt: skip

    def fiber_state(self) -> FiberState:
        """Return lengths, angles and forces of all fibres and tendons at the last evaluation.

        After `step` and `apply` with an elastic tendon they belong to the state at the start of the step. Raises
        `StateError` before the first evaluation.
        """
        plan, state, speed = self._plan, self._last, self.energetics().fiber_velocity
        given = state.activation, state.length, state.velocity, state.fiber
        return fiber_state(plan.law, plan.params, *given, speed)

    # -------------------------------------------------------------------------------------- stepping

    def step(self, data: mujoco.MjData, nstep: int = 1) -> None:
        """Advance the simulation by `nstep` time steps with the muscles' forces at every stage of the integrator.

        Works for every integrator of MuJoCo. Afterwards `data.xfrc_applied` holds only the forces of other code;
        forces on joints that move path points are among `data.qfrc_passive`.
        Raises `StateError` if the state is not finite, or if MuJoCo resets it because the motion became unstable.
        """
        if not (isinstance(nstep, int | np.integer) and nstep >= 0):
            raise StateError(f"nstep must be a whole number, not negative, got {validation.described(nstep)}")
        state = self._state(data)
        watch = ResetWatch(data)
        runge_kutta = int(self.model.opt.integrator) == _RK4
        try:
            if runge_kutta:
                self._step_stages(state, data, nstep, watch)
            else:
                for _ in range(nstep):
                    self._check(data)
                    self._pieces.set(data)
                    watch.begin()
                    mujoco.mj_step1(self.model, data)
                    self._act(state, data, ahead=self.model.opt.timestep)
                    state.failures += state.status != 0
                    state.count_held()
                    mujoco.mj_step2(self.model, data)
                    self._take_back(state, data)
                    if watch.reset:
                        break
                    if self._plan.integrates:
                        self._store(state, data)
        finally:
            self._take_back(state, data)
            watch.end()
        if watch.reset:
            raise watch.error()

    def _act(self, state: State, data: mujoco.MjData, since: float = 0.0, ahead: float = 0.0) -> None:
        """Evaluate at the present stage of `data`, whose kinematics are up to date, and add the forces."""
        self._evaluate(state, data, data, since, ahead)
        wrenches.add_to_xfrc(
            data.xfrc_applied, state.others, state.mine, state.total, state.written, state.wrench
        )
        if state.points is not None:  # MuJoCo clears the passive forces before every stage
            data.qfrc_passive += state.points.force

    def _take_back(self, state: State, data: mujoco.MjData) -> None:
        wrenches.remove_from_xfrc(data.xfrc_applied, state.others, state.mine, state.total, state.written)
        if state.joint_forces is not None:
            state.joint_forces.remove(data)

    def _step_stages(self, state: State, data: mujoco.MjData, nstep: int, watch: ResetWatch) -> None:
        """Step under Runge-Kutta: add the wrenches in MuJoCo's control callback, which runs at every stage."""
        start, half = data.time, 0.5 * self.model.opt.timestep
        acted = False
        failed = np.zeros(self._plan.n, dtype=np.bool_)
        caught: list[Exception] = []

        def act() -> None:
            nonlocal acted
            if caught:
                return
            try:
                self._pieces.rebuild(data)
                # a stage is at a multiple of half a step; data.time is rounded
                self._act(state, data, since=half * round((data.time - start) / half))
                np.logical_or(failed, state.status != 0, out=failed)
                acted = True
            except (
                Exception
            ) as error:  # an exception must not pass through MuJoCo's C code; it is raised below
                caught.append(error)

        pieces = self._pieces.stages(data, controlled=True)
        with pieces, control_callback(data, act, lambda: self._take_back(state, data)):
            for _ in range(nstep):
                self._check(data)
                self._pieces.set(data)
                watch.begin()
                start = data.time
                failed[:] = False
                acted = False
                mujoco.mj_step(self.model, data)
                if caught:
                    raise caught[0]
                state.failures += failed
                state.count_held()
                if watch.reset:
                    break
                if self._plan.integrates and acted:
                    self._store(state, data)

    def reset(self, data: mujoco.MjData | None = None) -> None:
        """Forget branches, warm starts and last forces. Call it after `mj_resetData` or a jump of qpos.

        Forces of mjwrap that are still in `data.xfrc_applied` are removed. None resets every data seen so far.
        """
        if data is None:
            for state in self._states.values():
                state.forget()
                state.written[:] = False
                if state.joint_forces is not None:
                    state.joint_forces.forget()
        else:
            self._last = self._state(data)
            self._take_back(self._last, data)
        self._last.forget()

    def branch(self, data: mujoco.MjData) -> Array:
        """Return the branches of all paths (k,): side, winding and warm start of every obstacle.

        MuJoCo saves poses, velocities and `act`, but not these. If they are restored too (`set_branch`), a restored
        simulation continues to the last bit as if it had never stopped.
        """
        state = self._state(data)
        return np.append(state.node[:, layout.S_MODE : layout.S_MODE + layout.STATE], state.own)

    def set_branch(self, data: mujoco.MjData, branch: ArrayLike) -> None:
        """Restore what `branch` returned, also for another MjData of the model; else `StateError`."""
        state = self._state(data)
        given = validation.numbers(branch, "branch", StateError)
        rows = state.node[:, layout.S_MODE :][:, : layout.STATE]
        if given.shape != (rows.size + state.own.size,):
            raise StateError(
                f"branch must have shape ({rows.size + state.own.size},) as branch() returns it, not {given.shape}"
            )
        if not np.isfinite(given).all():
            raise StateError("branch must be finite, as branch() returns it")
        rows[:] = given[: rows.size].reshape(rows.shape)
        state.own[:] = given[rows.size :].reshape(state.own.shape)

    def release(self) -> None:
        """Restore the forces of the native actuators. This MuscleSystem cannot be used afterwards."""
        self._takeover.release()
