"""Read and set the coordinates of a model by name, with everything that follows them."""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap import validation
from mjwrap.errors import StateError
from mjwrap.mjcf import name_of
from mjwrap.mjcf.coordinate_functions import CoordinateFunction, read_coordinate_functions
from mjwrap.mjcf.couplings import CoupledJoints
from mjwrap.system.pieces import PieceSwitch
from mjwrap.system.projection import Projection

Array = NDArray[np.float64]
OBJ, _KINDS = mujoco.mjtObj, mujoco.mjtJoint
_SCALAR = int(_KINDS.mjJNT_SLIDE), int(_KINDS.mjJNT_HINGE)
CLOSE = 1e-9  # largest difference of a value that couplings give [rad or m], relative above 1
TIED = 1e-7  # the same of a value that other equalities give


def coordinates(model: mujoco.MjModel, data: mujoco.MjData) -> dict[str, float]:
    """Return the values of all coordinates by name, angles in rad and lengths in m.

    These are the positions of the hinges and slides that have a name, in the model's order, also of those that follow
    others, and then the coordinates of an imported model that are functions of a joint. Ball and free joints have no
    single value. Of the state, only qpos is read.

    Args:
        model: any model, imported from OpenSim or not.
        data: the state.

    Returns:
        Values by name: what `set_coordinates` takes.

    Raises:
        StateError: the data belong to a different model.
        ModelError: a declaration of a coordinate is wrong.
    """
    _check(model, data)
    return _values(model, data.qpos, read_coordinate_functions(model))


def set_coordinates(model: mujoco.MjModel, data: mujoco.MjData, values: Mapping[str, float]) -> None:
    """Set coordinates by name, and all joints that couplers, splines, loops and other equalities tie to them.

    The coordinates move from their present values in strides, and each pose is projected on the active equalities, so
    that loops stay on the branch on which they are. Joints that equalities tie to the given ones move as little as
    possible; all others keep their values. Afterwards the error of each equality is below 1e-11 m or rad. Only
    `data.qpos` and, for couplings of several pieces, `data.eq_active` are written; call `mj_forward` afterwards, and
    `reset` of a `MuscleSystem`. A value outside the range of its joint is set as it is. If an error is raised, nothing
    has been written.

    Args:
        model: any model, imported from OpenSim or not.
        data: the state.
        values: value by name [rad or m]. A coordinate that follows others by a coupler, or is locked, may only be given
            with the value that it has then anyway; values of coordinates that other equalities tie have to fit each
            other, within 1e-7.

    Raises:
        StateError: there is no such coordinate, it follows others or is locked at another value, a value is not a
            finite number, or no pose with these values satisfies the equalities.
        ModelError: a declaration of a coordinate or a coupling is wrong.
    """
    _check(model, data)
    if not isinstance(values, Mapping):
        raise StateError(f"values must be a dict of values by coordinate, not {validation.described(values)}")
    functions, projection = read_coordinate_functions(model), Projection(model)
    couplings = projection.couplings
    wanted = {_known(model, functions, name): _number(name, value) for name, value in values.items()}
    given: dict[int, float] = {}
    for name, value in wanted.items():
        joint = _joint(model, name)
        if joint >= 0 and joint not in couplings.leader:
            given[joint] = value
        elif joint < 0 and functions[name].own and functions[name].joint not in couplings.leader:
            given[functions[name].joint] = functions[name].position(value)
    qpos = projection.place(data, given)
    found = _values(model, qpos, functions)
    close = TIED if projection.equalities.active(data) else CLOSE
    for name, value in wanted.items():
        if abs(found[name] - value) > close * max(1.0, abs(value)):
            raise StateError(_contradiction(model, functions, couplings, name, value, found[name]))
    data.qpos[:] = qpos
    PieceSwitch(model).set(data)


def _check(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    validation.of_type(model, "MjModel", "model", StateError)
    validation.of_type(data, "MjData", "data", StateError)
    if data.model._address != model._address:
        raise StateError("this MjData belongs to a different model")


def _joint(model: mujoco.MjModel, name: str) -> int:
    return int(mujoco.mj_name2id(model, OBJ.mjOBJ_JOINT, name))


def _values(
    model: mujoco.MjModel, qpos: Array, functions: Mapping[str, CoordinateFunction]
) -> dict[str, float]:
    found = {}
    for joint in range(model.njnt):
        name = mujoco.mj_id2name(model, OBJ.mjOBJ_JOINT, joint)
        if name and int(model.jnt_type[joint]) in _SCALAR:
            found[name] = float(qpos[model.jnt_qposadr[joint]])
    for name, function in functions.items():
        found.setdefault(name, function.value(float(qpos[model.jnt_qposadr[function.joint]])))
    return found


def _known(model: mujoco.MjModel, functions: Mapping[str, CoordinateFunction], name: object) -> str:
    """Return a name; raise `StateError`, which lists near ones, unless it is that of a coordinate."""
    if not isinstance(name, str):
        raise StateError(f"a coordinate is given by its name, not by {validation.described(name)}")
    joint = _joint(model, name)
    if joint >= 0 and int(model.jnt_type[joint]) not in _SCALAR:
        kind = _KINDS(int(model.jnt_type[joint])).name.removeprefix("mjJNT_").lower()
        raise StateError(f"joint '{name}' is a {kind} joint, which has no single value: set it in data.qpos")
    if joint < 0 and name not in functions:
        known = list(_values(model, model.qpos0, functions))
        near = difflib.get_close_matches(name, known)
        meant = f"did you mean {' or '.join(near)}?" if near else f"coordinates: {', '.join(known) or 'none'}"
        raise StateError(f"no coordinate '{name}'; {meant}")
    return name


def _number(name: str, value: object) -> float:
    if not (validation.is_number(value) and math.isfinite(float(value))):  # pyright: ignore[reportArgumentType]
        raise StateError(f"coordinate '{name}' must be a finite number, not {validation.described(value)}")
    return float(value)  # pyright: ignore[reportArgumentType]


def _contradiction(
    model: mujoco.MjModel,
    functions: Mapping[str, CoordinateFunction],
    couplings: CoupledJoints,
    name: str,
    value: float,
    there: float,
) -> str:
    """Return why a coordinate cannot be set to a value; there: the value that it has instead."""
    joint = _joint(model, name)
    shown = joint if joint >= 0 else functions[name].joint
    heads = couplings.heads(shown)
    if heads == [shown] and (joint >= 0 or functions[name].own):
        return (
            f"equalities of the model tie coordinate '{name}' to others: it is {there:.9g}, "
            f"so it cannot be {value:.9g}"
        )
    led = " and ".join(f"'{name_of(model, OBJ.mjOBJ_JOINT, head)}'" for head in heads)
    if not heads:
        return f"coordinate '{name}' is locked at {there:.9g} by an equality of the model, and cannot be {value:.9g}"
    return (
        f"coordinate '{name}' follows {led}, which puts it at {there:.9g}, so it cannot be {value:.9g}: set {led} "
        f"instead"
    )
