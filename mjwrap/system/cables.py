"""`CableSystem`: a `MuscleSystem` that also has MuJoCo's own actuators on spatial tendons, the cables of a model.

MuJoCo computes the force of a cable from its control, length and velocity. So before it does, length, velocity and
moment of the actuator are set to those along mjwrap's path, as the engine plugin does in mode "transmission".
"""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.mjcf import Declarations, MuscleDeclaration, is_muscle, read_declarations, tendon_declarations
from mjwrap.model.moment_columns import check_moment_columns
from mjwrap.muscles.laws import ActuatorForce, PathActuator
from mjwrap.system.muscle_system import MuscleSystem
from mjwrap.system.state import State

Array = NDArray[np.float64]
_GRAVITY = 9.81  # [m/s^2]


class CableSystem(MuscleSystem):
    """Drive the muscles of a model, and let MuJoCo's other actuators on spatial tendons pull along geodesic paths.

    The cables are in `declarations` with the law `ActuatorForce`. Their `tension` is minus the actuator's force times
    its gear, negative where it pushes. `step` moves them; `apply` does not.

    Args:
        model: as for `MuscleSystem`.
        strict: as for `MuscleSystem`.
        side_rule: as for `MuscleSystem`.
        transmission: whether MuJoCo also computes the forces of its own muscles, as in mode "transmission".
        tendons: whether spatial tendons without an actuator are listed too, as paths without a force.
        pulling: replace every cable by a string that pulls with its `excitation` times the model's weight, for tests of
            paths and forces; its actuator is left as it is.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        *,
        strict: bool = False,
        side_rule: int | None = None,
        transmission: bool = False,
        tendons: bool = False,
        pulling: bool = False,
    ) -> None:
        self._options = {"transmission": transmission, "tendons": tendons, "pulling": pulling}
        self.cables: list[str] = []  # names of the actuators that are not muscles
        self.bare: list[str] = []  # names of the tendons without an actuator
        super().__init__(model, strict=strict, side_rule=side_rule)
        self._rows = np.flatnonzero(self._plan.output >= 0)
        self._outputs = self._plan.output[self._rows]
        self._jacobian = np.zeros((self.n, model.nv))
        self._fits = False  # whether MuJoCo has room for the moments; only steps need it

    def on(self, model: mujoco.MjModel) -> CableSystem:
        """Return a system with the same muscles and cables for a copy of the model."""
        return type(self)(model, side_rule=self.side_rule, **self._options)

    def _declarations(self, model: mujoco.MjModel, side_rule: int | None) -> Declarations:
        options = self._options
        found = read_declarations(
            model, transmission=options["transmission"], cables=True, side_rule=side_rule
        )
        muscles = list(found.muscles)
        self.cables = [m.name for m in muscles if is_cable(m) and not is_muscle(model, m.actuator)]
        if options["tendons"]:
            bare = tendon_declarations(model, muscles, found.side_rule)
            self.bare = [muscle.name for muscle in bare]
            muscles += bare
        if options["pulling"]:
            muscles = [_pulled(model, muscle) for muscle in muscles]
        return replace(found, muscles=muscles)

    def _evaluate(
        self, state: State, poses: mujoco.MjData, data: mujoco.MjData, since: float = 0.0, ahead: float = 0.0
    ) -> None:
        super()._evaluate(state, poses, data, since, ahead)
        if not len(self._rows):
            return
        self._transmit(state, poses)
        if poses is state.scratch:
            poses.ctrl[:], poses.act[:], poses.time = data.ctrl, data.act, data.time
            mujoco.mj_fwdActuation(self.model, poses)
            self._read_forces(state, poses)

    def _transmit(self, state: State, poses: mujoco.MjData) -> None:
        """Write length, velocity and moment of the cables' actuators into data that have kinematics."""
        gear = self.model.actuator_gear[self._outputs, 0]
        poses.actuator_length[self._outputs] = gear * state.length[self._rows]
        poses.actuator_velocity[self._outputs] = gear * state.velocity[self._rows]
        if poses is state.scratch:
            return
        self._write_jacobian(state, poses, self._jacobian)
        columns = poses.moment_colind.reshape(-1)
        moment = poses.actuator_moment.reshape(-1)
        for row, output, factor in zip(self._rows, self._outputs, gear, strict=True):
            first = int(poses.moment_rowadr[output])
            places = slice(first, first + int(poses.moment_rownnz[output]))
            moment[places] = factor * self._jacobian[row, columns[places]]

    def _read_forces(self, state: State, data: mujoco.MjData) -> None:
        """Store the tensions that belong to the forces of the cables' actuators."""
        gear = self.model.actuator_gear[self._outputs, 0]
        state.tension[self._rows] = 0.0 - gear * data.actuator_force[self._outputs]

    def step(self, data: mujoco.MjData, nstep: int = 1) -> None:
        """Advance as `MuscleSystem.step` does; the cables' actuators pull along their paths at every stage."""
        if not self._fits:
            check_moment_columns(self.model, self._plan, self.declarations)
            self._fits = True
        super().step(data, nstep)
        if len(self._rows):
            self._read_forces(self._state(data), data)


def twin_of(muscles: MuscleSystem, model: mujoco.MjModel) -> MuscleSystem:
    """Return a system with the same muscles for a copy of the model."""
    if isinstance(muscles, CableSystem):
        return muscles.on(model)
    return MuscleSystem(model, side_rule=muscles.side_rule)


def kinds(muscles: MuscleSystem) -> dict[str, str]:
    """Return "muscle", "cable" or "tendon" (without an actuator) by name, also for what stays with MuJoCo."""
    found = dict.fromkeys([*muscles.names, *muscles.native], "muscle")
    for name in muscles.native:
        actuator = mujoco.mj_name2id(muscles.model, mujoco.mjtObj.mjOBJ_ACTUATOR, name)
        if actuator >= 0 and not is_muscle(muscles.model, actuator):
            found[name] = "cable"
    if isinstance(muscles, CableSystem):
        found |= dict.fromkeys(muscles.cables, "cable") | dict.fromkeys(muscles.bare, "tendon")
    return found


def is_cable(muscle: MuscleDeclaration) -> bool:
    """Return whether MuJoCo computes the force of a muscle."""
    return isinstance(muscle.parameters, ActuatorForce)


def _pulled(model: mujoco.MjModel, muscle: MuscleDeclaration) -> MuscleDeclaration:
    """Return a muscle as it is, a cable as a string that pulls with the model's weight."""
    if not is_cable(muscle):
        return muscle
    weight = _GRAVITY * float(model.body_mass.sum())
    return replace(muscle, parameters=PathActuator(weight or 1.0), actuator=-1)
