"""The tree of bodies that MuJoCo needs: which joint carries which body, and which joints close loops."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mjwrap.errors import OsimError
from mjwrap.osim.description.bodies import GROUND, Axis, Coordinate, Frame, Joint
from mjwrap.osim.description.functions import linear
from mjwrap.osim.description.model import OsimModel
from mjwrap.osim.writing.ellipsoids import ellipsoid_of
from mjwrap.osim.writing.motions import (
    Array,
    AxisMotion,
    Chain,
    inverse,
    inverted,
    merged,
    moved,
    placed,
    spatial_chain,
)


@dataclass(frozen=True)
class Plane:
    """A point of one body that stays in a plane of another: through the origin of `frame` (4, 4), across `axis` (3,).

    place: the transform (4, 4) of a frame of the second body, `mover`, whose origin is the point.
    """

    body: str
    frame: Array
    axis: Array
    mover: str
    place: Array


@dataclass(frozen=True)
class Branch:
    """A body with the joint that carries it; `chain` is its motion in its parent, another body or ground.

    The body may be a frame between two bodies of the file that needs one of its own. copy_of: the body that this one is
    part of, where the joint closes a loop; empty otherwise. backward: whether the joint's child is the parent here.
    """

    body: str
    parent: str
    joint: Joint
    chain: Chain
    copy_of: str = ""
    backward: bool = False
    planes: tuple[Plane, ...] = ()

    @property
    def fixed(self) -> bool:
        """Whether the body cannot move in its parent."""
        return not any(isinstance(step, AxisMotion) for step in self.chain)


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
    taken = {GROUND, *names}
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
        branches += _branches_across(joint, body, parent, taken, backward=backward)
    for joint in waiting:
        name = unused(f"{joint.child.body}_{joint.name}", taken)
        branches += _branches_across(joint, name, joint.parent.body, taken, copy_of=joint.child.body)
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


def _branches_across(
    joint: Joint, body: str, parent: str, taken: set[str], *, backward: bool = False, copy_of: str = ""
) -> list[Branch]:
    """Return the branches of a joint: one, or two where a frame between its two bodies needs a body of its own."""
    start, end = placed(joint.parent), inverse(placed(joint.child))
    if joint.radii is None:
        chain = merged([start, *spatial_chain(joint), end])
        return [Branch(body, parent, joint, inverted(chain) if backward else chain, copy_of, backward)]
    if backward:
        raise OsimError(
            f"{joint.kind} '{joint.name}': only its child body '{parent}' is joined to ground by other joints; "
            f"swap its parent and child frames"
        )
    across = ellipsoid_of(joint)
    onto = [start @ across.before, *across.onto]
    if not across.after:
        planes = tuple(
            Plane(
                parent, start @ across.before, axis, body, inverse(end) @ moved(np.array([0.0, 0.0, place]))
            )
            for place, axis in across.planes
        )
        return [Branch(body, parent, joint, merged([*onto, end]), copy_of, planes=planes)]
    middle = unused(f"{body}_{joint.name}_frame", taken)
    planes = tuple(
        Plane(parent, start @ across.before, axis, middle, moved(np.array([0.0, 0.0, place])))
        for place, axis in across.planes
    )
    return [
        Branch(middle, parent, joint, merged(onto), planes=planes),
        Branch(body, middle, joint, merged([*across.after, end]), copy_of),
    ]


def unused(name: str, taken: set[str]) -> str:
    """Return a name that is not taken, and take it."""
    while name in taken:
        name += "_"
    taken.add(name)
    return name


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
        Coordinate(
            each, name, "rotational" if k < 3 else "translational", 0.0, 0.0, (-np.pi, np.pi), False, False
        )
        for k, each in enumerate(names)
    )
    home = Frame(GROUND, np.zeros(3), np.eye(3))
    own = Frame(body, np.zeros(3), np.eye(3))
    return Joint(
        name, "FreeJoint", home, own, coordinates, (axes[0], axes[1], axes[2]), (axes[3], axes[4], axes[5])
    )
