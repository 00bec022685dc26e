"""Keep the muscles' arrays equal to the mjModel: a changed number takes effect at the next evaluation.

The parameters of MuJoCo's own muscle law and the limits of controls are compared in place, without a copy; `drives`
gives the actuator of each muscle. For all other numbers the block has a copy of the parts of the model from which the
muscles' arrays were made, in lists of regions (offset of the pointer in mjModel, first byte, count):

- plain: doubles that the muscles' arrays contain unchanged; the rows of `bound` copy them;
- derived: doubles from which the arrays are computed; if one changes, Python computes the arrays again;
- structure: bytes of ids and kinds, compared only when another model is used, as in `rollout` over a list of models.

`mjwrap/plugin/blocks/model_changes.py` makes the lists.
"""

from __future__ import annotations

from mjwrap.kernels.musculotendon import mujoco_muscle as law
from mjwrap.kernels.musculotendon.dispatch import PARAMS
from mjwrap.mjcf.marks import COLUMN
from mjwrap.plugin.callbacks import block as bk
from mjwrap.plugin.callbacks._cache import jit
from mjwrap.plugin.callbacks.memory import (
    call,
    float64_array,
    int64_array,
    read_int64,
    uint8_array,
    write_int64,
)

# columns of a list of regions; `bound` also has the array of the block, and the number in it
POINTER, FIRST, COUNT, ARRAY, NUMBER = 0, 1, 2, 3, 4
REGION, BINDING = 3, 5
# columns of `drives` (n, 4): a muscle's actuator and its output, -1 if its law is not MuJoCo's; what is compared
D_ACTUATOR, D_OUTPUT, D_FOLLOWS, DRIVE = 0, 1, 2, 4
BIAS, CONTROL = 1, 2  # bits of D_FOLLOWS: biasprm; the limits of its control
# `pointers` (6, 2): offsets in mjModel of the pointers to these arrays, and the arrays' sizes
POINTERS = (
    "actuator_gainprm", "actuator_biasprm", "actuator_lengthrange", "actuator_acc0", "actuator_gear",
    "actuator_ctrlrange",
)  # fmt: skip
PRM, GEARS = 10, 6  # numbers in a row of gainprm and biasprm, and of gear


@jit
def _table(block, which, rows, columns):
    return int64_array(block + read_int64(block + 8 * which), (read_int64(block + 8 * rows), columns))


@jit
def _differs(block, which, seen, rows, model):
    """Return whether doubles in a list of regions have changed."""
    regions = _table(block, which, rows, REGION)
    at = block + read_int64(block + 8 * seen)
    for r in range(regions.shape[0]):
        count = regions[r, COUNT]
        live = int64_array(read_int64(model + regions[r, POINTER]) + regions[r, FIRST], (count,))
        kept = int64_array(at, (count,))
        changes = 0
        for i in range(count):
            changes |= live[i] ^ kept[i]
        if changes != 0:
            return True
        at += 8 * count
    return False


@jit
def _living(block, model, which):
    """Return a flat array of the model, given by its row in `pointers`, as 64-bit integers."""
    pointers = int64_array(block + read_int64(block + 8 * bk.A_POINTERS), (6, 2))
    return int64_array(read_int64(model + pointers[which, 0]), (pointers[which, 1],))


@jit
def _match(live, at, mine, to, count):
    """Return the bits in which integers of two arrays differ."""
    changes = 0
    for i in range(count):
        changes |= live[at + i] ^ mine[to + i]
    return changes


@jit
def _copy(live, at, mine, to, count):
    for i in range(count):
        mine[to + i] = live[at + i]


