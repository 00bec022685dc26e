"""Tendons that only say where a muscle of mjwrap runs: MuJoCo need not spend up to half of its step on them.

A tendon whose number of stops (`tendon_num`) is 0 has no length, no Jacobian and no cost. The number itself is kept in
`wrap_prm` of the first stop, which MuJoCo does not read for a site: so a copy of the model, or its MJB, knows it too.
"""

from __future__ import annotations

import mujoco
import numpy as np

from mjwrap.mjcf import MuscleDeclaration

_TENDON, _ACTUATOR = int(mujoco.mjtObj.mjOBJ_TENDON), int(mujoco.mjtObj.mjOBJ_ACTUATOR)
_PULLS = int(mujoco.mjtTrn.mjTRN_TENDON)
_SITE = int(mujoco.mjtWrap.mjWRAP_SITE)
# fields of a tendon, each zero where it does nothing but pass a muscle's force on
_ACTIVE = (
    "tendon_limited", "tendon_actfrclimited", "tendon_stiffness", "tendon_stiffnesspoly", "tendon_damping",
    "tendon_dampingpoly", "tendon_armature", "tendon_frictionloss",
)  # fmt: skip


def _is_idle(model: mujoco.MjModel, tendon: int, pulled_by: int) -> bool:
    """Return whether nobody but one silenced actuator uses a tendon, and nothing measures either."""
    if any(np.any(getattr(model, name)[tendon]) for name in _ACTIVE if hasattr(model, name)):
        return False
    for kind, item in ((_TENDON, tendon), (_ACTUATOR, pulled_by)):
        if np.any((model.sensor_objtype == kind) & (model.sensor_objid == item)):
            return False
        if np.any((model.sensor_reftype == kind) & (model.sensor_refid == item)):
            return False
    ties = model.eq_type == int(mujoco.mjtEq.mjEQ_TENDON)
    if np.any(ties & ((model.eq_obj1id == tendon) | (model.eq_obj2id == tendon))):
        return False
    pulls = np.flatnonzero((model.actuator_trntype == _PULLS) & (model.actuator_trnid[:, 0] == tendon))
    return pulls.tolist() == [pulled_by] and int(model.wrap_type[model.tendon_adr[tendon]]) == _SITE


def drop_placeholders(model: mujoco.MjModel, muscles: list[MuscleDeclaration]) -> None:
    """Take the stops from the tendons of these muscles that nothing else needs."""
    for muscle in muscles:
        if muscle.tendon >= 0 and muscle.actuator >= 0 and _is_idle(model, muscle.tendon, muscle.actuator):
            model.wrap_prm[model.tendon_adr[muscle.tendon]] = model.tendon_num[muscle.tendon]
            model.tendon_num[muscle.tendon] = 0


def restore_placeholders(model: mujoco.MjModel) -> None:
    """Give tendons their stops back."""
    for tendon in np.flatnonzero(model.tendon_num == 0):
        first = int(model.tendon_adr[tendon])
        model.tendon_num[tendon] = int(model.wrap_prm[first])
        model.wrap_prm[first] = 0.0
