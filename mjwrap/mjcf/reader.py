"""Read all muscles of a model: those that its tuples declare, and its native muscle actuators."""

from __future__ import annotations

from dataclasses import replace

import mujoco

from mjwrap.errors import ModelError, VersionError
from mjwrap.mjcf.actuators import is_muscle, mujoco_law, native_reason, path_reason, pulled_tendon
from mjwrap.mjcf.declarations import Declarations, MuscleDeclaration
from mjwrap.mjcf.inside import reference_pose, shares_inside
from mjwrap.mjcf.moving_points import MovingSite, read_moving_axes
from mjwrap.mjcf.names import name_of
from mjwrap.mjcf.routes import build_routes, tendon_stops
from mjwrap.mjcf.side_rules import choose_side_rule
from mjwrap.mjcf.tuple_names import declares_muscle
from mjwrap.mjcf.tuples import read_tuple
from mjwrap.muscles.laws import ActuatorForce

OBJ = mujoco.mjtObj


def read_declarations(
    model: mujoco.MjModel, *, transmission: bool = False, cables: bool = False, side_rule: int | None = None
) -> Declarations:
    """Read every muscle that a model declares, in the order of its actuators, then of tuples without an actuator.

    transmission: MuJoCo computes the forces of its own muscles (`ActuatorForce`) and of all other actuators on spatial
    tendons, which then count as muscles too. cables: this only for the actuators that are not muscles.
    side_rule: of the tendons' side sites, see `choose_side_rule`. Raises `ModelError` for a wrong declaration. Native
    muscle actuators, or other actuators, that mjwrap cannot take over stay with MuJoCo and are listed in `native`.
    """
    if not hasattr(model, "nactuator"):
        raise VersionError(f"mjwrap needs MuJoCo 3.11 or newer, this is {mujoco.__version__}")
    rest, rule = reference_pose(model), choose_side_rule(model, side_rule)
    by_actuator, free = _read_tuples(model, rest, (transmission, transmission or cables), rule)
    muscles: list[MuscleDeclaration] = []
    native: dict[str, str] = {}
    for actuator in range(model.nactuator):
        if actuator in by_actuator:
            muscles.append(by_actuator[actuator])
            continue
        muscle = is_muscle(model, actuator)
        by_mujoco = transmission or (cables and not muscle)
        if muscle or (by_mujoco and pulled_tendon(model, actuator) >= 0):
            reason = (path_reason if by_mujoco else native_reason)(model, rest, actuator)
            if reason is None:
                muscles.append(_read_native(model, rest, actuator, by_mujoco, rule))
            else:
                native[name_of(model, OBJ.mjOBJ_ACTUATOR, actuator)] = reason
    for muscle, reason in _mostly_inside(model, [m for m in muscles if m.actuator not in by_actuator]):
        muscles.remove(muscle)
        native[muscle.name] = reason
    taken = [muscle.name for muscle in muscles]
    for muscle in free:
        if muscle.name in taken:
            raise ModelError(
                f"two muscles are called '{muscle.name}', one of them by a tuple without an actuator; if both are "
                f"the same muscle, list the actuator in the tuple"
            )
        taken.append(muscle.name)
    moving: dict[int, MovingSite] = {}
    for axis in read_moving_axes(model):
        known = moving[axis.site].joints if axis.site in moving else ()
        moving[axis.site] = MovingSite(axis.site, tuple(dict.fromkeys((*known, axis.joint))))
    return Declarations([_with_moving_sites(muscle, moving) for muscle in muscles + free], native, rule)


def _with_moving_sites(muscle: MuscleDeclaration, moving: dict[int, MovingSite]) -> MuscleDeclaration:
    """Return a muscle whose routes say which of their sites move within their bodies."""
    found = [tuple(moving[s] for s in dict.fromkeys(route.sites) if s in moving) for route in muscle.routes]
    if not any(found):
        return muscle
    routes = tuple(replace(route, moving=sites) for route, sites in zip(muscle.routes, found, strict=True))
    return replace(muscle, routes=routes)


def _read_tuples(
    model: mujoco.MjModel, rest: mujoco.MjData, by_mujoco: tuple[bool, bool], side_rule: int
) -> tuple[dict[int, MuscleDeclaration], list[MuscleDeclaration]]:
    """Return the muscles of all tuples that declare one: by actuator, and those without one.

    by_mujoco: whether MuJoCo computes the forces of its muscles, and of other actuators.
    """
    by_actuator: dict[int, MuscleDeclaration] = {}
    named_by: dict[int, str] = {}
    free: list[MuscleDeclaration] = []
    for index in range(model.ntuple):
        tuple_name = name_of(model, OBJ.mjOBJ_TUPLE, index)
        if not declares_muscle(tuple_name):
            continue
        muscle = read_tuple(model, rest, index, by_mujoco, side_rule)
        if muscle.actuator < 0:
            free.append(muscle)
        elif muscle.actuator in by_actuator:
            raise ModelError(
                f"actuator '{muscle.name}' is in two tuples, '{named_by[muscle.actuator]}' and '{tuple_name}'; it can "
                f"drive one muscle only"
            )
        else:
            by_actuator[muscle.actuator] = muscle
            named_by[muscle.actuator] = tuple_name
    return by_actuator, free


def _mostly_inside(
    model: mujoco.MjModel, muscles: list[MuscleDeclaration]
) -> list[tuple[MuscleDeclaration, str]]:
    """Return the native muscles that would have no path at most poses, as an end is inside a geom, with the reason."""
    pairs = [
        (muscle, node.geom, site)
        for muscle in muscles
        for route in muscle.routes
        for node, *ends in route.geom_ends()
        for site in ends
        if not node.inside
    ]
    found: dict[int, tuple[MuscleDeclaration, str]] = {}
    shares = shares_inside(model, [(geom, site) for _, geom, site in pairs])
    for (muscle, geom, site), share in zip(pairs, shares, strict=True):
        if share > 0.5:
            end, round_what = name_of(model, OBJ.mjOBJ_SITE, site), name_of(model, OBJ.mjOBJ_GEOM, geom)
            reason = (
                f"no path can go round geom '{round_what}' at {share:.0%} of poses in the joints' ranges: site '{end}' "
                f"is inside it there"
            )
            found[muscle.actuator] = muscle, reason
    return list(found.values())


def _read_native(
    model: mujoco.MjModel, rest: mujoco.MjData, actuator: int, transmission: bool, side_rule: int
) -> MuscleDeclaration:
    name, tendon = name_of(model, OBJ.mjOBJ_ACTUATOR, actuator), pulled_tendon(model, actuator)
    try:
        law = ActuatorForce() if transmission else mujoco_law(model, actuator)
    except ModelError as error:
        raise ModelError(f"muscle '{name}': {error}") from None
    stops = tendon_stops(model, rest, tendon, side_rule)
    return MuscleDeclaration(name, build_routes(model, name, stops), law, actuator, tendon)
