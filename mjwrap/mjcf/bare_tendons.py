"""Read spatial tendons that no actuator pulls and no tuple declares, as paths without a force."""

from __future__ import annotations

from collections.abc import Collection

import mujoco

from mjwrap.mjcf.actuators import is_fixed
from mjwrap.mjcf.declarations import MuscleDeclaration
from mjwrap.mjcf.inside import reference_pose
from mjwrap.mjcf.names import name_of
from mjwrap.mjcf.routes import build_routes, tendon_stops
from mjwrap.muscles.laws import PathActuator

OBJ = mujoco.mjtObj


def tendon_declarations(
    model: mujoco.MjModel, muscles: Collection[MuscleDeclaration], side_rule: int
) -> list[MuscleDeclaration]:
    """Return the spatial tendons without an actuator, each a muscle of 1 N that nothing excites.

    muscles: those that are declared; their names are avoided: a tendon of the same name is called "NAME (tendon)".
    side_rule: of the tendons' side sites.
    """
    pulled = {
        int(model.actuator_trnid[actuator, 0])
        for actuator in range(model.nactuator)
        if int(model.actuator_trntype[actuator]) == int(mujoco.mjtTrn.mjTRN_TENDON)
    } | {muscle.tendon for muscle in muscles}
    taken, rest = {muscle.name for muscle in muscles}, reference_pose(model)
    found = []
    for tendon in range(model.ntendon):
        if tendon in pulled or is_fixed(model, tendon):
            continue
        name = name_of(model, OBJ.mjOBJ_TENDON, tendon)
        routes = build_routes(model, name, tendon_stops(model, rest, tendon, side_rule))
        shown = f"{name} (tendon)" if name in taken else name
        found.append(MuscleDeclaration(shown, routes, PathActuator(1.0), tendon=tendon))
    return found
