"""Switch the couplings of several pieces inside MuJoCo, at every evaluation.

MuJoCo has built its constraints in the position stage, from the equalities that were active then. The plugin is called
in the velocity stage, with the passive forces, and before MuJoCo computes the reference accelerations of the
constraints. So if another piece holds at the present pose, the constraints are built once more here, by MuJoCo's own
functions in the order of its position stage. Nothing that MuJoCo computes between the two depends on them.
`mjwrap/plugin/blocks/pieces_part.py` writes the part of a block that is read here.
"""

from __future__ import annotations

from mjwrap.kernels.coupling.pieces import switch_pieces
from mjwrap.plugin.callbacks._cache import jit
from mjwrap.plugin.callbacks.memory import call_with_two, float64_array, read_int64, uint8_array
from mjwrap.plugin.callbacks.saving import floats, ints

# sizes: of the first five arrays of `switch_pieces` and of mjData's; if COUPLINGS is 0, the rest is not filled
COUPLINGS, TERMS, PIECES, POSITIONS, EQUALITIES = range(5)
QPOS, EQ_ACTIVE = 5, 6  # byte offsets of mjData's fields
MAKE, ISLAND, PROJECT = 7, 8, 9  # addresses of MuJoCo's functions
A_TERM, A_AT, A_WEIGHT, A_PIECE, A_EQUALITY, A_KNOTS = range(10, 16)  # offsets of the arrays of `Pieces`
HEAD = 16


@jit
def update_pieces(part, model, data):
    """Let the pieces that hold at the present qpos be active, and if one changes, build the constraints again."""
    couplings = read_int64(part + 8 * COUPLINGS)
    if couplings == 0:
        return
    terms, pieces = read_int64(part + 8 * TERMS), read_int64(part + 8 * PIECES)
    qpos = read_int64(data + read_int64(part + 8 * QPOS))
    active = read_int64(data + read_int64(part + 8 * EQ_ACTIVE))
    changed = switch_pieces(
        ints(part, A_TERM, (couplings + 1,)),
        ints(part, A_AT, (terms,)),
        floats(part, A_WEIGHT, (terms,)),
        ints(part, A_PIECE, (couplings + 1,)),
        ints(part, A_EQUALITY, (pieces,)),
        floats(part, A_KNOTS, (pieces - couplings,)),
        float64_array(qpos, (read_int64(part + 8 * POSITIONS),)),
        uint8_array(active, (read_int64(part + 8 * EQUALITIES),)),
    )
    if changed:
        call_with_two(read_int64(part + 8 * MAKE), model, data)
        call_with_two(read_int64(part + 8 * ISLAND), model, data)
        call_with_two(read_int64(part + 8 * PROJECT), model, data)
