"""Read an .osim file: the one function that the rest of mjwrap calls."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

from mjwrap.errors import OsimError
from mjwrap.osim.description.bodies import GROUND
from mjwrap.osim.description.forces import OtherForce
from mjwrap.osim.description.model import Marker, OsimModel
from mjwrap.osim.reading.constraints import read_constraint
from mjwrap.osim.reading.document import read_document
from mjwrap.osim.reading.forces import Known, read_force
from mjwrap.osim.reading.frames import FRAMES, STATIONS, Places
from mjwrap.osim.reading.joints import coordinate_nodes, joint_nodes, read_joint
from mjwrap.osim.reading.nodes import Node
from mjwrap.osim.reading.paths import read_wrap, wrap_nodes
from mjwrap.osim.reading.shapes import is_ground, read_body, read_contact_shape, read_meshes
from mjwrap.osim.reading.trees import connected


def read_osim(path: str | os.PathLike[str]) -> OsimModel:
    """Return what an .osim file says, whatever version from 2.0 on wrote it.

    Raises OsimError, which names the file, the line and the element, where the file is damaged or says something that
    cannot be represented. What is left out without harm is in the model's notes.
    """
    root = read_document(Path(path))
    model = root.find("Model")
    if model is None:
        raise OsimError(
            f"{root.document.file}: has no <Model>; it may hold a part of a model, or another document"
        )
    more = [node for node in root if node.tag == "Model"][1:]
    if more:
        raise more[0].error(f"is a second model; the file must have one, and '{model.name}' is the first")
    return _Reader(model).read()


class _Reader:
    def __init__(self, model: Node) -> None:
        self.model = model
        self.places = Places(model)
        self.coordinate_names: dict[int, str] = {}

    def read(self) -> OsimModel:
        model, places = self.model, self.places
        bodies = [node for node in model.objects("BodySet") if not is_ground(node.name)]
        bodies += [n for n in model.objects("components") if n.tag == "Body"]
        self._check_bodies(bodies)
        for node in model.walk():
            if node.tag in FRAMES or node.tag in STATIONS:
                places.add(node)
        joint_elements = joint_nodes(model)
        self._name_coordinates(joint_elements)
        names = _unique_names(joint_elements)
        joints = [
            read_joint(n, places, self.coordinate_names, name)
            for n, name in zip(joint_elements, names, strict=True)
        ]
        joints = connected(bodies, joints, joint_elements)
        coordinates = {c.name: c for joint in joints for c in joint.coordinates}
        wrap_elements = wrap_nodes(model)
        wrap_names = _unique_names(wrap_elements)
        wraps = tuple(read_wrap(n, places, name) for n, name in zip(wrap_elements, wrap_names, strict=True))
        by_name: dict[str, str] = {}
        for node, name in zip(wrap_elements, wrap_names, strict=True):
            by_name.setdefault(node.name, name)
        shapes = [
            s for n in model.objects("ContactGeometrySet") if (s := read_contact_shape(n, places)) is not None
        ]
        known = Known(places, self.coordinate, coordinates, by_name, frozenset(s.name for s in shapes))
        force_elements = model.objects("ForceSet")
        force_names = _unique_names(force_elements)
        forces = tuple(
            read_force(n, name, known) for n, name in zip(force_elements, force_names, strict=True)
        )
        constraint_elements = model.objects("ConstraintSet")
        constraint_names = _unique_names(constraint_elements)
        read = (
            read_constraint(n, name, places, self.coordinate)
            for n, name in zip(constraint_elements, constraint_names, strict=True)
        )
        constraints = tuple(c for c in read if c is not None)
        meshes = read_meshes(model, places)
        return OsimModel(
            model.name,
            model.document.version,
            model.vector("gravity", size=3, default=(0.0, -9.80665, 0.0)),
            tuple(read_body(node, meshes.get(node.name, ())) for node in bodies),
            tuple(joints),
            constraints,
            wraps,
            forces,
            tuple(shapes),
            tuple(Marker(n.name, places.point(n)) for n in model.objects("MarkerSet") if n.tag == "Marker"),
            meshes.get(GROUND, ()),
            tuple(self._others()),
            tuple(model.document.notes),
            model.string("credits", default=""),
        )

    def coordinate(self, owner: Node, text: str) -> str:
        """Return the name under which a coordinate is kept that an element refers to by path or name."""
        return self.coordinate_names[id(self.places.look_up(owner, text, {"Coordinate"}, "coordinate"))]

    def _check_bodies(self, bodies: Iterable[Node]) -> None:
        for node in bodies:
            if node.tag != "Body":
                raise node.error(f"bodies of class {node.tag} cannot be read; the class must be Body")
            if not node.name:
                raise node.error("a body needs a name")
            if node.name in self.places.bodies:
                raise node.error("another body has the same name; names of bodies must differ")
            self.places.bodies[node.name] = node

    def _name_coordinates(self, joints: Iterable[Node]) -> None:
        taken: set[str] = set()
        for joint in joints:
            for node in coordinate_nodes(joint):
                if not node.name:
                    raise node.error("a coordinate needs a name")
                name = node.name
                if name in taken:
                    name = f"{joint.name}_{node.name}"
                    node.note(f"is called {name}, as another coordinate has the same name")
                if name in taken:
                    raise node.error("another coordinate of the same joint has the same name")
                taken.add(name)
                self.coordinate_names[id(node)] = name
                self.places.add(node)

    def _others(self) -> list[OtherForce]:
        sets = ("ControllerSet", "ProbeSet", "ComponentSet", "components")
        skipped = {"Body", *FRAMES, *STATIONS}
        return [
            OtherForce(node.name, node.tag)
            for tag in sets
            for node in self.model.objects(tag)
            if node.tag not in skipped and not node.tag.endswith("Joint")
        ]


def _unique_names(nodes: list[Node]) -> list[str]:
    """Return a name for each element: its own, or as in OpenSim its class where it has none."""
    taken = {node.name for node in nodes}
    used: set[str] = set()
    names = []
    for node in nodes:
        name = node.name or node.tag.lower()
        wanted, number = name, 2
        while name in used or (name != node.name and name in taken):
            name = f"{wanted}_{number}"
            number += 1
        if name != node.name:
            node.note(f"is called {name}, as its own name is {'missing' if not node.name else 'taken'}")
        used.add(name)
        names.append(name)
    return names
