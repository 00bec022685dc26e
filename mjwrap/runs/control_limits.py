"""Warn of excitations outside the controls that a muscle or actuator takes, such as percents."""

from __future__ import annotations

import warnings

import mujoco
import numpy as np

from mjwrap.mjcf.actuators import is_muscle
from mjwrap.runs.excitation import Excitation, control_names
from mjwrap.runs.signals import Constant, Pulse, Samples, Signal, Sine, Step, Wander
from mjwrap.system import MuscleSystem, kinds
from mjwrap.text import few

_FREE = (-np.inf, np.inf)
_MUSCLE = (0.0, 1.0)
_ROUNDING = 1e-9  # by which a value may be outside, as a share of the range's ends


def check_levels(muscles: MuscleSystem, excitation: Excitation, stacklevel: int = 3) -> None:
    """Warn once of the signals that leave the range of their control, 0 to 1 for a muscle; those alike together.

    Zero is the rest of a muscle, also where its least activation is a little above.
    """
    ranges, kind = _ranges(muscles), kinds(muscles)
    told: dict[tuple[str, tuple[float, float]], list[str]] = {}
    for name, signal in excitation.signals.items():
        low, high = ends = ranges[name]
        if outside := _outside(_extent(signal), (min(low, 0.0) if kind.get(name) == "muscle" else low, high)):
            told.setdefault((outside, ends), []).append(f"'{name}'")
    for (outside, (low, high)), names in told.items():
        warnings.warn(
            f"the excitation of {few(names)} {outside}, outside its range of control, {low:g} to {high:g}, and is "
            f"clipped to it; {_remedy((low, high), outside)}",
            stacklevel=stacklevel,
        )


def _outside(extent: tuple[float, float], ends: tuple[float, float]) -> str:
    """Return in words which values of a signal are outside a range, empty if none is."""
    (lowest, highest), (low, high) = extent, ends
    below, above = lowest < low - _ROUNDING * abs(low), highest > high + _ROUNDING * abs(high)
    if below and above and lowest < highest:
        return f"goes from {lowest:g} to {highest:g}"
    if above:
        return f"reaches {highest:g}"
    return f"falls to {lowest:g}" if below else ""


def _remedy(ends: tuple[float, float], outside: str) -> str:
    if ends != _MUSCLE:
        return (
            "a control is in the units of its actuator, such as m for a servo of a length; see its ctrlrange"
        )
    if outside.startswith("reaches"):
        return "if these are percents, divide them by 100"
    return "a sine between 0 and 1 needs an offset: sine:0.5,1,0.5"


def _ranges(muscles: MuscleSystem) -> dict[str, tuple[float, float]]:
    """Return the least and the largest control by the name of the control or muscle; infinite without a limit."""
    model = muscles.model
    names, alone = control_names(model), [m for m in muscles.declarations if m.actuator < 0]
    found = {m.name: _MUSCLE if m.parameters.states else _FREE for m in alone}
    for actuator in range(model.nactuator):
        first = int(model.actuator_ctrladr[actuator])
        for place in range(first, first + int(model.actuator_ctrlnum[actuator])):
            limited = bool(np.ravel(model.actuator_ctrllimited)[place])
            low, high = model.actuator_ctrlrange[place].tolist() if limited else _FREE
            muscle = int(model.actuator_dyntype[actuator]) == int(mujoco.mjtDyn.mjDYN_MUSCLE)
            if muscle and is_muscle(model, actuator):
                low, high = max(low, _MUSCLE[0]), min(high, _MUSCLE[1])
            found[names[place]] = low, high
    return found


def _extent(signal: Signal) -> tuple[float, float]:
    """Return the least and the largest value that a signal takes in a long run."""
    if isinstance(signal, Constant):
        return signal.level, signal.level
    if isinstance(signal, Step):
        before = 0.0 if signal.start > 0.0 else signal.level
        return min(before, signal.level), max(before, signal.level)
    if isinstance(signal, Sine):
        return signal.offset - abs(signal.amplitude), signal.offset + abs(signal.amplitude)
    if isinstance(signal, Pulse):
        return min(0.0, signal.peak), max(0.0, signal.peak)
    if isinstance(signal, Samples):
        return float(signal.values.min()), float(signal.values.max())
    return (0.0, 1.0) if isinstance(signal, Wander) else _FREE
