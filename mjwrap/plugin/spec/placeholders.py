"""Tendons that only say where a muscle of mjwrap runs: MuJoCo need not spend up to half of its step on them.

A tendon whose number of stops (`tendon_num`) is 0 has no length, no Jacobian and no cost. The number itself is kept in
`wrap_prm` of the first stop, which MuJoCo does not read for a site: so a copy of the model, or its MJB, knows it too.

Where a tendon stays, MuJoCo would show it beside the path that the plugin draws. Its width is made too small to be
seen, by a power of two, so that its own width can still be read from it: in the MjSpec, so that models compiled from
it later, alone or attached, do not show it either. (The compiler takes no width of 0, and `to_xml` writes none below
1e-12 m.)
"""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from mjwrap.mjcf import MuscleDeclaration
from mjwrap.muscles.laws import ActuatorForce
from mjwrap.plugin.callbacks.drawing import THIN, THINNED
from mjwrap.plugin.spec.resting import wake_actuators

_TENDON, _ACTUATOR = int(mujoco.mjtObj.mjOBJ_TENDON), int(mujoco.mjtObj.mjOBJ_ACTUATOR)
_PULLS = int(mujoco.mjtTrn.mjTRN_TENDON)
_SITE = int(mujoco.mjtWrap.mjWRAP_SITE)
_POSITION = int(mujoco.mjtStage.mjSTAGE_POS)
_FORCES = (int(mujoco.mjtSensor.mjSENS_FORCE), int(mujoco.mjtSensor.mjSENS_TORQUE))
# fields of a tendon and of an actuator, each zero where it does nothing but pass the actuator's force on
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
    """Return whether MuJoCo makes forces of a tendon: by limit, spring, damper, friction, inertia or equality."""
    ties = model.eq_type == int(mujoco.mjtEq.mjEQ_TENDON)
    return (
        _acts(model, _TENDON_ACTS, tendon)
        or any(_acts(model, _ACTUATOR_ACTS, actuator) for actuator in _pulling(model, tendon))
        or bool(np.any(ties & ((model.eq_obj1id == tendon) | (model.eq_obj2id == tendon))))
    )


def shown_tendons(model: mujoco.MjModel, muscles: list[MuscleDeclaration]) -> set[int]:
    """Return the tendons that can show mjwrap's path: all that pulls them does so along the same one, and no more."""
    paths: dict[int, set[Any]] = {}
    for muscle in muscles:
        if isinstance(muscle.parameters, ActuatorForce):
            paths.setdefault(int(model.actuator_trnid[muscle.actuator, 0]), set()).add(muscle.routes)
    own = {muscle.actuator for muscle in muscles if isinstance(muscle.parameters, ActuatorForce)}
    return {
        tendon
        for tendon, routes in paths.items()
        if len(routes) == 1 and set(_pulling(model, tendon)) <= own and not _is_used(model, tendon)
    }


def is_measured_late(model: mujoco.MjModel, sensor: int) -> bool:
    """Return whether a sensor shows what it measured before, or at intervals, rather than what it measures."""
    late = model.sensor_delay[sensor], model.sensor_interval[sensor], model.sensor_history[sensor]
    return any(bool(np.any(value)) for value in late)


def _is_scaled(model: mujoco.MjModel, actuator: int) -> bool:
    """Return whether a muscle's strength is derived from acc0, which `mj_setConst` computes along MuJoCo's own path."""
    muscle = int(model.actuator_gaintype[actuator]) == int(mujoco.mjtGain.mjGAIN_MUSCLE)
    return muscle and bool(model.actuator_gainprm[actuator, 2] < 0.0)


def _is_measured(model: mujoco.MjModel, kind: int, item: int, transmitted: bool) -> bool:
    """Return whether a sensor needs a tendon's, or an actuator's, length along MuJoCo's own path.

    transmitted: it shows mjwrap's, but for lengths that MuJoCo takes down before mjwrap has computed them.
    """
    measured = (model.sensor_objtype == kind) & (model.sensor_objid == item)
    measured |= (model.sensor_reftype == kind) & (model.sensor_refid == item)
    return any(
        not transmitted or (int(model.sensor_needstage[i]) == _POSITION and is_measured_late(model, int(i)))
        for i in np.flatnonzero(measured)
    )


def _is_idle(model: mujoco.MjModel, tendon: int, taken: dict[int, bool], shown: set[int]) -> bool:
    """Return whether all that pulls a tendon is taken over, and nobody needs its path besides.

    taken: by actuator, whether it pulls along mjwrap's path, or no more. shown: tendons that show mjwrap's path.
    """
    if _is_used(model, tendon) or int(model.wrap_type[model.tendon_adr[tendon]]) != _SITE:
        return False
    pulling = _pulling(model, tendon)
    if not pulling or not set(pulling) <= set(taken):
        return False
    if model.tendon_actfrclimited[tendon] and not all(taken[actuator] for actuator in pulling):
        return False
    if np.isin(model.sensor_type, _FORCES).any() and any(taken[actuator] for actuator in pulling):
        return False  # MuJoCo lets them feel its actuators where its own tendons pull
    if any(taken[actuator] and _is_scaled(model, actuator) for actuator in pulling):
        return False
    return not (
        _is_measured(model, _TENDON, tendon, tendon in shown)
        or any(_is_measured(model, _ACTUATOR, actuator, taken[actuator]) for actuator in pulling)
    )


def drop_placeholders(model: mujoco.MjModel, muscles: list[MuscleDeclaration]) -> None:
    """Take the stops from the tendons of these muscles that nothing else needs."""
    taken = {m.actuator: isinstance(m.parameters, ActuatorForce) for m in muscles if m.actuator >= 0}
    shown = shown_tendons(model, muscles)
    for tendon in {muscle.tendon for muscle in muscles if muscle.tendon >= 0}:
        if model.tendon_num[tendon] > 0 and _is_idle(model, tendon, taken, shown):
            model.wrap_prm[model.tendon_adr[tendon]] = model.tendon_num[tendon]
            model.tendon_num[tendon] = 0


def restore_placeholders(model: mujoco.MjModel) -> None:
    """Give tendons their stops back, and muscle actuators that rest on them their curves."""
    wake_actuators(model)
    for tendon in np.flatnonzero(model.tendon_num == 0):
        first = int(model.tendon_adr[tendon])
        model.tendon_num[tendon] = int(model.wrap_prm[first])
        model.wrap_prm[first] = 0.0


def hide_placeholders(spec: mujoco.MjSpec, muscles: list[MuscleDeclaration]) -> None:
    """Make the tendons of these muscles invisible; a width set again later is shown, and drawn by the plugin too."""
    taken = {muscle.tendon for muscle in muscles}
    for tendon in spec.tendons:
        if tendon.id in taken and tendon.width >= THIN:
            tendon.width *= THINNED


def show_placeholder(spec: mujoco.MjSpec, actuator: str) -> None:
    """Give the tendon that an actuator pulls the width back that `hide_placeholders` has taken from it."""
    element = spec.actuator(actuator)
    tendon = spec.tendon(element.target) if element is not None else None
    if tendon is not None and tendon.width < THIN:
        tendon.width /= THINNED
