"""Find why a driven motion differs from OpenSim's, from the muscles at states of OpenSim's own motion."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from mjwrap.osim.verifying.imported import ImportedModel, SampleNumbers
from mjwrap.osim.verifying.reference import MotionNumbers, MotionSample

Array = NDArray[np.float64]
SPEED = 1e-3  # [m/s] by which OpenSim's lengthening speed may miss the rate of its own length
LENGTH = 1e-5  # [m] a difference of lengths that changes a motion
FORCE = 1e-2  # share of the largest generalised force that may be missing where no muscle differs


def driven_cause(imported: ImportedModel, motion: MotionNumbers, until: float) -> str:
    """Return why mjwrap's motion differs from OpenSim's at time `until` [s], or "" where the muscles do not tell.

    The muscles tell if, at states of OpenSim's own motion, one of them contradicts itself in OpenSim or has another
    path, and if forces and accelerations agree at the states where none does.
    """
    compared = [
        (motion.time[sample.frame], sample, imported.at_sample(motion, sample))
        for sample in motion.samples
        if motion.time[sample.frame] <= until
    ]
    plain = [
        ours.missing for _, sample, ours in compared if not _contradicts(sample) and not _apart(sample, ours)
    ]
    missing = _largest(plain)
    if missing > FORCE:
        return ""
    found = [text for text in (_contradiction(compared), _other_paths(compared)) if text]
    if found and np.isfinite(missing):
        found.append(
            f"at {len(plain)} states where no muscle differs, forces and accelerations agree within {missing:.1g}"
        )
    return "; ".join(found)


Compared = list[tuple[float, MotionSample, SampleNumbers]]


def _largest(values: Iterable[float]) -> float:
    return max((v for v in values if np.isfinite(v)), default=float("nan"))


def _contradicts(sample: MotionSample) -> dict[str, float]:
    """Return the muscles whose speed in OpenSim is not the rate of their length, and by how much [m/s]."""
    gaps = {name: abs(sample.velocities[name] - sample.lengthening[name]) for name in sample.lengths}
    return {name: gap for name, gap in gaps.items() if gap > SPEED}


def _apart(sample: MotionSample, ours: SampleNumbers) -> dict[str, float]:
    """Return the muscles whose lengths differ, and by how much [m]."""
    gaps = {name: length - sample.lengths[name] for name, length in ours.lengths.items()}
    return {name: gap for name, gap in gaps.items() if abs(gap) > LENGTH}


def _contradiction(compared: Compared) -> str:
    gaps = [(gap, name, time) for time, sample, _ in compared for name, gap in _contradicts(sample).items()]
    if not gaps:
        return ""
    gap, name, time = max(gaps)
    return f"OpenSim's lengthening speed of {name} is not the rate of its own length: {gap:.2g} m/s apart at {time:g} s"


def _other_paths(compared: Compared) -> str:
    """Return which muscle's tension differs most because its path does; "" if that does not bring the motions apart."""
    gaps = [
        (abs(ours.tensions[name] - sample.tensions[name]), name, gap, time)
        for time, sample, ours in compared
        for name, gap in _apart(sample, ours).items()
    ]
    if not gaps:
        return ""
    tension, name, gap, time = max(gaps)
    text = (
        f"paths differ: at OpenSim's own state at {time:g} s that of {name} is {1e3 * abs(gap):.2g} mm "
        f"{'longer' if gap > 0 else 'shorter'} in mjwrap, and its tension differs by {tension:.2g} N"
    )
    changed = [ours for _, sample, ours in compared if _apart(sample, ours) and not _contradicts(sample)]
    own, theirs = _largest(o.missing for o in changed), _largest(o.missing_with_theirs for o in changed)
    if np.isfinite(own):
        text += (
            f"; forces and accelerations differ by {100 * own:.2g} %, and with OpenSim's tensions by "
            f"{100 * theirs:.2g} %"
        )
        if theirs > 0.5 * own:
            return ""
    return text
