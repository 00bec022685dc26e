"""The tree of bodies: joints that lead away from ground, turned round where they do not, and free ones for the rest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mjwrap.osim.description.bodies import GROUND, Axis, Coordinate, Frame, Joint
from mjwrap.osim.description.functions import linear
from mjwrap.osim.reading.joints import ROTATIONAL, TRANSLATIONAL
from mjwrap.osim.reading.nodes import Node


def connected(bodies: list[Node], joints: list[Joint], elements: list[Node]) -> list[Joint]:
    """Return the joints so that each body but ground is the child of one of them, whose parent is nearer to ground.

    A joint that leads towards ground is turned round. A body to which no joint leads gets a free one, as in OpenSim.
    Raises OsimError where bodies form a loop.
    """
    result = list(joints)
    reached, waiting = {GROUND}, list(range(len(joints)))
    while True:
        waiting = _forward(result, elements, reached, waiting)
        if not waiting and all(node.name in reached for node in bodies):
            return result
        back = next((i for i in waiting if result[i].child.body in reached), None)
        if back is not None:
            result[back] = turned_round(result[back], elements[back])
            continue
        children = {result[i].child.body for i in waiting}
        loose = [node for node in bodies if node.name not in reached]
        base = next((node for node in loose if node.name not in children), None)
        if base is None:
            raise elements[waiting[0]].error(
                f"bodies form a loop: {', '.join(sorted(children))}; attach one of them to ground"
            )
        base.note("no joint leads to it; as in OpenSim it moves freely")
        result.append(free_joint(base.name, f"free_{base.name}"))
        reached.add(base.name)


def _forward(joints: list[Joint], elements: list[Node], reached: set[str], waiting: list[int]) -> list[int]:
    """Add the bodies to which joints lead from those reached; return the joints that lead from other bodies."""
    before = -1
    while len(waiting) != before:
        before, later = len(waiting), []
        for i in waiting:
            parent, child = joints[i].parent.body, joints[i].child.body
            if parent in reached and child in reached:
                raise elements[i].error(
                    f"closes a loop of bodies: '{parent}' and '{child}' are already connected by other joints; "
                    "replace one of these by a constraint"
                )
            if parent in reached:
                reached.add(child)
            else:
                later.append(i)
        waiting = later
    return waiting


def turned_round(joint: Joint, node: Node) -> Joint:
    """Return the joint with parent and child swapped, for the same coordinates; not possible for all joints."""
    turns = any(not _zero(axis) for axis in joint.rotations)
    moves = any(not _zero(axis) for axis in joint.translations)
    if joint.radii is not None or (turns and moves):
        raise node.error(
            "leads towards ground and both turns and moves its child, which cannot be turned round; "
            "swap parent_frame and child_frame"
        )
    node.note("leads towards ground; parent and child are swapped, with the same coordinates")
    first, second, third = joint.rotations
    along = joint.translations
    return replace(
        joint,
        parent=joint.child,
        child=joint.parent,
        rotations=(_opposite(third), _opposite(second), _opposite(first)),
        translations=(_opposite(along[0]), _opposite(along[1]), _opposite(along[2])),
    )


def _zero(axis: Axis) -> bool:
    return axis.function.is_constant and axis.function(0.0).item() == 0.0


def _opposite(axis: Axis) -> Axis:
    return replace(axis, axis=-axis.axis)


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
