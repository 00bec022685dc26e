"""Bodies with their inertia, meshes and drawn primitives, contact shapes and markers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mjwrap.osim.description.bodies import GROUND, Body, Frame, Mesh
from mjwrap.osim.description.forces import ContactShape
from mjwrap.osim.description.rotations import body_fixed_xyz
from mjwrap.osim.reading.frames import FRAMES, Places, offset, socket, unnamed
from mjwrap.osim.reading.nodes import Array, Node
from mjwrap.osim.report import LEFT_OUT

PRIMITIVES: dict[str, tuple[tuple[str, int, tuple[float, ...]], ...]] = {
    "Brick": (("half_lengths", 3, (0.1, 0.2, 0.3)),),
    "Sphere": (("radius", 1, (1.0,)),),
    "Ellipsoid": (("radii", 3, (0.5, 1.0, 2.0)),),
    "Cylinder": (("radius", 1, (0.5,)), ("half_height", 1, (0.5,))),
}
_CONTACTS: dict[str, tuple[tuple[str, int], ...]] = {
    "ContactSphere": (("radius", 1),),
    "ContactHalfSpace": (),
    "ContactMesh": (),
    "ContactEllipsoid": (("radii", 3),),
    "ContactCylinder": (("radius", 1),),
    "ContactTorus": (("torus_radius", 1), ("tube_radius", 1)),
}
NEW_INERTIA = (
    30500  # the document version that first had <inertia>; before, a missing moment of inertia was 1
)
_ZERO = (0.0, 0.0, 0.0)


def read_body(node: Node, meshes: tuple[Mesh, ...]) -> Body:
    """Return a body."""
    mass = node.number("mass")
    if mass < 0.0:
        raise node.error(f"its mass must not be negative, not {mass:g}")
    return Body(node.name, mass, node.vector("mass_center", size=3, default=_ZERO), _inertia(node), meshes)


def _inertia(node: Node) -> Array:
    if node.find("inertia") is not None:
        xx, yy, zz, xy, xz, yz = node.vector("inertia", size=6, default=(0.0,) * 6)
    else:
        default = 1.0 if node.document.version < NEW_INERTIA else 0.0
        xx, yy, zz = (node.number(f"inertia_{ii}", default=default) for ii in ("xx", "yy", "zz"))
        xy, xz, yz = (node.number(f"inertia_{ij}", default=0.0) for ij in ("xy", "xz", "yz"))
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def read_meshes(model: Node, places: Places) -> dict[str, tuple[Mesh, ...]]:
    """Return all drawn shapes by body."""
    found: dict[str, list[Mesh]] = {}
    for node in model.walk():
        parent = node.parent
        if parent is None:
            continue
        if parent.tag == "attached_geometry":
            mesh = _attached(node, places)
        elif node.tag == "DisplayGeometry":
            mesh = _displayed(node, places)
        elif node.tag == "geometry_files" and parent.tag == "VisibleObject":
            for file in node.text.split():
                listed = _listed(parent, places, file)
                if listed is not None:
                    found.setdefault(listed.frame.body, []).append(listed)
            continue
        else:
            continue
        if mesh is not None:
            found.setdefault(mesh.frame.body, []).append(mesh)
    return {
        body: tuple(
            mesh if mesh.name else replace(mesh, name=f"{body}_geom_{i + 1}") for i, mesh in enumerate(meshes)
        )
        for body, meshes in found.items()
    }


def _owner(node: Node) -> Node | None:
    above = node.parent
    while above is not None and above.tag not in FRAMES:
        if above.tag in ("PathPoint", "GeometryPath", "WrapObjectSet"):
            return None
        above = above.parent
    return above


def _attached(node: Node, places: Places) -> Mesh | None:
    owner = _owner(node)
    if owner is None:
        return None
    frame = unnamed(places.of(owner))
    scale = node.vector("scale_factors", size=3, default=(1.0, 1.0, 1.0))
    color, opacity = _appearance(node)
    if node.tag in ("Mesh", "TransformedMesh"):
        file = node.string("mesh_file", default="")
        if not file:
            node.note("names no mesh_file", LEFT_OUT)
            return None
        return Mesh(node.name, frame, file, scale, color=color, opacity=opacity)
    if node.tag not in PRIMITIVES:
        if node.tag != "FrameGeometry":
            node.note(f"shapes of class {node.tag} are not drawn", LEFT_OUT)
        return None
    size: list[float] = []
    for tag, count, default in PRIMITIVES[node.tag]:
        size += node.vector(tag, size=count, default=default).tolist()
    return Mesh(node.name, frame, "", scale, node.tag, tuple(size), color, opacity)


def _appearance(node: Node) -> tuple[tuple[float, float, float], float]:
    appearance = node.find("Appearance")
    if appearance is None:
        return (1.0, 1.0, 1.0), 1.0
    color = appearance.vector("color", size=3, default=(1.0, 1.0, 1.0)).tolist()
    opacity = appearance.number("opacity", default=1.0)
    visible = appearance.flag("visible", default=True)
    return (color[0], color[1], color[2]), opacity if visible else 0.0


def _displayed(node: Node, places: Places) -> Mesh | None:
    """Return a shape of a 3.x file, drawn with the scale factors of its own and of the body."""
    owner, visible = _owner(node), node.parent
    file = node.string("geometry_file", default="")
    if owner is None or not file:
        return None
    while visible is not None and visible.tag != "VisibleObject":
        visible = visible.parent
    ones = (1.0, 1.0, 1.0)
    frame, scale = places.of(owner), np.ones(3)
    for element in (visible, node):
        if element is not None:
            transform = element.vector("transform", size=6, default=(0.0,) * 6)
            frame = offset(frame, transform[3:], body_fixed_xyz(transform[:3]))
            scale = scale * element.vector("scale_factors", size=3, default=ones)
    color = node.vector("color", size=3, default=ones).tolist()
    hidden = node.string("display_preference", default="4") == "0"
    opacity = 0.0 if hidden else node.number("opacity", default=1.0)
    return Mesh("", unnamed(frame), file, scale, color=(color[0], color[1], color[2]), opacity=opacity)


def _listed(visible: Node, places: Places, file: str) -> Mesh | None:
    owner = _owner(visible) if visible.parent is None or visible.parent.tag not in FRAMES else visible.parent
    if owner is None or visible.parent is None or visible.parent.tag not in FRAMES:
        return None
    scale = visible.vector("scale_factors", size=3, default=(1.0, 1.0, 1.0))
    return Mesh("", unnamed(places.of(owner)), file, scale)


def read_contact_shape(node: Node, places: Places) -> ContactShape | None:
    """Return a contact shape; None, with a note, for a class that is not known."""
    if node.tag not in _CONTACTS:
        node.note(
            f"contact geometry of class {node.tag} cannot be read; classes: {', '.join(_CONTACTS)}", LEFT_OUT
        )
        return None
    frame: Frame = offset(
        places.frame(node, socket(node, "frame", "body_name")),
        node.vector("location", size=3, default=_ZERO),
        body_fixed_xyz(node.vector("orientation", size=3, default=_ZERO)),
    )
    dimensions: list[float] = []
    for tag, count in _CONTACTS[node.tag]:
        dimensions += node.vector(tag, size=count).tolist()
    if not all(d > 0.0 for d in dimensions):
        raise node.error("its dimensions must be positive")
    file = node.string("filename", default="") if node.tag == "ContactMesh" else ""
    return ContactShape(node.name, node.tag, unnamed(frame), tuple(dimensions), file)


def is_ground(name: str) -> bool:
    """Return whether a body's name means ground."""
    return name == GROUND
