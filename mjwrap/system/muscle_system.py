"""`MuscleSystem`: drives the muscles of a model step by step; only this module reads and writes mjData.

Forces belong to the state at which they act, at every stage of the integrator. So `step` evaluates the muscles between
MuJoCo's position and acceleration stages, and under RK4 in a control callback that lives only as long as the step.
"""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from mjwrap.errors import StateError
from mjwrap.kernels import layout
from mjwrap.kernels.coupling import from_python, wrenches
from mjwrap.kernels.musculotendon import dynamics
from mjwrap.kernels.musculotendon.dispatch import PATH_ACTUATOR
from mjwrap.muscles.energetics import Energetics, Umberger2010, compute_energetics, metabolic_constants
from mjwrap.system.callback import control_callback
from mjwrap.system.checks import resets
from mjwrap.system.derivatives import length_jacobian_rate
from mjwrap.system.evaluator import Evaluator
from mjwrap.system.results import Array
from mjwrap.system.state import State

_RK4 = int(mujoco.mjtIntegrator.mjINT_RK4)


class MuscleSystem(Evaluator):
    """Every muscle that a model declares, driven along geodesic paths.

    model: an `MjModel`; its muscle actuators that mjwrap takes over keep their activation dynamics but pull no more
    (`actuator_forcerange` is set to zero until `release`). strict: raise `PathError` where a path cannot be found,
    instead of holding the muscle's last good force for that step. Raises `ModelError` for declarations that cannot be
    understood. Results (`length`, `velocity`, `tension`, `activation`, `status`, each (n,)) are those of the last
    `forward`, `apply` or `step`, at the state at which its forces acted. SI units; lengthening and tension positive.
    """

    def forward(self, data: mujoco.MjData) -> None:
        """Compute paths, lengths, velocities and tensions of the present qpos, qvel, act and ctrl.

        Writes nothing to `data`, and needs no derived quantity of it to be up to date. A fibre length of 0, as
        `mj_resetData` leaves it, stands for static equilibrium.
        """
        state = self._state(data)
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
        The tensions are those for one time step from here (elastic tendons: at its end). The states that mjwrap
        integrates itself stay as they are: `advance` brings them to the end of the step.
        """
        state = self._state(data)
        self._evaluate(state, self._refresh(state, data), data, ahead=self.model.opt.timestep)
        state.applied = data.time
        state.failures += state.status != 0
        wrenches.add_to_xfrc(
            data.xfrc_applied, state.others, state.mine, state.total, state.written, state.wrench
        )

    def advance(self, data: mujoco.MjData) -> None:
        """Bring the states that mjwrap integrates itself to the end of the step for which `apply` put its forces in.

        For a loop of `apply`, `mj_step`, `advance`; `step` does all three. They are the activation and fibre length in
        `data.act` of actuators with dyntype="user" actdim="2", and those of muscles without an actuator. `StateError`
        where no step follows an `apply`.
        """
        state = self._state(data)
        if state.applied is None or not data.time > state.applied:
            raise StateError("nothing to advance: call apply, then mj_step, then advance")
        self._store(state, data)

    def _store(self, state: State, data: mujoco.MjData) -> None:
        plan = self._plan
        state.applied = None
        dynamics.write_states(
            plan.source, plan.index, state.next_activation, state.next_fiber, data.act, state.own
        )

    def length_jacobian(self, data: mujoco.MjData) -> Array:
        """Return ∂l/∂q (n, nv), the sign of MuJoCo's ten_J, at the present qpos; does a `forward` first."""
        self.forward(data)
        state, plan = self._last, self._plan
        jacobian = np.zeros((plan.n, self.model.nv))
        from_python.length_jacobian(
            *self._routes, *state.paths,
            self._last_dof, self._dofs[2], self._root, state.scratch.cdof, state.scratch.subtree_com,
            jacobian,
        )  # fmt: skip
        return jacobian

    def length_jacobian_rate(self, data: mujoco.MjData, direction: ArrayLike | None = None) -> Array:
        """Return the rate of ∂l/∂q (n, nv) as q moves along `direction` (nv,), or along qvel where None.

        Times qvel it is what the acceleration of the lengths has beside ∂l/∂q qacc. Does a `forward` first. Raises
        `PathError` naming a muscle without a path, `GeometryError` where the path has no second derivative.
        """
        self.forward(data)
        return length_jacobian_rate(self, self._last, direction)

    def energetics(
        self, metabolism: Umberger2010 | Sequence[Umberger2010 | None] | None = None
    ) -> Energetics:
        """Return powers, stored energies and, with `metabolism`, metabolic cost of all muscles at the last evaluation.

        metabolism: one model for all muscles, or one each. Muscles that are `held` there, and those switched off, have
        zeros; `StateError` before the first evaluation. With an elastic tendon they are those of the state there,
        whose tendon force the `tension` of a step, which is the one at its end, leaves by the first order of the step.
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
        try:
            if runge_kutta:
                self._step_stages(state, data, nstep)
            else:
                for _ in range(nstep):
                    self._check(data)
                    mujoco.mj_step1(self.model, data)
                    self._act(state, data, ahead=self.model.opt.timestep)
                    state.failures += state.status != 0
                    mujoco.mj_step2(self.model, data)
                    self._take_back(state, data)
                    if self._plan.integrates and resets(data) == before:
                        self._store(state, data)
        finally:
            self._take_back(state, data)
        if resets(data) > before:
            raise StateError(
                f"the motion became unstable at about time {state.time:g} s and MuJoCo reset the data; "
                f"a smaller time step or more joint damping may help"
            )

    def _act(self, state: State, data: mujoco.MjData, since: float = 0.0, ahead: float = 0.0) -> None:
        """Evaluate at the present stage of `data`, whose kinematics are fresh, and put the wrenches in."""
        self._evaluate(state, data, data, since, ahead)
        wrenches.add_to_xfrc(
            data.xfrc_applied, state.others, state.mine, state.total, state.written, state.wrench
        )

    def _take_back(self, state: State, data: mujoco.MjData) -> None:
        wrenches.remove_from_xfrc(data.xfrc_applied, state.others, state.mine, state.total, state.written)

    def _step_stages(self, state: State, data: mujoco.MjData, nstep: int) -> None:
        """Runge-Kutta: act in MuJoCo's control callback, which it calls at every stage."""
        start, half = data.time, 0.5 * self.model.opt.timestep
        before, acted = resets(data), False
        failed = np.zeros(self._plan.n, dtype=np.bool_)
        caught: list[Exception] = []

        def act() -> None:
            nonlocal acted
            if caught:
                return
            try:
                # stages are at half steps; the time itself is rounded
                self._act(state, data, since=half * round((data.time - start) / half))
                np.logical_or(failed, state.status != 0, out=failed)
                acted = True
            except Exception as error:  # an exception must not cross MuJoCo's C frames; it is raised below
                caught.append(error)

        with control_callback(data, act, lambda: self._take_back(state, data)):
            for _ in range(nstep):
                self._check(data)
                start = data.time
                failed[:] = False
                acted = False
                mujoco.mj_step(self.model, data)
                if caught:
                    raise caught[0]
                state.failures += failed
                if self._plan.integrates and acted and resets(data) == before:
                    self._store(state, data)

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

    def branch(self, data: mujoco.MjData) -> Array:
        """Return the branches of all paths, (k,): side, winding and warm start of every obstacle.

        MuJoCo saves poses, velocities and `act`, but not these: with them too (`set_branch`), a restored simulation
        goes on with the same bits as one that never stopped.
        """
        state = self._state(data)
        return np.append(state.node[:, layout.S_MODE : layout.S_MODE + layout.STATE], state.own)

    def set_branch(self, data: mujoco.MjData, branch: ArrayLike) -> None:
        """Restore what `branch` returned, perhaps for another MjData of the model; `StateError` for another size."""
        state = self._state(data)
        given, rows = np.asarray(branch, dtype=np.float64), state.node[:, layout.S_MODE :][:, : layout.STATE]
        if given.shape != (rows.size + state.own.size,):
            raise StateError(
                f"branch must have shape ({rows.size + state.own.size},) as branch() returns it, not {given.shape}"
            )
        rows[:] = given[: rows.size].reshape(rows.shape)
        state.own[:] = given[rows.size :].reshape(state.own.shape)

    def release(self) -> None:
        """Give the native actuators their forces back, as they were; this MuscleSystem can evaluate no more."""
        self._takeover.release()
