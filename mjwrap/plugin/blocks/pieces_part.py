"""Write the part of a block that switches couplings of several pieces."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.model.piece_table import piece_table
from mjwrap.plugin.callbacks import pieces as pc
from mjwrap.plugin.mujoco_c.library import library
from mjwrap.plugin.mujoco_c.offsets import offsets
from mjwrap.plugin.mujoco_c.registration import address_of


def pieces_part(model: mujoco.MjModel) -> NDArray[np.int64]:
    """Return the part of the block that `callbacks/pieces.py` reads, as 64-bit integers."""
    head, table = np.zeros(pc.HEAD, dtype=np.int64), piece_table(model)
    head[pc.COUPLINGS] = len(table.term) - 1
    if not head[pc.COUPLINGS]:
        return head
    head[pc.TERMS], head[pc.PIECES] = len(table.at), len(table.equality)
    head[pc.POSITIONS], head[pc.EQUALITIES] = model.nq, model.neq
    head[pc.QPOS], head[pc.EQ_ACTIVE] = (offsets().data[name] for name in ("qpos", "eq_active"))
    lib = library()
    functions = lib.mj_makeConstraint, lib.mj_island, lib.mj_projectConstraint
    head[pc.MAKE : pc.PROJECT + 1] = [address_of(function) for function in functions]
    pieces = [head]
    for place, array in enumerate(table, start=pc.A_TERM):
        head[place] = 8 * sum(len(piece) for piece in pieces)
        pieces.append(np.ascontiguousarray(array).view(np.int64))
    return np.concatenate(pieces)
