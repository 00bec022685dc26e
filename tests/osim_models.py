"""OpenSim models for tests: where they are, imported ones, and poses set by the values of their coordinates."""

import functools
from collections.abc import Mapping
from pathlib import Path

import mujoco
import numpy as np
import pytest

import mjwrap as mw

MODELS = Path(__file__).resolve().parents[2] / "shared" / "osim"
FROZEN = Path(__file__).parent / "data" / "osim"
OBJ = mujoco.mjtObj


def model_file(name: str) -> Path:
    """Return the file of a model; the test is skipped where it is absent."""
    path = MODELS / f"{name}.osim"
    if not path.exists():
        pytest.skip(f"the OpenSim model {name} is not in {MODELS}")
    return path


@functools.cache
def imported(name: str) -> mw.Imported:
    """Return an imported model."""
    return mw.import_osim(model_file(name))


@functools.cache
def compiled(name: str) -> mujoco.MjModel:
    """Return an imported model, compiled from its text."""
    found = imported(name)
    return mujoco.MjModel.from_xml_string(found.xml, found.assets)


def set_coordinates(model: mujoco.MjModel, data: mujoco.MjData, values: Mapping[str, float]) -> None:
    """Set joints to the values of the coordinates of their names, and those that follow them by equalities.

    Written from the meaning of the equalities and tuples only: it is no part of what is tested.
    """
    for name, value in values.items():
        joint = mujoco.mj_name2id(model, OBJ.mjOBJ_JOINT, name)
        if joint >= 0:
            data.qpos[model.jnt_qposadr[joint]] = value
    pieces: dict[int, tuple[list[int], np.ndarray]] = {}
    for i in range(model.ntuple):
        if model.tuple(i).name.startswith("mjwrap_coupling_"):
            first, last = model.tuple_adr[i], model.tuple_adr[i] + model.tuple_size[i] - 1
            equalities = model.tuple_objid[first:last].tolist()
            numeric = model.tuple_objid[last]
            knots = model.numeric_data[model.numeric_adr[numeric] :][: model.numeric_size[numeric]]
            pieces[model.eq_obj1id[equalities[0]]] = equalities, knots
    for _ in range(4):  # chains of followers
        for e in np.flatnonzero((model.eq_type == mujoco.mjtEq.mjEQ_JOINT) & (model.eq_obj2id >= 0)):
            follower, leader = (model.jnt_qposadr[ids[e]] for ids in (model.eq_obj1id, model.eq_obj2id))
            x = data.qpos[leader]
            equalities, knots = pieces.get(model.eq_obj1id[e], ([e], np.zeros(0)))
            if equalities[np.searchsorted(knots, x, side="right")] == e:
                change = np.polynomial.polynomial.polyval(x - model.qpos0[leader], model.eq_data[e, :5])
                data.qpos[follower] = model.qpos0[follower] + change
    mujoco.mj_forward(model, data)
