"""The engine plugin under hostile use: right or refused, never a crash; and nothing grows."""

from __future__ import annotations

import copy
import gc
import os
import pickle
import resource
import subprocess
import sys
import threading
import time
from pathlib import Path

import mujoco
import numpy as np
import pytest
from test_plugin import SCENES, moving, spec_of, state_of

from mjwrap.plugin import install, load, read

ROOT = Path(__file__).resolve().parent.parent
RELOAD = """
import gc, importlib, sys
import mujoco, mjwrap as mw
model = mw.load("models/elbow/elbow.xml")
data = mujoco.MjData(model)
mujoco.mj_step(model, data, nstep=10)
for name in [n for n in sys.modules if n.startswith("mjwrap")]:
    del sys.modules[name]
del mw
gc.collect()
again = importlib.import_module("mjwrap").load("models/elbow/elbow.xml")
other = mujoco.MjData(again)
mujoco.mj_step(again, other, nstep=20)
mujoco.mj_step(model, data, nstep=10)
assert (other.qpos == data.qpos).all() and data.qpos.any()
"""


UNPICKLED = """
import pickle, sys
import mujoco, mjwrap as mw
model = mw.load("models/elbow/elbow.xml")
others = [mujoco.MjData(model) for _ in range(3)]
with open(sys.argv[1], "rb") as file:
    data, wanted = pickle.load(file)
for _ in range(2):
    again = pickle.loads(pickle.dumps(data))
    mujoco.mj_step(model, again, nstep=50)
    assert (again.qpos == wanted).all()
    mujoco.mj_resetData(model, again)
mujoco.mj_step(model, data, nstep=50)
assert (data.qpos == wanted).all()
"""


def arm(force: int = 400) -> mujoco.MjModel:
    return install(spec_of(SCENES["arm"].replace('force="400"', f'force="{force}"')))


def test_a_second_import_finds_the_plugin_that_the_first_registered() -> None:
    """The modules are gone, their callbacks are not; the data live until the process ends."""
    done = subprocess.run(
        [sys.executable, "-X", "faulthandler", "-c", RELOAD], cwd=ROOT, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr


def test_data_outlives_its_model_and_its_origin() -> None:
    model = arm()
    data = moving(model)
    expected = moving(model)
    mujoco.mj_step(model, expected, nstep=20)
    copied, twin = copy.copy(data), moving(copy.copy(model))
    del model, data
    gc.collect()
    for left in (copied, twin):
        mujoco.mj_step(left.model, left, nstep=20)
        np.testing.assert_array_equal(state_of(left), state_of(expected))


@pytest.mark.parametrize("name", ["qpos", "qvel", "qacc_warmstart", "act", "ctrl"])
@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e300])
def test_a_state_that_blows_up_is_reset_as_a_whole(
    name: str, bad: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """MuJoCo resets it in the middle of a step; what the muscles knew goes with it."""
    monkeypatch.chdir(tmp_path)  # for MuJoCo's log
    model = install(spec_of(SCENES["elastic arm"]))
    data, fresh = moving(model), mujoco.MjData(model)
    mujoco.mj_step(model, data, nstep=20)
    getattr(data, name)[:] = bad
    mujoco.mj_forward(model, data)
    mujoco.mj_step(model, data, nstep=3)
    mujoco.mj_resetData(model, data)
    for each in (data, fresh):
        mujoco.mj_step(model, each, nstep=5)
    np.testing.assert_array_equal(state_of(data), state_of(fresh))
    assert np.isfinite(state_of(data)).all()


def test_threads_step_while_others_load() -> None:
    model = arm()
    reference = moving(model)
    mujoco.mj_step(model, reference, nstep=2000)
    expected, until = state_of(reference), time.monotonic() + 2.0
    wrong: list[str] = []

    def step() -> None:
        while time.monotonic() < until:
            data = moving(model)
            mujoco.mj_step(model, data, nstep=2000)
            if not np.array_equal(state_of(data), expected):
                wrong.append("another motion")

    def load() -> None:
        force = 500
        while time.monotonic() < until:
            force += 1
            other = arm(force)
            mujoco.mj_step(other, moving(other), nstep=3)

    threads = [threading.Thread(target=work) for work in (step, step, load, load)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong


@pytest.mark.slow
def test_nothing_grows() -> None:
    """40 loads of distinct models, 2,000 mjData and 20,000 steps take less than 4 MB; one block each would be 13 MB."""

    def use(first: int) -> None:
        for force in range(first, first + 40):
            model = arm(force)
            for _ in range(50):
                data = mujoco.MjData(model)
                mujoco.mj_step(model, data, nstep=10)

    use(1000)
    gc.collect()
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    use(2000)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 4096  # kB


def test_pickled_data_goes_on_with_the_same_bits(tmp_path: Path) -> None:
    """Here, while the original lives and after, and in another process; a copy that is never stepped hurts nobody."""
    model = load(ROOT / "models/elbow/elbow.xml")
    data, fresh = mujoco.MjData(model), mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    data.ctrl[:] = 0.3
    mujoco.mj_step(model, data, nstep=50)
    saved = pickle.dumps(data)
    wanted = pickle.loads(saved)
    mujoco.mj_step(model, data, nstep=50)
    mujoco.mj_step(model, wanted, nstep=50)
    assert np.array_equal(state_of(wanted), state_of(data))
    assert read(wanted).status.tolist() == [0] * 7
    unused = [pickle.loads(saved) for _ in range(5)]
    del data
    gc.collect()
    mujoco.mj_step(model, fresh, nstep=20)
    for other in (pickle.loads(saved), unused[2], copy.copy(unused[3])):
        mujoco.mj_step(model, other, nstep=50)
        assert np.array_equal(state_of(other), state_of(wanted))
        mujoco.mj_resetData(model, other)
        mujoco.mj_step(model, other, nstep=20)
        assert np.array_equal(state_of(other), state_of(fresh))
    file = tmp_path / "data.pkl"
    file.write_bytes(pickle.dumps((pickle.loads(saved), np.array(wanted.qpos))))
    done = subprocess.run(
        [sys.executable, "-X", "faulthandler", "-c", UNPICKLED, str(file)],
        cwd=ROOT, env=os.environ | {"PYTHONPATH": str(ROOT)}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
