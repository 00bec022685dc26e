"""Reading declarations out of a compiled model, written apart from the package that is under test."""

from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

MODELS = Path(__file__).parents[1] / "models"
PARAMETERS = {
    "degroote_fregly_2016": {
        "max_isometric_force",
        "optimal_fiber_length",
        "tendon_slack_length",
        "pennation_angle",
        "max_contraction_velocity",
        "fiber_damping",
    },
    "path_actuator": {"optimal_force"},
    "mujoco": set(),
}
OBJ = mujoco.mjtObj
Vector = NDArray[np.float64]


def load(path: Path) -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = mujoco.MjModel.from_xml_path(str(path))
    return model, mujoco.MjData(model)


def name_of(model: mujoco.MjModel, kind: mujoco.mjtObj, index: int) -> str:
    return mujoco.mj_id2name(model, kind, index)


def elements(model: mujoco.MjModel, index: int) -> list[tuple[int, int, float]]:
    """Object type, object id and prm of each element of tuple `index`."""
    start, size = model.tuple_adr[index], model.tuple_size[index]
    rows = slice(start, start + size)
    kinds, ids, prms = model.tuple_objtype[rows], model.tuple_objid[rows], model.tuple_objprm[rows]
    return [(int(kind), int(obj), float(prm)) for kind, obj, prm in zip(kinds, ids, prms, strict=True)]


def text_of(model: mujoco.MjModel, index: int) -> str:
    start = model.text_adr[index]
    return model.text_data[start : start + model.text_size[index] - 1].decode()


def parameters(model: mujoco.MjModel, index: int) -> dict[str, float]:
    """The numerics of tuple `index`, by the parameter that their name contains."""
    known = set().union(*PARAMETERS.values())
    found: dict[str, float] = {}
    for kind, obj, _ in elements(model, index):
        name = name_of(model, OBJ.mjOBJ_NUMERIC, obj) if kind == OBJ.mjOBJ_NUMERIC else "_size"
        if not name.endswith("_size"):  # of a surface
            (key,) = [key for key in known if key in name]
            found[key] = float(model.numeric_data[model.numeric_adr[obj]])
    return found
