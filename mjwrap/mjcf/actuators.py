"""Decide which native actuators mjwrap can take over, and read their muscle curves.

Most fields of an actuator are indexed by its id. Some actuators have several controls and outputs, so the fields of
these (control limits; gear, length range, acc0) are indexed by `actuator_ctrladr` and `actuator_outadr`.
"""

from __future__ import annotations

import mujoco
import numpy as np

from mjwrap.errors import ModelError
from mjwrap.kernels.musculotendon import actearly
from mjwrap.mjcf.inside import end_is_inside, is_inside_at_keyframes, side_is_inside
from mjwrap.mjcf.names import name_of
from mjwrap.mjcf.routes import geoms_of, tendon_stops
from mjwrap.muscles.laws import MuJoCoMuscle

OBJ = mujoco.mjtObj
_GAINS = [
    int(g) for g in (mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtGain.mjGAIN_AFFINE, mujoco.mjtGain.mjGAIN_MUSCLE)
]
_BIASES = [
    int(b) for b in (mujoco.mjtBias.mjBIAS_NONE, mujoco.mjtBias.mjBIAS_AFFINE, mujoco.mjtBias.mjBIAS_MUSCLE)
]

_NO_BIAS, _MUSCLE_BIAS = int(mujoco.mjtBias.mjBIAS_NONE), int(mujoco.mjtBias.mjBIAS_MUSCLE)
_DYN = mujoco.mjtDyn
# dyntypes whose next activation the kernels can compute: actuators with `actearly` use the next activation
ACTEARLY_DYNAMICS = {
    int(_DYN.mjDYN_INTEGRATOR): actearly.INTEGRATOR,
    int(_DYN.mjDYN_FILTER): actearly.FILTER,
    int(_DYN.mjDYN_FILTEREXACT): actearly.FILTER_EXACT,
    int(_DYN.mjDYN_MUSCLE): actearly.MUSCLE,
}


def is_muscle(model: mujoco.MjModel, actuator: int) -> bool:
    """Return whether an actuator has MuJoCo's muscle gain."""
    return int(model.actuator_gaintype[actuator]) == int(mujoco.mjtGain.mjGAIN_MUSCLE)


def pulled_tendon(model: mujoco.MjModel, actuator: int) -> int:
    """Return the spatial tendon that an actuator pulls, or -1."""
    if int(model.actuator_trntype[actuator]) != int(mujoco.mjtTrn.mjTRN_TENDON):
        return -1
    tendon = int(model.actuator_trnid[actuator, 0])
    return -1 if is_fixed(model, tendon) else tendon


def is_fixed(model: mujoco.MjModel, tendon: int) -> bool:
    """Return whether a tendon is fixed, which is a sum of joint angles and not a string."""
    return int(model.wrap_type[model.tendon_adr[tendon]]) == int(mujoco.mjtWrap.mjWRAP_JOINT)


def keeps_state(model: mujoco.MjModel, actuator: int) -> bool:
    """Return whether an actuator stores activation and fibre length for mjwrap: `dyntype="user" actdim="2"`."""
    user = int(model.actuator_dyntype[actuator]) == int(mujoco.mjtDyn.mjDYN_USER)
    return user and int(model.actuator_actnum[actuator]) == 2


def unfit_reason(model: mujoco.MjModel, actuator: int) -> str | None:
    """Return why an actuator cannot drive a muscle of mjwrap, or None."""
    kinds = int(model.actuator_gaintype[actuator]), int(model.actuator_biastype[actuator])
    if kinds[0] not in _GAINS or kinds[1] not in _BIASES:
        return "its gain or bias is not fixed, affine or muscle"
    if int(model.actuator_plugin[actuator]) >= 0:
        return "it belongs to a plugin"
    keeps = keeps_state(model, actuator)
    if model.actuator_actearly[actuator] and int(model.actuator_actnum[actuator]) > 0:
        if int(model.actuator_dyntype[actuator]) not in ACTEARLY_DYNAMICS:
            return "it has actearly, and its dynamics are not integrator, filter or muscle"
        if float(model.actuator_delay[actuator]) > 0.0:
            return "it has actearly, and its control has a delay"
    if int(model.actuator_actnum[actuator]) > 1 and not keeps:
        return "it has several activation states, but not with dyntype='user' actdim='2', as mjwrap needs"
    if keeps and model.actuator_actlimited[actuator]:
        return "its actrange would limit the fibre length, which is one of its states; leave actlimited out"
    if (keeps or int(model.actuator_actnum[actuator]) == 0) and float(model.actuator_delay[actuator]) > 0.0:
        return "its control has a delay, and MuJoCo does not integrate its activation"
    return None


