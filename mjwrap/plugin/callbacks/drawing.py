"""Draw muscles as geoms of an mjvScene, which MuJoCo's viewers and its renderer show with the model.

A path is drawn as MuJoCo draws a tendon: as capsules with the tendon's width, colour, material and group, or with those
of a new tendon if the muscle has none. The default grey is replaced by the colour of the muscle's activation. If
actuators are shown, the path is drawn a second time, wider and in the colour of control or activation. Contact points
are spheres.

The block is not changed: geodesics are evaluated from point to point in a copy of its nodes.
"""

from __future__ import annotations

import math

import numpy as np

from mjwrap.kernels import layout as lay
from mjwrap.kernels.coupling.drawn_paths import route_contacts, route_points
from mjwrap.kernels.coupling.muscle_paths import R_MUSCLE, ROUTE
from mjwrap.kernels.solved import segments as sg
from mjwrap.mjcf.marks import HIDDEN_BELOW, HIDDEN_FACTOR
from mjwrap.plugin.callbacks import block as bk
from mjwrap.plugin.callbacks._cache import jit
from mjwrap.plugin.callbacks.memory import (
    call,
    float32_array,
    int32_array,
    read_float32,
    read_float64,
    read_int32,
    read_int64,
    read_uint8,
    uint8_array,
)
from mjwrap.plugin.callbacks.saving import floats, ints, sizes
from mjwrap.plugin.callbacks.stage import GROUPS as SWITCHES

WIDTH = 0.003  # of a muscle without a tendon [m]: MuJoCo's default
BEAD = 1.5  # radius of a contact point [widths]
ROOM = 4096  # points of a path for which memory is allocated at first
GROUPS = 6  # mjNGROUP
TINY = 1e-15  # mjMINVAL
LABEL = 100  # bytes of a label
LOOK = 8  # colour (4), emission, specular, shininess, reflectance: as they follow each other in `D_MAT_...`


@jit
def _at(block, place):
    return read_int64(block + 8 * place)


@jit
def _shows(block, option, groups, group):
    """Return whether an option shows the elements of a group; the group is clipped as in MuJoCo."""
    return read_uint8(option + _at(block, groups) + min(max(group, 0), GROUPS - 1)) != 0


@jit
def width_of(width):
    """Return the width of a tendon as written in the model, before `hide_tendons`."""
    return width / HIDDEN_FACTOR if width < HIDDEN_BELOW else width


@jit
def _mix(block, model, value, low, high, look):
    """Write the colour of an actuator for a control or activation between its limits, by MuJoCo's rule."""
    if low == -math.inf:
        low, high = -1.0, 1.0
    least, middle, most = low, 0.0, high
    if low >= 0.0:
        least, middle = -1.0, low
    elif high <= 0.0:
        middle, most = high, 1.0
    above = value > middle
    share = (
        (value - middle) / max(most - middle, TINY) if above else (middle - value) / max(middle - least, TINY)
    )
    share = min(max(share, 0.0), 1.0)
    end = _at(block, bk.D_POSITIVE_RGBA if above else bk.D_NEGATIVE_RGBA)
    for i in range(4):
        rest = read_float32(model + _at(block, bk.D_ACTUATOR_RGBA) + 4 * i)
        look[i] = rest + share * (read_float32(model + end + 4 * i) - rest)


@jit
def _plain(block, look):
    """Write the reflection coefficients of a geom without a material."""
    blank = block + _at(block, bk.A_BLANK)
    for i in range(4):
        look[4 + i] = read_float32(blank + _at(block, bk.G_EMISSION + i))


@jit
def _tendon_look(block, model, option, tendon, activation, low, high, look):
    """Write colour and material of a tendon (-1: none) by MuJoCo's rules, except for the default grey."""
    _plain(block, look)
    material, own = -1, False
    if tendon >= 0:
        material = read_int32(read_int64(model + _at(block, bk.D_TENDON_MATID)) + 4 * tendon)
        rgba = read_int64(model + _at(block, bk.D_TENDON_RGBA)) + 16 * tendon
        own = (
            read_float32(rgba) != 0.5
            or read_float32(rgba + 4) != 0.5
            or read_float32(rgba + 8) != 0.5
            or read_float32(rgba + 12) != 1.0
        )
        if material >= 0:
            for i in range(4):
                look[i] = read_float32(read_int64(model + _at(block, bk.D_MAT_RGBA)) + 16 * material + 4 * i)
                look[4 + i] = read_float32(
                    read_int64(model + _at(block, bk.D_MAT_EMISSION + i)) + 4 * material
                )
        if own:
            for i in range(4):
                look[i] = read_float32(rgba + 4 * i)
    if material < 0 and not own:
        _mix(block, model, activation, low, high, look)
    if read_uint8(option + _at(block, bk.D_TRANSPARENT)) != 0:
        look[3] *= read_float32(model + _at(block, bk.D_ALPHA))


