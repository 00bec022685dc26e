"""Write the first contents of a block from its compiled model."""

from __future__ import annotations

import ctypes
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.kernels import layout
from mjwrap.kernels.coupling import muscle_paths, path_points
from mjwrap.kernels.musculotendon import mujoco_muscle
from mjwrap.kernels.musculotendon.dispatch import MUJOCO
from mjwrap.kernels.solved import segments
from mjwrap.mjcf import MuscleDeclaration
from mjwrap.mjcf.marks import limit_marks
from mjwrap.model.arrays import Plan
from mjwrap.plugin.blocks.model_changes import Watch, watch
from mjwrap.plugin.blocks.pieces_part import pieces_part
from mjwrap.plugin.blocks.points_part import points_part
from mjwrap.plugin.blocks.published_part import published_part
from mjwrap.plugin.blocks.transmission_part import transmission_part
from mjwrap.plugin.callbacks import block as bk
from mjwrap.plugin.callbacks import drawing as dr
from mjwrap.plugin.callbacks import saving
from mjwrap.plugin.callbacks.hooks import Entries
from mjwrap.plugin.mujoco_c.offsets import offsets
from mjwrap.plugin.mujoco_c.visualisation import drawing

Words = NDArray[np.int64]


def loaded_bodies(plan: Plan) -> NDArray[np.int64]:
    """Return the ids of the bodies on which the muscles of a plan can act with wrenches."""
    routes = plan.routes[plan.output[plan.routes[:, muscle_paths.R_MUSCLE]] < 0]
    stops = [
        plan.links[low:high, muscle_paths.L_BODY]
        for low, high in routes[:, [muscle_paths.R_LO, muscle_paths.R_HI]]
    ]
    ends = routes[:, [muscle_paths.R_FROM_BODY, muscle_paths.R_TO_BODY]].ravel()
    return np.unique(np.concatenate([*stops, ends]))


def pulled_bodies(model: mujoco.MjModel, plan: Plan) -> NDArray[np.int64]:
    """Return the ids of the bodies that the muscles of a plan can move: also those whose joints move path points."""
    return np.union1d(loaded_bodies(plan), model.dof_bodyid[plan.uses[:, path_points.U_DOF]]).astype(np.int64)


def state_size(plan: Plan) -> int:
    """Return the number of entries of plugin_state that the muscles of a plan need; see `saving.py`."""
    numbers = 1 + saving.PER_MUSCLE * plan.n + 13 * len(loaded_bodies(plan))
    for low, high, surfaces in plan.routes[
        :, [muscle_paths.R_LO, muscle_paths.R_HI, muscle_paths.R_SURFACES]
    ]:
        if surfaces:
            numbers += int(surfaces * saving.SAVED + 1 + (high - low + 1) * segments.SEGMENT)
    return numbers


def _arrays(
    model: mujoco.MjModel, plan: Plan, muscles: list[MuscleDeclaration], left_out: set[int], watched: Watch
) -> dict[str, Any]:
    n, nodes, routes = plan.n, len(plan.node), len(plan.routes)
    sketch = drawing()
    groups = [int(model.actuator_group[m.actuator]) if m.actuator >= 0 else -1 for m in muscles]
    groups = [bk.SILENT if out >= 0 else group for out, group in zip(plan.output, groups, strict=True)]
    arrays: dict[str, Any] = {name: getattr(plan, name) for name in bk.ARRAYS if hasattr(plan, name)}
    params = np.array(plan.params)
    for m, (muscle, law) in enumerate(zip(muscles, plan.law, strict=True)):
        if muscle.actuator >= 0 and law == MUJOCO:  # its limits are marks that `sync.py` compares
            limits = limit_marks(model, muscle.actuator)
            params[m, mujoco_muscle.LIMITS : mujoco_muscle.LIMITS + 2] = limits
    arrays |= {
        "params": params,
        "group": np.array(groups, dtype=np.int64),
        "body_rootid": np.array(model.body_rootid, dtype=np.int64),
        "loaded": loaded_bodies(plan),
        "seg": np.zeros((nodes + routes, segments.SEGMENT)),
        "count": np.zeros(routes, dtype=np.int64),
        "info": np.zeros((routes, layout.INFO)),
        "own": np.zeros((n, 2)),
        "status": np.zeros(n, dtype=np.int64),
        "failures": np.zeros(n, dtype=np.int64),
        "off": np.zeros(n, dtype=np.bool_),
        "lost": np.zeros(n, dtype=np.bool_),
        "written": np.zeros(model.nbody, dtype=np.bool_),
        "clock": np.zeros(bk.CLOCK),
        "transmission": transmission_part(model, plan, muscles),
        "published": published_part(model, plan, muscles, left_out),
        "points": points_part(model, plan.points),
        "pieces": pieces_part(model),
        "tendon": np.array([m.tendon for m in muscles], dtype=np.int64),
        "actuator": np.array([m.actuator for m in muscles], dtype=np.int64),
        "labels": np.array([m.name.encode()[: dr.LABEL - 1] for m in muscles], dtype=f"S{dr.LABEL}"),
        "blank": np.frombuffer(sketch.blank if sketch else b"", dtype=np.uint8),
    }
    for name, value in watched._asdict().items():
        arrays[name] = np.frombuffer(value, dtype=np.uint8) if isinstance(value, bytes) else value
    arrays |= {name: np.zeros((model.nbody, 6)) for name in ("wrench", "others", "mine", "total")}
    return {name: arrays.get(name, np.zeros(n)) for name in bk.ARRAYS}


