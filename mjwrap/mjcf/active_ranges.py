"""Read the ranges of a conditional path point: in a muscle's tuple, right after a site, a joint and a numeric."""

from __future__ import annotations

import mujoco
import numpy as np

from mjwrap.errors import ModelError
from mjwrap.mjcf.conditional_points import JointRange
from mjwrap.mjcf.moving_points import check_scalar
from mjwrap.mjcf.names import name_of

OBJ = mujoco.mjtObj
WORD = "active_range"


def read_active_range(model: mujoco.MjModel, joint: int, place: int) -> JointRange:
    """Return the range that a joint has in a tuple; place: of the next element, which must be its numeric."""
    name = name_of(model, OBJ.mjOBJ_JOINT, joint)
    check_scalar(model, joint, "decides on a path point")
    numeric = name_after(model, place)
    if WORD not in numeric:
        raise ModelError(
            f"joint '{name}' must be followed by a numeric whose name contains {WORD}: the range of its position in "
            f"which the site before it belongs to the path"
        )
    index = int(model.tuple_objid[place])
    first, count = int(model.numeric_adr[index]), int(model.numeric_size[index])
    given = [float(x) for x in model.numeric_data[first : first + count]]
    if len(given) != 2 or not np.isfinite(given).all() or given[0] > given[1]:
        raise ModelError(
            f"numeric '{numeric}' must be a lowest and a highest position of '{name}', not {given}"
        )
    return JointRange(joint, given[0], given[1])


def name_after(model: mujoco.MjModel, place: int) -> str:
    """Return the name of the numeric at a place of the tuples' elements, "" if there is no numeric."""
    if place < 0 or int(model.tuple_objtype[place]) != int(OBJ.mjOBJ_NUMERIC):
        return ""
    return name_of(model, OBJ.mjOBJ_NUMERIC, int(model.tuple_objid[place]))
