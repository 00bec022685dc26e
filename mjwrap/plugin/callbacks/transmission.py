"""Give MuJoCo's own actuators length, velocity and moment along mjwrap's paths.

MuJoCo computes these three in its position and velocity stages, then passive forces, for which it calls the plugin, and
after these the forces of actuators. So the values that the plugin writes are used by gain, bias, clamps, sensors of
velocity and force, and the derivatives of the implicit integrators. The additional data are in a part of the instance's
block with a head of its own, which `mjwrap/plugin/blocks/transmission_part.py` writes.
"""

from __future__ import annotations

from mjwrap.kernels.coupling.groups import Dofs, Transmissions
from mjwrap.kernels.coupling.moments import write_transmissions
from mjwrap.plugin.callbacks import block as bk
from mjwrap.plugin.callbacks._cache import jit
from mjwrap.plugin.callbacks.memory import int32_array, read_int32, read_int64
from mjwrap.plugin.callbacks.path_points import points_of
from mjwrap.plugin.callbacks.saving import field, floats, ints

# sizes; COUNT: number of muscles whose actuators pull; if it is 0, all act by wrenches and the rest is not filled
COUNT, DOFS, OUTPUTS, MOMENTS, TENDONS, TENDON_MOMENTS, SENSORS, SENSOR_NUMBERS = range(8)
NO_SENSORS = 8  # the bit of `disableflags` that switches sensors off
# byte offsets of mjData's fields, then of mjModel's
FIELDS = (
    "cdof", "actuator_length", "actuator_velocity", "moment_rownnz", "moment_rowadr", "moment_colind",
    "actuator_moment", "ten_length", "ten_velocity", "ten_J", "sensordata", "actuator_gear",
)  # fmt: skip
(
    CDOF, LENGTH, VELOCITY, ROWNNZ, ROWADR, COLIND, MOMENT, TEN_LENGTH, TEN_VELOCITY, TEN_J, SENSORDATA, GEAR,
) = range(9, 9 + len(FIELDS))  # fmt: skip
# offsets of the arrays: the first six as for `write_transmissions`; sensors of the position stage (k, 3): index of the
# number, muscle, whether it is an actuator's; their smallest and largest values (k, 2)
ARRAYS = ("output", "tendon", "tendon_row", "last_dof", "dof_parentid", "row", "sensor", "limits")
A_OUTPUT, A_TENDON, A_TENDON_ROW, A_LAST_DOF, A_PARENT, A_ROW, A_SENSOR, A_LIMITS = range(
    24, 24 + len(ARRAYS)
)
HEAD = 24 + len(ARRAYS)


@jit
def _indices(part, which, owner, shape):
    return int32_array(read_int64(owner + read_int64(part + 8 * which)), shape)


@jit
def transmit(part, block, model, data, first_stage, routes, poses, paths, states):
    """Write length, velocity and moment of the actuators; first_stage: also the sensors of the position stage."""
    n, dofs, outputs = states.length.shape[0], read_int64(part + 8 * DOFS), read_int64(part + 8 * OUTPUTS)
    entries, tendons = read_int64(part + 8 * MOMENTS), read_int64(part + 8 * TENDONS)
    bodies = poses.body_rootid.shape[0]
    tree = Dofs(
        ints(part, A_LAST_DOF, (bodies,)),
        ints(part, A_PARENT, (dofs,)),
        poses.body_rootid,
        field(part, CDOF, data, (dofs, 6)),
        poses.subtree_com,
    )
    targets = Transmissions(
        ints(part, A_OUTPUT, (n,)),
        ints(part, A_TENDON, (n,)),
        ints(part, A_TENDON_ROW, (n,)),
        field(part, GEAR, model, (outputs, 6)),
        field(part, LENGTH, data, (outputs,)),
        field(part, VELOCITY, data, (outputs,)),
        _indices(part, ROWNNZ, data, (outputs,)),
        _indices(part, ROWADR, data, (outputs,)),
        _indices(part, COLIND, data, (entries,)),
        field(part, MOMENT, data, (entries,)),
        field(part, TEN_LENGTH, data, (tendons,)),
        field(part, TEN_VELOCITY, data, (tendons,)),
        field(part, TEN_J, data, (read_int64(part + 8 * TENDON_MOMENTS),)),
    )
    row = floats(part, A_ROW, (dofs,))
    points = points_of(block + read_int64(block + 8 * bk.A_POINTS), block)
    write_transmissions(
        routes, paths, tree, points.uses, points.slopes, states.length, states.velocity, targets, row
    )
    flags = read_int32(model + read_int64(block + 8 * bk.DISABLEFLAGS))
    if not first_stage or flags & read_int64(part + 8 * NO_SENSORS):
        return
    sensors = read_int64(part + 8 * SENSORS)
    sensor, limits = ints(part, A_SENSOR, (sensors, 3)), floats(part, A_LIMITS, (sensors, 2))
    shown = field(part, SENSORDATA, data, (read_int64(part + 8 * SENSOR_NUMBERS),))
    for k in range(sensors):
        m = sensor[k, 1]
        value = targets.actuator_length[targets.output[m]]
        if sensor[k, 2] == 0:
            value = targets.ten_length[targets.tendon[m]]
        shown[sensor[k, 0]] = min(max(value, limits[k, 0]), limits[k, 1])
