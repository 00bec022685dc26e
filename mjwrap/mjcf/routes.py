"""Build the routes of muscles: convert a list of stops, from a tendon or a tuple, to pieces of string between sites."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal, NamedTuple

import mujoco

from mjwrap.errors import ModelError
from mjwrap.mjcf.conditional_points import MOST, JointRange, Presence, TooManyAlternatives, alternatives
from mjwrap.mjcf.declarations import Node, Route
from mjwrap.mjcf.inside import end_is_inside, is_beside, side_is_inside
from mjwrap.mjcf.names import listed, name_of, names
from mjwrap.mjcf.side_rules import AUTHORS, reference_turn
from mjwrap.mjcf.wrapping_geoms import read_surface, wrapping_geoms

OBJ = mujoco.mjtObj


class Stop(NamedTuple):
    """One element of a list of stops: id of a site, geom, hint (a site) or sizes (a numeric), or a pulley's divisor.

    finite: a cylinder geom has the length with which it is drawn, not an infinite one. inside: the string must meet the
    geom's solid. turn: of a hint, see `Node`. side: the hint is a side that holds at every pose. ranges: a site
    belongs to the path only where all of them hold.
    """

    kind: Literal["site", "geom", "hint", "sizes", "pulley"]
    index: int = -1
    divisor: float = 1.0
    finite: bool = False
    inside: bool = False
    turn: float = 0.0
    side: bool = False
    ranges: tuple[JointRange, ...] = ()


class _Place(NamedTuple):
    """A site of a route, or a geom with the properties that the elements after it give."""

    site: int = -1
    geom: int = -1
    finite: bool = False
    inside: bool = False
    hint: int = -1
    turn: float = 0.0
    side: bool = False
    sizes: int = -1


def tendon_stops(
    model: mujoco.MjModel, poses: mujoco.MjData, tendon: int, side_rule: int = AUTHORS
) -> list[Stop]:
    """Return the stops of a spatial tendon. poses: the reference pose; any, if the side sites do not matter.

    side_rule: the rule by which its side sites pick the way round cylinders at the reference pose.

    A string is held inside a geom if the side site is inside and stays there, or if one of its ends does: MuJoCo's path
    is straight then, and so is the shortest one that meets the solid.
    """
    stops: list[Stop] = []
    first = int(model.tendon_adr[tendon])
    for w in range(first, first + int(model.tendon_num[tendon])):
        kind, index, parameter = int(model.wrap_type[w]), int(model.wrap_objid[w]), float(model.wrap_prm[w])
        if kind == int(mujoco.mjtWrap.mjWRAP_SITE):
            stops.append(Stop("site", index))
        elif kind == int(mujoco.mjtWrap.mjWRAP_PULLEY):
            stops.append(Stop("pulley", divisor=parameter))
        elif kind in (int(mujoco.mjtWrap.mjWRAP_SPHERE), int(mujoco.mjtWrap.mjWRAP_CYLINDER)):
            stops.append(Stop("geom", index))
            if parameter >= 0.0:
                stops.append(Stop("hint", round(parameter)))
    for geom, side, ends in geoms_of(stops):
        place = stops[geom].index
        held = side >= 0 and is_beside(model, place, side) and side_is_inside(model, poses, place, side)
        for end in ends:
            held = held or (is_beside(model, place, end) and end_is_inside(model, poses, place, end))
        stops[geom] = stops[geom]._replace(inside=held)
        if side >= 0 and side_rule != AUTHORS and not held:
            turn = reference_turn(model, poses, place, side, ends, side_rule)
            stops[geom + 1] = stops[geom + 1]._replace(turn=turn)
    return stops


def geoms_of(stops: list[Stop]) -> list[tuple[int, int, tuple[int, int]]]:
    """Return for every geom its index among a tendon's stops, its side site or -1, and the sites around it."""
    found: list[tuple[int, int, tuple[int, int]]] = []
    for k, stop in enumerate(stops):
        if stop.kind == "geom":
            beside = stops[k + 1].kind == "hint"
            after = stops[k + 2 if beside else k + 1]
            found.append((k, stops[k + 1].index if beside else -1, (stops[k - 1].index, after.index)))
    return found


