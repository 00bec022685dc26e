"""One possible mistake in a model: its kind, its element, what is odd about it, and what to do."""

from __future__ import annotations

import enum
from dataclasses import dataclass

import mujoco

from mjwrap.mjcf import MuscleDeclaration, name_of
from mjwrap.system import pulls_as_cable


class Mistake(enum.StrEnum):
    """Kinds of possible mistakes."""

    UNREAD_TUPLE = "tuple that nothing reads"
    UNREAD_NUMERIC = "numeric that nothing reads"
    UNREAD_TEXT = "text that nothing reads"
    PLACEHOLDER = "placeholder wrapped"
    SIZE = "size"
    FAR_AWAY = "far away"
    AXIS = "axis along the path"
    RING = "ring not threaded"
    COLLIDES = "wrapping geom collides"
    SIDE = "side not met"
    SIDE_AS_STOP = "side site as a stop"
    NO_JOINT = "no joint crossed"
    NO_MOMENT_ARM = "no moment arm"
    SIGN_CHANGE = "moment arm changes sign"
    ON_JOINT = "muscle on a joint"
    NO_PATH = "no path"
    SAME_ROUTE = "same route"
    SAME_PLACE = "stops at one place"
    TURNS_BACK = "route turns back"
    JOINT_RANGE = "joint range"
    KEYFRAME = "keyframe in degrees"
    PARAMETER = "parameter in another unit"
    UNITS = "units"
    PUSHES = "cable pushes"
    ACTUATION = "actuation off"


@dataclass(frozen=True)
class PossibleMistake:
    """Something legal that is probably not meant.

    Attributes:
        kind: the kind of mistake.
        element: the element in question, such as "muscle 'BIC'".
        text: what is odd about it.
        remedy: what to do if it is not meant.
    """

    kind: Mistake
    element: str
    text: str
    remedy: str

    def __str__(self) -> str:
        """Return one line: element, text and remedy."""
        return f"{self.element} {self.text}; {self.remedy}"


_OBJECTS = {
    "site": mujoco.mjtObj.mjOBJ_SITE,
    "geom": mujoco.mjtObj.mjOBJ_GEOM,
    "keyframe": mujoco.mjtObj.mjOBJ_KEY,
    "joint": mujoco.mjtObj.mjOBJ_JOINT,
    "body": mujoco.mjtObj.mjOBJ_BODY,
    "tuple": mujoco.mjtObj.mjOBJ_TUPLE,
    "numeric": mujoco.mjtObj.mjOBJ_NUMERIC,
    "text": mujoco.mjtObj.mjOBJ_TEXT,
    "actuator": mujoco.mjtObj.mjOBJ_ACTUATOR,
}


def quoted(model: mujoco.MjModel, kind: str, index: int) -> str:
    """Return an object's kind and name in quotes, such as "geom 'elbow'"."""
    return f"{kind} '{name_of(model, _OBJECTS[kind], index)}'"


def muscle_of(model: mujoco.MjModel, muscle: MuscleDeclaration) -> str:
    """Return the element of a muscle or cable."""
    return f"{'cable' if pulls_as_cable(model, muscle) else 'muscle'} '{muscle.name}'"


def millimetres(length: float) -> str:
    """Return a length [m] for a message."""
    return f"{1e3 * length:.3g} mm" if length < 1.0 else f"{length:.3g} m"
