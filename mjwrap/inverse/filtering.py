"""Zero-phase low-pass filters for columns over time."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mjwrap import validation
from mjwrap.errors import StateError

Array = NDArray[np.float64]
UNEVEN = 1e-3  # largest difference of a time step from the mean, relative: times in files are rounded


def check_filter(time: Array, cutoff: float, order: int) -> None:
    """Raise `StateError` unless a low-pass filter with a cut-off [Hz] can be applied at these times [s]."""
    validation.positive(cutoff, "cutoff", StateError, "Hz")
    validation.whole(order, 1, "order", StateError)
    if len(time) < 2:
        raise StateError("cutoff: a motion of a single time cannot be filtered")
    steps = np.diff(time)
    mean = float(steps.mean())
    worst = int(np.argmax(np.abs(steps - mean)))
    if abs(steps[worst] - mean) > UNEVEN * mean:
        raise StateError(
            f"cutoff: a filter needs evenly spaced times; the step at {time[worst]:g} s is {steps[worst]:g} s, the "
            f"mean {mean:g} s: resample the motion first"
        )
    if cutoff >= 0.5 / mean:
        raise StateError(
            f"cutoff: {cutoff:g} Hz is not below half the sampling rate, {0.5 / mean:g} Hz: nothing would be filtered"
        )
    if len(time) <= _padding(order):
        raise StateError(
            f"cutoff: a filter of order {order} needs more than {_padding(order)} times, not {len(time)}"
        )


def low_pass(time: Array, values: Array, cutoff: float, order: int) -> Array:
    """Return columns (T, m) after a Butterworth filter that runs forwards and backwards; see `check_filter`."""
    from scipy.signal import butter, sosfiltfilt

    rate = (len(time) - 1) / (time[-1] - time[0])
    sections = butter(order, cutoff, fs=rate, output="sos")
    return np.ascontiguousarray(sosfiltfilt(sections, values, axis=0, padlen=_padding(order)))


def _padding(order: int) -> int:
    """Return by how many samples, mirrored at a point, the ends are continued."""
    return 3 * (order + 1)
