"""Moving and conditional path points inside MuJoCo: the kernels' groups, and the forces on joints that move points.

The additional data are in a part of the instance's block with a head of its own, which
`mjwrap/plugin/blocks/points_part.py` writes. The moving sites are written to site_xpos, so that viewers show them where
the paths pass; the generalised forces go to qfrc_passive, which MuJoCo clears before it calls the plugin.
"""

from __future__ import annotations

from mjwrap.kernels.coupling.groups import PathPoints, SiteFrames
from mjwrap.kernels.coupling.path_points import AXIS, CONDITION, SLOPE, USE
from mjwrap.plugin.callbacks import block as bk
from mjwrap.plugin.callbacks._cache import jit
from mjwrap.plugin.callbacks.memory import read_int64
from mjwrap.plugin.callbacks.saving import field, floats, ints

# sizes; GIVEN: whether there are such points; if it is 0, the rest is not filled
GIVEN, AXES, NUMBERS, USES, CONDITIONS, DOFS, POSITIONS = range(7)
# byte offsets of mjData's fields, then of mjModel's
FIELDS = ("qpos", "qvel", "xpos", "xmat", "qfrc_passive", "site_pos")
QPOS, QVEL, XPOS, XMAT, QFRC, SITE_POS = range(7, 7 + len(FIELDS))
# offsets of the arrays, as in `PathPoints`
ARRAYS = ("axes", "numbers", "uses", "conditions", "ranges", "slopes", "active", "force")
A_AXES, A_NUMBERS, A_USES, A_CONDITIONS, A_RANGES, A_SLOPES, A_ACTIVE, A_FORCE = range(13, 13 + len(ARRAYS))
HEAD = 13 + len(ARRAYS)


@jit
def points_of(part, block):
    """Return the group of moving and conditional points."""
    axes, conditions = read_int64(part + 8 * AXES), read_int64(part + 8 * CONDITIONS)
    return PathPoints(
        ints(part, A_AXES, (axes, AXIS)),
        floats(part, A_NUMBERS, (read_int64(part + 8 * NUMBERS),)),
        ints(part, A_USES, (read_int64(part + 8 * USES), USE)),
        ints(part, A_CONDITIONS, (conditions, CONDITION)),
        floats(part, A_RANGES, (conditions, 2)),
        floats(part, A_SLOPES, (axes, SLOPE)),
        ints(part, A_ACTIVE, (read_int64(block + 8 * bk.ROUTES),)),
        floats(part, A_FORCE, (read_int64(part + 8 * DOFS),)),
    )


@jit
def frames_of(part, block, model, data):
    """Return the group of what places sites."""
    bodies, sites = read_int64(block + 8 * bk.BODIES), read_int64(block + 8 * bk.SITES)
    return SiteFrames(
        field(part, QPOS, data, (read_int64(part + 8 * POSITIONS),)),
        field(part, QVEL, data, (read_int64(part + 8 * DOFS),)),
        field(part, XPOS, data, (bodies, 3)),
        field(part, XMAT, data, (bodies, 9)),
        field(part, SITE_POS, model, (sites, 3)),
    )


@jit
def add_joint_forces(part, data):
    """Add the generalised forces of the last evaluation to qfrc_passive."""
    force = floats(part, A_FORCE, (read_int64(part + 8 * DOFS),))
    passive = field(part, QFRC, data, (force.shape[0],))
    for i in range(force.shape[0]):
        passive[i] += force[i]
