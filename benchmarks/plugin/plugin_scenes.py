"""Scenes of unusual and wrong use of the engine plugin: each returns the mjData with which it ended."""

from __future__ import annotations

import copy
import gc
import importlib
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np

import mjwrap as mw
from mjwrap.plugin import excitations, read
from mjwrap.plugin.mujoco_c import offsets

MODELS = [
    Path(__file__).parents[2] / "models" / name / f"{name}.xml"
    for name in ("elbow", "paper_case1", "paper_case2")
]


def load(path: Path = MODELS[0], force: float = 0.0, mode: str = "wrench") -> mujoco.MjModel:
    """Return a model in the plugin; force [N]: added to the muscles'; mode: as in `install`."""
    spec = mujoco.MjSpec.from_file(str(path))
    for actuator in spec.actuators:
        actuator.gainprm[2] += force
    return mw.install(spec, mode)


def moving(model: mujoco.MjModel, seed: int = 0) -> mujoco.MjData:
    """Return data with positions, velocities and controls drawn from a seed."""
    data, rng = mujoco.MjData(model), np.random.default_rng(seed)
    data.qpos[:] += rng.uniform(0.0, 0.2, model.nq)
    data.qvel[:] = rng.uniform(-0.5, 0.5, model.nv)
    data.ctrl[:] = rng.uniform(0.0, 1.0, model.nu)
    for excitation in excitations(data).values():
        excitation[:] = 0.6
    return data


def motion() -> list[mujoco.MjData]:
    """All models, the elbow in both modes, under all integrators; looked at, copied, reset on the way."""
    ends = []
    for model in (*map(load, MODELS), load(mode="transmission")):
        for integrator in range(4):
            model.opt.integrator = integrator
            data, other = moving(model), moving(model, 1)
            mujoco.mj_step(model, data, nstep=60)
            mujoco.mj_forward(model, data)
            mujoco.mj_inverse(model, data)
            mujoco.mj_copyData(other, model, data)
            twin = copy.copy(data)
            mujoco.mj_step(model, twin, nstep=20)
            mujoco.mj_resetData(model, data)
            mujoco.mj_step(model, data, nstep=20)
            mujoco.mj_step(model, other, nstep=20)
            read(other)
            ends += [data, other, twin]
    return ends


def interleaved() -> list[mujoco.MjData]:
    """Two models of equal sizes in turn, and one mjData under both."""
    models = [load(force=f) for f in (0.0, 50.0)]
    datas = [moving(model) for model in models]
    for k in range(60):
        for model, data in zip(models, datas, strict=True):
            mujoco.mj_step(model, data)
        mujoco.mj_step(models[k % 2], datas[0])
    return datas


def orphans() -> list[mujoco.MjData]:
    """Models are freed, first ours, then Python's last name for it; the data live on, and their copies."""
    datas = [moving(load(force=float(f))) for f in range(4)]
    gc.collect()
    for data in datas[:]:
        mujoco.mj_step(data.model, data, nstep=20)
        datas.append(copy.copy(data))
    del datas[0:4]
    gc.collect()
    for data in datas:
        mujoco.mj_step(data.model, data, nstep=20)
    return datas


def threads() -> list[mujoco.MjData]:
    """Two threads step while two others load models and change the numbers of theirs."""
    model, until = load(), time.monotonic() + 3.0
    ends: list[mujoco.MjData] = []

    def step() -> None:
        while True:
            data = moving(model)
            mujoco.mj_step(model, data, nstep=500)
            if time.monotonic() > until:
                ends.append(data)
                return

    def change() -> None:
        force = 1.0
        while time.monotonic() < until:
            force += 1.0
            other = load(force=force)
            data = moving(other)
            for k in range(5):
                other.numeric_data[:] *= 1.0 + 1e-3 * k
                other.geom_size[:] *= 1.0 + 1e-3 * k
                mujoco.mj_step(other, data, nstep=3)

    workers = [threading.Thread(target=work) for work in (step, step, change, change)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    return ends


def garbage() -> list[mujoco.MjData]:
    """Anything in plugin_state, in poses, controls and numbers of the model; resets cure it."""
    ends = []
    rng = np.random.default_rng(7)
    for model in (*map(load, MODELS), load(mode="transmission")):
        data = moving(model)
        for k in range(30):
            bits = rng.integers(0, 2**64, model.npluginstate, dtype=np.uint64, endpoint=False)
            data.plugin_state[:] = bits.view(np.float64)
            if k % 3 == 0:
                data.plugin_state[:] = rng.choice([np.nan, np.inf, -np.inf, 1e308, -1.0, 3.0, 1e-320])
            elif k % 3 == 1:
                data.plugin_state[rng.integers(model.npluginstate)] = rng.choice([np.nan, 1e18, -1.0])
            mujoco.mj_forward(model, data)
            mujoco.mj_step(model, data)
            for name in ("qpos", "qvel", "ctrl", "act"):
                array = getattr(data, name)
                if array.size and k % 4 == 0:
                    array[rng.integers(array.size)] = rng.choice([np.nan, np.inf, 1e300])
            mujoco.mj_forward(model, data)
            mujoco.mj_step(model, data)
            mujoco.mj_resetData(model, data)
        kept = {
            name: getattr(model, name).copy() for name in ("actuator_gainprm", "actuator_gear", "geom_size")
        }
        for name, value in kept.items():
            for bad in (np.nan, -np.inf, -1.0, 0.0, 1e300):
                getattr(model, name)[:] = bad
                mujoco.mj_forward(model, data)
                getattr(model, name)[:] = value
        mujoco.mj_resetData(model, data)
        mujoco.mj_step(model, data, nstep=20)
        ends.append(data)
    return ends


def twice() -> list[mujoco.MjData]:
    """The package is thrown out and imported again, while data of the first import live."""
    model = load()
    data = moving(model)
    mujoco.mj_step(model, data, nstep=10)
    for name in [name for name in sys.modules if name.startswith("mjwrap")]:
        del sys.modules[name]
    gc.collect()
    again = importlib.import_module("mjwrap").load(MODELS[0])
    other = mujoco.MjData(again)
    mujoco.mj_step(again, other, nstep=10)
    mujoco.mj_step(model, data, nstep=10)
    return [data, other]


def version() -> list[mujoco.MjData]:
    """A MuJoCo whose structs are others is refused by an error, before anything is written."""
    declared = dict(offsets.structs())
    fields = tuple(f for f in declared["mjData"].fields if f.name != "arena")
    declared["mjData"] = type("Declared", (), {"fields": fields})
    offsets.structs = lambda: declared
    offsets.offsets.cache_clear()
    try:
        mw.load(MODELS[0])
    except mw.VersionError:
        return []
    raise SystemExit("an unknown MuJoCo was not refused")


def many() -> list[mujoco.MjData]:
    """Hundreds of mjData made and freed in any order, some never stepped."""
    model, rng = load(), np.random.default_rng(2)
    kept: list[mujoco.MjData] = []
    for k in range(400):
        kept.append(moving(model, k))
        if k % 3:
            mujoco.mj_step(model, kept[-1], nstep=2)
        if len(kept) > 20:
            del kept[int(rng.integers(len(kept)))]
    return kept


SCENES: dict[str, Callable[[], list[mujoco.MjData]]] = {
    scene.__name__: scene for scene in (motion, interleaved, orphans, threads, garbage, twice, version, many)
}
SHORT = ("interleaved", "orphans", "garbage")  # for valgrind
SAYS = {
    "garbage": ("MUJOCO_LOG", "WARNING", "mjwrap: ")
}  # what may be said: refused numbers, MuJoCo's own warnings
