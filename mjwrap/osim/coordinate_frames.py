"""Set the coordinates of a model at many times, with everything that follows them."""

from __future__ import annotations

from collections.abc import Mapping

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.errors import StateError
from mjwrap.mjcf import qpos_names
from mjwrap.mjcf.coordinate_functions import read_coordinate_functions
from mjwrap.mjcf.couplings import CoupledJoints

Array = NDArray[np.float64]


class CoordinateFrames:
    """The mechanism of `set_coordinates` for motions: poses from coordinates over time.

    Attributes:
        functions: coordinates that are functions of a joint, by name.
        couplings: joints that follow others.
    """

    def __init__(self, model: mujoco.MjModel) -> None:
        self._model = model
        self.functions = read_coordinate_functions(model)
        self.couplings = CoupledJoints(model)
        self._places = {name: i for i, name in enumerate(qpos_names(model))}

    def place(self, values: Mapping[str, Array], count: int) -> Array:
        """Return poses (count, nq) with values (count,) by entry of qpos or coordinate; others are those of qpos0.

        Raises `StateError` for a coordinate without such a value.
        """
        qpos = np.tile(self._model.qpos0, (count, 1))
        for name, column in values.items():
            if name in self._places:
                qpos[:, self._places[name]] = column
                continue
            function = self.functions.get(name)
            if function is None or not function.own:
                raise StateError(f"no coordinate '{name}' that can be set")
            at = int(self._model.jnt_qposadr[function.joint])
            qpos[:, at] = [function.position(float(value)) for value in column]
        columns = np.ascontiguousarray(qpos.T)
        self.couplings.place(columns)
        return np.ascontiguousarray(columns.T)

    def values(self, name: str, qpos: Array) -> Array:
        """Return the values (T,) of an entry of qpos, or a coordinate, at poses (T, nq)."""
        if name in self._places:
            return qpos[:, self._places[name]]
        function = self.functions[name]
        column = qpos[:, int(self._model.jnt_qposadr[function.joint])]
        return np.array([function.value(float(x)) for x in column])
