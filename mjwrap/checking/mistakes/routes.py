"""Find routes that are probably not meant: no joint, no path, a copy, stops at one place or in the wrong order."""

from __future__ import annotations

import itertools
from collections.abc import Hashable, Iterator

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.checking.mistakes.finding import Mistake, PossibleMistake, muscle_of, quoted
from mjwrap.checking.mistakes.parameters import parameter_mistakes
from mjwrap.checking.mistakes.pose import Posed
from mjwrap.mjcf import MuscleDeclaration, Route, name_of
from mjwrap.mjcf.actuators import is_muscle
from mjwrap.mjcf.conditional_points import holds
from mjwrap.system import pulls_as_cable

Array = NDArray[np.float64]
SAME = 1e-6  # distance of stops that count as one place, as a share of the muscle's size
SHARP = np.cos(np.radians(150.0))  # a route that turns by more at a via site goes back where it came from
_JOINTS = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))


def route_mistakes(posed: Posed, hints: bool) -> Iterator[PossibleMistake]:
    """Yield the findings about the routes of all muscles, and about muscles that have none.

    hints: also of hints that are not met.
    """
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
        if key in first and not _on_one_tendon(model, muscle, first[key]):
            yield PossibleMistake(
                Mistake.SAME_ROUTE,
                muscle_of(model, muscle),
                f"has the same sites and surfaces as {muscle_of(model, first[key])}",
                "if it is a copy, give it its own sites",
            )
        first.setdefault(key, muscle)
        yield from _of_route(posed, i, muscle, hints)


def _of_route(posed: Posed, i: int, muscle: MuscleDeclaration, hints: bool) -> Iterator[PossibleMistake]:
    muscles, model = posed.muscles, posed.model
    if not posed.crossed[i].any():
        stops = {int(model.site_bodyid[r.origin]) for r in muscle.routes} | {
            int(model.site_bodyid[r.insertion]) for r in muscle.routes
        }
        bodies = ", ".join(quoted(model, "body", b) for b in sorted(stops))
        yield PossibleMistake(
            Mistake.NO_JOINT,
            muscle_of(model, muscle),
            f"crosses no joint: no motion changes its length (its ends are on {bodies})",
            "put its insertion into the body that it should move",
        )
    if not posed.found[i]:
        yield PossibleMistake(
            Mistake.NO_PATH,
            muscle_of(model, muscle),
            f"has no path at the reference pose: {muscles.reason(i)}",
            "move its sites out of the surface, or make the surface smaller",
        )
    elif hints and muscles.unmet_hints(i):
        geoms = ", ".join(muscles.unmet_hints(i))
        yield PossibleMistake(
            Mistake.SIDE,
            muscle_of(model, muscle),
            f"passes {geoms} in the rest pose on another side than the hint or side site asks for, where no path was "
            f"found",
            "put the hint or side site where the muscle should touch",
        )
    yield from parameter_mistakes(model, muscle, float(posed.sizes[i]))
    for route in (r for r in muscle.routes if holds(model, r.when, posed.data.qpos)):
        yield from _of_stops(posed, i, muscle, route)
        yield from _of_side_sites(posed, muscle, route)


def _of_stops(posed: Posed, i: int, muscle: MuscleDeclaration, route: Route) -> Iterator[PossibleMistake]:
    model, poses = posed.model, posed.poses
    stops = [("site", route.origin)]
    stops += [("site", node.site) if node.site >= 0 else ("geom", node.geom) for node in route.nodes]
    stops.append(("site", route.insertion))
    places = [(poses.site_xpos if kind == "site" else poses.geom_xpos)[index] for kind, index in stops]
    names = [quoted(model, *stop) for stop in stops]
    sites = [k for k, (kind, _) in enumerate(stops) if kind == "site"]
    for a, b in itertools.pairwise(sites):
        if float(np.linalg.norm(places[b] - places[a])) <= SAME * posed.sizes[i]:
            yield PossibleMistake(
                Mistake.SAME_PLACE,
                muscle_of(model, muscle),
                "has stops at one place, one after the other: "
                + (f"{names[a]} and {names[b]}" if names[a] != names[b] else f"{names[a]}, twice"),
                "leave one of them out, or give the site its own position",
            )
    for stop, following in itertools.pairwise(stops):
        if stop == following and stop[0] == "geom":
            yield PossibleMistake(
                Mistake.SAME_PLACE,
                muscle_of(model, muscle),
                f"wraps {quoted(model, *stop)} twice, one after the other",
                "leave one of them out: a path touches a surface once, wherever it is listed",
            )
    straights = posed.straights(i) if posed.found[i] else np.empty((0, 2, 3))
    for k in sites[1:-1]:
        if _turns_back(straights, places[k], SAME * posed.sizes[i]):
            yield PossibleMistake(
                Mistake.TURNS_BACK,
                muscle_of(model, muscle),
                f"turns back at {names[k]}, between {names[k - 1]} and {names[k + 1]}",
                "check the order of its sites",
            )


def _turns_back(straights: Array, site: Array, near: float) -> bool:
    """Return whether a path of straight segments (m, 2, 3) goes back, at a via site, nearly where it came from."""
    for (a, b), (c, d) in itertools.pairwise(straights):
        if np.linalg.norm(b - site) <= near and np.linalg.norm(c - site) <= near:
            length = float(np.linalg.norm(b - a) * np.linalg.norm(d - c))
            return length > 0.0 and float((b - a) @ (d - c)) < SHARP * length
    return False


def _of_side_sites(posed: Posed, muscle: MuscleDeclaration, route: Route) -> Iterator[PossibleMistake]:
    """Yield a finding for a via site directly after a geom whose name says that it is a hint."""
    for before, node in itertools.pairwise(route.nodes):
        name = name_of(posed.model, mujoco.mjtObj.mjOBJ_SITE, node.site).lower() if node.site >= 0 else ""
        if (
            before.geom >= 0
            and before.hint_site < 0
            and ("side" in name or "hint" in name)
            and "inside" not in name
        ):
            yield PossibleMistake(
                Mistake.SIDE_AS_STOP,
                quoted(posed.model, "site", node.site),
                f"is a stop of {muscle_of(posed.model, muscle)}, which runs through it, although its name "
                f"speaks of a side of {quoted(posed.model, 'geom', before.geom)}",
                'write prm="1" at its element in the tuple, which makes it a hint',
            )


def _on_one_tendon(model: mujoco.MjModel, muscle: MuscleDeclaration, other: MuscleDeclaration) -> bool:
    """Return whether actuators that are not both muscles share a tendon, such as a servo and a brake."""
    shared = muscle.tendon >= 0 and muscle.tendon == other.tendon
    return shared and (pulls_as_cable(model, muscle) or pulls_as_cable(model, other))


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
