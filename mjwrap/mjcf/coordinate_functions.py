"""Read the coordinates of an imported model that are no joint's qpos, and the joints that are no coordinates.

A tuple "mjwrap_coordinate_NAME" lists a joint and a numeric with a piecewise polynomial: the coordinate as a function
of the joint's qpos. With prm="1" of the joint, or prm="2" for a coordinate that is an angle, it is the other way round:
the numeric is the joint's qpos as a function of the coordinate, which rises or falls within the range in a second
numeric, and goes on straight beyond it. Such a coordinate can be set. A tuple "mjwrap_axes" lists joints that are axes
of a joint only.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.polynomial.polynomial import polyder, polyval
from numpy.typing import NDArray

from mjwrap.errors import ModelError
from mjwrap.mjcf.names import name_of
from mjwrap.mjcf.piecewise_numerics import read_pieces
from mjwrap.mjcf.tuple_names import AXES, COORDINATE

OBJ = mujoco.mjtObj
Array = NDArray[np.float64]
LENGTH, ANGLE = 1.0, 2.0  # prm of the joint of a coordinate that can be set
STEEPEST = 1e12  # rate of a coordinate where its joint stands still


@dataclass(frozen=True)
class CoordinateFunction:
    """A coordinate that is a function of a joint (id), or of which the joint is a function.

    extent: the range of the coordinate in which the joint is a function of it; None where it is a function of the
    joint, and only follows. turns: whether a coordinate that can be set is known to be an angle. breaks (P - 1,),
    origins (P,), rows (P, degree + 1): the function.
    """

    joint: int
    extent: tuple[float, float] | None
    breaks: Array
    origins: Array
    rows: Array
    turns: bool = False

    @property
    def own(self) -> bool:
        """Whether the joint is there for this coordinate, which can be set."""
        return self.extent is not None

    def value(self, position: float) -> float:
        """Return the coordinate at a position of the joint."""
        if self.extent is None:
            return self._at(position)
        low, high = self.extent
        ends = self._at(low), self._at(high)
        for end, there, other in ((low, *ends), (high, *ends[::-1])):
            if (position - there) * (other - there) <= 0.0:  # at the end or beyond it
                slope = self._at(end, 1)
                return end + (position - there) / slope if slope else end
        return self._inverted(position, low, high, ends[1] > ends[0])

    def position(self, value: float) -> float:
        """Return the position of the joint at a value of a coordinate that can be set."""
        assert self.extent is not None
        near = min(max(value, self.extent[0]), self.extent[1])
        return self._at(near) + (self._at(near, 1) * (value - near) if near != value else 0.0)

    def rate(self, position: float) -> float:
        """Return the derivative of the coordinate with respect to the joint's position."""
        if self.extent is None:
            return self._at(position, 1)
        slope = self._at(min(max(self.value(position), self.extent[0]), self.extent[1]), 1)
        return 1.0 / slope if abs(slope) * STEEPEST > 1.0 else STEEPEST

    def _at(self, x: float, derivative: int = 0) -> float:
        piece = int(np.count_nonzero(self.breaks <= x))
        row = polyder(self.rows[piece], derivative) if derivative else self.rows[piece]
        return float(polyval(x - self.origins[piece], row))

    def _inverted(self, position: float, low: float, high: float, rises: bool) -> float:
        """Return the value in a range at which the joint has a position: Newton's steps where they stay in brackets."""
        x = 0.5 * (low + high)
        for _ in range(200):
            error = self._at(x) - position
            if error == 0.0:
                break
            if (error > 0.0) == rises:
                high = x
            else:
                low = x
            slope = self._at(x, 1)
            after = x - error / slope if slope else low
            if not low < after < high:
                after = 0.5 * (low + high)
            if after in (x, low, high):
                break
            x = after
        return x


def read_coordinate_functions(model: mujoco.MjModel) -> dict[str, CoordinateFunction]:
    """Return the coordinates that tuples declare, by name; `ModelError`, which names the tuple, for a wrong one."""
    found: dict[str, CoordinateFunction] = {}
    for label, elements in _tuples(model, COORDINATE):
        kinds = [kind for kind, _, _ in elements]
        mark = elements[0][2] if elements else 0.0
        own = mark in (LENGTH, ANGLE)
        wanted = [OBJ.mjOBJ_JOINT, OBJ.mjOBJ_NUMERIC] + [OBJ.mjOBJ_NUMERIC] * own
        if kinds != wanted:
            raise ModelError(
                f"tuple '{label}' must list a joint and then a numeric"
                + (
                    f" and, as the joint has prm={mark:g}, a second one with the range of the coordinate"
                    if own
                    else ""
                )
            )
        extent = _extent(model, elements[2][1]) if own else None
        pieces = read_pieces(model, elements[1][1])
        found[label.replace(COORDINATE, "")] = CoordinateFunction(
            elements[0][1], extent, *pieces, mark == ANGLE
        )
    return found


def read_axis_joints(model: mujoco.MjModel) -> set[int]:
    """Return the ids of the joints that are no coordinates; `ModelError` for a tuple that lists something else."""
    found: set[int] = set()
    for label, elements in _tuples(model, AXES):
        if any(kind != OBJ.mjOBJ_JOINT for kind, _, _ in elements):
            raise ModelError(f"tuple '{label}' must list joints")
        found.update(item for _, item, _ in elements)
    return found


def _tuples(model: mujoco.MjModel, word: str) -> list[tuple[str, list[tuple[mujoco.mjtObj, int, float]]]]:
    """Return the tuples with a word in their names: the name, and of each element its type, id and prm."""
    found = []
    for index in range(model.ntuple):
        label = name_of(model, OBJ.mjOBJ_TUPLE, index)
        if word in label:
            first, last = int(model.tuple_adr[index]), int(model.tuple_adr[index] + model.tuple_size[index])
            kinds = map(OBJ, model.tuple_objtype[first:last].tolist())
            ids, marks = model.tuple_objid[first:last].tolist(), model.tuple_objprm[first:last].tolist()
            found.append((label, list(zip(kinds, ids, marks, strict=True))))
    return found


def _extent(model: mujoco.MjModel, numeric: int) -> tuple[float, float]:
    first, size = int(model.numeric_adr[numeric]), int(model.numeric_size[numeric])
    values = model.numeric_data[first : first + size].tolist()
    if len(values) != 2 or not np.isfinite(values).all() or not values[0] < values[1]:
        name = name_of(model, OBJ.mjOBJ_NUMERIC, numeric)
        raise ModelError(f"numeric '{name}' must be the lowest and the highest value of a coordinate")
    return values[0], values[1]
