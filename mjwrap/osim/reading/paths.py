"""Wrap objects, and paths with their points and wraps."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from mjwrap.osim.description.bodies import Coordinate
from mjwrap.osim.description.functions import clamped, constant
from mjwrap.osim.description.paths import Condition, MovingLocation, Path, PathPoint, PathWrap, WrapObject
from mjwrap.osim.description.rotations import body_fixed_xyz
from mjwrap.osim.reading.frames import FRAMES, Places, offset, socket
from mjwrap.osim.reading.functions import read_property
from mjwrap.osim.reading.nodes import Node
from mjwrap.osim.report import APPROXIMATED

QUADRANTS = ("all", "x", "+x", "-x", "y", "+y", "-y", "z", "+z", "-z")
DIMENSIONS: dict[str, tuple[tuple[str, int, float], ...]] = {
    "WrapCylinder": (("radius", 1, 1.0), ("length", 1, 1.0)),
    "WrapEllipsoid": (("dimensions", 3, 0.05),),
    "WrapSphere": (("radius", 1, 0.05),),
    "WrapTorus": (("inner_radius", 1, 0.01), ("outer_radius", 1, 0.05)),
}
SMALLEST, LARGEST = 1e-9, 1e9  # [m] dimensions of wrap objects; some files have cylinders of kilometres
CoordinateName = Callable[[Node, str], str]


def wrap_nodes(model: Node) -> list[Node]:
    """Return the elements of all wrap objects: those in the wrap sets of bodies, frames and ground."""
    return [
        node
        for node in model.walk()
        if node.parent is not None
        and node.parent.tag == "objects"
        and node.parent.parent is not None
        and node.parent.parent.tag == "WrapObjectSet"
    ]


def read_wrap(node: Node, places: Places, name: str) -> WrapObject:
    """Return a wrap object in the frame of the body that it is on."""
    if node.tag not in DIMENSIONS:
        raise node.error(f"wrap objects of class {node.tag} cannot be read; classes: {', '.join(DIMENSIONS)}")
    owner = node.parent
    while owner is not None and owner.tag not in FRAMES:
        owner = owner.parent
    if owner is None:
        raise node.error("is on no body or frame")
    zero = (0.0, 0.0, 0.0)
    frame = offset(
        places.of(owner),
        node.vector("translation", size=3, default=zero),
        body_fixed_xyz(node.vector("xyz_body_rotation", size=3, default=zero)),
    )
    dimensions: list[float] = []
    for tag, size, default in DIMENSIONS[node.tag]:
        dimensions += node.vector(tag, size=size, default=(default,) * size).tolist()
    if not all(dimension > 0.0 for dimension in dimensions):
        raise node.error(f"its dimensions must be positive, not {' '.join(f'{d:g}' for d in dimensions)}")
    if not all(SMALLEST <= dimension <= LARGEST for dimension in dimensions):
        raise node.error(f"its dimensions must lie between {SMALLEST:g} and {LARGEST:g} m")
    if node.tag == "WrapTorus" and dimensions[0] >= dimensions[1]:
        node.note("its inner radius is not smaller than its outer one")
    quadrant = node.string("quadrant", default="all").lower() or "all"
    quadrant = "all" if quadrant == "unassigned" else quadrant
    if quadrant not in QUADRANTS:
        raise node.error(f"quadrant '{quadrant}' does not exist; quadrants: {', '.join(QUADRANTS)}")
    return WrapObject(name, node.tag, frame, tuple(dimensions), quadrant, node.flag("active", default=True))


def path_node(force: Node) -> Node | None:
    """Return the element of a force's path: of 4.5 on named 'path', before by its class."""
    found = force.find("GeometryPath")
    if found is None:
        found = next(
            (child for child in force.children if child.name == "path" or child.tag.endswith("Path")), None
        )
    return found


def read_path(
    node: Node,
    places: Places,
    coordinate: CoordinateName,
    wraps: dict[str, str],
    coordinates: Mapping[str, Coordinate],
) -> Path:
    """Return a path; `wraps` has the names of wrap objects as they are kept, by their names in the file."""
    points = [_point(point, places, coordinate, coordinates) for point in node.objects("PathPointSet")]
    if len(points) < 2:
        raise node.error(f"has {len(points)} points; a path needs two")
    for which, point in (("first", points[0]), ("last", points[-1])):
        if point.condition is not None:
            node.note(
                f"its {which} point is conditional: it always belongs to the path, where OpenSim can lose an end",
                APPROXIMATED,
            )
    return Path(
        tuple(points),
        tuple(_wrap(wrap, len(points), wraps) for wrap in node.objects("PathWrapSet")),
        node.tag,
    )


def _point(
    node: Node, places: Places, coordinate: CoordinateName, coordinates: Mapping[str, Coordinate]
) -> PathPoint:
    if node.tag in ("PathPoint", "MusclePoint"):
        return PathPoint(node.name, places.point(node))
    if node.tag in ("ConditionalPathPoint", "MuscleViaPoint"):
        low, high = node.vector("range", size=2, default=(0.0, 0.0), finite=False)
        name = coordinate(node, socket(node, "coordinate", "coordinate"))
        return PathPoint(node.name, places.point(node), Condition(name, (float(low), float(high))))
    if node.tag in ("MovingPathPoint", "MovingMusclePoint"):
        frame = places.frame(node, socket(node, "parent_frame", "body"))
        location = node.vector("location", size=3, default=(0.0, 0.0, 0.0))
        names, functions = [], []
        for i, axis in enumerate("xyz"):
            function = read_property(node, f"{axis}_location", default=location[i])
            if function.is_constant:
                names.append("")
                functions.append(constant(function(0.0).item()))
                continue
            names.append(coordinate(node, socket(node, f"{axis}_coordinate", f"{axis}_coordinate")))
            # OpenSim puts the point where it is at the nearest value in the coordinate's range, clamped or not.
            functions.append(clamped(function, *coordinates[names[-1]].range))
        moving = MovingLocation((names[0], names[1], names[2]), (functions[0], functions[1], functions[2]))
        return PathPoint(node.name, frame, moving=moving)
    raise node.error(
        f"path points of class {node.tag} cannot be read; classes: PathPoint, ConditionalPathPoint, MovingPathPoint"
    )


def _wrap(node: Node, points: int, wraps: dict[str, str]) -> PathWrap:
    name = node.string("wrap_object")
    if name not in wraps:
        raise node.error(
            f"wrap object '{name}' does not exist; there are: {', '.join(sorted(wraps)) or 'none'}"
        )
    first, last = node.vector("range", size=2, default=(-1.0, -1.0))
    start = 0 if first < 1 else min(int(first), points) - 1
    end = points - 1 if last < 1 else min(int(last), points) - 1
    return PathWrap(wraps[name], start, end, node.string("method", default="hybrid").lower() or "hybrid")
