"""Wrap objects as geoms that nothing collides with, and the marks that give them shape and side on a path."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mjwrap.osim.description.paths import WrapObject
from mjwrap.osim.report import APPROXIMATED, EXACT, LEFT_OUT, Report
from mjwrap.osim.writing.document import Document
from mjwrap.osim.writing.rotations import quaternion
from mjwrap.osim.writing.sites import SiteWriter
from mjwrap.osim.writing.unique_names import UniqueNames
from mjwrap.surfaces import Cylinder, Ellipsoid, Sphere, Surface, Torus

SHOWN, HIDDEN = 2, 4  # groups of geoms: the viewer shows 0 to 2
COLOR = (0.25, 0.6, 0.75, 0.35)
LARGEST_DRAWN = 10.0  # [m]: some files have cylinders of kilometres
SIDE = 2  # mark (prm) of a site: the path passes on its side of the geom before it, at every pose


@dataclass(frozen=True)
class WrittenWrap:
    """A wrap object as written: its surface for `solve_path`, its geom, the site of its side, and its numeric."""

    wrap: WrapObject
    surface: Surface
    geom: str
    side: str | None = None
    numeric: str | None = None

    @property
    def elements(self) -> list[dict[str, object]]:
        """The elements of a muscle's tuple that put the surface on its path."""
        found: list[dict[str, object]] = [{"objtype": "geom", "objname": self.geom}]
        if self.numeric:
            found.append({"objtype": "numeric", "objname": self.numeric})
        if self.side:
            found.append({"objtype": "site", "objname": self.side, "prm": SIDE})
        return found


def surface_of(wrap: WrapObject) -> Surface | None:
    """Return the surface of a wrap object; None for a kind that is not known."""
    size = wrap.dimensions
    match wrap.kind:
        case "WrapCylinder":
            return Cylinder(size[0])
        case "WrapSphere":
            return Sphere(size[0])
        case "WrapEllipsoid":
            return Ellipsoid((size[0], size[1], size[2]))
        case "WrapTorus":
            return Torus(max(size[:2]), min(size[:2]))
        case _:
            return None


def side_point(wrap: WrapObject) -> np.ndarray | None:
    """Return the point (3,) in the middle of the half that a wrap's quadrant allows, in its frame; None for all."""
    word = wrap.quadrant.strip().lower()
    if word in ("", "all", "unassigned") or word[-1] not in "xyz":
        return None
    axis = "xyz".index(word[-1])
    size = {"WrapEllipsoid": wrap.dimensions[axis : axis + 1]}.get(wrap.kind, wrap.dimensions[:1])
    point = np.zeros(3)
    point[axis] = -size[0] if word.startswith("-") else size[0]
    return point


def write_wrap(
    document: Document, report: Report, wrap: WrapObject, geoms: UniqueNames, sites: SiteWriter
) -> WrittenWrap | None:
    """Write a wrap object's geom, and the site of its side; None for one that is left out."""
    surface = surface_of(wrap)
    if surface is None or wrap.frame.body not in document.bodies:
        report.add(wrap.kind, wrap.name, LEFT_OUT, "mjwrap has no surface of this kind")
        return None
    parent, frame, size = document.bodies[wrap.frame.body], wrap.frame, wrap.dimensions
    geom = geoms.new(wrap.name)
    shape, group = {
        "WrapCylinder": ("cylinder", SHOWN),
        "WrapSphere": ("sphere", SHOWN),
        "WrapEllipsoid": ("ellipsoid", SHOWN),
        "WrapTorus": ("sphere", HIDDEN),
    }[wrap.kind]
    drawn: tuple[float, ...] = size
    if wrap.kind == "WrapCylinder":
        drawn = (size[0], min(0.5 * size[1], LARGEST_DRAWN) if size[1] > 0.0 else size[0])
    elif wrap.kind == "WrapTorus":
        drawn = (min(size[:2]),)
    document.add(parent, "geom", name=geom, type=shape, size=drawn, pos=frame.position,
                 quat=quaternion(frame.rotation), contype=0, conaffinity=0, group=group, mass=0,
                 rgba=COLOR)  # fmt: skip
    numeric = None
    if wrap.kind == "WrapTorus":
        numeric = document.numeric(f"mjwrap_{geom}_torus_size", (max(size[:2]), min(size[:2])))
    side, point = None, side_point(wrap)
    outcome, text = EXACT, f"geom '{geom}'"
    if point is not None and wrap.kind in ("WrapCylinder", "WrapEllipsoid") and not along_axis(wrap):
        side = sites.site(frame.body, f"{wrap.name}_side", frame.position + frame.rotation @ point, HIDDEN)
        text += f", the path passes on its side {wrap.quadrant.strip()}"
    elif point is not None:
        outcome = APPROXIMATED
        text += f"; its side {wrap.quadrant.strip()} is not kept: " + {
            "WrapSphere": "a string slides off a sphere to the short way round",
            "WrapTorus": "a string on a torus lies where it is pushed",
        }.get(wrap.kind, "both ways round the axis have it")
    if wrap.kind == "WrapTorus":
        outcome = APPROXIMATED if outcome is APPROXIMATED else EXACT
        text += ", wrapped as a torus (OpenSim wraps a cylinder in its place)"
    if not wrap.active:
        text += "; it is not active in the file, so no path uses it"
    report.add(wrap.kind, wrap.name, outcome, text)
    return WrittenWrap(wrap, surface, geom, side, numeric)


def along_axis(wrap: WrapObject) -> bool:
    """Return whether a quadrant says nothing, because it lies along a cylinder's axis."""
    return wrap.kind == "WrapCylinder" and wrap.quadrant.strip().lower().endswith("z")