def build_routes(model: mujoco.MjModel, muscle: str, stops: Iterable[Stop]) -> tuple[Route, ...]:
    """Return the routes of a list of stops; `ModelError` for a wrong list.

    There is one for each piece between pulleys, or, with conditional points, one for each combination of these.
    """
    stretches: list[tuple[float, list[Stop]]] = [(1.0, [])]
    for stop in stops:
        if stop.kind != "pulley":
            stretches[-1][1].append(stop)
        elif stop.divisor > 0.0:
            stretches.append((1.0 / stop.divisor, []))
        else:
            raise ModelError(f"muscle '{muscle}': pulley divisor {stop.divisor} must be positive")
    routes = tuple(
        route for weight, stretch in stretches if stretch for route in _pieces(model, muscle, stretch, weight)
    )
    if not routes:
        raise ModelError(f"muscle '{muscle}': its path has no sites; sites: {_list_sites(model)}")
    return routes


def _pieces(model: mujoco.MjModel, muscle: str, stops: list[Stop], weight: float) -> list[Route]:
    """Return the alternatives of a piece of string, one for each combination of its conditional points."""
    points = list(dict.fromkeys(stop.ranges for stop in stops if stop.ranges))
    try:
        found = alternatives(points)
    except TooManyAlternatives as error:
        raise ModelError(
            f"muscle '{muscle}': its {len(points)} conditional points have {error.count} combinations, each of them "
            f"a path of its own; at most {MOST} are possible"
        ) from None
    routes: list[Route] = []
    for when in found:
        absent = {presence.ranges for presence in when if not presence.holds}
        kept = [stop for stop in stops if stop.ranges not in absent]
        routes.append(_build_route(model, muscle, kept, weight, when))
    return routes


def _build_route(
    model: mujoco.MjModel, muscle: str, stops: list[Stop], weight: float, when: tuple[Presence, ...]
) -> Route:
    places: list[_Place] = []
    for stop in stops:
        if stop.kind == "site":
            places.append(_Place(site=stop.index))
        elif stop.kind == "geom":
            places.append(_Place(geom=stop.index, finite=stop.finite, inside=stop.inside))
        else:
            places[-1:] = [_completed(model, muscle, places[-1] if places else None, stop)]
    if len(places) < 2 or places[0].site < 0 or places[-1].site < 0:
        path = ", ".join(_describe(model, place) for place in places)
        raise ModelError(
            f"muscle '{muscle}': its path must begin and end with a site, two at least; it is: {path}"
            f"{', where its conditional points are absent' * bool(when)}; sites: {_list_sites(model)}"
        )
    nodes = tuple(_node(model, muscle, place) for place in places[1:-1])
    return Route(places[0].site, nodes, places[-1].site, weight, when)


def _completed(model: mujoco.MjModel, muscle: str, place: _Place | None, stop: Stop) -> _Place:
    """Return a geom's place with a hint or sizes added."""
    if place is not None and place.geom >= 0:
        if stop.kind == "hint" and place.hint < 0:
            return place._replace(hint=stop.index, turn=stop.turn, side=stop.side)
        if stop.kind == "sizes" and place.sizes < 0:
            return place._replace(sizes=stop.index)
    before = _describe(model, place) if place else "nothing"
    if stop.kind == "hint":
        mark = "side (prm=2)" if stop.side else "hint (prm=1)"
        what = f"site '{name_of(model, OBJ.mjOBJ_SITE, stop.index)}' is marked as a {mark} and"
    else:
        what = f"numeric '{name_of(model, OBJ.mjOBJ_NUMERIC, stop.index)}' declares a surface and"
    raise ModelError(
        f"muscle '{muscle}': {what} must directly follow a geom, not {before}; geoms to wrap: {wrapping_geoms(model)}"
    )


def _node(model: mujoco.MjModel, muscle: str, place: _Place) -> Node:
    if place.geom < 0:
        return Node(site=place.site)
    try:
        surface = read_surface(model, place.geom, place.sizes, place.finite)
    except ModelError as error:
        raise ModelError(f"muscle '{muscle}': {error}") from None
    return Node(
        geom=place.geom,
        hint_site=place.hint,
        surface=surface,
        inside=place.inside,
        sizes=place.sizes,
        turn=place.turn,
        side=place.side,
    )


def _describe(model: mujoco.MjModel, place: _Place) -> str:
    if place.geom < 0:
        return f"site '{name_of(model, OBJ.mjOBJ_SITE, place.site)}'"
    said = [
        word
        for word, given in (
            ("a side" if place.side else "a hint", place.hint >= 0),
            ("sizes", place.sizes >= 0),
        )
        if given
    ]
    return f"geom '{name_of(model, OBJ.mjOBJ_GEOM, place.geom)}'" + " with " * bool(said) + " and ".join(said)


def _list_sites(model: mujoco.MjModel) -> str:
    return listed(names(model, OBJ.mjOBJ_SITE, model.nsite))
