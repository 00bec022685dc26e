"""The names and the static contents of a recording: entities of bodies, geoms, sites and muscles."""

from collections import defaultdict
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import rerun as rr

from mjwrap.model.upright import up_axis
from mjwrap.recording.groups import Group, crossed_coordinates, given_groups, moved_groups
from mjwrap.recording.static_shapes import draws, geom_shape, pose, surface_shape
from mjwrap.recording.stream import Stream

MEASURED = (
    "length",
    "velocity",
    "tension",
    "activation",
    "status",
    "iterations",
)  # quantities of every muscle
FIBER = "fiber_length"  # if a muscle has fibres
SUMMED = {
    "activation": "mean",
    "tension": "sum",
    "power": "sum",
    "without_path": "number",
}  # sums and means of a group

SITE_COLORS = {"origins": (60, 200, 90), "insertions": (250, 160, 40), "via_points": (235, 235, 235)}
CONTACT_COLOR = (250, 230, 60)
FORCE_COLOR = (80, 220, 220)
# colours that can be distinguished on black and on white: eight for a page's muscles, four more for groups
SERIES_COLORS = np.array(
    [
        (31, 119, 180), (255, 127, 14), (44, 160, 44), (214, 39, 40),
        (148, 103, 189), (188, 189, 34), (23, 190, 207), (227, 119, 194),
        (174, 199, 232), (255, 187, 120), (152, 223, 138), (160, 130, 110),
    ],
    dtype=np.uint8,
)  # fmt: skip
PAGE = 8  # muscles whose curves are shown together
CROWDED = 40  # number of muscles from which lines and points are thinner
STRONGEST = 1e6  # a larger strength [N] is not realistic and is not used
VISIBLE_GROUPS = 3  # MuJoCo's viewer shows geom groups 0 to 2; later ones hold collision shapes


