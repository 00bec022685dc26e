"""Read the coordinates of an imported model that are functions of a joint instead of its position."""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

from mjwrap.errors import ModelError
from mjwrap.mjcf.names import name_of
from mjwrap.mjcf.piecewise_numerics import read_pieces
from mjwrap.mjcf.tuple_names import COORDINATE

OBJ = mujoco.mjtObj


class CoordinateFunction(NamedTuple):
    """A coordinate as a piecewise polynomial in a joint's qpos.

    joint: id; own: whether the joint shows this coordinate and no other, so that it can be set; breaks (P - 1,):
    values of qpos between the pieces.
    """

    joint: int
    own: bool
    breaks: NDArray[np.float64]
    pieces: list[Polynomial]

    def value(self, position: float) -> float:
        """Return the coordinate at a position of the joint."""
        return float(self.pieces[np.count_nonzero(self.breaks <= position)](position))

    def position(self, value: float, near: float, low: float, high: float) -> float | None:
        """Return the position of the joint, between low and high and nearest to `near`, with this value; or None."""
        edges = [low, *np.clip(self.breaks, low, high), high]
        found = []
        for piece, first, last in zip(self.pieces, edges[:-1], edges[1:], strict=True):
            roots = np.atleast_1d((piece - value).roots())
            real = roots[np.abs(roots.imag) <= 1e-7 * (1.0 + np.abs(roots))].real
            slack = 1e-9 * (1.0 + abs(first) + abs(last)) if np.isfinite([first, last]).all() else 0.0
            found += [float(x) for x in real if first - slack <= x <= last + slack]
        return min(found, key=lambda x: abs(x - near)) if found else None


def read_coordinate_functions(model: mujoco.MjModel) -> dict[str, CoordinateFunction]:
    """Return the coordinates that tuples declare, by name; `ModelError`, which names the tuple, for a wrong one.

    A tuple "mjwrap_coordinate_NAME" lists a joint, and a numeric with a piecewise polynomial in its qpos. With prm=1 of
    the joint, the joint shows this coordinate, which can be set; else the coordinate only follows.
    """
    found: dict[str, CoordinateFunction] = {}
    for index in range(model.ntuple):
        label = name_of(model, OBJ.mjOBJ_TUPLE, index)
        if COORDINATE not in label:
            continue
        first = int(model.tuple_adr[index])
        places = range(first, first + int(model.tuple_size[index]))
        kinds = [OBJ(int(model.tuple_objtype[j])) for j in places]
        if kinds != [OBJ.mjOBJ_JOINT, OBJ.mjOBJ_NUMERIC]:
            raise ModelError(f"tuple '{label}' must list a joint and then a numeric")
        joint, numeric = (int(model.tuple_objid[j]) for j in places)
        own = float(model.tuple_objprm[first]) == 1.0
        found[label.replace(COORDINATE, "")] = CoordinateFunction(joint, own, *_polynomials(model, numeric))
    return found


def _polynomials(model: mujoco.MjModel, numeric: int) -> tuple[NDArray[np.float64], list[Polynomial]]:
    breaks, origins, rows = read_pieces(model, numeric)
    shifted = [Polynomial(row)(Polynomial([-at, 1.0])) for row, at in zip(rows, origins, strict=True)]
    return breaks, shifted
