"""The tree of bodies that MuJoCo needs: which joint carries which body, and which joints close loops."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mjwrap.errors import OsimError
from mjwrap.osim.description.bodies import GROUND, Axis, Coordinate, Frame, Joint
from mjwrap.osim.description.functions import linear
from mjwrap.osim.description.model import OsimModel
from mjwrap.osim.writing.ellipsoids import ellipsoid_chain
from mjwrap.osim.writing.motions import Chain, Motion, inverse, inverted, merged, placed, spatial_chain


@dataclass(frozen=True)
class Branch:
    """A body with the joint that carries it; `chain` is its motion in its parent, another body or ground.

    copy_of: the body that this one is part of, where the joint closes a loop; empty otherwise. backward: whether the joint's
    child is the parent here.
    """

    body: str
    parent: str
    joint: Joint
    chain: Chain
    copy_of: str = ""
    backward: bool = False

    @property
    def fixed(self) -> bool:
        """Whether the body cannot move in its parent."""
        return not any(isinstance(step, Motion) for step in self.chain)


def branches_of(model: OsimModel) -> list[Branch]:
    """Return the bodies, parents first, in the order of the file's joints; a joint that closes a loop adds a copy.

    A body without any joint moves freely, as in OpenSim.
    """
    names = {body.name for body in model.bodies}
    for joint in model.joints:
        for frame in (joint.parent, joint.child):
            if frame.body != GROUND and frame.body not in names:
                raise OsimError(
                    f"{joint.kind} '{joint.name}': body '{frame.body}' not found; bodies: {', '.join(sorted(names))}"
                )
        if joint.parent.body == joint.child.body:
            raise OsimError(f"{joint.kind} '{joint.name}' joins body '{joint.parent.body}' to itself")
    reached = {GROUND}
    waiting = list(model.joints)
    branches: list[Branch] = []
    while True:
        step = _next(waiting, reached)
        if step is None:
            lost = [body.name for body in model.bodies if body.name not in reached]
            if not lost:
                break
            joined = {frame.body for joint in waiting for frame in (joint.parent, joint.child)}
            free = next((name for name in lost if name not in joined), lost[0])
            step = _free_joint(free, {c.name for c in model.coordinates}), False
        joint, backward = step
        if joint in waiting:
            waiting.remove(joint)
        parent, body = joint.parent.body, joint.child.body
        if backward:
            parent, body = body, parent
        reached.add(body)
        branches.append(Branch(body, parent, joint, chain_of(joint, backward), backward=backward))
    taken = set(reached)
    for joint in waiting:
        name = f"{joint.child.body}_{joint.name}"
        while name in taken:
            name += "_"
        taken.add(name)
        branches.append(Branch(name, joint.parent.body, joint, chain_of(joint, False), joint.child.body))
    return branches


def _next(waiting: list[Joint], reached: set[str]) -> tuple[Joint, bool] | None:
    """Return the next joint that reaches a new body, and whether it has to be turned round."""
    for joint in waiting:
        if joint.parent.body in reached and joint.child.body not in reached:
            return joint, False
    for joint in waiting:
        if joint.child.body in reached and joint.parent.body not in reached:
            return joint, True
    return None


def chain_of(joint: Joint, backward: bool) -> Chain:
    """Return the motion of a joint's child body in its parent body, or the other way round."""
    across = spatial_chain(joint) if joint.radii is None else ellipsoid_chain(joint)
    chain = merged([placed(joint.parent), *across, inverse(placed(joint.child))])
    return inverted(chain) if backward else chain


def _free_joint(body: str, taken: set[str]) -> Joint:
    """Return the joint of a body that has none."""
    name = f"{body}_free"
    names = [f"{name}_{part}" for part in ("rx", "ry", "rz", "tx", "ty", "tz")]
    if taken.intersection(names):
        raise OsimError(
            f"Body '{body}' has no joint, and the names of its six coordinates, {names[0]} to {names[5]}, are taken"
        )
    axes = [Axis(np.eye(3)[k % 3], (names[k],), linear(1.0)) for k in range(6)]
    coordinates = tuple(
        Coordinate(each, name, "rotational" if k < 3 else "translational", 0.0, 0.0, (-np.pi, np.pi), False, False)
        for k, each in enumerate(names)
    )
    home = Frame(GROUND, np.zeros(3), np.eye(3))
    own = Frame(body, np.zeros(3), np.eye(3))
    return Joint(
        name, "FreeJoint", home, own, coordinates, (axes[0], axes[1], axes[2]), (axes[3], axes[4], axes[5])
    )


