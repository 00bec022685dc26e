"""MuscleSystem.step beside a user's own control callback, Python or compiled."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable, Iterator
from typing import Any

import mujoco
import numpy as np
import pytest
from native_twins import EXPLICIT, INTEGRATORS, PUSH, excite, native_model, pair, start


@pytest.fixture
def no_callback() -> Iterator[None]:
    mujoco.set_mjcb_control(None)
    yield
    mujoco.set_mjcb_control(None)


Callback = Callable[[mujoco.MjModel, mujoco.MjData], None]


def run_both(integrator: int, user: Callback, nstep: int) -> tuple[mujoco.MjData, mujoco.MjData]:
    """Run mjwrap and the native twin under a user's control callback."""
    data, muscles, twin = pair(integrator)
    mujoco.set_mjcb_control(user)
    muscles.step(data, nstep=nstep)
    assert mujoco.get_mjcb_control() is user
    mujoco.mj_step(twin.model, twin, nstep=nstep)
    return data, twin


@pytest.mark.usefixtures("no_callback")
@pytest.mark.parametrize("integrator", EXPLICIT)
def test_a_users_controller_is_called_at_every_stage_and_kept(integrator: int) -> None:
    calls: dict[int, list[float]] = {}

    def user(model: mujoco.MjModel, data: mujoco.MjData) -> None:
        calls.setdefault(data._address, []).append(data.time)
        excite(data)

    data, twin = run_both(integrator, user, 100)
    assert calls[data._address] == calls[twin._address]
    assert data.qpos == pytest.approx(twin.qpos, abs=1e-12)


@pytest.mark.usefixtures("no_callback")
@pytest.mark.parametrize("integrator", EXPLICIT)
def test_a_users_controller_may_assign_external_forces(integrator: int) -> None:
    def user(model: mujoco.MjModel, data: mujoco.MjData) -> None:
        data.xfrc_applied[model.body("forearm").id] = math.sin(30 * data.time) * PUSH

    data, twin = run_both(integrator, user, 100)
    assert np.array_equal(data.xfrc_applied, twin.xfrc_applied)
    assert data.qpos == pytest.approx(twin.qpos, abs=1e-12)


@pytest.mark.usefixtures("no_callback")
@pytest.mark.parametrize("integrator", EXPLICIT)
def test_a_compiled_controller_is_called_and_kept(integrator: int) -> None:
    """MuJoCo takes C function pointers as callbacks as well."""
    calls = [0]

    @ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)
    def user(model: int, data: int) -> None:
        calls[0] += 1

    data, muscles, _ = pair(integrator)
    mujoco.set_mjcb_control(user)
    muscles.step(data, nstep=10)
    assert calls[0] == 10 * (4 if integrator == INTEGRATORS["mjINT_RK4"] else 1)
    assert mujoco.get_mjcb_control() is user


@pytest.mark.usefixtures("no_callback")
@pytest.mark.parametrize("integrator", EXPLICIT)
def test_an_error_in_a_users_controller_surfaces_and_leaves_everything_in_order(integrator: int) -> None:
    def user(model: mujoco.MjModel, data: mujoco.MjData) -> None:
        if data.time > 0.01:
            raise KeyError("the user's own")

    data, muscles, _ = pair(integrator)
    data.xfrc_applied[1] = PUSH
    mujoco.set_mjcb_control(user)
    with pytest.raises(KeyError, match="the user's own"):
        muscles.step(data, nstep=20)
    assert mujoco.get_mjcb_control() is user
    assert np.array_equal(data.xfrc_applied[1], PUSH)
    mujoco.set_mjcb_control(None)
    muscles.step(data, nstep=20)
    assert np.isfinite(data.qpos).all()


@pytest.mark.usefixtures("no_callback")
def test_other_models_step_undisturbed_inside_a_users_controller() -> None:
    """MuJoCo's callbacks are global: ours fires for every model and must act on its own data only."""
    other = native_model()
    inner = start(other)
    alone = start(other)
    inside: list[Any] = []

    def user(model: mujoco.MjModel, data: mujoco.MjData) -> None:
        if data._address != inner._address and not inside:
            inside.append(True)
            mujoco.mj_step(other, inner, nstep=5)

    data, muscles, _ = pair(INTEGRATORS["mjINT_RK4"])
    mujoco.set_mjcb_control(user)
    muscles.step(data)
    mujoco.set_mjcb_control(None)
    mujoco.mj_step(other, alone, nstep=5)
    assert inside
    assert np.array_equal(inner.qpos, alone.qpos)
    assert not inner.xfrc_applied.any()
