"""Write the part of a block that has the moving and conditional path points."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.model.path_points import PointPlan
from mjwrap.plugin.callbacks import path_points as pp
from mjwrap.plugin.mujoco_c.offsets import offsets

Ints = NDArray[np.int64]


def points_part(model: mujoco.MjModel, points: PointPlan | None) -> Ints:
    """Return the part of the block that `callbacks/path_points.py` reads, as 64-bit integers."""
    head = np.zeros(pp.HEAD, dtype=np.int64)
    if points is None:
        return head
    group = points.group()
    head[pp.GIVEN], head[pp.AXES], head[pp.NUMBERS] = 1, len(group.axes), len(group.numbers)
    head[pp.USES], head[pp.CONDITIONS] = len(group.uses), len(group.conditions)
    head[pp.DOFS], head[pp.POSITIONS] = model.nv, model.nq
    fields = offsets().data | offsets().model
    head[pp.QPOS : pp.QPOS + len(pp.FIELDS)] = [fields[name] for name in pp.FIELDS]
    pieces = [head]
    for place, name in enumerate(pp.ARRAYS, start=pp.A_AXES):
        head[place] = 8 * sum(len(piece) for piece in pieces)
        pieces.append(np.ascontiguousarray(getattr(group, name)).ravel().view(np.int64))
    return np.concatenate(pieces)
