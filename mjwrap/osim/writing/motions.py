"""A joint as a chain of elementary motions: fixed transforms, turns about an axis and slides along one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mjwrap.osim.description.bodies import Frame, Joint
from mjwrap.osim.description.functions import Piecewise

Array = NDArray[np.float64]
ROTATION_NAMES = ("rotation1", "rotation2", "rotation3")
TRANSLATION_NAMES = ("translation1", "translation2", "translation3")


Values = Callable[[str], float]  # the value of a coordinate by its name


@dataclass(frozen=True)
class AxisMotion:
    """A turn about, or a slide along, a unit axis (3,) by function(coordinate) [rad or m].

    name: of the axis in its joint, for a joint of its own. main: whether it is the turn that shows the coordinate.
    """

    turn: bool
    axis: Array
    coordinate: str
    function: Piecewise
    name: str
    main: bool = True

    def value(self, values: Values) -> float:
        """Return how far it has moved at values of the coordinates."""
        return float(self.function(values(self.coordinate)))

    def transform(self, value: float) -> Array:
        """Return the motion (4, 4) when its function has a value."""
        return turned(self.axis, value) if self.turn else moved(self.axis * value)

    def reversed(self) -> AxisMotion:
        """Return the inverse motion."""
        return replace(self, axis=-self.axis)


Step = AxisMotion | Array  # an array (4, 4) is a fixed transform
Chain = list[Step]


def turned(axis: Array, angle: float) -> Array:
    """Return the transform (4, 4) of a turn about a unit axis."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    out = np.eye(4)
    out[:3, :3] += np.sin(angle) * cross + 2.0 * np.sin(0.5 * angle) ** 2 * (cross @ cross)
    return out


def moved(by: Array) -> Array:
    """Return the transform (4, 4) of a translation."""
    out = np.eye(4)
    out[:3, 3] = by
    return out


def placed(frame: Frame) -> Array:
    """Return the transform (4, 4) of a frame in its body."""
    out = moved(frame.position)
    out[:3, :3] = frame.rotation
    return out


def inverse(transform: Array) -> Array:
    """Return the inverse of a rigid transform (4, 4)."""
    out = np.eye(4)
    out[:3, :3] = transform[:3, :3].T
    out[:3, 3] = -transform[:3, :3].T @ transform[:3, 3]
    return out


def inverted(chain: Chain) -> Chain:
    """Return the chain of the inverse motion."""
    return [step.reversed() if isinstance(step, AxisMotion) else inverse(step) for step in reversed(chain)]


def evaluated(chain: Chain, values: Values) -> Array:
    """Return the transform (4, 4) of a chain at values of the coordinates."""
    out = np.eye(4)
    for step in chain:
        if isinstance(step, AxisMotion):
            out = out @ step.transform(step.value(values))
        else:
            out = out @ step
    return out


def spatial_chain(joint: Joint) -> Chain:
    """Return the slides and turns of a joint that has three functions for each."""
    chain: Chain = []
    for turn, axes, names in (
        (False, joint.translations, TRANSLATION_NAMES),
        (True, joint.rotations, ROTATION_NAMES),
    ):
        for axis, name in zip(axes, names, strict=True):
            length = float(np.linalg.norm(axis.axis))
            direction = axis.axis / length if length > 0.0 else np.array([1.0, 0.0, 0.0])
            scale = 1.0 if turn or abs(length - 1.0) < 1e-15 else length
            function = axis.function if scale == 1.0 else scaled(axis.function, scale)
            coordinate = axis.coordinates[0] if axis.coordinates else ""
            motion = AxisMotion(turn, direction, coordinate, function, name)
            if function.is_constant or not coordinate:
                chain.append(motion.transform(float(function(0.0))))
            else:
                chain.append(motion)
    return chain


def scaled(function: Piecewise, factor: float) -> Piecewise:
    """Return factor times a function."""
    return replace(function, coefficients=factor * function.coefficients, error=abs(factor) * function.error)


def merged(chain: Chain) -> Chain:
    """Return the same chain with neighbouring fixed transforms multiplied."""
    out: Chain = []
    for step in chain:
        if out and not isinstance(step, AxisMotion) and not isinstance(out[-1], AxisMotion):
            out[-1] = out[-1] @ step
        else:
            out.append(step)
    return out
