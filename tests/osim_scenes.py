"""Descriptions of small OpenSim models, made without a file: bodies that turn about z, one after the other."""

import numpy as np

from mjwrap.osim.description.bodies import (
    Axis,
    Body,
    Coordinate,
    Frame,
    Joint,
)
from mjwrap.osim.description.functions import Piecewise, constant, linear
from mjwrap.osim.description.model import OsimModel

ORIGIN = Frame("ground", np.zeros(3), np.eye(3))


def frame(body: str, *position: float) -> Frame:
    return Frame(body, np.array(position or (0.0, 0.0, 0.0)), np.eye(3))


def body(name: str, mass: float = 1.0, inertia: float = 0.01) -> Body:
    return Body(name, mass, np.array([0.05, 0.1, -0.02]), inertia * np.diag([1.0, 1.2, 1.5]))


def coordinate(name: str, default: float = 0.0, **options) -> Coordinate:
    given = {"clamped": False, "locked": False, "range": (-2.0, 2.0)} | options
    return Coordinate(name, "", "rotational", default, 0.0, **given)


def turning(name: str, parent: Frame, child: Frame, function: Piecewise | None = None, **options) -> Joint:
    """A joint that turns about z by a function of its coordinate, which has the joint's name."""
    still = [Axis(axis, (), constant(0.0)) for axis in np.eye(3)]
    turn = Axis(np.array([0.0, 0.0, 1.0]), (name,), function or linear(1.0))
    rest = (
        Axis(np.array([1.0, 0.0, 0.0]), (), constant(0.0)),
        Axis(np.array([0.0, 1.0, 0.0]), (), constant(0.0)),
    )
    return Joint(
        name,
        "CustomJoint",
        parent,
        child,
        (coordinate(name, **options),),
        (turn, *rest),
        (still[0], still[1], still[2]),
    )


def model(bodies, joints, constraints=()) -> OsimModel:
    return OsimModel(
        "m", 40000, np.array([0.0, -9.81, 0.0]), tuple(bodies), tuple(joints), tuple(constraints), (), ()
    )


def chain(*constraints, count: int = 3, **options) -> OsimModel:
    """A chain of bodies b0, b1, ... that turn about z, each 0.3 m along x of the one before, by coordinates j0, ..."""
    bodies = [body(f"b{k}") for k in range(count)]
    parents = [ORIGIN, *(frame(f"b{k}", 0.3, 0.0, 0.0) for k in range(count - 1))]
    joints = [
        turning(f"j{k}", parents[k], frame(f"b{k}"), default=0.3 * (k + 1), **options) for k in range(count)
    ]
    return model(bodies, joints, constraints)
