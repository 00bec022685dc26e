"""Tables in the layout of OpenSim's MuscleAnalysis and ProbeReporter: a file for each quantity."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.files import RowWriter
from mjwrap.files.atomic import PartFile
from mjwrap.mjcf import dof_names
from mjwrap.mjcf.couplings import CoupledJoints
from mjwrap.muscles.energetics import Energetics, Umberger2010, basal_power
from mjwrap.muscles.fibers import FiberState
from mjwrap.system import MuscleSystem
from mjwrap.system.moment_arms import arms_of_all_dofs, moved_muscles

Array = NDArray[np.float64]


class _Sample(NamedTuple):
    """What the files are written from: moment arms (n, nv) [m], fibres, powers, and length, tension (n,)."""

    arms: Array
    fibers: FiberState
    energy: Energetics
    length: Array
    tension: Array


Read = Callable[[_Sample], Array]

# OpenSim's names of the files that have a column for every muscle
WHOLE: dict[str, Read] = {
    "Length": lambda s: s.length,
    "TendonForce": lambda s: s.tension,
    "MuscleActuatorPower": lambda s: s.energy.muscle_power,
}
# and of those that have one for every muscle with a fibre
FIBERS: dict[str, Read] = {
    "FiberLength": lambda s: s.fibers.length,
    "NormalizedFiberLength": lambda s: s.fibers.normalized_length,
    "FiberVelocity": lambda s: s.fibers.velocity,
    "NormFiberVelocity": lambda s: s.fibers.normalized_velocity,
    "PennationAngle": lambda s: s.fibers.pennation,
    "PennationAngularVelocity": lambda s: s.fibers.pennation_rate,
    "TendonLength": lambda s: s.fibers.tendon_length,
    "FiberForce": lambda s: s.fibers.force,
    "ActiveFiberForce": lambda s: s.fibers.active_force,
    "PassiveFiberForce": lambda s: s.fibers.passive_force,
    "ActiveFiberForceAlongTendon": lambda s: s.fibers.active_force_along_tendon,
    "PassiveFiberForceAlongTendon": lambda s: s.fibers.passive_force_along_tendon,
    "FiberActivePower": lambda s: s.energy.active_power,
    "FiberPassivePower": lambda s: s.energy.passive_power + s.energy.damping_power,
    "TendonPower": lambda s: s.energy.tendon_power,
}
METABOLICS = "metabolics"  # OpenSim's name of the probe: the beginning of its columns


class _Part(NamedTuple):
    """One file: its output, its writer, and the function that reads its numbers at a sample."""

    output: PartFile
    writer: RowWriter
    read: Read


class MuscleAnalysisTables:
    """Write a row to every file for every sample.

    The files PREFIX_MuscleAnalysis_QUANTITY.sto are those of `WHOLE` and `FIBERS`, and MomentArm_JOINT and
    Moment_JOINT for every degree of freedom that moves a muscle, 0 for muscles that it does not move. Moment arms are
    −dl/dq with coupled joints moved along, as in OpenSim; about a joint that follows another one they are −∂l/∂q alone.
    PREFIX_ProbeReporter_probes.sto has the metabolic power [W] of OpenSim's Umberger2010MuscleMetabolicsProbe with its
    default constants: metabolics_TOTAL, metabolics_BASAL and metabolics_MUSCLE. SI units, angles in rad. open_file:
    opens the `PartFile` of such a name. Raises `RecordingError` if a file cannot be written.
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
        self._couplings = CoupledJoints(model)
        self._parts: list[_Part] = []
        names, dofs = muscles.names, dof_names(model)
        fibers = [i for i, m in enumerate(muscles.declarations) if hasattr(m.parameters, "tendon")]
        for quantity, read in WHOLE.items():
            self._add(f"{prefix}_MuscleAnalysis", quantity, names, read)
        for quantity, read in FIBERS.items() if fibers else ():
            with_fibers = [names[i] for i in fibers]
            self._add(f"{prefix}_MuscleAnalysis", quantity, with_fibers, _only(read, fibers))
        for dof in self._moving(model):
            name = dofs[dof].replace("/", "_")
            self._add(f"{prefix}_MuscleAnalysis", f"MomentArm_{name}", names, lambda s, d=dof: s.arms[:, d])
            self._add(
                f"{prefix}_MuscleAnalysis", f"Moment_{name}", names, lambda s, d=dof: s.arms[:, d] * s.tension
            )
        if fibers:
            basal = basal_power(float(model.body_mass.sum()))
            heads = [f"{METABOLICS}_{name}" for name in ("TOTAL", "BASAL", *(names[i] for i in fibers))]

            def metabolic(sample: _Sample) -> Array:
                power = sample.energy.metabolic_power[fibers]
                return np.concatenate([[power.sum() + basal, basal], power])

            self._add(f"{prefix}_ProbeReporter", "probes", heads, metabolic)

    def _moving(self, model: mujoco.MjModel) -> list[int]:
        """Return the degrees of freedom that move a muscle, alone or with those that follow them."""
        moved = moved_muscles(model, self._couplings, self._muscles.declarations)
        return np.flatnonzero(moved.any(axis=0)).tolist()

    def _add(self, prefix: str, quantity: str, names: list[str], read: Read) -> None:
        output = self._open(f"{prefix}_{quantity}.sto")
        with output.writing():
            writer = RowWriter(output.open_text(), ".sto", names, {"header": quantity})
        self._parts.append(_Part(output, writer, read))

    def log(self, data: mujoco.MjData) -> None:
        """Write the results at the present state."""
        muscles, couplings = self._muscles, self._couplings
        arms = arms_of_all_dofs(couplings, muscles.length_jacobian(data), data.qpos)
        energy = muscles.energetics(Umberger2010())
        sample = _Sample(arms, muscles.fiber_state(), energy, muscles.length, muscles.tension)
        for part in self._parts:
            with part.output.writing():
                part.writer.add(data.time, part.read(sample))

    def close(self) -> None:
        """Complete the files and give them their names."""
        for part in self._parts:
            with part.output.writing():
                part.writer.finish()
            part.output.publish()


def _only(read: Read, muscles: list[int]) -> Read:
    return lambda sample: read(sample)[muscles]
