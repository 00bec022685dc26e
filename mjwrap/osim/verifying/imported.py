"""Compute for an imported model the numbers that `reference.py` has of OpenSim."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.errors import GeometryError
from mjwrap.mjcf.coordinate_functions import read_axis_joints, read_coordinate_functions
from mjwrap.mjcf.couplings import CoupledJoints
from mjwrap.muscles.bench import simulate_muscle
from mjwrap.osim.coordinates import coordinates, set_coordinates
from mjwrap.osim.verifying.reference import MotionNumbers, MotionSample, PoseNumbers
from mjwrap.osim.verifying.stops import TouchingRoute, TouchingRoutes
from mjwrap.osim.writing.unique_names import body_name
from mjwrap.system import MuscleSystem
from mjwrap.system.moment_arms import CoordinateMotions

Array = NDArray[np.float64]
# OpenSim's reference motions have gravity and, if driven, muscles. MuJoCo's other forces are switched off by these
# flags, and springs and dampers by their constants, as couplings in pieces need a passive stage.
DRIVEN_OFF = ("LIMIT", "CONTACT")
MOMENT = 1e-6  # of differences of the couplings' slopes [s]
PASSIVE_OFF = (*DRIVEN_OFF, "ACTUATION")
SPRINGS = ("jnt_stiffness", "dof_damping", "tendon_stiffness", "tendon_damping")


@dataclass(frozen=True)
class ImportedNumbers:
    """An imported model's numbers at one pose, with the names and the order of `PoseNumbers`."""

    bodies: dict[str, Array]
    mass: Array | None
    lengths: dict[str, float]
    statuses: dict[str, str]  # of paths that are not converged: why
    moment_arms: dict[str, dict[str, float]]
    tensions: dict[str, Array]  # along the path's own length
    laws: dict[str, Array]  # of the same law, at OpenSim's path length
    touched: dict[str, int]  # how many surfaces the path touches
    coordinates: dict[str, float]
    routes: list[TouchingRoute]


@dataclass(frozen=True)
class SampleNumbers:
    """An imported model's muscles at a state of a driven motion.

    missing: the largest difference between the generalised forces that OpenSim's accelerations need and those that the
    muscles have, as a share of the largest one; NaN where couplings are not the model's only constraints, or OpenSim's
    coordinates not its joints. missing_with_theirs: the same with OpenSim's tensions along mjwrap's paths.
    """

    lengths: dict[str, float]
    tensions: dict[str, float]
    missing: float
    missing_with_theirs: float


@dataclass(frozen=True)
class SimulatedMotion:
    """A motion of an imported model: coordinates (frames,), the change of its energy [J], NaN if muscles acted, and how
    far joints were at most from where their leaders put them [rad or m]."""

    coordinates: Mapping[str, Array]
    energy_change: float
    coupling_errors: Mapping[str, float]


