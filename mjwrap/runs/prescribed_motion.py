"""Joints that follow a given motion, whatever forces act on them; the rest of the model is moved by them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.errors import SignalError
from mjwrap.files import SUFFIXES, read_table
from mjwrap.poses.angles import Angle
from mjwrap.runs.angles import check_column, check_position, pattern_in_radians, unit_taken
from mjwrap.runs.models import find_joint, single_joints
from mjwrap.runs.signals import Constant, Sine, SmoothSignal, match_columns, parse_pattern

Array = NDArray[np.float64]
_HINGE = int(mujoco.mjtJoint.mjJNT_HINGE)
HEAVY = 1e9  # inertia of a prescribed joint, relative to the largest inertia in the model


class Spline:
    """A smooth curve through samples; before the first and after the last one it is constant."""

    def __init__(self, times: Array, values: Array) -> None:
        from scipy.interpolate import CubicSpline

        self._low, self._high = float(times[0]), float(times[-1])
        # at rest at both ends, beyond which the value is constant
        self._curve = CubicSpline(times, values, bc_type="clamped") if len(times) > 1 else None
        self._only = float(values[0])

    def _at(self, t: float, order: int) -> float:
        if self._curve is None:
            return 0.0 if order else self._only
        if order and not self._low <= t <= self._high:
            return 0.0
        return float(self._curve(min(max(t, self._low), self._high), order))

    def value(self, t: float) -> float:
        """Return the value at time t."""
        return self._at(t, 0)

    def rate(self, t: float) -> float:
        """Return the derivative at time t."""
        return self._at(t, 1)


class PrescribedMotion:
    """The prescribed joints of a run.

    Args:
        model: the model, in which the armature of these joints is changed.
        entries: "JOINT=constant:...", "JOINT=sine:...", "JOINT=cosine:...", or a table (.csv, .sto, .mot, .npz) with a
            column for each joint; a number alone is a constant. Positions are in rad or m, with "deg" after a number
            in degrees ("knee=90deg", "knee=sine:30deg,1"), and in degrees if the table's header says so.
        option: name of the command-line option of the entries, for messages.

    Raises:
        SignalError: an entry is not valid, or positions are so far outside a joint's range that only degrees explain
            them.
        ModelError: a joint does not exist.
    """

    def __init__(self, model: mujoco.MjModel, entries: Sequence[str], *, option: str = "") -> None:
        self._model = model
        self.remarks: list[str] = []  # on the units of tables
        found: dict[int, SmoothSignal] = {}
        for entry in entries:
            name, equals, pattern = entry.rpartition("=")
            equals = equals and not Path(entry).is_file()
            if not equals and Path(entry).suffix.lower() not in SUFFIXES:
                known = ", ".join(single_joints(model)) or "none"
                named = f"{option} '{entry}'".lstrip()
                raise SignalError(
                    f"{named}: write JOINT=PATTERN, such as knee=sine:0.5,1 or knee=90deg, or name a table "
                    f"({', '.join(SUFFIXES)}); joints: {known}"
                )
            if equals:
                joint = find_joint(model, name, entry)
                found[joint] = _smooth(model, joint, name, pattern)
            else:
                table, joints = read_table(entry), single_joints(model)
                matched = match_columns(table, list(joints), "hinge or slide")
                unit = unit_taken(model, table, {column: joints[name] for column, name in matched.items()})
                self.remarks += [unit] if unit else []
                for column, driven in matched.items():
                    joint = joints[driven]
                    check_column(model, joint, table, column)
                    turns = table.in_degrees and int(model.jnt_type[joint]) == _HINGE
                    values = np.radians(table[column]) if turns else table[column]
                    found[joint] = Spline(table.time, values)
        self.joints = list(found)
        self._signals = list(found.values())
        self._qpos = np.array([model.jnt_qposadr[j] for j in found], dtype=np.int64)
        self._dofs = np.array([model.jnt_dofadr[j] for j in found], dtype=np.int64)
        # So much inertia that no other force moves the joints: they follow the motion at every stage of the integrator.
        self._inertia = HEAVY * float(np.max(model.dof_M0, initial=1e-3))
        model.dof_armature[self._dofs] = self._inertia

    def place(self, data: mujoco.MjData) -> None:
        """Set the joints to their prescribed positions and speeds at `data.time`."""
        if self.joints:
            data.qpos[self._qpos] = [signal.value(data.time) for signal in self._signals]
            data.qvel[self._dofs] = [signal.rate(data.time) for signal in self._signals]

    def drive(self, data: mujoco.MjData) -> None:
        """Apply the joint forces that move the joints through the coming step.

        The accelerations are the means over the step, accurate to second order in the time step.
        """
        if self.joints:
            now, h = data.time, self._model.opt.timestep
            change = np.array([signal.rate(now + h) - signal.rate(now) for signal in self._signals])
            data.qfrc_applied[self._dofs] = self._inertia * change / h


def _smooth(model: mujoco.MjModel, joint: int, name: str, pattern: str) -> SmoothSignal:
    radians, degrees = pattern_in_radians(pattern)
    signal = parse_pattern(radians)(name, 0, 1)
    if not isinstance(signal, Constant | Sine):
        raise SignalError(
            f"'{name}={pattern}': a joint can follow a constant, sine, cosine or file; it cannot jump"
        )
    ends = (signal.level,) if isinstance(signal, Constant) else _extremes(signal)
    for end in ends:
        value = Angle(end) if degrees else end
        check_position(model, joint, value, f"'{name}={pattern}'", SignalError)
    return signal


def _extremes(signal: Sine) -> tuple[float, float]:
    reach = abs(signal.amplitude)
    return signal.offset + reach, signal.offset - reach


def check_free(model: mujoco.MjModel, joints: Sequence[int], positions: Mapping[str, float]) -> None:
    """Raise `SignalError` if a start position [rad, m] is given for a prescribed joint."""
    for name, value in positions.items():
        entry = f"{name}={value:g}"
        if find_joint(model, name, entry) in joints:
            raise SignalError(f"'{entry}': this joint's position is prescribed")
