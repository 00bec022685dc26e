"""Which MuJoCo joint shows each OpenSim coordinate, and the values of all coordinates at the default pose."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from mjwrap.errors import OsimError
from mjwrap.osim.description.bodies import Coordinate, Coupler
from mjwrap.osim.description.functions import Piecewise
from mjwrap.osim.description.model import OsimModel
from mjwrap.osim.writing.motions import AxisMotion, scaled
from mjwrap.osim.writing.piece_algebra import composed
from mjwrap.osim.writing.quartics import TOLERANCE, inverse_pieces
from mjwrap.osim.writing.tree import Branch, unused
from mjwrap.osim.writing.unique_names import plain_name

MOST_PIECES = 70  # of degree 4 in the 500 numbers of a numeric


@dataclass(frozen=True)
class Substitute:
    """The motion, with the name of its joint, that stands for a coordinate, which is a function of the joint's qpos."""

    joint: str
    motion: AxisMotion
    extent: tuple[float, float]  # of the coordinate, in which the motion rises or falls
    short_inverse: Piecewise  # with so few pieces that a numeric of MuJoCo can hold them


@dataclass
class Drivers:
    """The joints of coordinates.

    couplers: by dependent coordinate, each with its first coupler. carriers: the motion that shows a coordinate, by
    its name. substitutes: by independent coordinate that no motion shows.
    values: of all coordinates at the default pose [rad or m].
    """

    coordinates: dict[str, Coordinate]
    couplers: dict[str, Coupler]
    carriers: dict[str, AxisMotion]
    substitutes: dict[str, Substitute] = field(default_factory=dict)
    values: dict[str, float] = field(default_factory=dict)

    def dependence(self, name: str) -> tuple[str, Piecewise] | None:
        """Return the coordinate that a dependent one follows, and by which function; None for an independent one."""
        coupler = self.couplers.get(name)
        if coupler is None:
            return None
        function = coupler.function if coupler.scale == 1.0 else scaled(coupler.function, coupler.scale)
        return coupler.independent[0], function

    def leader(self, name: str) -> tuple[str, Piecewise | None]:
        """Return the coordinate with a joint that gives a coordinate, and by which function; None if it is the same."""
        dependence = self.dependence(name)
        if name in self.carriers or dependence is None:
            return name, None
        above, inner = self.leader(dependence[0])
        return above, dependence[1] if inner is None else composed(dependence[1], inner)

    def driver(self, name: str) -> tuple[str, Piecewise | None] | None:
        """Return the joint that gives a coordinate, and the coordinate as a function of its qpos; None: it is the qpos.

        None instead of both where there is no such coordinate.
        """
        if name not in self.coordinates:
            return None
        leader, function = self.leader(name)
        if leader not in self.substitutes:
            return leader, function
        substitute = self.substitutes[leader]
        inverse = substitute.short_inverse
        return substitute.joint, inverse if function is None else composed(function, inverse)

    def settle(self, independent: dict[str, float]) -> None:
        """Set the values of all coordinates from those of the independent ones."""
        self.values = dict(independent)
        for name in self.coordinates:
            self.value(name)

    def value(self, name: str) -> float:
        """Return the value of a coordinate at the default pose."""
        if name not in self.values:
            dependence = self.dependence(name)
            assert dependence is not None
            self.values[name] = float(dependence[1](self.value(dependence[0])))
        return self.values[name]


