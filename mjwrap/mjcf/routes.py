"""Routes of muscles: a list of stops, from a tendon or a tuple, becomes stretches of string between sites."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal, NamedTuple

import mujoco
import numpy as np

from mjwrap.errors import ModelError
from mjwrap.kernels import layout
from mjwrap.mjcf.declarations import Node, Route
from mjwrap.mjcf.names import listed, name_of, names

OBJ = mujoco.mjtObj
SURFACES = {
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): layout.CYLINDER,
    int(mujoco.mjtGeom.mjGEOM_SPHERE): layout.SPHERE,
}


class Stop(NamedTuple):
    """One element of a list of stops: id of a site, geom or hint (a site), or the divisor of a pulley."""

    kind: Literal["site", "geom", "hint", "pulley"]
    index: int = -1
    divisor: float = 1.0


def tendon_stops(model: mujoco.MjModel, tendon: int) -> list[Stop]:
    """Return the stops of a spatial tendon."""
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
    return stops


def build_routes(model: mujoco.MjModel, muscle: str, stops: Iterable[Stop]) -> tuple[Route, ...]:
    """Return the routes of a list of stops, one per stretch between pulleys; `ModelError` names what is wrong."""
    stretches: list[tuple[float, list[Stop]]] = [(1.0, [])]
    for stop in stops:
        if stop.kind != "pulley":
            stretches[-1][1].append(stop)
        elif stop.divisor > 0.0:
            stretches.append((1.0 / stop.divisor, []))
        else:
            raise ModelError(f"muscle '{muscle}': pulley divisor {stop.divisor} must be positive")
    routes = tuple(_build_route(model, muscle, stretch, weight) for weight, stretch in stretches if stretch)
    if not routes:
        raise ModelError(f"muscle '{muscle}': its path has no sites; sites: {_list_sites(model)}")
    return routes


def _build_route(model: mujoco.MjModel, muscle: str, stops: list[Stop], weight: float) -> Route:
    nodes: list[Node] = []
    for stop in stops:
        if stop.kind == "site":
            nodes.append(Node(site=stop.index))
        elif stop.kind == "geom":
            _check_geom(model, muscle, stop.index)
            nodes.append(Node(geom=stop.index))
        elif nodes and nodes[-1].geom >= 0 and nodes[-1].hint_site < 0:
            nodes[-1] = Node(geom=nodes[-1].geom, hint_site=stop.index)
        else:
            before = _describe(model, nodes[-1]) if nodes else "nothing"
            raise ModelError(
                f"muscle '{muscle}': site '{name_of(model, OBJ.mjOBJ_SITE, stop.index)}' is marked as a hint (prm=1) "
                f"and must directly follow a geom, not {before}; geoms to wrap: {_list_surfaces(model)}"
            )
    if len(nodes) < 2 or nodes[0].site < 0 or nodes[-1].site < 0:
        path = ", ".join(_describe(model, node) for node in nodes)
        raise ModelError(
            f"muscle '{muscle}': its path must begin and end with a site, two at least; it is: {path}; "
            f"sites: {_list_sites(model)}"
        )
    return Route(nodes[0].site, tuple(nodes[1:-1]), nodes[-1].site, weight)


def _check_geom(model: mujoco.MjModel, muscle: str, geom: int) -> None:
    name, kind = name_of(model, OBJ.mjOBJ_GEOM, geom), int(model.geom_type[geom])
    if kind not in SURFACES:
        shape = mujoco.mjtGeom(kind).name.removeprefix("mjGEOM_").lower()
        raise ModelError(
            f"muscle '{muscle}': geom '{name}' is of type {shape}; a wrapping surface must be a cylinder or a sphere: "
            f"{_list_surfaces(model)}"
        )
    radius = float(model.geom_size[geom, 0])
    if not (np.isfinite(radius) and radius > 0.0):
        raise ModelError(f"muscle '{muscle}': geom '{name}' has radius {radius}; it must be positive [m]")


def _describe(model: mujoco.MjModel, node: Node) -> str:
    if node.geom >= 0:
        return f"geom '{name_of(model, OBJ.mjOBJ_GEOM, node.geom)}'" + " with a hint" * (node.hint_site >= 0)
    return f"site '{name_of(model, OBJ.mjOBJ_SITE, node.site)}'"


def _list_sites(model: mujoco.MjModel) -> str:
    return listed(names(model, OBJ.mjOBJ_SITE, model.nsite))


def _list_surfaces(model: mujoco.MjModel) -> str:
    fit = (i for i in range(model.ngeom) if int(model.geom_type[i]) in SURFACES)
    return listed(name_of(model, OBJ.mjOBJ_GEOM, i) for i in fit)
