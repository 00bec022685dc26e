"""A whole OpenSim model."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mjwrap.osim.description.bodies import Body, Constraint, Coordinate, Frame, Joint, Mesh
from mjwrap.osim.description.forces import ContactShape, Force, OtherForce
from mjwrap.osim.description.paths import WrapObject

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Marker:
    """A marker: the origin of its frame."""

    name: str
    frame: Frame


@dataclass(frozen=True)
class Note:
    """Something that the reader says about an element: what it left out, understood in part, or did."""

    kind: str  # its class in the file
    name: str  # its own, or as "of Model 'leg'" where it has none
    text: str
    outcome: str  # of the report: exact, approximated, left out


@dataclass(frozen=True)
class OsimModel:
    """All that an .osim file says that mjwrap knows, in the file's order. Names of bodies, coordinates, joints and wrap
    objects are unique."""

    name: str
    version: int  # of the document, 20001 to 40600
    gravity: Array  # (3,) [m/s^2]
    bodies: tuple[Body, ...]
    joints: tuple[Joint, ...]
    constraints: tuple[Constraint, ...]
    wraps: tuple[WrapObject, ...]
    forces: tuple[Force, ...]
    contacts: tuple[ContactShape, ...] = ()
    markers: tuple[Marker, ...] = ()
    ground_meshes: tuple[Mesh, ...] = ()
    others: tuple[OtherForce, ...] = ()  # controllers, probes, components that are only named in the report
    notes: tuple[Note, ...] = field(default=())
    credits: str = ""

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        """All coordinates, joint by joint."""
        return tuple(coordinate for joint in self.joints for coordinate in joint.coordinates)
