"""The layout of a block, which is the memory of one instance of the plugin for one mjData.

A block has a copy of the muscles' arrays (`mjwrap/model/arrays.py`), the kernels' scratch memory, and the forces that
were added to xfrc_applied. So threads share no memory, and all of it is freed with the mjData. Its head is an array of
64-bit integers: sizes, offsets of MuJoCo's fields, addresses of functions, and the byte at which each array starts.
"""

from __future__ import annotations

# sizes
BYTES = 0
MUSCLES, NODES, ROUTES, BODIES, SITES, GEOMS, ACTS, CTRLS = 1, 2, 3, 4, 5, 6, 7, 8
LOADED, NSTATE = 9, 10  # bodies that muscles pull, numbers in plugin_state
STATE_ADDRESS = 11  # index of the instance's first number in plugin_state
# functions
DRAW = 12  # 0 if drawing is not possible
STAGE, FINISH, FREE = 13, 14, 15  # FREE: frees the block
# byte offsets of mjData's and mjModel's fields, in this order
FIELDS = (
    "time", "act", "ctrl", "plugin_state", "xfrc_applied", "site_xpos", "geom_xpos", "geom_xmat", "cvel",
    "subtree_com", "xipos", "opt.timestep", "opt.integrator", "opt.disableflags", "opt.disableactuator",
)  # fmt: skip
(
    TIME, ACT, CTRL, PLUGIN_STATE, XFRC, SITE_XPOS, GEOM_XPOS, GEOM_XMAT, CVEL,
    SUBTREE_COM, XIPOS, TIMESTEP, INTEGRATOR, DISABLEFLAGS, DISABLEACTUATOR,
) = range(16, 16 + len(FIELDS))  # fmt: skip
# MuJoCo's codes: the integrator RK4, the bit of `disableflags` that switches actuation off
RUNGE_KUTTA, NO_ACTUATION = 32, 33
# for `sync.py`: the model at the last update, its instance, the function that rewrites the block, and the number of
# regions of each kind
MODEL, INSTANCE, REBUILD, PLAIN, DERIVED, STRUCTURE, BOUND = 34, 35, 36, 37, 38, 39, 40
PUBLISH = 41  # a function: shows the forces of muscles that act by wrenches
# offsets of the arrays
ARRAYS = (
    "routes", "links", "law", "source", "index", "control", "form", "group", "body_rootid", "loaded",
    "weights", "params", "ctrl_low", "ctrl_high", "times",
    "node", "seg", "count", "info", "own", "excitation", "drive", "start_activation", "start_fiber", "start_length",
    "activation", "fiber", "length", "velocity", "tension", "next_activation", "next_fiber", "status",
    "wrench", "others", "mine", "total", "off", "written", "clock", "failures", "lost", "transmission", "published",
    "points",
    "tendon", "actuator", "labels", "blank",
    "plain", "plain_seen", "derived", "derived_seen", "structure", "structure_seen", "bound", "drives", "pointers",
    "pieces",
)  # fmt: skip
(
    A_ROUTES, A_LINKS, A_LAW, A_SOURCE, A_INDEX, A_CONTROL, A_FORM, A_GROUP, A_BODY_ROOTID, A_LOADED,
    A_WEIGHTS, A_PARAMS, A_CTRL_LOW, A_CTRL_HIGH, A_TIMES,
    A_NODE, A_SEG, A_COUNT, A_INFO, A_OWN, A_EXCITATION, A_DRIVE, A_START_ACTIVATION, A_START_FIBER, A_START_LENGTH,
    A_ACTIVATION, A_FIBER, A_LENGTH, A_VELOCITY, A_TENSION, A_NEXT_ACTIVATION, A_NEXT_FIBER, A_STATUS,
    A_WRENCH, A_OTHERS, A_MINE, A_TOTAL, A_OFF, A_WRITTEN, A_CLOCK, A_FAILURES, A_LOST, A_TRANSMISSION, A_PUBLISHED,
    A_POINTS,
    A_TENDON, A_ACTUATOR, A_LABELS, A_BLANK,
    A_PLAIN, A_PLAIN_SEEN, A_DERIVED, A_DERIVED_SEEN, A_STRUCTURE, A_STRUCTURE_SEEN, A_BOUND, A_DRIVES, A_POINTERS,
    A_PIECES,
) = range(48, 48 + len(ARRAYS))  # fmt: skip
# for drawing: byte offsets in MuJoCo's structs (for an option: of its byte), the size of an mjvGeom, MuJoCo's codes,
# the addresses of a function that warns and of its message
DRAWING = (
    "scene.maxgeom", "scene.ngeom", "scene.geoms", "scene.status",
    "option.label", "option.tendon", "option.actuator", "option.activation", "option.transparent",
    "option.tendongroup", "option.actuatorgroup",
    "geom.bytes", "geom.type", "geom.objtype", "geom.objid", "geom.category", "geom.segid", "geom.size", "geom.pos",
    "geom.mat", "geom.rgba", "geom.emission", "geom.specular", "geom.shininess", "geom.reflectance", "geom.label",
    "model.tendon_width", "model.tendon_rgba", "model.tendon_group", "model.tendon_matid", "model.mat_rgba",
    "model.mat_emission", "model.mat_specular", "model.mat_shininess", "model.mat_reflectance", "model.actuator_group",
    "model.vis.rgba.actuator", "model.vis.rgba.actuatornegative", "model.vis.rgba.actuatorpositive",
    "model.vis.rgba.contactpoint",
    "model.vis.map.alpha", "model.vis.map.actuatortendon",
    "code.label_tendon", "code.label_actuator", "code.capsule", "code.sphere", "code.tendon", "code.actuator",
    "code.dynamic", "code.decor", "code.unknown",
    "warn", "full",
)  # fmt: skip
_FIRST = 48 + len(ARRAYS)
(
    D_MAXGEOM, D_NGEOM, D_GEOMS, D_STATUS,
    D_LABEL, D_TENDON, D_ACTUATOR, D_ACTIVATION, D_TRANSPARENT,
    D_TENDONGROUP, D_ACTUATORGROUP,
    G_BYTES, G_TYPE, G_OBJTYPE, G_OBJID, G_CATEGORY, G_SEGID, G_SIZE, G_POS,
    G_MAT, G_RGBA, G_EMISSION, G_SPECULAR, G_SHININESS, G_REFLECTANCE, G_LABEL,
    D_TENDON_WIDTH, D_TENDON_RGBA, D_TENDON_GROUP, D_TENDON_MATID, D_MAT_RGBA,
    D_MAT_EMISSION, D_MAT_SPECULAR, D_MAT_SHININESS, D_MAT_REFLECTANCE, D_GROUP,
    D_ACTUATOR_RGBA, D_NEGATIVE_RGBA, D_POSITIVE_RGBA, D_CONTACT_RGBA,
    D_ALPHA, D_ACTUATOR_SCALE,
    C_LABEL_TENDON, C_LABEL_ACTUATOR, C_CAPSULE, C_SPHERE, C_TENDON, C_ACTUATOR,
    C_DYNAMIC, C_DECOR, C_UNKNOWN,
    D_WARN, D_FULL,
) = range(_FIRST, _FIRST + len(DRAWING))  # fmt: skip
HEAD = _FIRST + len(DRAWING)

SILENT = -2  # in `group`: the muscle's own tension is zero, since its actuator pulls

# entries of `clock`: time of the first evaluation since the last step, used while the state has no time of its own;
# whether there was an evaluation since the last step
FIRST, ACTED = 0, 1
CLOCK = 2
