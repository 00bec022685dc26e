"""Find why a driven motion differs from OpenSim's, from the muscles at states of OpenSim's own motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mjwrap.osim.verifying.imported import ImportedModel
from mjwrap.osim.verifying.reference import MotionNumbers

Array = NDArray[np.float64]
SPEED = 1e-3  # [m/s] by which OpenSim's lengthening speed may miss the rate of its own length
LENGTH = 1e-5  # [m] a difference of lengths that changes a motion
FORCE = 1e-2  # share of the largest generalised force that may be missing where no muscle differs


@dataclass(frozen=True)
class DrivenCause:
    """Why a driven motion differs.

    text: the reason, "" if none was found. agreeing: number of samples at which all muscles have OpenSim's lengths, and
    speeds that are the rate of these. missing: the largest share of the generalised forces that OpenSim's accelerations
    lack there, NaN where it cannot be computed.
    """

    text: str
    agreeing: int
    missing: float


def driven_cause(imported: ImportedModel, motion: MotionNumbers) -> DrivenCause:
    """Compare the muscles and the equations of motion at OpenSim's states."""
    speeds: dict[str, tuple[float, float]] = {}  # by muscle: largest gap of speeds, and the time
    lengths: dict[str, tuple[float, float, float]] = {}  # gap of lengths and of tensions, and the time
    agreeing, missing = 0, 0.0
    for sample in motion.samples:
        time = motion.time[sample.frame]
        ours = imported.at_sample(motion, sample)
        agree = True
        for name, length in ours.lengths.items():
            speed = abs(sample.velocities[name] - sample.lengthening[name])
            if speed > SPEED:
                speeds[name] = max(speeds.get(name, (0.0, 0.0)), (speed, time))
            gap = length - sample.lengths[name]
            if abs(gap) > LENGTH:
                tension = ours.tensions[name] - sample.tensions[name]
                lengths[name] = max(lengths.get(name, (0.0, 0.0, 0.0)), (gap, tension, time), key=_size)
            agree = agree and speed <= SPEED and abs(gap) <= LENGTH
        if agree:
            agreeing += 1
            missing = max(missing, ours.missing)
    text = ""
    if not missing > FORCE:
        text = _text(speeds, lengths, missing, agreeing)
    return DrivenCause(text, agreeing, missing)


def _size(gap: tuple[float, float, float]) -> float:
    return abs(gap[0])


def _text(
    speeds: dict[str, tuple[float, float]],
    lengths: dict[str, tuple[float, float, float]],
    missing: float,
    agreeing: int,
) -> str:
    found = []
    if speeds:
        name = max(speeds, key=lambda n: speeds[n])
        gap, time = speeds[name]
        found.append(
            f"OpenSim's lengthening speed of {name} is not the rate of its own length: {gap:.2g} m/s apart at {time:g} s"
        )
    if lengths:
        name = max(lengths, key=lambda n: abs(lengths[n][1]))
        gap, tension, time = lengths[name]
        found.append(
            f"paths differ: at OpenSim's own state at {time:g} s {name} is {1e3 * gap:+.2g} mm longer, and its tension "
            f"{tension:+.2g} N larger"
        )
    if found and agreeing and missing == missing:
        found.append(f"where no muscle differs, forces and accelerations agree within {missing:.1g}")
    return "; ".join(found)
