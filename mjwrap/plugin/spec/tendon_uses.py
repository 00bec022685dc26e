"""Find the tendons that MuJoCo itself needs, and those that can show mjwrap's paths."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from mjwrap.mjcf import MuscleDeclaration

_TENDON, _ACTUATOR = int(mujoco.mjtObj.mjOBJ_TENDON), int(mujoco.mjtObj.mjOBJ_ACTUATOR)
_PULLS = int(mujoco.mjtTrn.mjTRN_TENDON)
_SITE = int(mujoco.mjtWrap.mjWRAP_SITE)
_POSITION = int(mujoco.mjtStage.mjSTAGE_POS)
FORCE_SENSORS = (int(mujoco.mjtSensor.mjSENS_FORCE), int(mujoco.mjtSensor.mjSENS_TORQUE))
# fields of a tendon and of an actuator that are all zero if it only transmits the actuator's force
_TENDON_ACTS = (
    "tendon_limited", "tendon_stiffness", "tendon_stiffnesspoly", "tendon_damping", "tendon_dampingpoly",
    "tendon_armature", "tendon_frictionloss",
)  # fmt: skip
_ACTUATOR_ACTS = ("actuator_armature", "actuator_damping", "actuator_dampingpoly")


def _acts(model: mujoco.MjModel, fields: tuple[str, ...], item: int) -> bool:
    return any(np.any(getattr(model, name)[item]) for name in fields if hasattr(model, name))


def _pulling(model: mujoco.MjModel, tendon: int) -> list[int]:
    """Return the actuators that pull a tendon."""
    return np.flatnonzero(
        (model.actuator_trntype == _PULLS) & (model.actuator_trnid[:, 0] == tendon)
    ).tolist()


def _is_used(model: mujoco.MjModel, tendon: int) -> bool:
    """Return whether a tendon makes forces of its own: by limit, spring, damper, friction, inertia or equality."""
    ties = model.eq_type == int(mujoco.mjtEq.mjEQ_TENDON)
    return (
        _acts(model, _TENDON_ACTS, tendon)
        or any(_acts(model, _ACTUATOR_ACTS, actuator) for actuator in _pulling(model, tendon))
        or bool(np.any(ties & ((model.eq_obj1id == tendon) | (model.eq_obj2id == tendon))))
    )


def pulled_by(model: mujoco.MjModel, actuator: int) -> int:
    """Return the tendon that an actuator pulls, spatial or fixed; -1 if it pulls none, or for actuator -1."""
    if actuator < 0 or int(model.actuator_trntype[actuator]) != _PULLS:
        return -1
    return int(model.actuator_trnid[actuator, 0])


def tendon_of(model: mujoco.MjModel, muscle: MuscleDeclaration) -> int:
    """Return the spatial tendon whose length is that of a muscle: which its actuator pulls, or its own; or -1."""
    if muscle.actuator >= 0 and pulled_by(model, muscle.actuator) != muscle.tendon:
        return -1
    return muscle.tendon


def shown_tendons(model: mujoco.MjModel, muscles: list[MuscleDeclaration]) -> set[int]:
    """Return the tendons that can show mjwrap's path: all their actuators pull along it, and they do nothing else."""
    paths: dict[int, set[Any]] = {}
    for muscle in muscles:
        tendon = tendon_of(model, muscle)
        if tendon >= 0:
            paths.setdefault(tendon, set()).add(muscle.routes)
    own = {muscle.actuator for muscle in muscles}
    return {
        tendon
        for tendon, routes in paths.items()
        if len(routes) == 1 and set(_pulling(model, tendon)) <= own and not _is_used(model, tendon)
    }


def is_measured_late(model: mujoco.MjModel, sensor: int) -> bool:
    """Return whether a sensor shows delayed values, or values at intervals."""
    late = model.sensor_delay[sensor], model.sensor_interval[sensor], model.sensor_history[sensor]
    return any(bool(np.any(value)) for value in late)


def _is_scaled(model: mujoco.MjModel, actuator: int) -> bool:
    """Return whether a muscle's strength is derived from acc0, which `mj_setConst` computes along MuJoCo's own path."""
    muscle = int(model.actuator_gaintype[actuator]) == int(mujoco.mjtGain.mjGAIN_MUSCLE)
    return muscle and bool(model.actuator_gainprm[actuator, 2] < 0.0)


def _is_measured(model: mujoco.MjModel, kind: int, item: int, shown: bool) -> bool:
    """Return whether a sensor needs the length of a tendon or actuator along MuJoCo's own path.

    shown: the sensor shows mjwrap's path, except for lengths that MuJoCo stores before mjwrap computes them.
    """
    measured = (model.sensor_objtype == kind) & (model.sensor_objid == item)
    measured |= (model.sensor_reftype == kind) & (model.sensor_refid == item)
    return any(
        not shown or (int(model.sensor_needstage[i]) == _POSITION and is_measured_late(model, int(i)))
        for i in np.flatnonzero(measured)
    )


def is_needed(model: mujoco.MjModel, tendon: int, taken: dict[int, bool], shown: set[int]) -> bool:
    """Return whether MuJoCo needs a tendon's path: for forces, sensors, or an actuator that is not taken over.

    taken: for each actuator taken over, whether it pulls along mjwrap's path (else it is disabled). shown: tendons
    that show mjwrap's path.
    """
    if _is_used(model, tendon) or int(model.wrap_type[model.tendon_adr[tendon]]) != _SITE:
        return True
    pulling = _pulling(model, tendon)
    if not pulling or not set(pulling) <= set(taken):
        return True
    if model.tendon_actfrclimited[tendon] and not all(taken[actuator] for actuator in pulling):
        return True
    if np.isin(model.sensor_type, FORCE_SENSORS).any() and any(taken[actuator] for actuator in pulling):
        return True  # these sensors feel MuJoCo's actuators along MuJoCo's tendons
    if any(taken[actuator] and _is_scaled(model, actuator) for actuator in pulling):
        return True
    return _is_measured(model, _TENDON, tendon, tendon in shown) or any(
        _is_measured(model, _ACTUATOR, actuator, True) for actuator in pulling
    )
