"""Show the results of muscles that act by wrenches where MuJoCo has those of its own actuators and tendons.

MuJoCo computes lengths, then velocities, then passive forces, for which it calls the plugin, and then the forces of
actuators. So `publish_lengths` runs with the passive forces, and `publish_forces` where MuJoCo asks plugins for the
forces of actuators: after its own, before sensors read them. There the moments of these actuators become empty rows,
because the wrenches pull already; MuJoCo fills the rows again at every state. The additional data are in a part of the
instance's block with a head of its own, which `mjwrap/plugin/blocks/published_part.py` writes.
"""

from __future__ import annotations

import math

from mjwrap.plugin.callbacks import block as bk
from mjwrap.plugin.callbacks._cache import jit
from mjwrap.plugin.callbacks.memory import float64_array, int32_array, read_int32, read_int64
from mjwrap.plugin.callbacks.saving import field, ints

# sizes; COUNT: number of muscles that are shown; if it is 0, the rest is not filled
COUNT, OUTPUTS, TENDONS, SENSORS, SENSOR_NUMBERS = range(5)
NO_SENSORS = 5  # the bit of `disableflags` that switches sensors off
# byte offsets of mjData's fields, then of mjModel's
FIELDS = (
    "actuator_length", "actuator_velocity", "actuator_force", "moment_rownnz", "ten_length",
    "ten_velocity", "sensordata", "actuator_gear",
)  # fmt: skip
LENGTH, VELOCITY, FORCE, ROWNNZ, TEN_LENGTH, TEN_VELOCITY, SENSORDATA, GEAR = range(6, 6 + len(FIELDS))
# offsets of the arrays: `shown` (COUNT, SHOWN); sensors of the position stage (k, 3): index of the number, muscle, row
# of `shown`, whether it is an actuator's; their smallest and largest values (k, 2)
ARRAYS = ("shown", "sensor", "limits")
A_SHOWN, A_SENSOR, A_LIMITS = range(20, 20 + len(ARRAYS))
HEAD = 20 + len(ARRAYS)
# columns of `shown`: the muscle; its actuator's output and its tendon, -1 if it has none that shows it; whether the
# force is shown too
S_MUSCLE, S_OUTPUT, S_TENDON, S_FORCE, SHOWN = range(5)


@jit
def publish_lengths(part, block, model, data, first_stage, length, velocity):
    """Write lengths and velocities of actuators and tendons; first_stage: also the sensors of the position stage.

    length [m], velocity [m/s] (n,): of the muscles. Where one of them is not finite, both are shown as zero.
    """
    outputs, tendons = read_int64(part + 8 * OUTPUTS), read_int64(part + 8 * TENDONS)
    shown = ints(part, A_SHOWN, (read_int64(part + 8 * COUNT), SHOWN))
    gear = field(part, GEAR, model, (outputs, 6))
    actuator_length = field(part, LENGTH, data, (outputs,))
    actuator_velocity = field(part, VELOCITY, data, (outputs,))
    ten_length, ten_velocity = (
        field(part, TEN_LENGTH, data, (tendons,)),
        field(part, TEN_VELOCITY, data, (tendons,)),
    )
    for k in range(shown.shape[0]):
        m, out, tendon = shown[k, S_MUSCLE], shown[k, S_OUTPUT], shown[k, S_TENDON]
        size, speed = length[m], velocity[m]
        if not (math.isfinite(size) and math.isfinite(speed)):
            size, speed = 0.0, 0.0
        if out >= 0:
            actuator_length[out], actuator_velocity[out] = gear[out, 0] * size, gear[out, 0] * speed
        if tendon >= 0:
            ten_length[tendon], ten_velocity[tendon] = size, speed
    flags = read_int32(model + read_int64(block + 8 * bk.DISABLEFLAGS))
    if not first_stage or flags & read_int64(part + 8 * NO_SENSORS):
        return
    sensors = read_int64(part + 8 * SENSORS)
    sensor = ints(part, A_SENSOR, (sensors, 3))
    limits = float64_array(part + read_int64(part + 8 * A_LIMITS), (sensors, 2))
    values = field(part, SENSORDATA, data, (read_int64(part + 8 * SENSOR_NUMBERS),))
    for j in range(sensors):
        k = sensor[j, 1]
        value = actuator_length[shown[k, S_OUTPUT]] if sensor[j, 2] != 0 else ten_length[shown[k, S_TENDON]]
        values[sensor[j, 0]] = min(max(value, limits[j, 0]), limits[j, 1])


def publish_forces(block, model, data):
    """Write the forces of actuators whose muscles act by wrenches, and make their moments empty rows.

    The force times the gear is minus the tension, as for MuJoCo's own actuators.
    """
    part = block + read_int64(block + 8 * bk.A_PUBLISHED)
    count = read_int64(part + 8 * COUNT)
    if count == 0:
        return
    outputs = read_int64(part + 8 * OUTPUTS)
    shown = ints(part, A_SHOWN, (count, SHOWN))
    tension = float64_array(
        block + read_int64(block + 8 * bk.A_TENSION), (read_int64(block + 8 * bk.MUSCLES),)
    )
    gear, force = field(part, GEAR, model, (outputs, 6)), field(part, FORCE, data, (outputs,))
    rownnz = int32_array(read_int64(data + read_int64(part + 8 * ROWNNZ)), (outputs,))
    for k in range(count):
        out, value = shown[k, S_OUTPUT], 0.0
        if out < 0:
            continue
        if shown[k, S_FORCE] != 0 and gear[out, 0] != 0.0:
            value = -tension[shown[k, S_MUSCLE]] / gear[out, 0]
        force[out] = value if math.isfinite(value) and value != 0.0 else 0.0
        rownnz[out] = 0