def drivers_of(model: OsimModel, branches: list[Branch]) -> Drivers:
    """Return the drivers of a model, at its default values."""
    coordinates = {c.name: c for branch in branches for c in branch.joint.coordinates}
    coordinates |= {c.name: c for c in model.coordinates}
    couplers: dict[str, Coupler] = {}
    for constraint in model.constraints:
        if isinstance(constraint, Coupler):
            _check(constraint, coordinates)
            couplers.setdefault(constraint.dependent, constraint)
    _refuse_circles(couplers)
    carriers: dict[str, AxisMotion] = {}
    for branch in branches:
        for step in branch.chain:
            if not isinstance(step, AxisMotion):
                continue
            if step.coordinate not in coordinates:
                raise OsimError(
                    f"{branch.joint.kind} '{branch.joint.name}': coordinate '{step.coordinate}' not found; "
                    f"coordinates: {', '.join(coordinates)}"
                )
            if _shows(step):
                known = carriers.get(step.coordinate)
                fits = step.turn == (coordinates[step.coordinate].motion == "rotational")
                if known is None or (fits and not _fits(known, coordinates)):
                    carriers[step.coordinate] = step
    substitutes = _substitutes(branches, coordinates, carriers.keys() | couplers.keys())
    drivers = Drivers(coordinates, couplers, carriers, substitutes)
    drivers.settle({name: default_of(c) for name, c in coordinates.items() if name not in couplers})
    return drivers


def _substitutes(
    branches: list[Branch], coordinates: dict[str, Coordinate], shown: set[str]
) -> dict[str, Substitute]:
    """Return motions that rise or fall all along with a coordinate that none shows; turns first."""
    found: dict[str, Substitute] = {}
    taken = set(coordinates)
    steps = [(branch, step) for branch in branches for step in branch.chain if isinstance(step, AxisMotion)]
    for branch, step in sorted(steps, key=lambda pair: not pair[1].turn):
        name = step.coordinate
        if name in shown or name in found or not step.main:
            continue
        low, high = coordinates[name].range
        room = 0.1 * (high - low)
        inverse = inverse_pieces(step.function, low - room, high + room) if low < high else None
        if inverse is not None:
            joint = unused(plain_name(f"{branch.joint.name}_{step.name}"), taken)
            found[name] = Substitute(
                joint,
                step,
                (low - room, high + room),
                _shortened(step.function, low - room, high + room, inverse),
            )
    return found


def _shortened(function: Piecewise, low: float, high: float, inverse: Piecewise) -> Piecewise:
    """Return the inverse of a function with at most as many pieces as a numeric holds."""
    tolerance = TOLERANCE
    while len(inverse.origins) > MOST_PIECES and tolerance < 1e-3:
        tolerance *= 10.0
        inverse = inverse_pieces(function, low, high, tolerance) or inverse
    return inverse


def default_of(coordinate: Coordinate) -> float:
    """Return where a coordinate starts: its default value, or its prescribed function at time 0."""
    return (
        coordinate.default if coordinate.prescribed is None else float(np.asarray(coordinate.prescribed(0.0)))
    )


def _shows(motion: AxisMotion) -> bool:
    """Whether a motion goes with its coordinate, one to one, in one direction or the other."""
    return motion.main and motion.function.is_linear and abs(float(motion.function(0.0, 1))) == 1.0


def _fits(motion: AxisMotion, coordinates: dict[str, Coordinate]) -> bool:
    return motion.turn == (coordinates[motion.coordinate].motion == "rotational")


def _check(coupler: Coupler, coordinates: dict[str, Coordinate]) -> None:
    where = f"CoordinateCouplerConstraint '{coupler.name}'"
    if len(coupler.independent) != 1:
        raise OsimError(
            f"{where} has {len(coupler.independent)} independent coordinates; mjwrap imports couplers of one"
        )
    for name in (coupler.dependent, *coupler.independent):
        if name not in coordinates:
            raise OsimError(f"{where}: coordinate '{name}' not found; coordinates: {', '.join(coordinates)}")


def _refuse_circles(couplers: dict[str, Coupler]) -> None:
    for start in couplers:
        seen, name = [start], couplers[start].independent[0]
        while name in couplers:
            if name in seen:
                raise OsimError(
                    f"CoordinateCouplerConstraint '{couplers[start].name}': coordinates follow each other in a circle: "
                    f"{', '.join([*seen, name])}"
                )
            seen.append(name)
            name = couplers[name].independent[0]
