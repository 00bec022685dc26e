"""Values of all coordinates: given ones, default ones, and those that follow others by couplers."""

from __future__ import annotations

from collections.abc import Mapping

from mjwrap.errors import OsimError
from mjwrap.osim.description.bodies import Coupler
from mjwrap.osim.description.model import OsimModel


def complete(model: OsimModel, values: Mapping[str, float] | None = None) -> dict[str, float]:
    """Return the value of every coordinate [rad or m]: default values where none is given, couplers applied last.

    A value given for a coordinate that follows another one is replaced. Raises OsimError for an unknown name, and
    for couplers that form a loop.
    """
    result = {coordinate.name: coordinate.default for coordinate in model.coordinates}
    for name, value in (values or {}).items():
        if name not in result:
            raise OsimError(f"coordinate '{name}' does not exist; coordinates: {', '.join(result) or 'none'}")
        result[name] = float(value)
    couplers = {c.dependent: c for c in model.constraints if isinstance(c, Coupler)}
    done: set[str] = set()
    for dependent in couplers:
        chain = [dependent]
        while chain[-1] in couplers and chain[-1] not in done:
            leader = couplers[chain[-1]].independent[0]
            if leader in chain:
                raise OsimError(f"couplers form a loop: {', '.join(chain)}")
            chain.append(leader)
        for name in reversed(chain[:-1]):
            coupler = couplers[name]
            result[name] = coupler.scale * coupler.function(result[coupler.independent[0]]).item()
            done.add(name)
    return result
