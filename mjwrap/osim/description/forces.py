"""Muscles and all other forces of an OpenSim model. SI units; angles in rad."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mjwrap.osim.description.bodies import Frame
from mjwrap.osim.description.functions import Piecewise
from mjwrap.osim.description.paths import Path

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Muscle:
    """A muscle; parameters have OpenSim's names (max_isometric_force, optimal_fiber_length, ..., KshapeActive, ...).

    curves: all parameters of a curve by the class of a Millard curve ("ActiveForceLengthCurve", ...), with OpenSim's
    names and defaults filled in. splines: functions that a Schutte muscle lists, by tag.
    """

    name: str
    kind: str  # "Thelen2003Muscle", "Millard2012EquilibriumMuscle", "DeGrooteFregly2016Muscle", ...
    path: Path
    parameters: Mapping[str, float]  # booleans as 0 and 1
    curves: Mapping[str, Mapping[str, float]]
    splines: Mapping[str, Piecewise]
    rigid_tendon: bool
    active: bool  # appliesForce, or not isDisabled
    control_range: tuple[float, float] = (0.0, 1.0)


@dataclass(frozen=True)
class Ligament:
    """A passive path: force = pcsa_force * curve(length / resting_length)."""

    name: str
    path: Path
    resting_length: float
    pcsa_force: float
    curve: Piecewise
    active: bool = True


@dataclass(frozen=True)
class PathSpring:
    """A passive path: tension = stiffness * stretch * (1 + dissipation * stretching speed), never negative."""

    name: str
    path: Path
    resting_length: float
    stiffness: float
    dissipation: float
    active: bool = True


@dataclass(frozen=True)
class PathActuator:
    """A path that pulls with control * optimal_force."""

    name: str
    path: Path
    optimal_force: float
    control_range: tuple[float, float]
    active: bool = True


@dataclass(frozen=True)
class CoordinateActuator:
    """A generalised force on a coordinate: control * optimal_force."""

    name: str
    coordinate: str
    optimal_force: float
    control_range: tuple[float, float]
    active: bool = True


@dataclass(frozen=True)
class LimitForce:
    """CoordinateLimitForce. Limits [rad or m] and stiffness per rad or m; files have degrees for angles."""

    name: str
    coordinate: str
    upper_limit: float
    lower_limit: float
    upper_stiffness: float
    lower_stiffness: float
    damping: float
    transition: float
    active: bool = True


@dataclass(frozen=True)
class SpringGeneralizedForce:
    """SpringGeneralizedForce: -stiffness (q - rest) - viscosity * speed on a coordinate."""

    name: str
    coordinate: str
    stiffness: float
    rest: float
    viscosity: float
    active: bool = True


@dataclass(frozen=True)
class Bushing:
    """BushingForce between two frames; stiffness and damping (3,) each, rotational and translational."""

    name: str
    first: Frame
    second: Frame
    rotational_stiffness: Array
    translational_stiffness: Array
    rotational_damping: Array
    translational_damping: Array
    active: bool = True


@dataclass(frozen=True)
class ContactShape:
    """ContactSphere (dimensions: radius), ContactHalfSpace (its solid is x > 0 of the frame), ContactMesh (file)."""

    name: str
    kind: str
    frame: Frame
    dimensions: tuple[float, ...] = ()
    file: str = ""


@dataclass(frozen=True)
class HuntCrossley:
    """HuntCrossleyForce, or another contact force (`kind`), between contact shapes by name, with its parameters."""

    name: str
    kind: str
    shapes: tuple[str, ...]
    parameters: Mapping[str, float]  # of the first group of shapes, with transition_velocity
    active: bool = True
    by_shape: Mapping[str, Mapping[str, float]] = field(default_factory=dict)  # where groups differ


@dataclass(frozen=True)
class OtherForce:
    """A force, controller or probe that is only named in the report, and why."""

    name: str
    kind: str
    text: str = "mjwrap does not import this class"


Force = (
    Muscle | Ligament | PathSpring | PathActuator | CoordinateActuator | LimitForce | SpringGeneralizedForce | Bushing
    | HuntCrossley | OtherForce
)  # fmt: skip
