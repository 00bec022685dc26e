"""Forces and torques on bodies that are measured over time, such as ground reactions."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from typing import overload

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap import validation
from mjwrap.errors import ModelError, SignalError
from mjwrap.files import Table
from mjwrap.inverse.external_force import ExternalForce
from mjwrap.inverse.external_load_files import read_external_loads
from mjwrap.mjcf import names
from mjwrap.mjcf.names import listed
from mjwrap.text import nearest

Array = NDArray[np.float64]
GROUND = ("ground", "world")


class ExternalLoads(Sequence[ExternalForce]):
    """External forces that act on a model, for `inverse_dynamics`.

    Args:
        forces: the external forces.

    Raises:
        SignalError: something else is given.
    """

    def __init__(self, forces: Iterable[ExternalForce]) -> None:
        good = isinstance(forces, Iterable) and not isinstance(forces, str | bytes)
        found = tuple(forces) if good else ()
        good = good and all(isinstance(force, ExternalForce) for force in found)
        validation.require(good, "forces", "a list of mw.ExternalForce", forces, SignalError)
        self._forces = found

    def __len__(self) -> int:
        return len(self._forces)

    @overload
    def __getitem__(self, index: int) -> ExternalForce: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[ExternalForce, ...]: ...
    def __getitem__(self, index: int | slice) -> ExternalForce | tuple[ExternalForce, ...]:
        return self._forces[index]

    def __repr__(self) -> str:
        return (
            f"ExternalLoads({', '.join(f'{f.name or f.body} on {f.body}' for f in self._forces) or 'none'})"
        )

    @classmethod
    def from_osim(
        cls, path: str | os.PathLike[str], table: Table | None = None, *, interpolation: str = "cubic"
    ) -> ExternalLoads:
        """Read OpenSim's ExternalLoads from its .xml file, and the data from the file that it names, or from a table.

        Forces that are switched off (appliesForce, or isDisabled in older files) are left out.

        Args:
            path: the .xml file; its <datafile> is looked up beside it.
            table: the data, in place of that file.
            interpolation: of the data between its times, as for `ExternalForce`.

        Raises:
            OsimError: the file cannot be read, or lacks something; the message names file, line and element.
            TableError: the data cannot be read, or lack columns.
        """
        return cls(read_external_loads(path, table, interpolation))


class LoadFrames:
    """External loads at the frames of a motion, ready to be added to generalised forces.

    Raises `ModelError` for a body that the model does not have, `StateError` for times that a load does not cover.
    """

    def __init__(self, model: mujoco.MjModel, loads: ExternalLoads, time: Array) -> None:
        self._model = model
        self._parts = [
            (
                _body(model, load, load.body),
                _body(model, load, load.force_frame),
                _body(model, load, load.point_frame),
                *load.at(time),
            )
            for load in loads
        ]

    def add(self, data: mujoco.MjData, k: int, qfrc: Array) -> None:
        """Add Jᵀ of the forces of frame k to qfrc (nv,); data has the kinematics and cdof of this frame."""
        for body, force, torque, at in self._in_world(data, k):
            mujoco.mj_applyFT(self._model, data, force, torque, at, body, qfrc)

    def add_to_bodies(self, data: mujoco.MjData, k: int, xfrc: Array) -> None:
        """Add the forces of frame k to xfrc (nbody, 6), as of `xfrc_applied`; data has the kinematics of this frame."""
        for body, force, torque, at in self._in_world(data, k):
            xfrc[body, :3] += force
            xfrc[body, 3:] += torque + np.cross(at - data.xipos[body], force)

    def _in_world(self, data: mujoco.MjData, k: int) -> Iterator[tuple[int, Array, Array, Array]]:
        """Yield the body, force, torque and point of application of each load, in the world."""
        for body, axes, frame, force, point, torque in self._parts:
            turn = data.xmat[axes].reshape(3, 3)
            at = data.xpos[body]
            if point is not None:
                at = data.xpos[frame] + data.xmat[frame].reshape(3, 3) @ point[k]
            yield body, turn @ force[k], turn @ torque[k], at


def _body(model: mujoco.MjModel, load: ExternalForce, name: str) -> int:
    if name in GROUND:
        return 0
    known = names(model, mujoco.mjtObj.mjOBJ_BODY, model.nbody)
    if name not in known:
        raise ModelError(f"{load.label}: no body '{name}'{nearest(name, known)}; bodies: {listed(known)}")
    return known.index(name)
