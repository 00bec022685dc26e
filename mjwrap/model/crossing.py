"""Which degrees of freedom a muscle crosses: those that move some of the bodies on its route and not all."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjwrap.mjcf import MuscleDeclaration

Bools = NDArray[np.bool_]


def moved_bodies(model: Any) -> Bools:
    """Return which dofs move each body, (nbody, nv); model: a mujoco.MjModel."""
    moves = np.zeros((model.nbody, model.nv), dtype=np.bool_)
    for body in range(1, model.nbody):
        moves[body] = moves[model.body_parentid[body]]
        first = int(model.body_dofadr[body])
        moves[body, first : first + int(model.body_dofnum[body])] = True
    return moves


def crossed_by_route(moves: Bools, bodies: Sequence[int]) -> Bools:
    """Return which dofs (nv,) a route over some bodies crosses; moves: as `moved_bodies` returns them."""
    count = moves[list(bodies)].sum(axis=0)
    return (count > 0) & (count < len(bodies))


def crossed_dofs(model: Any, muscles: Sequence[MuscleDeclaration]) -> Bools:
    """Return which dofs each muscle crosses with one of its routes at least, (n, nv)."""
    moves = moved_bodies(model)
    found = np.zeros((len(muscles), model.nv), dtype=np.bool_)
    for i, muscle in enumerate(muscles):
        for route in muscle.routes:
            sites = [route.origin, route.insertion, *(node.site for node in route.nodes if node.geom < 0)]
            geoms = [node.geom for node in route.nodes if node.geom >= 0]
            found[i] |= crossed_by_route(moves, [*model.site_bodyid[sites], *model.geom_bodyid[geoms]])
    return found