@jit
def _laws(block, model):
    """Copy MuJoCo's muscle laws and the limits of controls from the model, where they differ.

    Limits of force are the marks in gainprm and biasprm (`mjcf/marks.py`). All numbers are compared bit by bit.
    """
    n = read_int64(block + 8 * bk.MUSCLES)
    drives = int64_array(block + read_int64(block + 8 * bk.A_DRIVES), (n, DRIVE))
    control = int64_array(block + read_int64(block + 8 * bk.A_CONTROL), (n,))
    params = int64_array(block + read_int64(block + 8 * bk.A_PARAMS), (n * PARAMS,))
    low = int64_array(block + read_int64(block + 8 * bk.A_CTRL_LOW), (n,))
    high = int64_array(block + read_int64(block + 8 * bk.A_CTRL_HIGH), (n,))
    gain, bias, lengths = _living(block, model, 0), _living(block, model, 1), _living(block, model, 2)
    acc0, gear, limits = _living(block, model, 3), _living(block, model, 4), _living(block, model, 5)
    for m in range(n):
        a, o, follows = drives[m, D_ACTUATOR], drives[m, D_OUTPUT], drives[m, D_FOLLOWS]
        row, c = m * PARAMS, 2 * control[m]
        if follows & CONTROL != 0:
            changes = _match(limits, c, low, m, 1) | _match(limits, c + 1, high, m, 1)
            if changes != 0:
                low[m], high[m] = limits[c], limits[c + 1]
        if a < 0:
            continue
        changes = _match(gain, PRM * a, params, row, 9)
        changes |= _match(gain, PRM * a + COLUMN, params, row + law.LIMITS, 1)
        changes |= _match(bias, PRM * a + COLUMN, params, row + law.LIMITS + 1, 1)
        changes |= _match(lengths, 2 * o, params, row + law.RANGE, 2)
        changes |= _match(acc0, o, params, row + law.ACC0, 1)
        changes |= _match(gear, GEARS * o, params, row + law.GEAR, 1)
        if follows & BIAS != 0:
            changes |= _match(bias, PRM * a, params, row + law.PASSIVE, 4)
            changes |= _match(bias, PRM * a + 5, params, row + law.PASSIVE + 4, 1)
            changes |= _match(bias, PRM * a + 7, params, row + law.PASSIVE + 5, 1)
        if changes == 0:
            continue
        _copy(gain, PRM * a, params, row, 9)
        _copy(gain, PRM * a + COLUMN, params, row + law.LIMITS, 1)
        _copy(bias, PRM * a + COLUMN, params, row + law.LIMITS + 1, 1)
        _copy(lengths, 2 * o, params, row + law.RANGE, 2)
        _copy(acc0, o, params, row + law.ACC0, 1)
        _copy(gear, GEARS * o, params, row + law.GEAR, 1)
        if follows & BIAS != 0:
            _copy(bias, PRM * a, params, row + law.PASSIVE, 4)
            _copy(bias, PRM * a + 5, params, row + law.PASSIVE + 4, 1)
            _copy(bias, PRM * a + 7, params, row + law.PASSIVE + 5, 1)


@jit
def _other_structure(block, model):
    """Return whether another model has other ids or kinds."""
    regions = _table(block, bk.A_STRUCTURE, bk.STRUCTURE, REGION)
    at = block + read_int64(block + 8 * bk.A_STRUCTURE_SEEN)
    for r in range(regions.shape[0]):
        count = regions[r, COUNT]
        live = uint8_array(read_int64(model + regions[r, POINTER]) + regions[r, FIRST], (count,))
        kept = uint8_array(at, (count,))
        for i in range(count):
            if live[i] != kept[i]:
                return True
        at += count
    return False


@jit
def _note(block, which, seen, rows, size, model):
    """Store the present contents of a list of regions; size: bytes of a number."""
    regions = _table(block, which, rows, REGION)
    at = block + read_int64(block + 8 * seen)
    for r in range(regions.shape[0]):
        count = size * regions[r, COUNT]
        live = uint8_array(read_int64(model + regions[r, POINTER]) + regions[r, FIRST], (count,))
        kept = uint8_array(at, (count,))
        for i in range(count):
            kept[i] = live[i]
        at += count


@jit
def _bind(block, model):
    """Copy the plain numbers of the model to the muscles' arrays."""
    bound = _table(block, bk.A_BOUND, bk.BOUND, BINDING)
    for r in range(bound.shape[0]):
        count = bound[r, COUNT]
        live = float64_array(read_int64(model + bound[r, POINTER]) + bound[r, FIRST], (count,))
        place = float64_array(
            block + read_int64(block + 8 * bound[r, ARRAY]) + 8 * bound[r, NUMBER], (count,)
        )
        for i in range(count):
            place[i] = live[i]


@jit
def sync_with_model(block, model):
    """Update the muscles' arrays to the present model."""
    other = read_int64(block + 8 * bk.MODEL) != model
    _laws(block, model)
    plain = _differs(block, bk.A_PLAIN, bk.A_PLAIN_SEEN, bk.PLAIN, model)
    derived = _differs(block, bk.A_DERIVED, bk.A_DERIVED_SEEN, bk.DERIVED, model)
    if not (plain or derived or other):
        return
    write_int64(block + 8 * bk.MODEL, model)
    if derived or (other and _other_structure(block, model)):
        call(read_int64(block + 8 * bk.REBUILD), block, model, read_int64(block + 8 * bk.INSTANCE))
        _note(block, bk.A_DERIVED, bk.A_DERIVED_SEEN, bk.DERIVED, 8, model)
        _note(block, bk.A_STRUCTURE, bk.A_STRUCTURE_SEEN, bk.STRUCTURE, 1, model)
    if plain:
        _bind(block, model)
        _note(block, bk.A_PLAIN, bk.A_PLAIN_SEEN, bk.PLAIN, 8, model)
