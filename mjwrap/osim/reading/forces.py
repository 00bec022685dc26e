"""All forces: muscles, ligaments, springs, actuators, limits, bushings and contacts; others only by name."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from mjwrap.osim.description.bodies import Coordinate, Frame
from mjwrap.osim.description.forces import (
    Bushing,
    CoordinateActuator,
    Force,
    HuntCrossley,
    Ligament,
    LimitForce,
    OtherForce,
    PathActuator,
    PathSpring,
    SpringGeneralizedForce,
)
from mjwrap.osim.description.paths import Path
from mjwrap.osim.description.rotations import body_fixed_xyz
from mjwrap.osim.reading.default_curves import PASSIVE_FORCE_LENGTH, spline_through
from mjwrap.osim.reading.frames import Places, offset, socket, unnamed
from mjwrap.osim.reading.functions import read_function
from mjwrap.osim.reading.joints import ROTATIONAL
from mjwrap.osim.reading.muscles import is_muscle, read_muscle
from mjwrap.osim.reading.nodes import Node
from mjwrap.osim.reading.paths import path_node, read_path

_INFINITE = math.inf


@dataclass(frozen=True)
class Known:
    """What forces refer to: places, coordinates and wrap objects by their names in the file, contact shapes."""

    places: Places
    coordinate: Callable[[Node, str], str]
    coordinates: Mapping[str, Coordinate]
    wraps: dict[str, str]
    shapes: frozenset[str]


def read_force(node: Node, name: str, known: Known) -> Force:
    """Return a force; a class that is not known, and a path that is only a function, as `OtherForce`."""
    active = not node.flag("isDisabled", default=False) and node.flag("appliesForce", default=True)
    if is_muscle(node) or node.tag in _ALONG_PATHS:
        element = path_node(node)
        if element is None:
            raise node.error("has no path; add a <GeometryPath>")
        if element.tag != "GeometryPath":
            return OtherForce(name, node.tag, f"its path is a {element.tag}, which mjwrap does not read")
        path = read_path(element, known.places, known.coordinate, known.wraps, known.coordinates)
        if is_muscle(node):
            return read_muscle(node, name, path, active)
        return _ALONG_PATHS[node.tag](node, name, path, active)
    reader = _READERS.get(node.tag)
    return reader(node, name, known, active) if reader is not None else OtherForce(name, node.tag)


def _ligament(node: Node, name: str, path: Path, active: bool) -> Force:
    length = node.number("resting_length", default=0.0)
    if not length > 0.0:
        raise node.error(f"resting_length must be positive, not {length:g}")
    given = node.object("force_length_curve")
    curve = spline_through(PASSIVE_FORCE_LENGTH) if given is None else read_function(given)
    return Ligament(name, path, length, node.number("pcsa_force", default=0.0), curve, active)


def _path_spring(node: Node, name: str, path: Path, active: bool) -> Force:
    values = [node.number(tag) for tag in ("resting_length", "stiffness", "dissipation")]
    return PathSpring(name, path, values[0], values[1], values[2], active)


def _path_actuator(node: Node, name: str, path: Path, active: bool) -> Force:
    return PathActuator(name, path, node.number("optimal_force", default=1.0), _controls(node), active)


def _controls(node: Node) -> tuple[float, float]:
    return (
        node.number("min_control", default=-_INFINITE, finite=False),
        node.number("max_control", default=_INFINITE, finite=False),
    )


def _coordinate(node: Node, known: Known) -> str:
    return known.coordinate(node, node.string("coordinate"))


def _coordinate_actuator(node: Node, name: str, known: Known, active: bool) -> Force:
    optimal = node.number("optimal_force", default=1.0)
    return CoordinateActuator(name, _coordinate(node, known), optimal, _controls(node), active)


def _limit(node: Node, name: str, known: Known, active: bool) -> Force:
    coordinate = _coordinate(node, known)
    unit = math.pi / 180.0 if known.coordinates[coordinate].motion == ROTATIONAL else 1.0
    upper, lower = node.number("upper_limit", default=0.0), node.number("lower_limit", default=0.0)
    if lower > upper:
        raise node.error(f"lower_limit {lower:g} is above upper_limit {upper:g}")
    return LimitForce(
        name,
        coordinate,
        upper * unit,
        lower * unit,
        node.number("upper_stiffness", default=1.0) / unit,
        node.number("lower_stiffness", default=1.0) / unit,
        node.number("damping", default=0.001) / unit,
        node.number("transition", default=0.1) * unit,
        active,
    )


def _spring(node: Node, name: str, known: Known, active: bool) -> Force:
    stiffness, rest, viscosity = (
        node.number(tag, default=0.0) for tag in ("stiffness", "rest_length", "viscosity")
    )
    return SpringGeneralizedForce(name, _coordinate(node, known), stiffness, rest, viscosity, active)


def two_frames(node: Node, places: Places) -> tuple[Frame, Frame]:
    """Return the two frames of a bushing or weld: of 4.x as sockets, before as two bodies with places on them."""
    frames = []
    for i in ("1", "2"):
        if node.find(f"body_{i}") is not None:
            zero = (0.0, 0.0, 0.0)
            turned = body_fixed_xyz(node.vector(f"orientation_body_{i}", size=3, default=zero))
            location = node.vector(f"location_body_{i}", size=3, default=zero)
            frames.append(offset(places.frame(node, node.string(f"body_{i}")), location, turned))
        else:
            frames.append(places.frame(node, socket(node, f"frame{i}")))
    return unnamed(frames[0]), unnamed(frames[1])


def _bushing(node: Node, name: str, known: Known, active: bool) -> Force:
    first, second = two_frames(node, known.places)
    turning, moving, turning_damping, moving_damping = (
        node.vector(f"{motion}_{what}", size=3, default=(0.0, 0.0, 0.0))
        for what in ("stiffness", "damping")
        for motion in ("rotational", "translational")
    )
    return Bushing(name, first, second, turning, moving, turning_damping, moving_damping, active)


def _contact(node: Node, name: str, known: Known, active: bool) -> Force:
    shapes: list[str] = []
    parameters: dict[str, float] = {}
    by_shape: dict[str, dict[str, float]] = {}
    for group in node.walk():
        if group.tag.endswith("::ContactParameters"):
            words = group.words("geometry")
            values = {tag: group.number(tag, default=0.0) for tag in _CONTACT}
            by_shape.update(dict.fromkeys(words, values))
            shapes += words
            parameters = parameters or values
    if node.tag == "SmoothSphereHalfSpaceForce":
        shapes = [socket(node, which).rsplit("/", 1)[-1] for which in ("sphere", "half_space")]
        parameters = {tag: node.number(tag, default=value) for tag, value in _SMOOTH.items()}
    for tag, value in [*parameters.items(), *(item for each in by_shape.values() for item in each.items())]:
        if value < 0.0:
            raise node.error(f"{tag} must not be negative, not {value:g}")
    parameters = {**parameters, "transition_velocity": node.number("transition_velocity", default=0.01)}
    for shape in shapes:
        if shape not in known.shapes:
            raise node.error(
                f"contact geometry '{shape}' does not exist; there are: {', '.join(sorted(known.shapes)) or 'none'}"
            )
    return HuntCrossley(name, node.tag, tuple(shapes), parameters, active, by_shape)


_CONTACT = ("stiffness", "dissipation", "static_friction", "dynamic_friction", "viscous_friction")
_SMOOTH = {
    "stiffness": 1.0,
    "dissipation": 0.0,
    "static_friction": 0.0,
    "dynamic_friction": 0.0,
    "viscous_friction": 0.0,
    "constant_contact_force": 1e-5,
    "hertz_smoothing": 300.0,
    "hunt_crossley_smoothing": 50.0,
}
_ALONG_PATHS: dict[str, Callable[[Node, str, Path, bool], Force]] = {
    "Ligament": _ligament,
    "PathSpring": _path_spring,
    "PathActuator": _path_actuator,
}
_READERS: dict[str, Callable[[Node, str, Known, bool], Force]] = {
    "CoordinateActuator": _coordinate_actuator,
    "CoordinateLimitForce": _limit,
    "SpringGeneralizedForce": _spring,
    "BushingForce": _bushing,
    "HuntCrossleyForce": _contact,
    "ElasticFoundationForce": _contact,
    "SmoothSphereHalfSpaceForce": _contact,
}
