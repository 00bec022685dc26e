"""Joints whose child moves on an ellipsoid, as chains of turns with fixed arms: exact, without approximated functions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mjwrap.errors import OsimError
from mjwrap.osim.description.bodies import Joint
from mjwrap.osim.description.functions import linear
from mjwrap.osim.writing.motions import ROTATION_NAMES, Array, Chain, Motion, moved, turned

X, Y, Z = np.eye(3)


def ellipsoid_chain(joint: Joint) -> Chain:
    """Return the motion across an EllipsoidJoint or a ScapulothoracicJoint."""
    names = [coordinate.name for coordinate in joint.coordinates]
    radii = joint.radii
    count = 4 if joint.kind == "ScapulothoracicJoint" else 3
    if radii is None or len(names) != count:
        raise OsimError(
            f"{joint.kind} '{joint.name}' has {len(names)} coordinates and radii {radii}; it needs {count} coordinates and three radii"
        )
    if count == 3:
        return [*_on_ellipsoid(radii, names[0], names[1]), _turn(Z, names[2], ROTATION_NAMES[2])]
    # Abduction turns about y and elevation about -x: the axes of the other joint, turned by 90 degrees about z.
    a, b, c = radii
    quarter = turned(Z, 0.5 * np.pi)
    winging = np.zeros(3)
    if joint.winging_origin is not None:
        winging[:2] = joint.winging_origin
    axis = np.array([-np.sin(joint.winging_direction), np.cos(joint.winging_direction), 0.0])
    return [
        quarter,
        *_on_ellipsoid((b, a, c), names[0], names[1]),
        _turn(Z, names[2], ROTATION_NAMES[2]),
        quarter.T,
        moved(winging),
        _turn(axis, names[3], "rotation4"),
        moved(-winging),
    ]


def _turn(axis: Array, coordinate: str, name: str) -> Motion:
    return Motion(True, axis, coordinate, linear(1.0), name)


def _on_ellipsoid(radii: Sequence[float] | Array, first: str, second: str) -> Chain:
    """Return the chain that turns about x by a coordinate, about the new y by another, and moves to the ellipsoid.

    The point reached is (a n_x, b n_y, c n_z), where n is the turned z axis. Products of sines and cosines of the two
    angles are sums of points on circles, so fixed arms on turns by multiples of the coordinates reach it exactly.
    """
    a, b, c = (float(radius) for radius in radii)
    mean, quarter = 0.5 * (b + c), 0.25 * (c - b)

    def follow(axis: Array, coordinate: str, slope: float, name: str) -> Motion:
        return Motion(True, axis, coordinate, linear(slope), name, main=False)

    chain: Chain = []
    if b != c:  # two arms that turn against each other: a length of (c - b) / 2 cos(second) along z, turned by -first
        chain += [
            follow(X, first, -1.0, "arm1"),
            follow(Y, second, 1.0, "arm2"),
            moved(quarter * Z),
            follow(Y, second, -2.0, "arm3"),
            moved(quarter * Z),
            follow(Y, second, 1.0, "arm4"),
            follow(X, first, 1.0, "arm5"),
        ]
    chain.append(_turn(X, first, ROTATION_NAMES[0]))
    if a != mean:
        chain += [
            follow(Y, second, -1.0, "arm6"),
            moved(0.5 * (mean - a) * Z),
            follow(Y, second, 1.0, "arm7"),
        ]
    return [*chain, _turn(Y, second, ROTATION_NAMES[1]), moved(0.5 * (mean + a) * Z)]