class ImportedModel:
    """An imported model, evaluated at OpenSim's poses."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self.model = model
        self.data = mujoco.MjData(model)
        self.muscles = MuscleSystem(model)
        self._routes = TouchingRoutes(self.muscles)
        self._joints = {model.joint(i).name: i for i in range(model.njnt)}
        self._functions = read_coordinate_functions(model)
        self._motions = CoordinateMotions(model, CoupledJoints(model))
        own = [name for name, function in self._functions.items() if function.own]
        axes = read_axis_joints(model)
        self.settable = [name for name in self.muscles.coordinates if self._joints[name] not in axes] + own

    def at(self, pose: PoseNumbers, independent: list[str], activations: list[float]) -> ImportedNumbers:
        """Return the numbers at a pose of OpenSim's; coordinates that follow others by a function are not set.

        Raises `StateError` where no pose with these values satisfies the equalities.
        """
        model, data, muscles = self.model, self.data, self.muscles
        mujoco.mj_resetData(model, data)
        free = [name for name in self.settable if name in pose.coordinates]
        set_coordinates(model, data, {name: pose.coordinates[name] for name in free})
        mujoco.mj_forward(model, data)
        muscles.reset(data)
        muscles.forward(data)
        bodies = {
            name: np.concatenate([data.body(written).xpos, data.body(written).xmat.ravel()])
            for name in pose.bodies
            if mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, written := body_name(name)) >= 0
        }
        lengths = dict(zip(muscles.names, muscles.length.tolist(), strict=True))
        routes = self._routes.now(data)
        statuses = {muscles.names[i]: muscles.reason(int(i)) for i in np.flatnonzero(muscles.status)}
        touched = {name: len(muscles.contact_points(i)) for i, name in enumerate(muscles.names)}
        arms = self._arms(pose, independent) if pose.moment_arms else {}
        tensions, laws = {}, {}
        for name in pose.tensions:
            if name not in muscles:
                continue
            law = muscles[name].parameters
            if name not in statuses:
                tensions[name] = self._tension(law, lengths[name], activations)
            laws[name] = self._tension(law, pose.lengths[name], activations)
        values, mass = coordinates(model, data), self._mass(independent)
        return ImportedNumbers(bodies, mass, lengths, statuses, arms, tensions, laws, touched, values, routes)

    def _tension(self, law: object, length: float, activations: list[float]) -> Array:
        """Return the tension at rest at each activation [N]."""
        found = [
            simulate_muscle(law, [0.0], length, activation=a).tension[0]  # type: ignore[arg-type]
            for a in activations
        ]
        return np.array(found)

    def _arms(self, pose: PoseNumbers, independent: list[str]) -> dict[str, dict[str, float]]:
        """Return moment arms about the coordinates, or about OpenSim's speeds where these are not their rates."""
        data, muscles, found = self.data, self.muscles, {name: {} for name in self.muscles.names}
        known = [name for name in independent if self.knows(name)]
        if pose.speeds is None:
            arms = muscles.moment_arms(data, known)
            columns = dict(zip(known, arms.T, strict=True))
        else:
            names = list(pose.coordinates)
            rates = np.array([self._rate(name) for name in names])
            jacobian, columns = muscles.length_jacobian(data), {}
            for name in known:
                along = self._motions.of_speed(data, np.array(pose.speeds) @ rates, names.index(name))
                if along is not None:
                    columns[name] = -jacobian @ along
        for coordinate, column in columns.items():
            for muscle, arm in zip(muscles.names, column.tolist(), strict=True):
                found[muscle][coordinate] = arm
        return found

    def knows(self, name: str) -> bool:
        """Return whether the model has a coordinate."""
        return name in self._joints or name in self._functions

    def _rate(self, name: str) -> Array:
        """Return the rate (nv,) of a coordinate as a function of qvel; zeros for one that the model does not have."""
        model, found = self.model, np.zeros(self.model.nv)
        if name in self._joints:
            found[model.jnt_dofadr[self._joints[name]]] = 1.0
        elif name in self._functions:
            function = self._functions[name]
            position = float(self.data.qpos[model.jnt_qposadr[function.joint]])
            found[model.jnt_dofadr[function.joint]] = function.rate(position)
        return found

    def _mass(self, independent: list[str]) -> Array | None:
        """Return NᵀMN about the rates of the independent coordinates; None where a coordinate does not move."""
        model, data = self.model, self.data
        if model.nv == 0 or not independent or not all(self.knows(name) for name in independent):
            return None
        try:
            n = self._motions.columns(data, independent)
        except GeometryError:
            return None
        inertia = np.zeros(model.nv)
        moments = []
        for column in n.T:
            mujoco.mj_mulM(model, data, inertia, np.ascontiguousarray(column))
            moments.append(inertia.copy())
        return n.T @ np.array(moments).reshape(-1, model.nv).T

    def motion(self, given: MotionNumbers, timestep: float | None = None) -> SimulatedMotion:
        """Return the motion that starts as OpenSim's did.

        timestep [s]: None for the model's own; the equalities' time constants change with it. A passive motion is that
        without muscles.
        """
        model = self.model
        before, flags, constants = model.opt.timestep, int(model.opt.enableflags), model.eq_solref.copy()
        model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
        if timestep is not None:
            model.opt.timestep = timestep
            model.eq_solref[:, 0] *= timestep / before
        try:
            return self._motion(given)
        finally:
            model.opt.timestep, model.opt.enableflags = before, flags
            model.eq_solref[:] = constants

    def _motion(self, given: MotionNumbers) -> SimulatedMotion:
        model, muscles = self.model, self.muscles
        data, couplings = mujoco.MjData(model), CoupledJoints(self.model)
        passive = given.excitation is None
        if passive:
            free = {n: given.coordinates[n][0] for n in self.settable if n in given.coordinates}
            set_coordinates(model, data, free)
            self._set_speeds(data, given.speeds)
        muscles.reset(data)
        if not passive:
            self._set_muscles(data, given.excitation, given.activation, given.fiber_length)
        mujoco.mj_forward(model, data)
        energy = float(data.energy.sum())
        rows: dict[str, list[float]] = {}
        apart: dict[str, float] = {}
        for time in given.time:
            steps = round((time - data.time) / model.opt.timestep)
            if steps > 0:
                self._step(data, steps, PASSIVE_OFF if passive else DRIVEN_OFF)
            for name, value in coordinates(model, data).items():
                rows.setdefault(name, []).append(value)
            for joint, error in couplings.residuals(data.qpos).items():
                name = model.joint(joint).name
                apart[name] = max(apart.get(name, 0.0), abs(error))
        mujoco.mj_forward(model, data)
        change = float(data.energy.sum()) - energy if passive else float("nan")
        found = {name: np.array(rows[name]) for name in given.coordinates if name in rows}
        return SimulatedMotion(found, change, apart)

    def at_sample(self, motion: MotionNumbers, sample: MotionSample) -> SampleNumbers:
        """Return the muscles' numbers at a state of OpenSim's driven motion."""
        model, muscles = self.model, self.muscles
        data = mujoco.MjData(model)
        values = {n: motion.coordinates[n][sample.frame] for n in self.settable if n in motion.coordinates}
        set_coordinates(model, data, values)
        self._set_speeds(data, sample.speeds)
        muscles.reset(data)
        self._set_muscles(data, motion.excitation, sample.activation, sample.fiber_length)
        muscles.forward(data)
        lengths = dict(zip(muscles.names, muscles.length.tolist(), strict=True))
        tensions = dict(zip(muscles.names, muscles.tension.tolist(), strict=True))
        known = [name for name in lengths if name in sample.lengths]
        theirs = np.array([sample.tensions.get(name, tensions[name]) for name in muscles.names])
        missing = self._missing(data, sample.accelerations, (muscles.tension, theirs))
        return SampleNumbers({n: lengths[n] for n in known}, {n: tensions[n] for n in known}, *missing)

    def _missing(
        self, data: mujoco.MjData, accelerations: Mapping[str, float], pulls: tuple[Array, Array]
    ) -> tuple[float, float]:
        """Return the share of the generalised forces about the independent joints that accelerations need and tensions
        along the paths of the last evaluation do not have, for either of two tensions."""
        model, couplings = self.model, CoupledJoints(self.model)
        chosen = {
            int(model.jnt_dofadr[self._joints[n]]): accelerations.get(n) for n in self.muscles.coordinates
        }
        found = [chosen.get(int(dof)) for dof in couplings.independent]
        others = data.eq_active.astype(np.bool_) & (model.eq_type != int(mujoco.mjtEq.mjEQ_JOINT))
        if others.any() or any(each is None for each in found):
            return float("nan"), float("nan")
        jacobian, n = self.muscles.length_jacobian(data), couplings.matrix(data.qpos)
        beside = []
        for sign in (-1.0, 1.0):  # N changes along the motion
            qpos = data.qpos.copy()
            mujoco.mj_integratePos(model, qpos, data.qvel, sign * MOMENT)
            beside.append(couplings.matrix(qpos))
        change = (beside[1] - beside[0]) / (2.0 * MOMENT)
        independent = data.qvel[couplings.independent]
        acceleration = n @ np.array(found, dtype=np.float64) + change @ independent
        mujoco.mj_forward(model, data)
        inertial = np.zeros(model.nv)
        mujoco.mj_mulM(model, data, inertial, acceleration)
        needed, bias = n.T @ (inertial + data.qfrc_bias), n.T @ data.qfrc_bias
        own, theirs = (-n.T @ jacobian.T @ tension for tension in pulls)
        largest = max(*(float(np.abs(force).max()) for force in (bias, own, theirs)), 1e-9)
        return float(np.abs(needed - own).max()) / largest, float(np.abs(needed - theirs).max()) / largest

    def _set_speeds(self, data: mujoco.MjData, speeds: Mapping[str, float]) -> None:
        """Set the speeds of the independent joints, and of those that follow them."""
        model, couplings = self.model, CoupledJoints(self.model)
        for name in self.muscles.coordinates:
            data.qvel[model.jnt_dofadr[self._joints[name]]] = speeds.get(name, 0.0)
        data.qvel[:] = couplings.matrix(data.qpos) @ data.qvel[couplings.independent]

    def _step(self, data: mujoco.MjData, steps: int, off: tuple[str, ...]) -> None:
        """Step with some of MuJoCo's forces switched off, by the names of their flags."""
        model = self.model
        before, constants = (
            int(model.opt.disableflags),
            {name: getattr(model, name).copy() for name in SPRINGS},
        )
        for name in off:
            model.opt.disableflags |= int(getattr(mujoco.mjtDisableBit, f"mjDSBL_{name}"))
        try:
            for name in SPRINGS:
                getattr(model, name)[:] = 0.0
            self.muscles.step(data, steps)
        finally:
            model.opt.disableflags = before
            for name, values in constants.items():
                getattr(model, name)[:] = values

    def _set_muscles(
        self,
        data: mujoco.MjData,
        excitation: float | None,
        activation: Mapping[str, float],
        fiber_length: Mapping[str, float],
    ) -> None:
        """Give the muscles an excitation and OpenSim's states."""
        model = self.model
        for name in activation:
            actuator = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, name)
            if actuator < 0:
                continue
            data.ctrl[int(model.actuator_ctrladr[actuator])] = excitation
            first, count = int(model.actuator_actadr[actuator]), int(model.actuator_actnum[actuator])
            if count > 0:
                data.act[first] = activation[name]
            if count > 1:
                data.act[first + 1] = fiber_length[name]
