"""Joints whose child moves on an ellipsoid: turns, slides, and the planes on which points of the child stay.

The child's origin is at (a n_x, b n_y, c n_z), where n is its z axis, in the ellipsoid's frame. So its point at -a z
stays in the plane x = 0, that at -b z in y = 0 and that at -c z in z = 0, as in a trammel. The child turns
about the second of these points, which slides along x and z; constraints keep the two others in their planes. All of
this is exact, without an approximated function.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mjwrap.errors import OsimError
from mjwrap.osim.description.bodies import Joint
from mjwrap.osim.description.functions import constant, linear
from mjwrap.osim.writing.motions import (
    ROTATION_NAMES,
    TRANSLATION_NAMES,
    Array,
    AxisMotion,
    Chain,
    Values,
    moved,
    turned,
)

X, Y, Z = np.eye(3)


@dataclass(frozen=True)
class EllipsoidSlide(AxisMotion):
    """A slide along x by offset n_x, or along z by offset n_z. `coordinate` is the second coordinate.

    first: the name of the first coordinate; offset [m]: a - b or c - b. along_z: whether it slides along z.
    """

    first: str = ""
    offset: float = 0.0
    along_z: bool = False

    def value(self, values: Values) -> float:
        """Return how far it has moved at values of the coordinates."""
        second = values(self.coordinate)
        if self.along_z:
            return self.offset * float(np.cos(values(self.first)) * np.cos(second))
        return self.offset * float(np.sin(second))


@dataclass(frozen=True)
class Ellipsoid:
    """The motion across an ellipsoid joint: `onto` from its frame to the moved frame, and what comes before and after.

    planes: pairs of a point's place along z of the moved frame [m] and of the axis (3,) of the ellipsoid's frame that
    it stays perpendicular to.
    """

    before: Array
    onto: Chain
    after: Chain
    planes: tuple[tuple[float, Array], ...]


def ellipsoid_of(joint: Joint) -> Ellipsoid:
    """Return the motion across an EllipsoidJoint or a ScapulothoracicJoint."""
    names = [coordinate.name for coordinate in joint.coordinates]
    count = 4 if joint.kind == "ScapulothoracicJoint" else 3
    if joint.radii is None or len(names) != count:
        raise OsimError(
            f"{joint.kind} '{joint.name}' has {len(names)} coordinates and radii {joint.radii}; "
            f"it needs {count} coordinates and three radii"
        )
    if count == 3:
        return _ellipsoid(np.eye(4), joint.radii, names, [])
    # Abduction turns about y and elevation about -x: the axes of the other joint, turned by 90 degrees about z.
    a, b, c = joint.radii
    quarter = turned(Z, 0.5 * np.pi)
    origin = np.zeros(3) if joint.winging_origin is None else np.array([*joint.winging_origin, 0.0])
    axis = np.array([-np.sin(joint.winging_direction), np.cos(joint.winging_direction), 0.0])
    winging = [quarter.T @ moved(origin), _turn(axis, names[3], "rotation4"), moved(-origin)]
    return _ellipsoid(quarter, np.array([b, a, c]), names, winging)


def _turn(axis: Array, coordinate: str, name: str) -> AxisMotion:
    return AxisMotion(True, axis, coordinate, linear(1.0), name)


def _ellipsoid(before: Array, radii: Array, names: list[str], after: Chain) -> Ellipsoid:
    a, b, c = (float(radius) for radius in radii)
    onto: Chain = []
    planes: list[tuple[float, Array]] = []
    for axis, radius, name, along_z in (
        (X, a, TRANSLATION_NAMES[0], False),
        (Z, c, TRANSLATION_NAMES[2], True),
    ):
        if radius != b:
            onto.append(
                EllipsoidSlide(
                    False, axis, names[1], constant(0.0), name, False, names[0], radius - b, along_z
                )
            )
            planes.append((-radius, axis))
    onto += [
        _turn(X, names[0], ROTATION_NAMES[0]),
        _turn(Y, names[1], ROTATION_NAMES[1]),
        moved(b * Z),
        _turn(Z, names[2], ROTATION_NAMES[2]),
    ]
    return Ellipsoid(before, onto, after, tuple(planes))
