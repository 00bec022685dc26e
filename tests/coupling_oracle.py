"""A slow twin of `mj_step` that sets the active pieces of couplings in Python before every evaluation, for tests."""

from __future__ import annotations

from collections.abc import Callable

import mujoco
import numpy as np

Array = np.ndarray
_RK4 = int(mujoco.mjtIntegrator.mjINT_RK4)
_SHARES = (1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0)


def step(model: mujoco.MjModel, data: mujoco.MjData, choose: Callable[[], None]) -> None:
    """Advance by one time step; choose: sets `data.eq_active` from `data.qpos`.

    Runge-Kutta is written out, in MuJoCo's order of operations.
    """
    choose()
    if int(model.opt.integrator) != _RK4:
        mujoco.mj_step(model, data)
        return
    h, time = model.opt.timestep, data.time
    mujoco.mj_forward(model, data)
    start = [data.qpos.copy(), data.qvel.copy(), data.act.copy()]
    speeds, rates, acts = [data.qvel.copy()], [data.qacc.copy()], [data.act_dot.copy()]
    for share in (0.5, 0.5, 1.0):
        data.qpos[:] = start[0]
        mujoco.mj_integratePos(model, data.qpos, _added(speeds[-1:], (share,)), h)
        mujoco.mju_addScl(data.qvel, start[1], _added(rates[-1:], (share,)), h)
        mujoco.mju_addScl(data.act, start[2], _added(acts[-1:], (share,)), h)
        data.time = time + share * h
        choose()
        mujoco.mj_forward(model, data)
        speeds.append(data.qvel.copy())
        rates.append(data.qacc.copy())
        acts.append(data.act_dot.copy())
    data.qpos[:] = start[0]
    mujoco.mj_integratePos(model, data.qpos, _added(speeds, _SHARES), h)
    mujoco.mju_addScl(data.qvel, start[1], _added(rates, _SHARES), h)
    mujoco.mju_addScl(data.act, start[2], _added(acts, _SHARES), h)
    data.qacc_warmstart[:] = data.qacc
    data.time = time + h


def _added(stages: list[Array], shares: tuple[float, ...]) -> Array:
    """Return a weighted sum, by the function of MuJoCo's that its own step uses, so that it rounds the same way."""
    total = np.zeros_like(stages[0])
    for share, stage in zip(shares, stages, strict=True):
        mujoco.mju_addToScl(total, stage, share)
    return total
