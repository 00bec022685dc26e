"""Which MuJoCo joint shows each OpenSim coordinate, and the values of all coordinates at the default pose."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from mjwrap.errors import OsimError
from mjwrap.osim.description.bodies import Coordinate, Coupler
from mjwrap.osim.description.functions import Piecewise
from mjwrap.osim.description.model import OsimModel
from mjwrap.osim.writing.motions import Motion, scaled
from mjwrap.osim.writing.piece_algebra import composed
from mjwrap.osim.writing.tree import Branch


@dataclass
class Drivers:
    """The joints of coordinates.

    couplers: by dependent coordinate, each with its first coupler. carriers: the motion that shows a coordinate, by
    its name. values: of all coordinates at the default pose [rad or m].
    """

    coordinates: dict[str, Coordinate]
    couplers: dict[str, Coupler]
    carriers: dict[str, Motion]
    values: dict[str, float] = field(default_factory=dict)

    def dependence(self, name: str) -> tuple[str, Piecewise] | None:
        """Return the coordinate that a dependent one follows, and by which function; None for an independent one."""
        coupler = self.couplers.get(name)
        if coupler is None:
            return None
        function = coupler.function if coupler.scale == 1.0 else scaled(coupler.function, coupler.scale)
        return coupler.independent[0], function

    def driver(self, name: str) -> tuple[str, Piecewise | None] | None:
        """Return the joint that gives a coordinate, and the coordinate as a function of its qpos; None: it is the qpos.

        None instead of both where there is no such coordinate.
        """
        if name not in self.coordinates:
            return None
        dependence = self.dependence(name)
        if name in self.carriers or dependence is None:
            return name, None
        leader, function = dependence
        above = self.driver(leader)
        if above is None:
            return None
        return above[0], function if above[1] is None else composed(function, above[1])

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
    carriers: dict[str, Motion] = {}
    for branch in branches:
        for step in branch.chain:
            if not isinstance(step, Motion):
                continue
            if step.coordinate not in coordinates:
                raise OsimError(
                    f"{branch.joint.kind} '{branch.joint.name}': coordinate '{step.coordinate}' of {step.name} not found; "
                    f"coordinates: {', '.join(coordinates)}"
                )
            if _shows(step):
                known = carriers.get(step.coordinate)
                fits = step.turn == (coordinates[step.coordinate].motion == "rotational")
                if known is None or (fits and not _fits(known, coordinates)):
                    carriers[step.coordinate] = step
    drivers = Drivers(coordinates, couplers, carriers)
    drivers.settle({name: default_of(c) for name, c in coordinates.items() if name not in couplers})
    return drivers


def default_of(coordinate: Coordinate) -> float:
    """Return where a coordinate starts: its default value, or its prescribed function at time 0."""
    return (
        coordinate.default if coordinate.prescribed is None else float(np.asarray(coordinate.prescribed(0.0)))
    )


def _shows(motion: Motion) -> bool:
    """Whether a motion goes with its coordinate, one to one, in one direction or the other."""
    return motion.main and motion.function.is_linear and abs(float(motion.function(0.0, 1))) == 1.0


def _fits(motion: Motion, coordinates: dict[str, Coordinate]) -> bool:
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
