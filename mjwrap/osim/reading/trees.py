"""How joints connect bodies to ground, and the free joints of bodies that none connects."""

from __future__ import annotations

import numpy as np

from mjwrap.osim.description.bodies import GROUND, Axis, Coordinate, Frame, Joint
from mjwrap.osim.description.functions import linear
from mjwrap.osim.reading.joints import ROTATIONAL, TRANSLATIONAL
from mjwrap.osim.reading.nodes import Node


def connected(bodies: list[Node], joints: list[Joint], elements: list[Node]) -> list[Joint]:
    """Return the joints, with a free one for every body or chain of bodies that none connects to ground, as in OpenSim.

    Raises OsimError for a joint of a body with itself, and for bodies whose joints form a circle without ground.
    """
    for joint, node in zip(joints, elements, strict=True):
        if joint.parent.body == joint.child.body:
            raise node.error(f"both its frames are on '{joint.child.body}'; put one of them on another body")
    result = list(joints)
    children = {joint.child.body: node for joint, node in zip(joints, elements, strict=True)}
    reached = _reached({GROUND}, joints)
    while True:
        loose = [node for node in bodies if node.name not in reached]
        if not loose:
            return result
        base = next((node for node in loose if node.name not in children), None)
        if base is None:
            circle = ", ".join(node.name for node in loose)
            raise children[loose[0].name].error(f"bodies form a loop: {circle}; join one of them to ground")
        base.note("no joint connects it to ground; as in OpenSim it moves freely")
        result.append(free_joint(base.name, f"free_{base.name}"))
        reached |= _reached({base.name}, joints)


def _reached(start: set[str], joints: list[Joint]) -> set[str]:
    """Return the bodies that joints connect to some of them, in either direction."""
    reached, before = set(start), -1
    while len(reached) != before:
        before = len(reached)
        for joint in joints:
            ends = {joint.parent.body, joint.child.body}
            if ends & reached:
                reached |= ends
    return reached


def free_joint(body: str, name: str) -> Joint:
    """Return the free joint that OpenSim gives to a body without a joint."""
    zero = Frame(GROUND, np.zeros(3), np.eye(3))
    names = [f"{name}_coord_{i}" for i in range(6)]
    axes = [Axis(np.eye(3)[i % 3], (names[i],), linear(1.0)) for i in range(6)]
    coordinates = tuple(
        Coordinate(
            names[i], name, ROTATIONAL if i < 3 else TRANSLATIONAL, 0.0, 0.0, (-10.0, 10.0), False, False
        )
        for i in range(6)
    )
    child = Frame(body, np.zeros(3), np.eye(3))
    return Joint(
        name, "FreeJoint", zero, child, coordinates, (axes[0], axes[1], axes[2]), (axes[3], axes[4], axes[5])
    )
