"""MuscleSystem: the only reader and writer of mjData.

Forces belong to the state at which they act, at every stage of the integrator. So `step` evaluates the muscles between
MuJoCo's position and acceleration stages, and under RK4 in a control callback that lives only as long as the step.
"""

from __future__ import annotations

import weakref
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.errors import GeometryError, ModelError, PathError, StateError
from mjwrap.kernels import coupling, drawing, layout, readiness, segments
from mjwrap.mjcf import MuscleDeclaration, name_of, read_declarations
from mjwrap.paths import Status
from mjwrap.plan import Plan, build_plan
from mjwrap.takeover import Takeover

Array = NDArray[np.float64]
TOLERANCE = 1e-10  # largest tangency error of a path


class _State:
    """What belongs to one mjData: warm starts, results, and what was added to its xfrc_applied."""

    def __init__(self, model: mujoco.MjModel, plan: Plan) -> None:
        n, routes = plan.n, len(plan.routes)
        self.node = plan.node.copy()
        self.segments = np.zeros((len(plan.node) + routes, segments.SEGMENT))
        self.count = np.zeros(routes, dtype=np.int64)
        self.info = np.zeros((routes, layout.INFO))
        self.length, self.velocity, self.tension, self.activation = (np.zeros(n) for _ in range(4))
        self.status = np.zeros(n, dtype=np.int64)
        self.failures = np.zeros(n, dtype=np.int64)
        self.last_failure = np.zeros(n, dtype=np.int64)
        self.own, self.own_now = np.zeros(n), np.zeros(n)
        self.wrench, self.others, self.mine, self.total = (np.zeros((model.nbody, 6)) for _ in range(4))
        self.written = np.zeros(model.nbody, dtype=np.bool_)
        self.scratch = mujoco.MjData(model)
        self.time = 0.0

    def forget(self) -> None:
        """Start cold: no branch, no last force, no failures."""
        self.node[:, layout.S_MODE] = layout.COLD
        self.count[:] = 0
        for array in (self.length, self.velocity, self.tension, self.activation, self.own, self.own_now):
            array[:] = 0.0
        self.status[:] = 0
        self.failures[:] = 0


