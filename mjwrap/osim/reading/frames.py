"""Frames by name or path: bodies, offset frames on them to any depth, and frames through stations."""

from __future__ import annotations

import posixpath
from dataclasses import dataclass, field, replace

import numpy as np

from mjwrap.osim.description.bodies import GROUND, Frame
from mjwrap.osim.description.rotations import body_fixed_xyz
from mjwrap.osim.reading.nodes import Array, Node

BODIES = {"Body", "Ground"}
DEEPEST = 100  # offset frames on one another
_AXES = {"+x": 0, "+y": 1, "+z": 2, "-x": 0, "-y": 1, "-z": 2, "x": 0, "y": 1, "z": 2}


@dataclass(eq=False)
class Places:
    """The frames, stations and coordinates of a model, by path and by name."""

    model: Node
    by_path: dict[str, list[Node]] = field(default_factory=dict)
    by_name: dict[str, list[Node]] = field(default_factory=dict)
    bodies: dict[str, Node] = field(default_factory=dict)
    _frames: dict[int, Frame] = field(default_factory=dict)
    _open: list[Node] = field(default_factory=list)

    def add(self, node: Node) -> None:
        """Make a frame, station or coordinate known; of several of a kind with one name its first is meant."""
        self.by_path.setdefault(node.path, []).append(node)
        self.by_name.setdefault(node.name or node.tag.lower(), []).append(node)

    def look_up(self, owner: Node, text: str, kinds: set[str], what: str) -> Node:
        """Return the element that a path or name in an element means."""
        name = text.rstrip("/").rsplit("/", 1)[-1]
        for node in [*self._by_path(owner, text), *self.by_name.get(name, [])]:
            if node.tag in kinds:
                return node
        known = sorted(
            {n.name for nodes in self.by_path.values() for n in nodes if n.tag in kinds and n.name}
        )
        raise owner.error(f"{what} '{text}' does not exist; there are: {', '.join(known) or 'none'}")

    def _by_path(self, owner: Node, text: str) -> list[Node]:
        if text.startswith("/"):
            path = posixpath.normpath(text)
            found = self.by_path.get(path, [])
            if not found and path.startswith(f"/{self.model.name}/"):
                found = self.by_path.get(path[len(self.model.name) + 1 :], [])
            return found
        if not text or posixpath.normpath(text).strip("/") == "":
            return []
        return self.by_path.get(posixpath.normpath(posixpath.join(owner.path, text)), [])

    def frame(self, owner: Node, text: str) -> Frame:
        """Return the frame that a path or name in an element means."""
        if text.rstrip("/").rsplit("/", 1)[-1] == GROUND:
            return Frame(GROUND, np.zeros(3), np.eye(3))
        return self.of(self.look_up(owner, text, FRAMES, "frame"))

    def of(self, node: Node) -> Frame:
        """Return the frame that an element is."""
        if node.tag in BODIES:
            return Frame(node.name or GROUND, np.zeros(3), np.eye(3))
        known = self._frames.get(id(node))
        if known is None:
            if node in self._open:
                names = " on ".join(f"'{n.name}'" for n in [*self._open[self._open.index(node) :], node])
                raise node.error(f"frames form a loop: {names}; attach one of them to a body")
            if len(self._open) > DEEPEST:
                raise node.error(f"lies on more than {DEEPEST} frames on one another")
            self._open.append(node)
            known = self._offset(node) if node.tag == "PhysicalOffsetFrame" else self._through_stations(node)
            self._open.pop()
            self._frames[id(node)] = known
        return known

    def _offset(self, node: Node) -> Frame:
        parent = self.frame(node, socket(node, "parent"))
        translation = node.vector("translation", size=3, default=(0.0, 0.0, 0.0))
        angles = node.vector("orientation", size=3, default=(0.0, 0.0, 0.0))
        return offset(parent, translation, body_fixed_xyz(angles), node.name)

    def _through_stations(self, node: Node) -> Frame:
        points = []
        for name in ("point_a", "point_b", "point_c", "origin_point"):
            station = self.look_up(node, socket(node, name), STATIONS, "station")
            points.append(self.point(station))
        a, b, c, origin = points
        if len({point.body for point in points}) > 1:
            raise node.error(
                f"its stations lie on several bodies: {', '.join(sorted({p.body for p in points}))}"
            )
        first = node.string("ab_axis", default="+x") or "+x"
        second = node.string("ab_x_ac_axis", default="+y") or "+y"
        if first not in _AXES or second not in _AXES or _AXES[first] == _AXES[second]:
            raise node.error(
                f"ab_axis '{first}' and ab_x_ac_axis '{second}' must be two of +x, -x, +y, -y, +z, -z"
            )
        along = b.position - a.position
        normal = np.cross(along, c.position - a.position)
        if not np.linalg.norm(normal) > 0.0:
            raise node.error("point_a, point_b and point_c lie on one line; a frame needs a triangle")
        columns: dict[int, Array] = {
            _AXES[first]: _unit(along) * (-1.0 if first[0] == "-" else 1.0),
            _AXES[second]: _unit(normal) * (-1.0 if second[0] == "-" else 1.0),
        }
        last = ({0, 1, 2} - set(columns)).pop()
        columns[last] = np.cross(columns[(last + 1) % 3], columns[(last + 2) % 3])
        return Frame(a.body, origin.position, np.column_stack([columns[i] for i in range(3)]), node.name)

    def point(self, node: Node) -> Frame:
        """Return the frame at the location of a station, marker or path point, turned like the frame it lies in."""
        parent = self.frame(node, socket(node, "parent_frame", "body"))
        return offset(parent, node.vector("location", size=3, default=(0.0, 0.0, 0.0)))


STATIONS = {"Station", "Marker"}
FRAMES = {*BODIES, "PhysicalOffsetFrame", "StationDefinedFrame"}


def offset(parent: Frame, translation: Array, rotation: Array | None = None, name: str = "") -> Frame:
    """Return the frame at a translation (3,) and rotation (3, 3) in another one."""
    position = parent.position + parent.rotation @ translation
    turned = parent.rotation if rotation is None else parent.rotation @ rotation
    return Frame(parent.body, position, turned, name)


def unnamed(frame: Frame) -> Frame:
    """Return the frame without its name."""
    return replace(frame, name="")


def socket(node: Node, name: str, *older: str) -> str:
    """Return what a socket is connected to, as written: in 4.x, in its beta versions, and under older names."""
    tags = (f"socket_{name}", f"connector_{name}_connectee_name", *older)
    text = node.string(*tags, default="")
    if not text:
        connector = node.find("connectors")
        if connector is not None:
            for child in connector.children:
                if child.name == name:
                    text = child.string("connectee_name", default="")
    if not text:
        raise node.error(f"<{tags[0]}> is missing or empty; it must name what '{name}' is connected to")
    return text


def _unit(vector: Array) -> Array:
    return vector / np.linalg.norm(vector)