def block_image(
    model: mujoco.MjModel,
    instance: int,
    plan: Plan,
    muscles: list[MuscleDeclaration],
    left_out: set[int],
    entries: Entries,
    free: int,
    rebuild: int,
) -> bytes:
    """Return the block for an instance of the plugin.

    left_out: tendons that the running model leaves out. free, rebuild: addresses of functions.
    """
    watched = watch(model, plan, muscles)
    head = np.zeros(bk.HEAD, dtype=np.int64)
    head[bk.MUSCLES], head[bk.NODES], head[bk.ROUTES] = plan.n, len(plan.node), len(plan.routes)
    head[bk.BODIES], head[bk.SITES], head[bk.GEOMS] = model.nbody, model.nsite, model.ngeom
    head[bk.ACTS], head[bk.CTRLS] = model.na, model.nu
    head[bk.LOADED], head[bk.NSTATE] = len(loaded_bodies(plan)), state_size(plan)
    head[bk.STATE_ADDRESS] = model.plugin_stateadr[instance]
    head[bk.STAGE], head[bk.FINISH], head[bk.FREE] = entries.stage.address, entries.finish.address, free
    head[bk.PUBLISH] = entries.publish.address
    head[bk.RUNGE_KUTTA] = int(mujoco.mjtIntegrator.mjINT_RK4)
    head[bk.NO_ACTUATION] = int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
    head[bk.INSTANCE], head[bk.REBUILD], head[bk.BOUND] = instance, rebuild, len(watched.bound)
    head[bk.PLAIN], head[bk.DERIVED] = len(watched.plain), len(watched.derived)
    head[bk.STRUCTURE] = len(watched.structure)
    fields = offsets().data | offsets().model
    head[bk.TIME : bk.TIME + len(bk.FIELDS)] = [fields[name] for name in bk.FIELDS]
    sketch = drawing()
    if sketch:
        head[bk.DRAW] = entries.draw.address
        head[bk.HEAD - len(bk.DRAWING) :] = sketch.words
    pieces, here = [], 8 * bk.HEAD
    for place, array in enumerate(
        _arrays(model, plan, muscles, left_out, watched).values(), start=bk.A_ROUTES
    ):
        head[place] = here
        piece = np.ascontiguousarray(array).tobytes()
        pieces.append(piece + bytes(-len(piece) % 8))
        here += len(pieces[-1])
    head[bk.BYTES] = here
    return head.tobytes() + b"".join(pieces)


# arrays that depend on the model; the states in the rows of nodes are read from plugin_state afterwards
_CONSTANT = (
    "routes", "links", "law", "source", "index", "control", "form", "group", "body_rootid", "loaded",
    "weights", "params", "ctrl_low", "ctrl_high", "times", "node", "bound", "drives", "transmission",
    "published", "points", "pieces", "tendon", "actuator", "labels",
)  # fmt: skip


def renew(block: int, image: bytes) -> bool:
    """Copy a new image into a block in use, keeping its state; return False, and copy nothing, if layouts differ."""
    head = np.frombuffer(image, dtype=np.int64, count=bk.HEAD)
    living = np.ctypeslib.as_array((ctypes.c_int64 * bk.HEAD).from_address(block))
    same = head == living
    same[bk.MODEL] = True
    if not same.all():
        return False
    for name in _CONSTANT:
        which = bk.ARRAYS.index(name)
        first = int(head[bk.A_ROUTES + which])
        end = int(head[bk.A_ROUTES + which + 1]) if which + 1 < len(bk.ARRAYS) else len(image)
        ctypes.memmove(block + first, image[first:end], end - first)
    return True