class MuscleSystem:
    """Every muscle that a model declares, driven along geodesic paths.

    model: an `MjModel`; its muscle actuators that mjwrap takes over keep their activation dynamics but pull no more
    (`actuator_forcerange` is set to zero until `release`). strict: raise `PathError` where a path cannot be found,
    instead of holding the muscle's last good force for that step. Raises `ModelError` for declarations that cannot be
    understood. Results (`length`, `velocity`, `tension`, `activation`, `status`, each (n,)) are those of the last
    `forward`, `apply` or `step`, at the state at which its forces acted. SI units; lengthening and tension positive.
    """

    def __init__(self, model: mujoco.MjModel, *, strict: bool = False) -> None:
        self.model = model
        self.strict = strict
        self._takeover = Takeover(model)
        with self._takeover.suspended():
            found = read_declarations(model)
        self.declarations: list[MuscleDeclaration] = found.muscles
        self.native: dict[str, str] = found.native
        self._plan = build_plan(model, found.muscles)
        self._takeover.silence([muscle.actuator for muscle in found.muscles if muscle.actuator >= 0])
        self._states: dict[int, _State] = {}
        self._released = False
        self._last = _State(model, self._plan)
        self.excitation: Array = np.zeros(self._plan.n)
        self._root = np.asarray(model.body_rootid, dtype=np.int64)
        self._parent = np.asarray(model.body_parentid, dtype=np.int64)
        self._dofs = tuple(
            np.asarray(a, dtype=np.int64) for a in (model.body_dofadr, model.body_dofnum, model.dof_parentid)
        )

    # ------------------------------------------------------------------------------------- results

    @property
    def n(self) -> int:
        """Number of muscles."""
        return self._plan.n

    @property
    def names(self) -> list[str]:
        """Names of the muscles, in the order of all arrays."""
        return [muscle.name for muscle in self.declarations]

    @property
    def length(self) -> Array:
        """Musculotendon lengths (n,) [m]."""
        return self._last.length

    @property
    def velocity(self) -> Array:
        """Lengthening speeds (n,) [m/s]."""
        return self._last.velocity

    @property
    def tension(self) -> Array:
        """Tensions (n,) [N], never negative."""
        return self._last.tension

    @property
    def activation(self) -> Array:
        """Activations (n,) [-]."""
        return self._last.activation

    @property
    def status(self) -> NDArray[np.int64]:
        """Codes of `mjwrap.Status` (n,)."""
        return self._last.status

    @property
    def time(self) -> float:
        """Simulation time [s] to which all results belong."""
        return self._last.time

    @property
    def failures(self) -> NDArray[np.int64]:
        """Number of steps (n,) at which a muscle's path was not found and its last good force was held."""
        return self._last.failures

    def index(self, name: str) -> int:
        """Return the index of a muscle by name; `GeometryError` lists the names where there is no such muscle."""
        if name not in self.names:
            raise GeometryError(f"no muscle '{name}'; muscles: {', '.join(self.names) or 'none'}")
        return self.names.index(name)

    def report(self) -> str:
        """Return one line per muscle whose path was not found on some steps, with the reason; empty if none."""
        lines = []
        for i, count in enumerate(self.failures):
            if count:
                reason = Status(int(self._last.last_failure[i])).message
                lines.append(
                    f"{self.names[i]}: {count} step{'s' if count != 1 else ''} without a path; at last {reason}"
                )
        return "\n".join(lines)

    # ----------------------------------------------------------------------------------- evaluation

    def _state(self, data: mujoco.MjData) -> _State:
        if self._released:
            raise ModelError(
                "this MuscleSystem has given its actuators back (release); build a new one to go on"
            )
        if not isinstance(data, mujoco.MjData):
            raise StateError(f"expected an MjData, not {type(data).__name__}")
        if data.model._address != self.model._address:
            raise StateError("this MjData belongs to another model than this MuscleSystem")
        key = id(data)
        if key not in self._states:
            self._states[key] = _State(self.model, self._plan)
            weakref.finalize(data, self._states.pop, key, None)
        return self._states[key]

    def _check(self, data: mujoco.MjData) -> None:
        """Raise `StateError` naming what is not finite."""
        for what, values in (
            ("qpos", data.qpos),
            ("qvel", data.qvel),
            ("act", data.act),
            ("ctrl", data.ctrl),
            ("mocap_pos", data.mocap_pos.ravel()),
            ("mocap_quat", data.mocap_quat.ravel()),
        ):
            bad = readiness.first_bad(values)
            if bad >= 0:
                raise StateError(
                    f"{what}[{bad}]{self._owner(what, bad)} is not finite at time {data.time:g} s"
                )
        bad = readiness.first_bad(self.excitation)
        if bad >= 0:
            raise StateError(
                f"excitation of muscle '{self.names[bad]}' is not finite at time {data.time:g} s"
            )

    def _owner(self, what: str, index: int) -> str:
        model = self.model
        kinds = mujoco.mjtObj
        if what == "qpos":
            joint = int(np.searchsorted(model.jnt_qposadr, index, side="right")) - 1
            return f" (joint '{name_of(model, kinds.mjOBJ_JOINT, joint)}')"
        if what == "qvel":
            return f" (joint '{name_of(model, kinds.mjOBJ_JOINT, int(model.dof_jntid[index]))}')"
        if what == "ctrl":
            return f" (actuator '{name_of(model, kinds.mjOBJ_ACTUATOR, index)}')"
        if what == "act":
            first, count = model.actuator_actadr, model.actuator_actnum
            actuator = int(np.flatnonzero((first <= index) & (index < first + count))[0])
            return f" (actuator '{name_of(model, kinds.mjOBJ_ACTUATOR, actuator)}')"
        body = int(np.flatnonzero(model.body_mocapid == index // (3 if what == "mocap_pos" else 4))[0])
        return f" (mocap body '{name_of(model, kinds.mjOBJ_BODY, body)}')"

    def _evaluate(self, state: _State, poses: mujoco.MjData, data: mujoco.MjData) -> None:
        """Paths, activations and tensions from the poses and velocities of `poses`; wrenches into state.wrench."""
        plan = self._plan
        coupling.solve_routes(
            plan.routes, plan.links, poses.site_xpos, poses.geom_xpos, poses.geom_xmat, TOLERANCE,
            state.node, state.segments, state.count, state.info,
        )  # fmt: skip
        readiness.gather_activation(
            plan.source, plan.source_index, plan.ctrl_low, plan.ctrl_high,
            data.act, data.ctrl, state.own_now, self.excitation, state.activation,
        )  # fmt: skip
        coupling.drive_muscles(
            plan.routes, plan.weights, plan.links, state.segments, state.count, state.info,
            poses.cvel, poses.subtree_com, self._root, plan.law, plan.params, state.activation,
            state.length, state.velocity, state.tension, state.status,
        )  # fmt: skip
        coupling.body_wrenches(
            plan.routes,
            plan.weights,
            plan.links,
            state.segments,
            state.count,
            state.tension,
            poses.xipos,
            state.wrench,
        )
        self._last = state
        state.time = data.time
        if state.status.any():
            self._failed(state, data)

    def _failed(self, state: _State, data: mujoco.MjData) -> None:
        """Note which muscles have no path; raise where the user asked for that."""
        bad = np.flatnonzero(state.status)
        state.last_failure[bad] = state.status[bad]
        first = int(bad[0])
        if (state.status == Status.NON_FINITE).any():
            first = int(np.flatnonzero(state.status == Status.NON_FINITE)[0])
            raise StateError(
                f"muscle '{self.names[first]}': a pose or force is not finite at time {data.time:g} s"
            )
        if self.strict:
            reason = Status(int(state.status[first])).message
            raise PathError(f"muscle '{self.names[first]}' at time {data.time:g} s: {reason}")

    def _refresh(self, state: _State, data: mujoco.MjData) -> mujoco.MjData:
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

    def apply(self, data: mujoco.MjData) -> None:
        """Do `forward`, then put the wrenches into `data.xfrc_applied`, beside what others have there.

        The last call's contribution is taken back first. Right for one following `mj_step` with an Euler or implicit
        integrator; under RK4 use `step`, which evaluates at every stage.
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

    # -------------------------------------------------------------------------------------- stepping

    def step(self, data: mujoco.MjData, nstep: int = 1) -> None:
        """Advance the simulation by `nstep` time steps with the muscles' forces at every stage of the integrator.

        Works for every integrator of MuJoCo. Afterwards `data.xfrc_applied` holds other people's contributions only.
        Raises `StateError` for a state that is not finite, and where MuJoCo finds the motion unstable and resets it.
        """
        state = self._state(data)
        resets = _resets(data)
        runge_kutta = int(self.model.opt.integrator) == int(mujoco.mjtIntegrator.mjINT_RK4)
        silent = bool(int(self.model.opt.disableflags) & int(mujoco.mjtDisableBit.mjDSBL_ACTUATION))
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
        if _resets(data) > resets:
            raise StateError(
                f"the motion became unstable at about time {state.time:g} s and MuJoCo reset the data; "
                f"a smaller time step or more joint damping may help"
            )

    def _act(self, state: _State, data: mujoco.MjData) -> None:
        """Evaluate at the present stage of `data`, whose kinematics are fresh, and put the wrenches in."""
        self._evaluate(state, data, data)
        coupling.put(data.xfrc_applied, state.others, state.mine, state.total, state.written, state.wrench)

    def _advance_own(self, state: _State, duration: float) -> None:
        plan = self._plan
        if plan.has_own:
            readiness.advance_own(
                plan.source, self.excitation, plan.times, duration, state.own, state.own_now
            )
            state.own[:] = state.own_now

    def _take_back(self, state: _State, data: mujoco.MjData) -> None:
        coupling.take_back(data.xfrc_applied, state.others, state.mine, state.total, state.written)

    def _step_stages(self, state: _State, data: mujoco.MjData, nstep: int) -> None:
        """Runge-Kutta: act in MuJoCo's control callback, which it calls at every stage."""
        plan = self._plan
        address, start = data._address, data.time
        failed = np.zeros(plan.n, dtype=np.bool_)
        caught: list[Exception] = []

        def act(stage: mujoco.MjData) -> None:
            if stage._address != address or caught:
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

        with _control_callback(act, lambda: self._take_back(state, data)):
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
        self._released = True
        self._takeover.release()

    # -------------------------------------------------------------------------------------- geometry

    def _known(self, i: int) -> int:
        if not 0 <= i < self.n:
            raise GeometryError(
                f"muscle {i} does not exist; there are {self.n}: {', '.join(self.names) or 'none'}"
            )
        return int(i)

    def _polylines(self, spacing: float | None, only: int) -> tuple[Array, NDArray[np.int64]]:
        if spacing is not None and not (np.isfinite(spacing) and spacing > 0.0):
            raise GeometryError(f"spacing must be finite and positive [m], not {spacing!r}")
        state = self._last
        starts = np.zeros(self.n + 1, dtype=np.int64)
        given = (self._plan.routes, state.node, state.segments, state.count, state.info)
        tail = (0.0 if spacing is None else float(spacing), only)
        out = np.empty((drawing.polylines(*given, *tail, np.empty((0, 3)), starts), 3))
        drawing.polylines(*given, *tail, out, starts)
        return out, starts

    def _contacts(self, only: int) -> tuple[Array, NDArray[np.int64]]:
        state = self._last
        starts = np.zeros(self.n + 1, dtype=np.int64)
        given = (self._plan.routes, state.node, state.segments, state.count, only)
        out = np.empty((drawing.contacts(*given, np.empty((0, 3)), starts), 3))
        drawing.contacts(*given, out, starts)
        return out, starts

    def points(self, i: int, spacing: float | None = None) -> Array:
        """Return the polyline of muscle i, (m, 3), world [m], at the last evaluation; empty before the first.

        spacing [m]: largest distance between points; None: as many as the curvature asks for. Routes joined by
        pulleys follow one another. A muscle whose path was not found is drawn along the force that it holds.
        """
        return self._polylines(spacing, self._known(i))[0]

    def polylines(self, spacing: float | None = None) -> tuple[Array, NDArray[np.int64]]:
        """Return the polylines of all muscles: points (m, 3), starts (n + 1,); muscle i has starts[i]:starts[i + 1]."""
        return self._polylines(spacing, -1)

    def contact_points(self, i: int) -> Array:
        """Return first and last contact point, (k, 2, 3), world [m], of every obstacle that muscle i touches."""
        return self._contacts(self._known(i))[0].reshape(-1, 2, 3)

    def contacts(self) -> tuple[Array, NDArray[np.int64]]:
        """Return the contact points of all muscles, P and Q in turn: points (m, 3), starts (n + 1,)."""
        return self._contacts(-1)

    def forces(self, i: int) -> list[tuple[int, Array, Array]]:
        """Return the forces of muscle i at the last evaluation: (body id, point (3,) [m], force (3,) [N]), world."""
        state, plan = self._last, self._plan
        found = []
        for c in np.flatnonzero(plan.routes[:, coupling.R_MUSCLE] == self._known(i)):
            pull = state.tension[i] * plan.weights[c]
            first = int(plan.routes[c, coupling.R_LO]) + int(c)
            for row in state.segments[first : first + int(state.count[c])]:
                force = pull * row[segments.G_E : segments.G_E + 3]
                for column, sign, index in ((segments.G_A, 1.0, row[0]), (segments.G_B, -1.0, row[1])):
                    body = int(coupling.end_body(plan.routes, plan.links, c, int(index)))
                    found.append((body, row[column : column + 3].copy(), sign * force))
        return found


_BADQPOS = int(mujoco.mjtWarning.mjWARN_BADQPOS)
_BADQVEL = int(mujoco.mjtWarning.mjWARN_BADQVEL)
_BADQACC = int(mujoco.mjtWarning.mjWARN_BADQACC)


def _resets(data: mujoco.MjData) -> int:
    """Return how often MuJoCo has found the state not finite or too large; it resets the data then."""
    number = data.warning.number
    return int(number[_BADQPOS]) + int(number[_BADQVEL]) + int(number[_BADQACC])


@contextmanager
def _control_callback(act: Callable[[mujoco.MjData], None], retreat: Callable[[], None]) -> Iterator[None]:
    """Run `act` in MuJoCo's control callback for the length of a with block.

    A callback that is there already, a Python function or a C function pointer, runs first, after `retreat` has taken
    out of the data what `act` put in at the stage before.
    """
    before: Any = mujoco.get_mjcb_control()
    compiled = hasattr(before, "argtypes")

    def callback(model: mujoco.MjModel, data: mujoco.MjData) -> None:
        if before is not None:
            retreat()
            if compiled:
                before(model._address, data._address)
            else:
                before(model, data)
        act(data)

    mujoco.set_mjcb_control(callback)
    try:
        yield
    finally:
        mujoco.set_mjcb_control(before)
