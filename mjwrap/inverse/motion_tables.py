"""Positions of a model over time from a table of coordinates."""

from __future__ import annotations

import warnings
from collections.abc import Mapping

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap import validation
from mjwrap.errors import StateError, TableError
from mjwrap.files import Table
from mjwrap.inverse.coordinates import quaternions
from mjwrap.inverse.filtering import check_filter, low_pass
from mjwrap.inverse.splines import continuous
from mjwrap.mjcf import name_of, qpos_names
from mjwrap.mjcf.coordinate_functions import CoordinateFunction
from mjwrap.mjcf.names import listed
from mjwrap.osim.coordinate_frames import CoordinateFrames
from mjwrap.runs.angles import check_column
from mjwrap.text import nearest

Array = NDArray[np.float64]
OFF = 1e-3  # [rad or m] difference of a column from what its coordinate's leaders give, from which a warning tells
_HINGE, _SLIDE = int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)


def table_positions(
    model: mujoco.MjModel, table: Table, missing: Mapping[str, float] | None, cutoff: float | None, order: int
) -> Array:
    """Return positions (T, nq); arguments and errors as of `Motion.from_table`."""
    validation.of_type(model, "MjModel", "model", StateError)
    validation.instance(table, Table, "table", TableError, "a Table, as from mw.read_table")
    validation.optional(missing, Mapping, "missing", StateError, "a dict of values by coordinate")
    validation.whole(order, 1, "order", StateError)
    frames = CoordinateFrames(model)
    wanted = _wanted(model, frames)
    columns = _columns(model, table, frames.functions)
    values = {name: _values(model, table, column, name, frames.functions) for name, column in columns.items()}
    for name, value in (missing or {}).items():
        if name not in wanted:
            known = f"{nearest(str(name), wanted)}; coordinates: {listed(wanted)}"
            raise StateError(f"missing: no independent coordinate '{name}'{known}")
        values.setdefault(name, np.full(len(table.time), validation.finite(value, f"'{name}'", StateError)))
    absent = [name for name in wanted if name not in values]
    if absent:
        where = f"'{table.source}'" if table.source else "the table"
        raise TableError(
            f"{where} has no column for {', '.join(absent)}; its columns: {', '.join(table.names)}. Give values for "
            f"coordinates that it lacks: missing={{'{absent[0]}': 0.0}}"
        )
    chosen = np.column_stack([values[name] for name in wanted]) if wanted else np.zeros((len(table.time), 0))
    chosen = _filtered(model, table.time, wanted, chosen, cutoff, order)
    qpos = frames.place({name: chosen[:, i] for i, name in enumerate(wanted)}, len(table.time))
    _compare_followers(frames, qpos, {n: v for n, v in values.items() if n not in wanted}, table, columns)
    return qpos


def _columns(
    model: mujoco.MjModel, table: Table, functions: Mapping[str, CoordinateFunction]
) -> dict[str, str]:
    """Return the columns of positions by the entry of qpos, or the coordinate, that they give."""
    known = {*qpos_names(model), *functions}
    found: dict[str, str] = {}
    for column in table.names:
        short = column.removesuffix("/value").rpartition("/")[2] if ":" not in column else ""
        name = next((each for each in (column, column.removeprefix("qpos:"), short) if each in known), None)
        speed = column.endswith("/speed") or column.startswith("qvel:")
        if name is None or speed:
            continue
        if name in found:
            raise TableError(f"'{table.source}': columns '{found[name]}' and '{column}' both give '{name}'")
        found[name] = column
    return found


def _values(
    model: mujoco.MjModel,
    table: Table,
    column: str,
    name: str,
    functions: Mapping[str, CoordinateFunction],
) -> Array:
    """Return the values of a column [rad or m], checked against the range of its joint."""
    joint = int(mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name))
    shown = joint if joint >= 0 else functions[name].joint if name in functions else -1
    turns = shown >= 0 and int(model.jnt_type[shown]) == _HINGE
    if joint >= 0 and turns:
        check_column(model, joint, table, column)
    values = np.radians(table[column]) if turns and table.in_degrees else table[column]
    bad = np.flatnonzero(~np.isfinite(values))
    if len(bad):
        raise TableError(f"'{table.source}', column '{column}': not finite at time {table.time[bad[0]]:g} s")
    return values


def _wanted(model: mujoco.MjModel, frames: CoordinateFrames) -> list[str]:
    """Return the entries of qpos, and the coordinates in place of joints that show them, that a table must give."""
    shown = {f.joint: name for name, f in frames.functions.items() if f.own}
    found: list[str] = []
    for joint in range(model.njnt):
        if joint in frames.couplings.leader:
            continue
        name = shown.get(joint, name_of(model, mujoco.mjtObj.mjOBJ_JOINT, joint))
        count = {int(mujoco.mjtJoint.mjJNT_FREE): 7, int(mujoco.mjtJoint.mjJNT_BALL): 4}
        size = count.get(int(model.jnt_type[joint]), 1)
        found += [name] if size == 1 else [f"{name}[{i}]" for i in range(size)]
    return found


def _filtered(
    model: mujoco.MjModel, time: Array, names: list[str], values: Array, cutoff: float | None, order: int
) -> Array:
    """Return the columns after a low-pass filter, if there is a cut-off, and quaternions of one sign."""
    for joint, _, _ in quaternions(model):
        # the last four entries of a ball or free joint
        last = max(i for i, name in enumerate(names) if name.startswith(f"{joint}["))
        four = values[:, last - 3 : last + 1]
        if (np.linalg.norm(four, axis=1) < 1e-6).any():
            raise StateError(f"the quaternion of joint '{joint}' is zero in the table")
        values[:, last - 3 : last + 1] = continuous(four)
    if cutoff is None:
        return values
    check_filter(time, cutoff, order)
    return low_pass(time, values, cutoff, order)


def _compare_followers(
    frames: CoordinateFrames,
    qpos: Array,
    others: Mapping[str, Array],
    table: Table,
    columns: Mapping[str, str],
) -> None:
    """Warn where columns of coordinates that follow others, or are locked, differ from where these are."""
    for name, values in others.items():
        there = frames.values(name, qpos)
        off = np.abs(there - values)
        k = int(np.argmax(off))
        if off[k] > OFF:
            warnings.warn(
                f"'{table.source}', column '{columns.get(name, name)}': {values[k]:g} at time {table.time[k]:g} s is "
                f"not used, because '{name}' follows others or is locked, which puts it at {there[k]:g} (rad, m)",
                stacklevel=5,
            )
