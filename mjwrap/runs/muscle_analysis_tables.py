"""Tables in the layout of OpenSim's MuscleAnalysis: a file for each quantity, a column for each muscle."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.files import RowWriter
from mjwrap.files.atomic import PartFile
from mjwrap.mjcf import dof_names
from mjwrap.model.kinematic_tree import crossed_dofs
from mjwrap.system import MuscleSystem

Array = NDArray[np.float64]


class _Part(NamedTuple):
    """One file: its output, its writer, and the function that reads its numbers at a sample."""

    output: PartFile
    writer: RowWriter
    read: Callable[[Array], Array]


class MuscleAnalysisTables:
    """Write a row to every file for every sample.

    Length, FiberLength (of muscles whose law has fibres) and TendonForce; MomentArm_JOINT, −∂l/∂q, for every degree
    of freedom that a muscle spans, 0 for muscles that do not span it. SI units. The files are called
    PREFIX_MuscleAnalysis_QUANTITY.sto. open_file: opens the `PartFile` of such a name. Raises `RecordingError` if a
    file cannot be written.
    """

    def __init__(
        self,
        prefix: str,
        model: mujoco.MjModel,
        muscles: MuscleSystem,
        open_file: Callable[[str], PartFile] = lambda path: PartFile(path, ".sto"),
    ) -> None:
        self._muscles = muscles
        self._open = open_file
        self._parts: list[_Part] = []
        names, dofs = muscles.names, dof_names(model)
        fibers = [i for i, m in enumerate(muscles.declarations) if hasattr(m.parameters, "tendon")]
        moved = np.flatnonzero(crossed_dofs(model, muscles.declarations).any(axis=0)).tolist()
        self._add(prefix, "Length", names, lambda _: muscles.length)
        if fibers:
            with_fibers = [names[i] for i in fibers]
            self._add(prefix, "FiberLength", with_fibers, lambda _: muscles.fiber_length[fibers])
        self._add(prefix, "TendonForce", names, lambda _: muscles.tension)
        for dof in moved:
            self._add(prefix, f"MomentArm_{dofs[dof]}", names, lambda jacobian, d=dof: -jacobian[:, d])

    def _add(self, prefix: str, quantity: str, names: list[str], read: Callable[[Array], Array]) -> None:
        path = f"{prefix}_MuscleAnalysis_{quantity.replace('/', '_')}.sto"
        output = self._open(path)
        with output.writing():
            writer = RowWriter(output.open_text(), ".sto", names, {"header": quantity})
        self._parts.append(_Part(output, writer, read))

    def log(self, data: mujoco.MjData) -> None:
        """Write the results at the present state."""
        jacobian = self._muscles.length_jacobian(data)
        for part in self._parts:
            with part.output.writing():
                part.writer.add(data.time, part.read(jacobian))

    def close(self) -> None:
        """Complete the files and give them their names."""
        for part in self._parts:
            with part.output.writing():
                part.writer.finish()
            part.output.publish()