def tendon_reason(model: mujoco.MjModel, actuator: int) -> str | None:
    """Return why an actuator does not pull a spatial tendon, or None."""
    if int(model.actuator_trntype[actuator]) != int(mujoco.mjtTrn.mjTRN_TENDON):
        return "it does not pull a tendon"
    return "its tendon is fixed, not spatial" if pulled_tendon(model, actuator) < 0 else None


def path_reason(model: mujoco.MjModel, rest: mujoco.MjData, actuator: int) -> str | None:
    """Return why an actuator of any kind must keep MuJoCo's path, or None. rest: kinematics of the reference pose."""
    return tendon_reason(model, actuator) or _inside_reason(
        model, rest, int(model.actuator_trnid[actuator, 0])
    )


def curves_reason(model: mujoco.MjModel, actuator: int) -> str | None:
    """Return why a muscle actuator's own curves cannot be computed along a path, or None."""
    astray = tendon_reason(model, actuator)
    if astray is not None:
        return astray
    tendon = pulled_tendon(model, actuator)
    if float(model.actuator_gear[int(model.actuator_outadr[actuator]), 0]) <= 0.0:
        return "its gear is not positive, so it pushes"
    if model.tendon_actfrclimited[tendon]:
        return "its tendon limits the forces of its actuators together (actuatorfrcrange)"
    if int(model.actuator_biastype[actuator]) not in (_NO_BIAS, _MUSCLE_BIAS):
        return "its bias is not that of a muscle"
    return None


def native_reason(model: mujoco.MjModel, rest: mujoco.MjData, actuator: int) -> str | None:
    """Return why a muscle actuator must stay native, or None. rest: kinematics of the reference pose."""
    return (
        curves_reason(model, actuator)
        or unfit_reason(model, actuator)
        or ("its activation states are defined by the user" if keeps_state(model, actuator) else None)
        or _inside_reason(model, rest, int(model.actuator_trnid[actuator, 0]))
    )


def _inside_reason(model: mujoco.MjModel, rest: mujoco.MjData, tendon: int) -> str | None:
    """Return which site is inside its geom at the reference pose and may leave it at another one, or None."""
    stops = tendon_stops(model, rest, tendon)
    for k, side, ends in geoms_of(stops):
        if stops[k].inside:
            continue
        index = stops[k].index
        geom = f"geom '{name_of(model, OBJ.mjOBJ_GEOM, index)}'"
        if side >= 0 and side_is_inside(model, rest, index, side):
            site = name_of(model, OBJ.mjOBJ_SITE, side)
            return (
                f"whether its tendon runs inside {geom} changes with the pose: side site '{site}', which is inside at "
                f"the reference pose, moves relative to it"
            )
        for end in ends:
            if end_is_inside(model, rest, index, end) and is_inside_at_keyframes(model, index, end):
                site = name_of(model, OBJ.mjOBJ_SITE, end)
                return f"no path can go round {geom}: site '{site}' is inside it at the reference pose"
    return None


def mujoco_law(model: mujoco.MjModel, actuator: int) -> MuJoCoMuscle:
    """Return the native curves of a muscle actuator; `ModelError` if they are undefined."""
    output = int(model.actuator_outadr[actuator])
    prm = [float(p) for p in model.actuator_gainprm[actuator, :9]]
    passive = None
    if int(model.actuator_biastype[actuator]) == _NO_BIAS:
        prm[7] = 0.0
    else:
        bias = tuple(float(p) for p in model.actuator_biasprm[actuator, :9])
        passive = None if bias == tuple(prm) else bias
    short, long = (float(x) for x in model.actuator_lengthrange[output])
    low, high = -np.inf, np.inf
    if model.actuator_forcelimited[actuator]:
        low, high = (float(x) for x in model.actuator_forcerange[actuator])
        if low == high == 0.0:
            raise ModelError(
                "its force range is 0 to 0, as set by a MuscleSystem: call release() on the MuscleSystem of "
                "the model, or set actuator_forcelimited to 0"
            )
    return MuJoCoMuscle(
        tuple(prm),
        (short, long),
        float(model.actuator_acc0[output]),
        float(model.actuator_gear[output, 0]),
        (low, high),
        passive,
    )
