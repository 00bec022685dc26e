"""The declared muscles of a model as a table, and as values for JSON."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Any

import mujoco

from mjwrap.calibration.plausibility import as_unit
from mjwrap.mjcf import MuscleDeclaration, Node, Route, name_of
from mjwrap.mjcf.conditional_points import JointRange, ranges_text, when_text
from mjwrap.mjcf.moving_points import site_text
from mjwrap.text import aligned

_HEAD = ("muscle", "law", "F_max [N]", "l_opt [mm]", "l_slack [mm]", "tendon", "path")
_WORDS = (0, 1, 5, 6)  # columns that hold no numbers


def table(model: mujoco.MjModel, muscles: Sequence[MuscleDeclaration]) -> str:
    """Return a line for each muscle: law, sizes, and the sites and surfaces of its path.

    l_opt, l_slack: optimal fibre length and tendon slack length; under MuJoCo's law computed from its length range.
    """
    rows: list[tuple[str, ...]] = [_HEAD]
    for muscle in muscles:
        unit = as_unit(muscle.parameters)
        sizes = [_size(unit.peak, 1.0), _size(unit.optimal, 1e3), _size(unit.slack, 1e3)]
        tendon = getattr(muscle.parameters, "tendon", "rigid" if muscle.law == "mujoco" else "")
        path = " | ".join(piece_text(model, routes) for routes in muscle.pieces)
        rows.append((muscle.name, muscle.law, *sizes, tendon, path))
    return "\n".join(aligned(rows, _WORDS))


def _size(value: float, scale: float) -> str:
    return f"{scale * value:.4g}" if math.isfinite(value) else "-"


def piece_text(model: mujoco.MjModel, routes: Sequence[Route]) -> str:
    """Return the alternative routes of a piece of string as one, with the ranges of its conditional points.

    Where no pose has all points, the alternatives are listed, each with the poses at which it holds.
    """
    whole = [route for route in routes if all(presence.holds for presence in route.when)]
    conditions = {site: condition(routes, site) for route in routes for site in route.sites}
    if not whole or len(routes) == 1:
        return " / ".join(path_text(model, route) for route in routes)
    text = path_text(model, replace(whole[0], when=()), whole=True)
    told = [
        f"{_site(model, site)} only where {ranges_text(model, ranges)}"
        for site, ranges in conditions.items()
        if ranges
    ]
    return f"{text}, {', '.join(told)}"


def condition(routes: Sequence[Route], site: int) -> tuple[JointRange, ...]:
    """Return the ranges in which a site belongs to the path, none for one that always does."""
    for point, presence in enumerate(routes[0].when):
        if all((site in route.sites) == route.when[point].holds for route in routes):
            return presence.ranges
    return ()


def path_text(model: mujoco.MjModel, route: Route, whole: bool = False) -> str:
    """Return the sites and surfaces of a route in words; whole: name every via point."""
    stops = [site_text(model, route.moving, route.origin)]
    for is_via, group in itertools.groupby(route.nodes, lambda node: node.surface is None):
        nodes = list(group)
        if is_via and len(nodes) > 1 and not (route.when or route.moving or whole):
            stops.append(f"{len(nodes)} via points")
        else:
            stops += [_stop(model, route, node) for node in nodes]
    stops.append(site_text(model, route.moving, route.insertion))
    factor = "" if route.weight == 1.0 else f"{route.weight:g} × "
    return factor + " > ".join(stops) + when_text(model, route.when)


def _stop(model: mujoco.MjModel, route: Route, node: Node) -> str:
    if node.surface is None:
        return site_text(model, route.moving, node.site)
    side = f", side {_site(model, node.hint_site)}" if node.hint_site >= 0 else ""
    side += " at every pose" * node.side
    held = ", held inside" if node.inside else ""
    return f"{_geom(model, node.geom)} ({type(node.surface).__name__.lower()}{side}{held})"


def _site(model: mujoco.MjModel, site: int) -> str:
    return name_of(model, mujoco.mjtObj.mjOBJ_SITE, site)


def _joint(model: mujoco.MjModel, joint: int) -> str:
    return name_of(model, mujoco.mjtObj.mjOBJ_JOINT, joint)


def _geom(model: mujoco.MjModel, geom: int) -> str:
    return name_of(model, mujoco.mjtObj.mjOBJ_GEOM, geom)


def as_values(model: mujoco.MjModel, muscle: MuscleDeclaration) -> dict[str, Any]:
    """Return a declaration as values: names of elements, parameters of the law, sizes of surfaces."""
    kinds = mujoco.mjtObj
    return {
        "name": muscle.name,
        "actuator": name_of(model, kinds.mjOBJ_ACTUATOR, muscle.actuator) if muscle.actuator >= 0 else None,
        "tendon": name_of(model, kinds.mjOBJ_TENDON, muscle.tendon) if muscle.tendon >= 0 else None,
        "law": muscle.law,
        "parameters": asdict(muscle.parameters),  # pyright: ignore[reportArgumentType]
        "activation_dynamics": asdict(muscle.activation),
        "routes": [
            {
                "weight": route.weight,
                "origin": _site(model, route.origin),
                "stops": [_stop_values(model, node) for node in route.nodes],
                "insertion": _site(model, route.insertion),
                "moving_sites": {
                    _site(model, each.site): [_joint(model, joint) for joint in each.joints]
                    for each in route.moving
                },
                "holds_where": [
                    {
                        "ranges": [[_joint(model, r.joint), r.low, r.high] for r in presence.ranges],
                        "inside": presence.holds,
                    }
                    for presence in route.when
                ],
            }
            for route in muscle.routes
        ],
    }


def _stop_values(model: mujoco.MjModel, node: Node) -> dict[str, Any]:
    if node.surface is None:
        return {"via_site": _site(model, node.site)}
    return {
        "geom": _geom(model, node.geom),
        "surface": type(node.surface).__name__,
        "sizes": list(node.surface.dims),
        "side_site": _site(model, node.hint_site) if node.hint_site >= 0 else None,
        "side_at_every_pose": node.side,
        "held_inside": node.inside,
    }
