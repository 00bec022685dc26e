"""Check that MuJoCo has room for the moments of its own actuators along mjwrap's paths."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np

from mjwrap.errors import ModelError
from mjwrap.kernels.coupling import muscle_paths
from mjwrap.kernels.coupling.path_points import U_DOF, U_ROUTE
from mjwrap.mjcf import MuscleDeclaration, name_of
from mjwrap.model.arrays import Plan
from mjwrap.model.kinematic_tree import moving_dofs

OBJ = mujoco.mjtObj


def _columns(model: mujoco.MjModel, actuator: int) -> set[int]:
    """Return the dofs for which MuJoCo stores the moment of an actuator: those that move its tendon's bodies."""
    tendon = int(model.actuator_trnid[actuator, 0])
    first = int(model.ten_J_rowadr[tendon])
    return {int(dof) for dof in model.ten_J_colind[first : first + int(model.ten_J_rownnz[tendon])]}


def check_moment_columns(model: mujoco.MjModel, plan: Plan, muscles: Sequence[MuscleDeclaration]) -> None:
    """Raise `ModelError` if the path of a muscle depends on a dof for which MuJoCo stores no moment of its actuator."""
    moves = moving_dofs(model)
    for c, route in enumerate(plan.routes):
        muscle = muscles[int(route[muscle_paths.R_MUSCLE])]
        if plan.output[route[muscle_paths.R_MUSCLE]] < 0:
            continue
        stops = plan.links[route[muscle_paths.R_LO] : route[muscle_paths.R_HI], muscle_paths.L_BODY].tolist()
        bodies = [int(route[muscle_paths.R_FROM_BODY]), *stops, int(route[muscle_paths.R_TO_BODY])]
        moved = {body: set(np.flatnonzero(moves[body]).tolist()) for body in bodies}
        stored = _columns(model, muscle.actuator) | set.intersection(*moved.values())
        for dof in plan.uses[plan.uses[:, U_ROUTE] == c, U_DOF].tolist():
            if dof not in _columns(model, muscle.actuator):
                tendon = name_of(model, OBJ.mjOBJ_TENDON, int(model.actuator_trnid[muscle.actuator, 0]))
                joint = name_of(model, OBJ.mjOBJ_JOINT, int(model.dof_jntid[dof]))
                raise ModelError(
                    f"muscle '{muscle.name}': joint '{joint}' moves a point of its path, but does not move tendon "
                    f"'{tendon}', so MuJoCo does not store its moment there; let the tendon pass a site that the joint "
                    f"moves, or use mode 'wrench'"
                )
        for body, dofs in moved.items():
            if not dofs <= stored:
                tendon = name_of(model, OBJ.mjOBJ_TENDON, int(model.actuator_trnid[muscle.actuator, 0]))
                raise ModelError(
                    f"muscle '{muscle.name}': its path runs over body '{name_of(model, OBJ.mjOBJ_BODY, body)}', which "
                    f"tendon '{tendon}' does not touch, so MuJoCo does not store its moment there; let the tendon "
                    f"pass a site on that body, or use mode 'wrench'"
                )
