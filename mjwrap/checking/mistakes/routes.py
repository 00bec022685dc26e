"""Find routes that are probably not meant: no joint, no path, a copy, stops at one place or in the wrong order."""

from __future__ import annotations

import itertools
from collections.abc import Hashable, Iterator

import mujoco
import numpy as np

from mjwrap.checking.mistakes.finding import Mistake, PossibleMistake, muscle_of, quoted
from mjwrap.checking.mistakes.pose import Posed
from mjwrap.mjcf import MuscleDeclaration, Route, name_of
from mjwrap.mjcf.actuators import is_muscle

SAME = 1e-6  # distance of stops that count as one place, as a share of the muscle's size
SHARP = np.cos(np.radians(150.0))  # a route that turns by more at a via site goes back where it came from
_JOINTS = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))


def route_mistakes(posed: Posed) -> Iterator[PossibleMistake]:
    """Yield the findings about the routes of all muscles, and about muscles that have none."""
    muscles, model = posed.muscles, posed.model
    for actuator in range(model.nactuator):
        name = name_of(model, mujoco.mjtObj.mjOBJ_ACTUATOR, actuator)
        on_joint = int(model.actuator_trntype[actuator]) in _JOINTS
        if name in muscles.native and is_muscle(model, actuator) and on_joint:
            joint = quoted(model, "joint", int(model.actuator_trnid[actuator, 0]))
            yield PossibleMistake(
                Mistake.ON_JOINT,
                quoted(model, "actuator", actuator),
                f"is a muscle on {joint}, so it has no path: it stays with MuJoCo, with its gear as moment arm",
                "let it pull a spatial tendon (tendon=...), or list it in a tuple 'mjwrap_...' with its sites",
            )
    first: dict[Hashable, MuscleDeclaration] = {}
    for i, muscle in enumerate(muscles.declarations):
        key = tuple(_place(model, route) for route in muscle.routes)
        if key in first:
            yield PossibleMistake(
                Mistake.SAME_ROUTE,
                muscle_of(muscle),
                f"has the same sites and surfaces as {muscle_of(first[key])}",
                "if it is a copy, give it its own sites",
            )
        first.setdefault(key, muscle)
        yield from _of_route(posed, i, muscle)


def _of_route(posed: Posed, i: int, muscle: MuscleDeclaration) -> Iterator[PossibleMistake]:
    muscles, model = posed.muscles, posed.model
    if not posed.crossed[i].any():
        stops = {int(model.site_bodyid[r.origin]) for r in muscle.routes} | {
            int(model.site_bodyid[r.insertion]) for r in muscle.routes
        }
        bodies = ", ".join(quoted(model, "body", b) for b in sorted(stops))
        yield PossibleMistake(
            Mistake.NO_JOINT,
            muscle_of(muscle),
            f"crosses no joint: no motion changes its length (its ends are on {bodies})",
            "put its insertion into the body that it should move",
        )
    if not posed.found[i]:
        yield PossibleMistake(
            Mistake.NO_PATH,
            muscle_of(muscle),
            f"has no path at the reference pose: {muscles.reason(i)}",
            "move its sites out of the surface, or make the surface smaller",
        )
    elif muscles.unmet_hints(i):
        geoms = ", ".join(muscles.unmet_hints(i))
        yield PossibleMistake(
            Mistake.SIDE,
            muscle_of(muscle),
            f"passes {geoms} in the rest pose on another side than the hint or side site asks for, where no path was "
            f"found",
            "put the hint or side site where the muscle should touch",
        )
    for route in muscle.routes:
        yield from _of_stops(posed, i, muscle, route)


def _of_stops(posed: Posed, i: int, muscle: MuscleDeclaration, route: Route) -> Iterator[PossibleMistake]:
    model, at = posed.model, posed.poses.site_xpos
    stops: list[tuple[int, bool]] = [(route.origin, False)]  # sites, and whether a geom lies before them
    geom = False
    for node in route.nodes:
        if node.site >= 0:
            stops.append((node.site, geom))
        geom = node.site < 0
    stops.append((route.insertion, geom))
    for (a, _), (b, _) in itertools.pairwise(stops):
        if float(np.linalg.norm(at[b] - at[a])) <= SAME * posed.sizes[i]:
            names = (
                f"{quoted(model, 'site', a)} and {quoted(model, 'site', b)}"
                if a != b
                else f"{quoted(model, 'site', a)}, twice"
            )
            yield PossibleMistake(
                Mistake.SAME_PLACE,
                muscle_of(muscle),
                f"has stops at one place, one after the other: {names}",
                "leave one of them out, or give the site its own position",
            )
    for (a, _), (b, before), (c, after) in zip(stops, stops[1:], stops[2:], strict=False):
        if before or after:
            continue
        there, onwards = at[b] - at[a], at[c] - at[b]
        length = float(np.linalg.norm(there) * np.linalg.norm(onwards))
        if length > 0.0 and float(there @ onwards) < SHARP * length:
            yield PossibleMistake(
                Mistake.TURNS_BACK,
                muscle_of(muscle),
                f"turns back at {quoted(model, 'site', b)}, between {quoted(model, 'site', a)} and "
                f"{quoted(model, 'site', c)}",
                "check the order of its sites",
            )


def _place(model: mujoco.MjModel, route: Route) -> Hashable:
    """Return a route by the places of its stops in their bodies, so that copies of sites count as the same."""

    def site(index: int) -> Hashable:
        return int(model.site_bodyid[index]), *np.round(model.site_pos[index], 9).tolist()

    stops: list[Hashable] = [site(route.origin)]
    for node in route.nodes:
        if node.site >= 0:
            stops.append(site(node.site))
        else:
            pose = (*np.round(model.geom_pos[node.geom], 9), *np.round(model.geom_quat[node.geom], 9))
            hint = site(node.hint_site) if node.hint_site >= 0 else None
            stops.append((int(model.geom_bodyid[node.geom]), *map(float, pose), node.surface, hint))
    return tuple(stops), site(route.insertion), route.weight