@jit
def _add(block, scene, kind, identity, category, look):
    """Return the address of a new geom of the scene with all but its shape filled in; 0 if the scene is full.

    identity: type and id of its element, as in segmented images.
    """
    number = read_int32(scene + _at(block, bk.D_NGEOM))
    if number >= read_int32(scene + _at(block, bk.D_MAXGEOM)):
        status = int32_array(scene + _at(block, bk.D_STATUS), (1,))
        if status[0] == 0:
            status[0] = 1
            call(_at(block, bk.D_WARN), _at(block, bk.D_FULL), 0, 0)
        return 0
    size = _at(block, bk.G_BYTES)
    geom = read_int64(scene + _at(block, bk.D_GEOMS)) + size * number
    blank, new = int32_array(block + _at(block, bk.A_BLANK), (size // 4,)), int32_array(geom, (size // 4,))
    for i in range(size // 4):
        new[i] = blank[i]
    new[_at(block, bk.G_TYPE) // 4] = kind
    new[_at(block, bk.G_OBJTYPE) // 4] = identity[0]
    new[_at(block, bk.G_OBJID) // 4] = identity[1]
    new[_at(block, bk.G_CATEGORY) // 4] = category
    new[_at(block, bk.G_SEGID) // 4] = number
    number_of = int32_array(scene + _at(block, bk.D_NGEOM), (1,))
    number_of[0] = number + 1
    colour = float32_array(geom + _at(block, bk.G_RGBA), (4,))
    for i in range(4):
        colour[i] = look[i]
        light = float32_array(geom + _at(block, bk.G_EMISSION + i), (1,))
        light[0] = look[4 + i]
    return geom


@jit
def _stretch(block, geom, ax, ay, az, bx, by, bz, radius):
    """Set the shape of a capsule between two points, turned from z by the shortest way, as by mjv_connector."""
    dx, dy, dz = bx - ax, by - ay, bz - az
    length = math.sqrt(dx * dx + dy * dy + dz * dz)
    x, y, z = dx / length, dy / length, dz / length
    across = x * x + y * y
    h = 0.0
    if across > 0.0:
        h = 1.0 / (1.0 + z) if z > 0.0 else (1.0 - z) / across
    size, pos = (
        float32_array(geom + _at(block, bk.G_SIZE), (3,)),
        float32_array(geom + _at(block, bk.G_POS), (3,)),
    )
    size[0], size[1], size[2] = radius, radius, 0.5 * length
    pos[0], pos[1], pos[2] = 0.5 * (ax + bx), 0.5 * (ay + by), 0.5 * (az + bz)
    turn = float32_array(geom + _at(block, bk.G_MAT), (9,))
    turn[0], turn[1], turn[2] = 1.0 - h * x * x, -h * x * y, x
    turn[3], turn[4], turn[5] = -h * x * y, 1.0 - h * y * y, y
    turn[6], turn[7], turn[8] = -x, -y, z
    if across == 0.0 and z < 0.0:
        turn[4] = -1.0


@jit
def _line(block, scene, points, count, radius, identity, category, look, label):
    """Draw a path's points (count, 3) as capsules, the first with the label at an address (0: none)."""
    for i in range(1, count):
        ax, ay, az = points[i - 1, 0], points[i - 1, 1], points[i - 1, 2]
        bx, by, bz = points[i, 0], points[i, 1], points[i, 2]
        if not 0.0 < (bx - ax) ** 2 + (by - ay) ** 2 + (bz - az) ** 2 < math.inf:
            continue
        geom = _add(block, scene, _at(block, bk.C_CAPSULE), identity, category, look)
        if geom == 0:
            return
        _stretch(block, geom, ax, ay, az, bx, by, bz, radius)
        if label != 0:
            text, given = uint8_array(geom + _at(block, bk.G_LABEL), (LABEL,)), uint8_array(label, (LABEL,))
            for j in range(LABEL):
                text[j] = given[j]
            label = 0


@jit
def _beads(block, scene, points, count, radius, identity, look):
    """Draw contact points (count, 3) as spheres."""
    for i in range(count):
        geom = _add(block, scene, _at(block, bk.C_SPHERE), identity, _at(block, bk.C_DECOR), look)
        if geom == 0:
            return
        size, pos = (
            float32_array(geom + _at(block, bk.G_SIZE), (3,)),
            float32_array(geom + _at(block, bk.G_POS), (3,)),
        )
        for j in range(3):
            size[j], pos[j] = radius, points[i, j]


def draw(block, model, option, scene):
    """Append the muscles of an instance, as last evaluated, to a scene, according to its options."""
    tendons = read_uint8(option + _at(block, bk.D_TENDON)) != 0
    actuators = read_uint8(option + _at(block, bk.D_ACTUATOR)) != 0
    if not tendons and not actuators:
        return
    n, nodes, routes, _ = sizes(block)
    route = ints(block, bk.A_ROUTES, (routes, ROUTE))
    node = floats(block, bk.A_NODE, (nodes, lay.ROW)).copy()
    seg = floats(block, bk.A_SEG, (nodes + routes, sg.SEGMENT))
    count, info = ints(block, bk.A_COUNT, (routes,)), floats(block, bk.A_INFO, (routes, lay.INFO))
    activation, drive = floats(block, bk.A_ACTIVATION, (n,)), floats(block, bk.A_DRIVE, (n,))
    tendon, actuator = ints(block, bk.A_TENDON, (n,)), ints(block, bk.A_ACTUATOR, (n,))
    low, high = floats(block, bk.A_CTRL_LOW, (n,)), floats(block, bk.A_CTRL_HIGH, (n,))
    switched = read_int32(model + _at(block, bk.DISABLEACTUATOR))
    by_activation = read_uint8(option + _at(block, bk.D_ACTIVATION)) != 0
    wanted = read_int32(option + _at(block, bk.D_LABEL))
    points, look = np.empty((ROOM, 3)), np.empty(LOOK)
    identity, acting = np.empty(2, dtype=np.int64), np.empty(2, dtype=np.int64)
    for c in range(routes):
        if count[c] == 0:
            continue
        m = route[c, R_MUSCLE]
        t, width, ten_group = tendon[m], WIDTH, 0
        if t >= 0:
            width = width_of(read_float64(read_int64(model + _at(block, bk.D_TENDON_WIDTH)) + 8 * t))
            ten_group = read_int32(read_int64(model + _at(block, bk.D_TENDON_GROUP)) + 4 * t)
        seen = tendons and _shows(block, option, bk.D_TENDONGROUP, ten_group)
        acts = actuators and actuator[m] >= 0
        if acts:
            group = read_int32(read_int64(model + _at(block, bk.D_GROUP)) + 4 * actuator[m])
            acts = _shows(block, option, bk.D_ACTUATORGROUP, group)
            acts = acts and not (0 <= group < SWITCHES and ((switched >> group) & 1) != 0)
        if not seen and not acts:
            continue
        many = route_points(c, route, node, seg, count, info, 0.0, points, 0)
        if many > points.shape[0]:
            points = np.empty((2 * many, 3))
            many = route_points(c, route, node, seg, count, info, 0.0, points, 0)
        label = block + _at(block, bk.A_LABELS) + LABEL * m
        if c > 0 and route[c - 1, R_MUSCLE] == m:
            label = 0
        _tendon_look(block, model, option, t, activation[m], low[m], high[m], look)
        identity[0], identity[1] = _at(block, bk.C_TENDON), t
        if t < 0:
            identity[0] = _at(block, bk.C_ACTUATOR if actuator[m] >= 0 else bk.C_UNKNOWN)
            identity[1] = actuator[m]
        if seen:
            named = label if wanted == _at(block, bk.C_LABEL_TENDON) else 0
            _line(block, scene, points, many, width, identity, _at(block, bk.C_DYNAMIC), look, named)
        if acts:
            acting[0], acting[1] = _at(block, bk.C_ACTUATOR), actuator[m]
            _mix(block, model, activation[m] if by_activation else drive[m], low[m], high[m], look)
            wide = width * read_float32(model + _at(block, bk.D_ACTUATOR_SCALE))
            named = label if wanted == _at(block, bk.C_LABEL_ACTUATOR) else 0
            _line(block, scene, points, many, wide, acting, _at(block, bk.C_DECOR), look, named)
        if seen:
            many = min(route_contacts(c, route, node, seg, count, points, 0), points.shape[0])
            _plain(block, look)
            for i in range(4):
                look[i] = read_float32(model + _at(block, bk.D_CONTACT_RGBA) + 4 * i)
            _beads(block, scene, points, many, BEAD * width, identity, look)
