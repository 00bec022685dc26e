"""The cables of a model, MuJoCo's own actuators on spatial tendons, as a table and as values for JSON."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.calibration import LengthRange
from mjwrap.cli.inspect.declared import path_text
from mjwrap.mjcf import name_of
from mjwrap.system import CableSystem
from mjwrap.text import aligned

_GAIN, _BIAS, _DYN = mujoco.mjtGain, mujoco.mjtBias, mujoco.mjtDyn
_HEAD = ("cable", "actuator", "tendon", "gear", "control", "force [N]", "length [mm]", "range [mm]", "path")
_WORDS = (0, 1, 2, 8)  # columns that hold no numbers


def kind(model: mujoco.MjModel, actuator: int) -> str:
    """Return the element by which an actuator could be written in MJCF: motor, position, velocity, damper, general."""
    if int(model.actuator_plugin[actuator]) >= 0:
        return "plugin"
    gain, bias = int(model.actuator_gaintype[actuator]), int(model.actuator_biastype[actuator])
    g, b = model.actuator_gainprm[actuator], model.actuator_biasprm[actuator]
    dynamics = int(model.actuator_dyntype[actuator])
    integrated = dynamics == int(_DYN.mjDYN_INTEGRATOR)
    smooth = dynamics in (int(_DYN.mjDYN_NONE), int(_DYN.mjDYN_FILTEREXACT), int(_DYN.mjDYN_FILTER))
    if not (smooth or integrated):
        return "general"
    if gain == int(_GAIN.mjGAIN_AFFINE) and g[2] < 0.0 and not g[:2].any() and bias == int(_BIAS.mjBIAS_NONE):
        return "damper"
    if gain != int(_GAIN.mjGAIN_FIXED):
        return "general"
    if bias == int(_BIAS.mjBIAS_NONE) and dynamics == int(_DYN.mjDYN_NONE) and g[0] == 1.0:
        return "motor"
    if bias == int(_BIAS.mjBIAS_AFFINE) and b[0] == 0.0 and g[0] > 0.0:
        if b[1] == -g[0]:
            return "intvelocity" if integrated else "position"
        if b[1] == 0.0 and b[2] == -g[0] and not integrated:
            return "velocity"
    return "general"


def cable_rows(
    model: mujoco.MjModel,
    muscles: CableSystem,
    rest: NDArray[np.float64],
    ranges: Mapping[str, LengthRange],
) -> list[dict[str, Any]]:
    """Return the cables as values; rest (nq,): pose at which lengths are given [m]; NaN without a path."""
    data = mujoco.MjData(muscles.model)
    data.qpos[:] = rest
    muscles.forward(data)
    lengths = np.where(muscles.held, np.nan, muscles.length)
    found = []
    for i, muscle in enumerate(muscles.declarations):
        if muscle.name not in muscles.cables:
            continue
        a, known = muscle.actuator, ranges.get(muscle.name)
        control = int(model.actuator_ctrladr[a]) if int(model.actuator_ctrlnum[a]) else -1
        limited = control >= 0 and bool(model.actuator_ctrllimited[control])
        forced = bool(model.actuator_forcelimited[a])
        found.append(
            {
                "name": muscle.name,
                "actuator": kind(model, a),
                "tendon": name_of(model, mujoco.mjtObj.mjOBJ_TENDON, muscle.tendon),
                "gear": float(model.actuator_gear[int(model.actuator_outadr[a]), 0]),
                "control": model.actuator_ctrlrange[control].tolist() if limited else None,
                "force": model.actuator_forcerange[a].tolist() if forced else None,
                "length": float(lengths[i]),
                "length_range": [known.shortest, known.longest] if known and not known.held else None,
                "path": " | ".join(path_text(model, route) for route in muscle.routes),
            }
        )
    return found


def cable_table(rows: list[dict[str, Any]]) -> str:
    """Return a line for each cable."""
    cells = [
        (
            row["name"], row["actuator"], row["tendon"], f"{row['gear']:g}", _range(row["control"]),
            _range(row["force"]), _number(1e3 * row["length"]), _range(row["length_range"], 1e3), row["path"],
        )
        for row in rows
    ]  # fmt: skip
    return "\n".join(aligned([_HEAD, *cells], _WORDS))


def _number(value: float) -> str:
    return f"{value:.4g}" if math.isfinite(value) else "-"


def _range(ends: list[float] | None, scale: float = 1.0) -> str:
    return "-" if ends is None else " to ".join(_number(scale * end) for end in ends)
