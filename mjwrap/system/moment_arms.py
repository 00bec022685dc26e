"""Choose independent coordinates of a model by name, and compute moment arms about them, couplings included."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap import validation
from mjwrap.errors import GeometryError
from mjwrap.mjcf import MuscleDeclaration, name_of, names
from mjwrap.mjcf.couplings import CoupledJoints
from mjwrap.mjcf.names import listed
from mjwrap.model.kinematic_tree import crossed_dofs
from mjwrap.text import nearest

Array = NDArray[np.float64]
_JOINT = mujoco.mjtObj.mjOBJ_JOINT
_SCALAR = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))


def independent_coordinates(model: mujoco.MjModel, couplings: CoupledJoints) -> list[str]:
    """Return the names of all hinges and slides that follow no other joint, in the model's order."""
    leader = couplings.leader
    return [
        name_of(model, _JOINT, joint)
        for joint in range(model.njnt)
        if int(model.jnt_type[joint]) in _SCALAR and joint not in leader
    ]


def moment_arms(
    model: mujoco.MjModel,
    couplings: CoupledJoints,
    jacobian: Array,
    qpos: Array,
    coordinates: Iterable[str] | None,
) -> Array:
    """Return −J N (n, k) [m] at a pose qpos (nq,), from J = ∂l/∂q (n, nv); see `MuscleSystem.moment_arms`."""
    given = independent_coordinates(model, couplings) if coordinates is None else coordinates
    dofs = _dofs(model, couplings, _listed(given))
    columns = np.searchsorted(couplings.independent, dofs)
    return -jacobian @ couplings.matrix(qpos)[:, columns]


def arms_of_all_dofs(couplings: CoupledJoints, jacobian: Array, qpos: Array) -> Array:
    """Return moment arms (n, nv) [m]: −J N for independent degrees of freedom, −J for those that follow others."""
    arms = -jacobian
    arms[:, couplings.independent] = arms @ couplings.matrix(qpos)
    return arms


def moved_muscles(
    model: mujoco.MjModel, couplings: CoupledJoints, muscles: Sequence[MuscleDeclaration]
) -> NDArray[np.bool_]:
    """Return which degrees of freedom move each muscle (n, nv), alone or with the joints that follow them."""
    crossed = crossed_dofs(model, muscles)
    moved = crossed.copy()
    for joint in couplings.leader:
        for head in couplings.heads(joint):
            moved[:, model.jnt_dofadr[head]] |= crossed[:, model.jnt_dofadr[joint]]
    return moved


def _listed(coordinates: Iterable[str]) -> list[str]:
    good = isinstance(coordinates, Iterable) and not isinstance(coordinates, Mapping | bytes)
    found = [coordinates] if isinstance(coordinates, str) else list(coordinates) if good else []
    good = good and all(isinstance(name, str) for name in found)
    validation.require(good, "coordinates", "a joint's name, or several", coordinates, GeometryError)
    return found


def _dofs(model: mujoco.MjModel, couplings: CoupledJoints, coordinates: list[str]) -> NDArray[np.int64]:
    """Return the degrees of freedom (k,) of joints by name; `GeometryError` for one that is not independent."""
    known = names(model, _JOINT, model.njnt)
    found: list[int] = []
    for name in coordinates:
        if name not in known:
            raise GeometryError(
                f"no joint '{name}' for a moment arm{nearest(name, known)}; joints: {listed(known)}"
            )
        joint = known.index(name)
        if joint in couplings.leader:
            heads = [f"'{known[head]}'" for head in couplings.heads(joint)]
            those, led = "that joint" if len(heads) == 1 else "one of these", ", ".join(heads)
            instead = f"give {those}, {led}" if heads else "there is no moment arm about it"
            follows = f"follows {' and '.join(heads)}" if heads else "is held at a position"
            raise GeometryError(f"joint '{name}' {follows} by an equality of the model: {instead}")
        first = int(model.jnt_dofadr[joint])
        count = {int(mujoco.mjtJoint.mjJNT_FREE): 6, int(mujoco.mjtJoint.mjJNT_BALL): 3}
        found += range(first, first + count.get(int(model.jnt_type[joint]), 1))
    return np.array(found, dtype=np.int64)
