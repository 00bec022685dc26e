"""Find the degrees of freedom that move each body, and those that each muscle crosses."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.mjcf import MuscleDeclaration, read_moving_axes

Bools = NDArray[np.bool_]
Ints = NDArray[np.int64]


def last_dofs(model: mujoco.MjModel) -> Ints:
    """Return the last degree of freedom that moves each body (nbody,), -1 for bodies that cannot move.

    The others that move it follow from there by `dof_parentid`.
    """
    last = np.full(model.nbody, -1, dtype=np.int64)
    for body in range(1, model.nbody):
        first, count = int(model.body_dofadr[body]), int(model.body_dofnum[body])
        last[body] = first + count - 1 if count else last[model.body_parentid[body]]
    return last


def moving_dofs(model: mujoco.MjModel) -> Bools:
    """Return which degrees of freedom move each body (nbody, nv): its own and those of all bodies above it."""
    moves = np.zeros((model.nbody, model.nv), dtype=np.bool_)
    for body in range(1, model.nbody):
        moves[body] = moves[model.body_parentid[body]]
        first = int(model.body_dofadr[body])
        moves[body, first : first + int(model.body_dofnum[body])] = True
    return moves


def crossed_dofs(model: mujoco.MjModel, muscles: Sequence[MuscleDeclaration]) -> Bools:
    """Return the degrees of freedom that each muscle crosses, (n, nv).

    A route crosses a degree of freedom that moves some, but not all, of the bodies of its sites and geoms; only these
    can change its length. A muscle crosses those that any of its routes crosses, and those of the joints that move its
    path points or decide whether these are present.
    """
    moves = moving_dofs(model)
    axes = read_moving_axes(model)
    crossed = np.zeros((len(muscles), model.nv), dtype=np.bool_)
    for i, muscle in enumerate(muscles):
        for route in muscle.routes:
            sites = route.sites
            geoms = [node.geom for node in route.nodes if node.geom >= 0]
            stops = moves[[*model.site_bodyid[sites], *model.geom_bodyid[geoms]]]
            crossed[i] |= stops.any(axis=0) & ~stops.all(axis=0)
            joints = [axis.joint for axis in axes if axis.site in sites]
            joints += [each.joint for presence in route.when for each in presence.ranges]
            crossed[i, model.jnt_dofadr[joints]] = True
    return crossed
