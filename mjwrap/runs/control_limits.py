"""Warn of excitations above the largest control that a muscle or actuator takes, such as percents."""

from __future__ import annotations

import warnings

import mujoco
import numpy as np

from mjwrap.mjcf.actuators import is_muscle
from mjwrap.runs.excitation import Excitation, control_names
from mjwrap.runs.signals import Constant, Pulse, Samples, Signal, Sine, Step


def check_levels(model: mujoco.MjModel, excitation: Excitation) -> None:
    """Warn once for each level of a signal that is above the control's range, 0 to 1 for a muscle."""
    highest = _highest(model)
    told: dict[tuple[float, float], list[str]] = {}
    for name, signal in excitation.signals.items():
        peak, most = _peak(signal), highest.get(name, 1.0)  # 1: a muscle without an actuator
        if peak > most + 1e-9 * abs(most):
            told.setdefault((peak, most), []).append(name)
    for (peak, most), names in told.items():
        whose = f"'{names[0]}'" + (f" and {len(names) - 1} more" if len(names) > 1 else "")
        remedy = (
            "if these are percents, divide them by 100"
            if most == 1.0
            else "its control is in the units of its actuator, such as m for a servo of a length; see its ctrlrange"
        )
        warnings.warn(
            f"the excitation of {whose} reaches {peak:g}, which acts like {most:g}, the largest control; {remedy}",
            stacklevel=3,
        )


def _highest(model: mujoco.MjModel) -> dict[str, float]:
    """Return the largest control of every actuator that limits its control, by the control's name."""
    found: dict[str, float] = {}
    names = control_names(model)
    for actuator in range(model.nactuator):
        first = int(model.actuator_ctrladr[actuator])
        for place in range(first, first + int(model.actuator_ctrlnum[actuator])):
            limited = bool(np.ravel(model.actuator_ctrllimited)[place])
            high = float(model.actuator_ctrlrange[place, 1]) if limited else np.inf
            muscle = int(model.actuator_dyntype[actuator]) == int(mujoco.mjtDyn.mjDYN_MUSCLE)
            found[names[place]] = min(high, 1.0) if muscle and is_muscle(model, actuator) else high
    return found


def _peak(signal: Signal) -> float:
    """Return the largest value of a signal; a random one stays below 1."""
    if isinstance(signal, Constant | Step):
        return signal.level
    if isinstance(signal, Sine):
        return signal.offset + abs(signal.amplitude)
    if isinstance(signal, Pulse):
        return signal.peak
    return float(signal.values.max()) if isinstance(signal, Samples) else -np.inf
