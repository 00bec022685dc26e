"""The couplings of several pieces of a model, as arrays for the kernels."""

from __future__ import annotations

import mujoco
import numpy as np

from mjwrap.kernels.coupling.pieces import Pieces
from mjwrap.mjcf.coupling_pieces import read_pieces


def piece_table(model: mujoco.MjModel) -> Pieces:
    """Return the couplings of a model that have several pieces; `ModelError` for a wrong tuple."""
    couplings = [coupling for coupling in read_pieces(model) if len(coupling.equalities) > 1]

    def joined(parts: list, kind: type) -> np.ndarray:  # an empty list has no numbers
        return np.array([x for part in parts for x in part], dtype=kind)

    def starts(parts: list) -> np.ndarray:
        return np.cumsum([0, *(len(part) for part in parts)], dtype=np.int64)

    leaders = [coupling.leaders for coupling in couplings]
    equalities = [coupling.equalities for coupling in couplings]
    return Pieces(
        starts(leaders),
        joined([model.jnt_qposadr[list(each)] for each in leaders], np.int64),
        joined([coupling.weights for coupling in couplings], np.float64),
        starts(equalities),
        joined(equalities, np.int64),
        joined([coupling.knots for coupling in couplings], np.float64),
    )