class Scene:
    """The entity paths of everything in `model` that the recording shows."""

    def __init__(
        self, model: Any, muscles: Any, groups: Mapping[str, str | Iterable[str]] | None = None
    ) -> None:
        self.model = model
        self.declarations = list(muscles.declarations)
        self.muscle_names = _distinct([str(name) for name in muscles.names], "muscle")
        self.paths = [entity("world", "muscles", name, "path") for name in self.muscle_names]
        self.contacts = [entity("world", "muscles", name, "contacts") for name in self.muscle_names]
        self.forces = [entity("world", "forces", name) for name in self.muscle_names]
        fibers = any(hasattr(muscle.parameters, "optimal_fiber_length") for muscle in self.declarations)
        self.measured = [*MEASURED, FIBER] if fibers else [*MEASURED]
        self.series = {q: [entity(q, name) for name in self.muscle_names] for q in [*self.measured, "power"]}
        body_names = _distinct([model.body(i).name for i in range(model.nbody)], "body")
        self.bodies = [entity("world", "bodies", name) for name in body_names]
        joint_names = _distinct([model.joint(i).name for i in range(model.njnt)], "joint")
        self.coordinates = crossed_coordinates(model, self.declarations, joint_names)
        self.moment_arms = [entity("moment_arm", coordinate.name) for coordinate in self.coordinates]
        self.joints = {k: entity("joint", c.name) for k, c in enumerate(self.coordinates) if c.qpos >= 0}
        self.groups = self._grouped(body_names, groups)
        self.group_series = {q: [entity("groups", q, group.name) for group in self.groups] for q in SUMMED}
        self.group_sizes = np.array([len(group.members) for group in self.groups], dtype=np.int64)
        # the muscles in the order of the groups, and the first of each group
        order = [i for group in self.groups for i in group.members]
        self.by_group = np.array(order, dtype=np.int64), np.cumsum([0, *self.group_sizes])[:-1]
        self.pages = [_pages(group) for group in self.groups]
        # each muscle's colour, given by its place in its page
        self.colors = np.empty((len(self.muscle_names), 3), dtype=np.uint8)
        for page in (page for pages in self.pages for page in pages):
            self.colors[page] = SERIES_COLORS[: len(page)]
        strengths = [muscle.parameters.strength for muscle in self.declarations]
        self.strength = max((s for s in strengths if s < STRONGEST), default=1e3)
        geom_names = _distinct([model.geom(i).name for i in range(model.ngeom)], "geom")
        self.geoms = [
            f"{self.bodies[model.geom_bodyid[i]]}/{entity('geoms', name)}"
            for i, name in enumerate(geom_names)
        ]
        surfaces = [
            pair for muscle in self.declarations for pair in zip(muscle.geoms, muscle.surfaces, strict=True)
        ]
        self.wrapping = {geom for geom, surface in surfaces if draws(model, geom, surface)}
        drawn = dict.fromkeys(pair for pair in surfaces if not draws(model, *pair))
        named = _distinct([geom_names[geom] for geom, _ in drawn], "surface")
        self.surfaces = {
            f"{self.bodies[model.geom_bodyid[geom]]}/{entity('surfaces', name)}": (geom, surface)
            for (geom, surface), name in zip(drawn, named, strict=True)
        }
        self.hidden = [
            self.geoms[i]
            for i in range(model.ngeom)
            if model.geom_group[i] >= VISIBLE_GROUPS and i not in self.wrapping
        ]
        sites = {int(site) for muscle in self.declarations for site in _route_sites(muscle)}
        shown = {int(body) for body in model.geom_bodyid} | {int(model.site_bodyid[site]) for site in sites}
        self.shown = sorted(shown - {0})
        self.moving = [body for body in self.shown if _moves(model, body)]

    def _grouped(
        self, body_names: list[str], groups: Mapping[str, str | Iterable[str]] | None
    ) -> list[Group]:
        """Return the given groups; else one group if all muscles fit on a page; else groups by the body they move."""
        if groups is not None:
            return given_groups(groups, self.muscle_names)
        if len(self.muscle_names) <= PAGE:
            return [Group("muscles", list(range(len(self.muscle_names))))] if self.muscle_names else []
        return moved_groups(self.model, self.declarations, body_names)

    def log_static(self, stream: Stream) -> None:
        """Log geoms, muscle sites, and the style of lines, points and curves."""
        stream.static("world", _up(self.model))
        model = self.model
        for geom, path in enumerate(self.geoms):
            shape = geom_shape(model, geom, wraps=geom in self.wrapping)
            if shape is not None:
                stream.static(path, shape, pose(model.geom_pos[geom], model.geom_quat[geom]))
        for path, (geom, surface) in self.surfaces.items():
            shape = surface_shape(model, geom, surface)
            stream.static(path, shape, pose(model.geom_pos[geom], model.geom_quat[geom]))
        for path, points in self._site_points().items():
            stream.static(path, points)
        line = rr.LineStrips3D.from_fields(radii=self._radius(2.0))
        dots = rr.Points3D.from_fields(colors=[CONTACT_COLOR], radii=self._radius(3.0))
        arrows = rr.Arrows3D.from_fields(colors=[FORCE_COLOR], radii=self._radius(3.0))
        for path, contact, force in zip(self.paths, self.contacts, self.forces, strict=True):
            stream.static(path, line)
            stream.static(contact, dots)
            stream.static(force, arrows)
        for i, name in enumerate(self.muscle_names):
            curve = _curves([name], self.colors[[i]])
            for entities in self.series.values():
                stream.static(entities[i], curve)
        for i, group in enumerate(self.groups):
            curve = _curves([group.name], SERIES_COLORS[[i % len(SERIES_COLORS)]])
            for entities in self.group_series.values():
                stream.static(entities[i], curve)
        for path, coordinate in zip(self.moment_arms, self.coordinates, strict=True):
            names = [self.muscle_names[i] for i in coordinate.muscles]
            stream.static(path, _curves(names, self.colors[coordinate.muscles]))
        for place, (k, path) in enumerate(self.joints.items()):
            color = SERIES_COLORS[[place % len(SERIES_COLORS)]]
            stream.static(path, _curves([self.coordinates[k].name], color))

    def log_welded(self, stream: Stream, positions: np.ndarray, quaternions: np.ndarray) -> None:
        """Log the poses (nbody, 3), (nbody, 4) w-x-y-z of bodies that are fixed in the world."""
        for body in set(self.shown) - set(self.moving):
            stream.static(self.bodies[body], pose(positions[body], quaternions[body]))

    def _radius(self, points: float) -> Any:
        """Return a radius on the screen [points], halved if there are many muscles."""
        return rr.Radius.ui_points(points if len(self.muscle_names) < CROWDED else 0.5 * points)

    def _site_points(self) -> dict[str, rr.Points3D]:
        """Log origins, insertions and via points, fixed in their bodies and labelled with their muscles."""
        where: defaultdict[tuple[str, int], defaultdict[int, list[str]]] = defaultdict(
            lambda: defaultdict(list)
        )
        for muscle, name in zip(self.declarations, self.muscle_names, strict=True):
            ends = [("origins", muscle.origin_site), ("insertions", muscle.insertion_site)]
            for kind, site in ends + [("via_points", site) for site in muscle.via_sites]:
                if site in muscle.moving_sites:
                    continue  # not fixed in its body; the path itself shows it
                where[kind, int(self.model.site_bodyid[site])][int(site)].append(name)
        points = {}
        for (kind, body), sites in where.items():
            points[f"{self.bodies[body]}/{kind}"] = rr.Points3D(
                positions=self.model.site_pos[list(sites)],
                labels=[", ".join(names) for names in sites.values()],
                show_labels=False,
                colors=[SITE_COLORS[kind]],
                radii=self._radius(2.5 if kind == "via_points" else 4.0),
            )
        return points


def _curves(names: list[str], colors: np.ndarray) -> rr.SeriesLines:
    return rr.SeriesLines(colors=colors, names=names, widths=[1.5] * len(names))


def _pages(group: Group) -> list[list[int]]:
    """Return the muscles of a group, spread evenly over pages."""
    parts = np.array_split(group.members, -(-len(group.members) // PAGE))
    return [[int(i) for i in part] for part in parts]


def entity(*parts: str) -> str:
    """Return the entity path of `parts`, with special characters escaped."""
    return rr.new_entity_path(list(parts)).lstrip("/")


def model_name(model: Any) -> str:
    """Return the name in the element `<mujoco model="...">`."""
    return model.names.split(b"\0", 1)[0].decode()


def _up(model: Any) -> rr.ViewCoordinates:
    """Return which axis of the world points up, for the viewer's camera."""
    axis, sign = up_axis(model)
    return getattr(rr.ViewCoordinates, f"RIGHT_HAND_{'XYZ'[axis]}_{'UP' if sign > 0 else 'DOWN'}")


def _moves(model: Any, body: int) -> bool:
    """Return whether a body can move: by a joint above it, or by a mocap pose."""
    return model.body_weldid[body] != 0 or model.body_mocapid[model.body_rootid[body]] >= 0


def _route_sites(muscle: Any) -> list[int]:
    return [muscle.origin_site, *muscle.via_sites, muscle.insertion_site]


def _distinct(names: list[str], kind: str) -> list[str]:
    """Return unique names: elements without a name, or with a repeated name, get their number."""
    taken: set[str] = set()
    for i, name in enumerate(names):
        if not name or name in taken:
            names[i] = f"{name or kind}#{i}"
        taken.add(names[i])
    return names
