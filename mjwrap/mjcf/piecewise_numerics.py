"""Read a piecewise polynomial from a numeric: P, then P - 1 breaks, P origins, and P rows of coefficients."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.errors import ModelError
from mjwrap.mjcf.names import name_of

Array = NDArray[np.float64]
OBJ = mujoco.mjtObj
_FORM = "P, then P-1 breaks, P origins and P rows of coefficients, the constant first"


def read_pieces(model: mujoco.MjModel, numeric: int) -> tuple[Array, Array, Array]:
    """Return breaks (P - 1,), origins (P,) and coefficients (P, degree + 1); `ModelError` names a wrong numeric."""
    first, name = int(model.numeric_adr[numeric]), name_of(model, OBJ.mjOBJ_NUMERIC, numeric)
    data = np.array(model.numeric_data[first : first + int(model.numeric_size[numeric])])
    if not np.isfinite(data).all():
        raise ModelError(f"numeric '{name}' must be finite")
    pieces = int(data[0]) if len(data) and data[0] == np.floor(data[0]) and 1.0 <= data[0] <= len(data) else 0
    rest = len(data) - 2 * pieces
    if not pieces or rest < pieces or rest % pieces:
        raise ModelError(
            f"numeric '{name}' is not a piecewise polynomial: its {len(data)} numbers are not {_FORM}"
        )
    breaks, origins = data[1:pieces], data[pieces : 2 * pieces]
    if (np.diff(breaks) <= 0.0).any():
        raise ModelError(f"numeric '{name}': its breaks must ascend, not be {breaks.tolist()}")
    return breaks, origins, data[2 * pieces :].reshape(pieces, -1)
