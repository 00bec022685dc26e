"""Motions: positions over time, with velocities and accelerations that are given or computed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap import validation
from mjwrap.errors import StateError
from mjwrap.files import Table
from mjwrap.inverse.coordinates import IndependentCoordinates, quaternions
from mjwrap.inverse.filtering import check_filter, low_pass
from mjwrap.inverse.motion_tables import table_positions
from mjwrap.inverse.splines import ENDS, angular_rates, continuous, derivatives

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Motion:
    """The motion of a model: what `muscle_analysis`, `inverse_dynamics` and other inverse tools follow.

    Velocities and accelerations that are None are computed for a model by `completed`, which all tools call. SI units
    and rad, in MuJoCo's layout.

    Args:
        time: (T,) times [s], ascending; at a single time the model is at rest, unless velocities are given.
        qpos: (T, nq) positions.
        qvel: (T, nv) velocities, or None.
        qacc: (T, nv) accelerations, or None.
        ends: of the splines: "not-a-knot", which is the more accurate, or "natural", as of OpenSim's splines.

    Raises:
        StateError: shapes do not fit each other, numbers are not finite, or times do not ascend.
    """

    time: Array
    qpos: Array
    qvel: Array | None = None
    qacc: Array | None = None
    ends: str = "not-a-knot"

    def __post_init__(self) -> None:
        validation.choice(self.ends, ENDS, "ends", StateError)
        time = validation.numbers(self.time, "time", StateError)
        if time.ndim != 1 or not len(time):
            raise StateError(f"time must be (T,) with at least one time, not of shape {time.shape}")
        if not np.isfinite(time).all() or (np.diff(time) <= 0.0).any():
            raise StateError("time must be finite and ascend")
        object.__setattr__(self, "time", time)
        for name in ("qpos", "qvel", "qacc"):
            given = getattr(self, name)
            if given is None and name != "qpos":
                continue
            values = validation.numbers(given, name, StateError)
            if values.ndim != 2 or len(values) != len(time):
                raise StateError(
                    f"{name} must have a row for each of {len(time)} times, not shape {values.shape}"
                )
            bad = np.argwhere(~np.isfinite(values))
            if len(bad):
                raise StateError(f"{name}[{bad[0][1]}] is not finite at time {time[bad[0][0]]:g} s")
            object.__setattr__(self, name, values)
        if self.qpos.shape[1] < max(_width(self.qvel), _width(self.qacc)):
            raise StateError("qvel and qacc have more columns than qpos")

    def __len__(self) -> int:
        return len(self.time)

    @classmethod
    def from_table(
        cls,
        model: mujoco.MjModel,
        table: Table,
        *,
        missing: Mapping[str, float] | None = None,
        cutoff: float | None = None,
        order: int = 3,
        ends: str = "not-a-knot",
    ) -> Motion:
        """Return the motion in a table of coordinates, such as an OpenSim .mot file, with all that follows them.

        A column is called as its coordinate or joint, also as in OpenSim's states files ("/jointset/J/NAME/value") and
        in tables of `mjwrap run` ("qpos:NAME"). Rotations are in degrees if the table's header says inDegrees=yes.
        Coordinates that follow others are where these put them, as `mw.osim.set_coordinates` does; columns for them
        are compared with that, and a difference is a warning. Other columns are not used.

        Args:
            model: any model, imported from OpenSim or not.
            table: the table.
            missing: values [rad, m] of coordinates that the table does not have, by name.
            cutoff: of a low-pass filter for the coordinates [Hz], None for none; see `low_pass`.
            order: of the filter, in each of its two directions.
            ends: of the splines.

        Returns:
            The motion, positions only.

        Raises:
            TableError: columns are missing, or angles so far outside a joint's range that only degrees explain them.
            StateError: a coordinate has no such value, or the filter does not fit the times.
        """
        qpos = table_positions(model, table, missing or {}, cutoff, order)
        return cls(table.time, qpos, ends=ends)

    def low_pass(self, model: mujoco.MjModel, cutoff: float, order: int = 3) -> Motion:
        """Return the motion after a zero-phase Butterworth filter, run forwards and backwards (SciPy's sosfiltfilt).

        At the cut-off each of the two runs halves the power, so the amplitude there is half. Quaternions are filtered
        by component and normalised; joints that follow others are placed again. Velocities and accelerations are
        filtered where they are given.

        Args:
            model: the model that moves.
            cutoff: [Hz], below half the sampling rate; times must be evenly spaced.
            order: of the filter, in each direction; OpenSim's is 3.

        Raises:
            StateError: the cut-off or the times do not allow it.
        """
        check_filter(self.time, cutoff, order)
        whole = self._checked(model)
        qpos = whole.qpos.copy()
        for _, at, _ in quaternions(model):
            qpos[:, at : at + 4] = continuous(qpos[:, at : at + 4])
        qpos = low_pass(self.time, qpos, cutoff, order)
        mapped = {
            name: None if values is None else low_pass(self.time, values, cutoff, order)
            for name, values in (("qvel", self.qvel), ("qacc", self.qacc))
        }
        for _, at, _ in quaternions(model):
            qpos[:, at : at + 4] = continuous(qpos[:, at : at + 4])
        placed = np.ascontiguousarray(qpos.T)
        IndependentCoordinates(model).couplings.place(placed)
        return replace(self, qpos=np.ascontiguousarray(placed.T), **mapped)

    def completed(self, model: mujoco.MjModel) -> Motion:
        """Return the motion with all velocities and accelerations, and quaternions of length 1.

        Splines of degree 5 through the positions give both; if velocities are given, accelerations are the slopes of
        splines through these. Rates of joints that follow others are those that their leaders' give: q̇ = N q̇_ind,
        and with the rate of N for the accelerations. Positions of followers are left as they are.

        Raises:
            StateError: the motion does not fit the model, or a quaternion is zero.
        """
        whole = self._checked(model)
        if self.qvel is not None and self.qacc is not None:
            return whole
        if self.qvel is not None:
            return replace(whole, qacc=derivatives(self.time, self.qvel, self.ends)[0])
        qvel, second = _rates(model, self.time, whole.qpos, self.ends)
        couplings = IndependentCoordinates(model).couplings
        poses, speeds, growth = (np.ascontiguousarray(a.T) for a in (whole.qpos, qvel, second))
        couplings.spread(poses, speeds)
        couplings.accelerate(poses, speeds, growth)
        qacc = np.ascontiguousarray(growth.T) if self.qacc is None else self.qacc
        return replace(whole, qvel=np.ascontiguousarray(speeds.T), qacc=qacc)

    def _checked(self, model: mujoco.MjModel) -> Motion:
        """Return the motion with quaternions of length 1; `StateError` if it does not fit the model."""
        validation.of_type(model, "MjModel", "model", StateError)
        for name, values, wide in (
            ("qpos", self.qpos, model.nq), ("qvel", self.qvel, model.nv), ("qacc", self.qacc, model.nv),
        ):  # fmt: skip
            if values is not None and values.shape[1] != wide:
                raise StateError(f"{name} must be (T, {wide}) for this model, not {values.shape}")
        qpos = self.qpos.copy()
        for joint, at, _ in quaternions(model):
            sizes = np.linalg.norm(qpos[:, at : at + 4], axis=1)
            if (sizes < 1e-6).any():
                k = int(np.argmin(sizes))
                raise StateError(f"the quaternion of joint '{joint}' is zero at time {self.time[k]:g} s")
            qpos[:, at : at + 4] /= sizes[:, None]
        return replace(self, qpos=qpos)


def _width(values: Array | None) -> int:
    return 0 if values is None else values.shape[1]


def _rates(model: mujoco.MjModel, time: Array, qpos: Array, ends: str) -> tuple[Array, Array]:
    """Return velocities and accelerations (T, nv) of all joints by splines through their positions."""
    curve = qpos.copy()
    turning = quaternions(model)
    for _, at, _ in turning:
        curve[:, at : at + 4] = continuous(curve[:, at : at + 4])
    first, second = derivatives(time, curve, ends)
    qvel, qacc = np.zeros((len(time), model.nv)), np.zeros((len(time), model.nv))
    for joint in range(model.njnt):
        at, dof = int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])
        count = {int(mujoco.mjtJoint.mjJNT_FREE): 3, int(mujoco.mjtJoint.mjJNT_BALL): 0}
        straight = count.get(int(model.jnt_type[joint]), 1)
        qvel[:, dof : dof + straight] = first[:, at : at + straight]
        qacc[:, dof : dof + straight] = second[:, at : at + straight]
    for _, at, dof in turning:
        four = slice(at, at + 4)
        qvel[:, dof : dof + 3], qacc[:, dof : dof + 3] = angular_rates(
            curve[:, four], first[:, four], second[:, four]
        )
    return qvel, qacc
