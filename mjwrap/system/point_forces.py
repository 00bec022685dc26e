"""The share of each muscle's force that acts on the joints that move points of its path."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mjwrap.kernels.coupling import muscle_paths, path_points
from mjwrap.kernels.solved import segments
from mjwrap.system.results import Results


def forces_on_joints(muscles: Results, i: int) -> NDArray[np.float64]:
    """Return the generalised forces (nv,) of muscle i on joints that move points of its path, at the last evaluation.

    They act beside the forces on bodies (`Results.forces`) [N m, N for slides]; zero for a muscle without such points.
    """
    state, plan = muscles._evaluation(), muscles._plan
    force = np.zeros(muscles.model.nv)
    for c, node, axis, dof in plan.uses.tolist():
        if plan.routes[c, muscle_paths.R_MUSCLE] != i:
            continue
        first = int(plan.routes[c, muscle_paths.R_LO]) + c
        rows = state.segments[first : first + int(state.count[c])]
        sign = (rows[:, segments.G_FAR] == node).astype(np.float64) - (rows[:, segments.G_NEAR] == node)
        gradient = sign @ rows[:, segments.G_E : segments.G_E + 3]
        slope = state.slopes[axis, path_points.S_FIRST : path_points.S_FIRST + 3]
        force[dof] -= state.tension[i] * plan.weights[c] * float(gradient @ slope)
    return force
