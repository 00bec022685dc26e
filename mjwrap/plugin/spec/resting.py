"""Actuators whose muscles mjwrap pulls and whose tendons are dropped: MuJoCo computes no force that is to be zero.

They go on having activations. In the model that `install` returns their gain and bias are constants, and a mark in the
last of `dynprm`, which MuJoCo's muscles do not read, says so: a copy of the model, or its MJB, knows it too.
"""

from __future__ import annotations

import mujoco
import numpy as np

_PULLS = int(mujoco.mjtTrn.mjTRN_TENDON)
_MUSCLE_DYNAMICS = int(mujoco.mjtDyn.mjDYN_MUSCLE)
_CURVES = int(mujoco.mjtGain.mjGAIN_MUSCLE), int(mujoco.mjtBias.mjBIAS_MUSCLE)
_NO_CURVES = int(mujoco.mjtGain.mjGAIN_FIXED), int(mujoco.mjtBias.mjBIAS_NONE)
_RESTS = 1.0


def _dropped(model: mujoco.MjModel, kinds: tuple[int, int], mark: float) -> list[int]:
    """Return the muscle actuators on dropped tendons with these kinds of gain and bias and this mark."""
    return [
        actuator
        for actuator in np.flatnonzero(model.actuator_trntype == _PULLS).tolist()
        if model.tendon_num[model.actuator_trnid[actuator, 0]] == 0
        and (model.actuator_gaintype[actuator], model.actuator_biastype[actuator]) == kinds
        and model.actuator_dyntype[actuator] == _MUSCLE_DYNAMICS
        and model.actuator_dynprm[actuator, -1] == mark
    ]


def rest_actuators(model: mujoco.MjModel, hushed: tuple[float, float]) -> None:
    """Let actuators on dropped tendons, whose force range `hushed` makes their force zero, compute none."""
    for actuator in _dropped(model, _CURVES, 0.0):
        if model.actuator_forcelimited[actuator] and tuple(model.actuator_forcerange[actuator]) == hushed:
            model.actuator_gaintype[actuator], model.actuator_biastype[actuator] = _NO_CURVES
            model.actuator_dynprm[actuator, -1] = _RESTS
            model.actuator_forcerange[actuator] = 0.0


def wake_actuators(model: mujoco.MjModel) -> None:
    """Give actuators that rest their curves back; their force stays zero. Before the tendons are given their stops."""
    for actuator in _dropped(model, _NO_CURVES, _RESTS):
        model.actuator_gaintype[actuator], model.actuator_biastype[actuator] = _CURVES
        model.actuator_dynprm[actuator, -1] = 0.0
