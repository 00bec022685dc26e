"""Joints of all classes as six motions: three turns about axes of their own, after three translations."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mjwrap.osim.description.bodies import Axis, Coordinate, Frame, Joint
from mjwrap.osim.description.functions import Piecewise, constant, linear
from mjwrap.osim.description.rotations import body_fixed_xyz
from mjwrap.osim.reading.frames import Places, offset, socket
from mjwrap.osim.reading.functions import read_function, read_property
from mjwrap.osim.reading.nodes import Array, Node

ROTATIONAL, TRANSLATIONAL, COUPLED = "rotational", "translational", "coupled"
MOTIONS = ("rotation1", "rotation2", "rotation3", "translation1", "translation2", "translation3")

# Of each class of joint, for each coordinate the index of the one of its six motions (x, y, z of each) that it drives.
SIMPLE = {
    "WeldJoint": (),
    "PinJoint": (2,),
    "SliderJoint": (3,),
    "PlanarJoint": (2, 3, 4),
    "UniversalJoint": (0, 1),
    "BallJoint": (0, 1, 2),
    "GimbalJoint": (0, 1, 2),
    "FreeJoint": (0, 1, 2, 3, 4, 5),
    "EllipsoidJoint": (0, 1, 2),
}
SCAPULOTHORACIC = "ScapulothoracicJoint"
CLASSES = (*SIMPLE, "CustomJoint", SCAPULOTHORACIC)


def joint_nodes(model: Node) -> list[Node]:
    """Return the elements of all joints, in the order of the file; an unknown class is an error."""
    found = []
    for node in model.walk():
        parent = node.parent
        if parent is None or not (
            (parent.tag == "objects" and parent.parent is not None and parent.parent.tag == "JointSet")
            or (parent.tag == "Joint" and parent.parent is not None and parent.parent.tag == "Body")
            or (node.tag.endswith("Joint") and parent.tag in ("components", "objects"))
        ):
            continue
        if node.tag not in CLASSES:
            raise node.error(f"joints of class {node.tag} cannot be read; classes: {', '.join(CLASSES)}")
        found.append(node)
    return found


def coordinate_nodes(joint: Node) -> list[Node]:
    """Return the elements of a joint's coordinates."""
    return [node for node in joint.objects("coordinates", "CoordinateSet") if node.tag == "Coordinate"]


def read_joint(node: Node, places: Places, names: dict[int, str], name: str) -> Joint:
    """Return a joint; `names` has the name of every coordinate by its element."""
    parent, child = _frames(node, places)
    elements = coordinate_nodes(node)
    if node.tag == "CustomJoint":
        known = {element.name: names[id(element)] for element in elements}
        axes = _custom_axes(node, known)
    else:
        axes, known = _fixed_axes(node, elements, names)
    coordinates = _coordinates(node, elements, list(known.values()), axes, name)
    radii, origin, direction = None, None, 0.0
    if node.tag == "EllipsoidJoint":
        radii = _radii(node, "radii_x_y_z")
    elif node.tag == SCAPULOTHORACIC:
        radii = _radii(node, "thoracic_ellipsoid_radii_x_y_z")
        origin = node.vector("scapula_winging_axis_origin", size=2, default=(0.0, 0.0))
        direction = node.number("scapula_winging_axis_direction", default=0.0)
    rotations, translations = (axes[0], axes[1], axes[2]), (axes[3], axes[4], axes[5])
    return Joint(
        name, node.tag, parent, child, coordinates, rotations, translations, radii, origin, direction
    )


def _frames(node: Node, places: Places) -> tuple[Frame, Frame]:
    if node.parent is not None and node.parent.tag == "Joint" and node.parent.parent is not None:
        body = node.parent.parent
        parent = places.frame(node, node.string("parent_body"))
        child = places.frame(node, body.name)
        first = _placed(node, parent, "location_in_parent", "orientation_in_parent")
        second = _placed(node, child, "location", "orientation")
        return (second, first) if node.flag("reverse", default=False) else (first, second)
    return tuple(places.frame(node, socket(node, which)) for which in ("parent_frame", "child_frame"))  # type: ignore[return-value]


def _placed(node: Node, frame: Frame, location: str, orientation: str) -> Frame:
    zero = (0.0, 0.0, 0.0)
    turned = body_fixed_xyz(node.vector(orientation, size=3, default=zero))
    return offset(frame, node.vector(location, size=3, default=zero), turned)


def _still(index: int) -> Axis:
    return Axis(np.eye(3)[index % 3], (), constant(0.0))


