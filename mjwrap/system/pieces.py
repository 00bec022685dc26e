"""Switch couplings of several pieces in an mjData, so that MuJoCo's constraints are those of the present pose.

MuJoCo builds its constraints in the position stage, from the equalities that `eq_active` has on. That is no part of
the physics state that is saved and restored (mjSTATE_FULLPHYSICS), so it is set from qpos at every evaluation.
"""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext

import mujoco
import numpy as np

from mjwrap.errors import StateError
from mjwrap.kernels.coupling.pieces import switch_pieces
from mjwrap.model.piece_table import piece_table
from mjwrap.system.callback import control_callback, passive_callback

_RK4 = int(mujoco.mjtIntegrator.mjINT_RK4)
_NO_ACTUATION = int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
_NOT_PASSIVE = int(mujoco.mjtDisableBit.mjDSBL_SPRING) | int(mujoco.mjtDisableBit.mjDSBL_DAMPER)


class PieceSwitch:
    """The couplings of a model that have several pieces; without any, nothing is done."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self.model = model
        self._table = piece_table(model)
        self.needed = len(self._table.equality) > 0

    def set(self, data: mujoco.MjData) -> bool:
        """Set `eq_active` by the present qpos, before a position stage; return whether it has changed."""
        if not self.needed:
            return False
        return bool(switch_pieces(*self._table, data.qpos, data.eq_active.view(np.uint8)))

    def rebuild(self, data: mujoco.MjData) -> None:
        """Do the same after the position stage, and build its constraints again if another piece holds now."""
        if self.set(data):
            mujoco.mj_makeConstraint(self.model, data)
            mujoco.mj_island(self.model, data)
            mujoco.mj_projectConstraint(self.model, data)
            mujoco.mj_referenceConstraint(self.model, data)

    def stages(self, data: mujoco.MjData, controlled: bool = False) -> AbstractContextManager[None]:
        """Return a context in which the pieces are switched at every stage of Runge-Kutta.

        controlled: the caller has a control callback, and calls `rebuild` in it. MuJoCo calls that only while actuation
        is enabled, and the callback for passive forces only while springs or dampers are. Raises `StateError` if it
        calls neither.
        """
        flags = int(self.model.opt.disableflags)
        actuated = not flags & _NO_ACTUATION
        if not self.needed or (controlled and actuated):
            return nullcontext()
        if flags & _NOT_PASSIVE != _NOT_PASSIVE:
            return passive_callback(data, lambda: self.rebuild(data))
        if actuated:
            return control_callback(data, lambda: self.rebuild(data))
        raise StateError(
            "the pieces of the model's couplings cannot be switched inside a step of RK4 while actuation, springs and "
            "dampers are all disabled: enable one of them, or use another integrator"
        )

    def step(self, data: mujoco.MjData) -> None:
        """Call `mj_step` with the piece that holds at every stage; for models without muscles of mjwrap's."""
        self.set(data)
        if not self.needed or int(self.model.opt.integrator) != _RK4:
            mujoco.mj_step(self.model, data)
            return
        with self.stages(data):
            mujoco.mj_step(self.model, data)
