"""Constraints: couplers of coordinates, points, welds, distances and points on lines."""

from __future__ import annotations

from collections.abc import Callable

from mjwrap.osim.description.bodies import (
    Constraint,
    Coupler,
    DistanceConstraint,
    Frame,
    PointConstraint,
    PointOnLineConstraint,
    WeldConstraint,
)
from mjwrap.osim.description.functions import Piecewise
from mjwrap.osim.reading.forces import two_frames
from mjwrap.osim.reading.frames import Places, offset, socket, unnamed
from mjwrap.osim.reading.functions import read_property
from mjwrap.osim.reading.nodes import Node
from mjwrap.osim.report import LEFT_OUT

CoordinateName = Callable[[Node, str], str]


def read_constraint(node: Node, name: str, places: Places, coordinate: CoordinateName) -> Constraint | None:
    """Return a constraint; None, with a note, where it is switched off or of a class that is not known."""
    if node.flag("isDisabled", default=False) or not node.flag("isEnforced", default=True):
        node.note("is switched off in the file", LEFT_OUT)
        return None
    reader = _READERS.get(node.tag)
    if reader is None:
        node.note(f"constraints of class {node.tag} cannot be read; classes: {', '.join(_READERS)}", LEFT_OUT)
        return None
    return reader(node, name, places, coordinate)


def _coupler(node: Node, name: str, places: Places, coordinate: CoordinateName) -> Constraint:
    words = node.words("independent_coordinate_names")
    dependent = coordinate(node, node.string("dependent_coordinate_name"))
    function = read_property(node, "coupled_coordinates_function")
    if len(words) != 1:
        raise node.error(f"has {len(words)} independent coordinates; only one is possible")
    independent = coordinate(node, words[0])
    if independent == dependent:
        raise node.error(f"couples coordinate '{dependent}' to itself")
    return Coupler(name, dependent, (independent,), function, node.number("scale_factor", default=1.0))


def _two_points(node: Node, places: Places) -> tuple[Frame, Frame]:
    return (
        _located(node, places, socket(node, "body_1", "body_1"), "location_body_1"),
        _located(node, places, socket(node, "body_2", "body_2"), "location_body_2"),
    )


def _located(node: Node, places: Places, body: str, location: str) -> Frame:
    return unnamed(offset(places.frame(node, body), node.vector(location, size=3, default=(0.0, 0.0, 0.0))))


def _point(node: Node, name: str, places: Places, coordinate: CoordinateName) -> Constraint:
    return PointConstraint(name, *_two_points(node, places))


def _weld(node: Node, name: str, places: Places, coordinate: CoordinateName) -> Constraint:
    return WeldConstraint(name, *two_frames(node, places))


def _distance(node: Node, name: str, places: Places, coordinate: CoordinateName) -> Constraint:
    distance = node.number("constant_distance")
    if not distance > 0.0:
        raise node.error(f"constant_distance must be positive, not {distance:g}")
    return DistanceConstraint(name, *_two_points(node, places), distance)


def _on_line(node: Node, name: str, places: Places, coordinate: CoordinateName) -> Constraint:
    direction = node.vector("line_direction_vec", size=3, default=(0.0, 0.0, 0.0))
    if not direction.any():
        raise node.error("line_direction_vec is zero; it needs a direction")
    line = _located(node, places, socket(node, "line_body", "line_body"), "point_on_line")
    point = _located(node, places, socket(node, "follower_body", "follower_body"), "point_on_follower")
    return PointOnLineConstraint(name, line, direction, point)


_READERS: dict[str, Callable[[Node, str, Places, CoordinateName], Constraint]] = {
    "CoordinateCouplerConstraint": _coupler,
    "PointConstraint": _point,
    "WeldConstraint": _weld,
    "ConstantDistanceConstraint": _distance,
    "PointOnLineConstraint": _on_line,
}


def functions_of(constraints: tuple[Constraint, ...]) -> dict[str, tuple[str, Piecewise, float]]:
    """Return, by dependent coordinate, what it follows: the independent one, the function and the scale."""
    return {
        c.dependent: (c.independent[0], c.function, c.scale) for c in constraints if isinstance(c, Coupler)
    }