def _fixed_axes(
    node: Node, elements: Sequence[Node], names: dict[int, str]
) -> tuple[list[Axis], dict[str, str]]:
    driven = SIMPLE.get(node.tag, ())
    count = 4 if node.tag == SCAPULOTHORACIC else len(driven)
    if len(elements) != count:
        raise node.error(f"has {len(elements)} coordinates; a {node.tag} has {count}")
    known = {element.name: names[id(element)] for element in elements}
    axes = [_still(i) for i in range(6)]
    if (
        node.tag == SCAPULOTHORACIC
    ):  # abduction, elevation, upward rotation; the fourth, winging, comes after them
        turns = ((0.0, 1.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
        for i, (turn, coordinate) in enumerate(zip(turns, known.values(), strict=False)):
            axes[i] = Axis(np.array(turn), (coordinate,), linear(1.0))
    for coordinate, i in zip(known.values(), driven, strict=False):
        axes[i] = Axis(axes[i].axis, (coordinate,), linear(1.0))
    return axes, known


def _custom_axes(node: Node, known: dict[str, str]) -> list[Axis]:
    transform = node.find("SpatialTransform")
    axes = [_still(i) for i in range(6)]
    elements = [] if transform is None else [child for child in transform if child.tag == "TransformAxis"]
    if len(elements) > 6:
        raise node.error(f"has {len(elements)} transform axes; six are possible")
    for i, element in enumerate(elements):
        place = MOTIONS.index(element.name) if element.name in MOTIONS else i
        axes[place] = _transform_axis(element, place, known)
    for first, second in ((0, 1), (1, 2)):
        if not np.linalg.norm(np.cross(axes[first].axis, axes[second].axis)) > 1e-6:
            raise node.error(f"the axes of {MOTIONS[first]} and {MOTIONS[second]} are parallel")
    return axes


def _transform_axis(node: Node, place: int, known: dict[str, str]) -> Axis:
    axis = node.vector("axis", size=3, default=np.eye(3)[place % 3].tolist())
    length = np.linalg.norm(axis)
    if not length > 0.0:
        raise node.error("its axis is zero; it needs a direction")
    words = node.words("coordinates", "coordinate")
    for word in words:
        if word not in known:
            raise node.error(
                f"coordinate '{word}' is not of this joint; it has: {', '.join(known) or 'none'}"
            )
    function = read_property(node, "function", default=0.0) if not words else _moving(node)
    if len(words) > 1 and not function.is_constant:
        raise node.error(f"is a function of several coordinates ({', '.join(words)}); only one is possible")
    if not words and not function.is_constant:
        raise node.error("has a function, but no coordinate that it is of")
    if function.is_constant:
        words = []
    return Axis(axis / length, tuple(known[word] for word in words), function)


def _moving(node: Node) -> Piecewise:
    function = node.object("function")
    return read_property(node, "function", default=0.0) if function is None else read_function(function)


def _coordinates(
    node: Node, elements: Sequence[Node], names: Sequence[str], axes: Sequence[Axis], joint: str
) -> tuple[Coordinate, ...]:
    result = []
    for i, name in enumerate(names):
        motion = _motion(node, name, axes)
        element = elements[i]
        low, high = element.vector("range", size=2, default=(-10.0, 10.0), finite=False)
        if not low <= high:
            raise element.error(f"its range ends at {high:g}, below its start {low:g}")
        prescribed = (
            element.object("prescribed_function") if element.flag("prescribed", default=False) else None
        )
        result.append(
            Coordinate(
                name,
                joint,
                motion,
                element.number("default_value", default=0.0),
                element.number("default_speed_value", default=0.0),
                (float(low), float(high)),
                element.flag("clamped", default=False),
                element.flag("locked", default=False),
                None if prescribed is None else read_function(prescribed),
                element.flag("is_free_to_satisfy_constraints", default=False),
            )
        )
    return tuple(result)


def _motion(node: Node, name: str, axes: Sequence[Axis]) -> str:
    """Return whether a coordinate is an angle, a length, or neither, by OpenSim's rule: the last motion that it drives
    with a slope of 1 or -1."""
    if node.tag == SCAPULOTHORACIC:
        return ROTATIONAL
    motion = COUPLED
    for i, axis in enumerate(axes):
        linear_in_it = name in axis.coordinates and axis.function.kind == "LinearFunction"
        if linear_in_it and abs(axis.function.coefficients[0, 1]) == 1.0:
            motion = ROTATIONAL if i < 3 else TRANSLATIONAL
    return motion


def _radii(node: Node, tag: str) -> Array:
    radii = node.vector(tag, size=3)
    if not np.all(radii > 0.0):
        raise node.error(f"{tag} must be positive")
    return radii
