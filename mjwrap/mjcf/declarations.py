"""Dataclasses of a model's declarations: muscles, their routes, and the stops of these; ids are MuJoCo's."""

from __future__ import annotations

from dataclasses import dataclass, field

from mjwrap import html
from mjwrap.mjcf.conditional_points import Presence
from mjwrap.mjcf.moving_points import MovingSite
from mjwrap.muscles.activation import ActivationDynamics
from mjwrap.muscles.laws import Law
from mjwrap.surfaces import Surface


@dataclass(frozen=True)
class Node:
    """One stop of a route: a via site, or a surface in a geom's frame, which may have a site as hint.

    inside: the string must meet the solid, as with a side site inside, and is not kept out of it. sizes: the numeric
    that gives the surface's sizes, -1 if the geom gives them. turn: if a tendon's side site picks the way round a
    cylinder, the angle by which the string goes round at the reference pose (`side_rules.py`), else 0. side: the hint
    site is a side, on which the path passes the surface at every pose.
    """

    site: int = -1
    geom: int = -1
    hint_site: int = -1
    surface: Surface | None = None
    inside: bool = False
    sizes: int = -1
    turn: float = field(default=0.0, compare=False)
    side: bool = False

    def __repr__(self) -> str:
        if self.surface is None:
            return f"Node(site {self.site})"
        hint = f", {'side' if self.side else 'hint'} site {self.hint_site}" if self.hint_site >= 0 else ""
        return f"Node(geom {self.geom}: {self.surface!r}{hint}{', held inside' * self.inside})"


@dataclass(frozen=True)
class Route:
    """An unbroken piece of string: origin site, nodes, insertion site; weight: its factor in the muscle's length.

    when: for a muscle with conditional points, at which poses the route holds: those where each presence is as it says.
    The routes of one piece of string that differ in `when` are alternatives; one of them holds at each pose. moving:
    the sites of the route that move within their bodies.
    """

    origin: int
    nodes: tuple[Node, ...]
    insertion: int
    weight: float = 1.0
    when: tuple[Presence, ...] = ()
    moving: tuple[MovingSite, ...] = field(default=(), compare=False)

    def __repr__(self) -> str:
        stops = [f"site {self.origin}", *(repr(n)[5:-1] for n in self.nodes), f"site {self.insertion}"]
        factor = f", weight {self.weight:g}" if self.weight != 1.0 else ""
        moving = f", moving sites {', '.join(str(each.site) for each in self.moving)}" if self.moving else ""
        when = f", when {' and '.join(map(repr, self.when))}" if self.when else ""
        return f"Route({' > '.join(stops)}{factor}{moving}{when})"

    @property
    def sites(self) -> list[int]:
        """Ids of all sites on the path, in order, without hints."""
        return [self.origin, *(node.site for node in self.nodes if node.site >= 0), self.insertion]

    def geom_ends(self) -> list[tuple[Node, int, int]]:
        """Return every node on a geom with the sites before and after it."""
        stops = [self.origin, *(node.site for node in self.nodes), self.insertion]
        return [
            (
                node,
                next(s for s in stops[place - 1 :: -1] if s >= 0),
                next(s for s in stops[place:] if s >= 0),
            )
            for place, node in enumerate(self.nodes, start=1)
            if node.geom >= 0
        ]


@dataclass(frozen=True)
class MuscleDeclaration:
    """One muscle of a model: ids are MuJoCo's.

    name; routes: one, or several joined by pulleys; parameters: the law's dataclass; actuator, tendon: id or -1;
    activation: the activation dynamics, if mjwrap integrates the activation.
    """

    name: str
    routes: tuple[Route, ...]
    parameters: Law
    actuator: int = -1
    tendon: int = -1
    activation: ActivationDynamics = field(default_factory=ActivationDynamics)

    def __repr__(self) -> str:
        driven = f", actuator {self.actuator}" if self.actuator >= 0 else ""
        routes = ", ".join(map(repr, self.routes))
        return f"MuscleDeclaration({self.name!r}, law {self.law}{driven}, {routes})"

    def _repr_html_(self) -> str:
        """Return the declaration as a notebook shows it; `muscles["NAME"]` shows it with the model's names."""
        return html.facts(
            [
                ("name", self.name),
                ("parameters", self.parameters),
                (
                    "actuator, tendon",
                    ", ".join(str(i) if i >= 0 else "none" for i in (self.actuator, self.tendon)),
                ),
                *(("route", route) for route in self.routes),
            ],
            "MuscleDeclaration (numbers are MuJoCo's ids)",
        )

    @property
    def law(self) -> str:
        """Name of the muscle law."""
        return self.parameters.law

    @property
    def origin_site(self) -> int:
        """Site id of the origin."""
        return self.routes[0].origin

    @property
    def insertion_site(self) -> int:
        """Site id of the insertion."""
        return self.routes[-1].insertion

    @property
    def via_sites(self) -> list[int]:
        """Site ids of the via points, in order; those of alternative routes once."""
        found = [node.site for route in self.routes for node in route.nodes if node.site >= 0]
        return list(dict.fromkeys(found)) if self._has_alternatives else found

    @property
    def moving_sites(self) -> list[int]:
        """Ids of the sites on the path that move within their bodies as joints move."""
        return list(dict.fromkeys(each.site for route in self.routes for each in route.moving))

    @property
    def conditional_sites(self) -> list[int]:
        """Ids of the sites that belong to the path only while joints are within ranges."""
        found: dict[int, None] = {}
        for routes in self.pieces:
            always = set(routes[0].sites).intersection(*(route.sites for route in routes))
            found |= dict.fromkeys(site for route in routes for site in route.sites if site not in always)
        return list(found)

    @property
    def pieces(self) -> list[list[Route]]:
        """The pieces of string between pulleys: of each its alternative routes, one without conditional points."""
        found: list[list[Route]] = []
        for route in self.routes:
            last = found[-1] if found else []
            here = [presence.ranges for presence in route.when]
            known = [each.when for each in last]
            if (
                here
                and here == [presence.ranges for presence in (known or [()])[0]]
                and route.when not in known
            ):
                last.append(route)
            else:
                found.append([route])
        return found

    @property
    def _has_alternatives(self) -> bool:
        return any(route.when for route in self.routes)

    @property
    def geoms(self) -> list[int]:
        """Ids of the geoms of the wrapping surfaces, in order; those of alternative routes once."""
        return [node.geom for node in self._surface_nodes()]

    @property
    def surfaces(self) -> list[Surface]:
        """The wrapping surfaces, in order: one for each of `geoms`."""
        return [node.surface for node in self._surface_nodes() if node.surface is not None]

    def _surface_nodes(self) -> list[Node]:
        found = [node for route in self.routes for node in route.nodes if node.surface is not None]
        return list({node.geom: node for node in found}.values()) if self._has_alternatives else found


@dataclass(frozen=True)
class Declarations:
    """All muscles of a model, and the native muscle actuators that cannot be taken over, with the reasons.

    side_rule: the rule by which the tendons' side sites were read (`side_rules.py`).
    """

    muscles: list[MuscleDeclaration]
    native: dict[str, str] = field(default_factory=dict)
    side_rule: int = 3
