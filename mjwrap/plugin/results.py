"""`Muscles`: the engine plugin's last results for an mjData, with the attributes of a MuscleSystem."""

from __future__ import annotations

import ctypes
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap import validation
from mjwrap.errors import StateError
from mjwrap.kernels import layout
from mjwrap.kernels.coupling import path_points
from mjwrap.kernels.solved import segments
from mjwrap.mjcf import Declarations
from mjwrap.mjcf.side_rules import choose_side_rule
from mjwrap.plugin.blocks.instance_muscles import read_instances
from mjwrap.plugin.callbacks import block as bk
from mjwrap.plugin.callbacks import path_points as pp
from mjwrap.plugin.readout import block_address, head_of, instances, transmit
from mjwrap.plugin.spec.configuration import TRANSMISSION, configuration_at
from mjwrap.system.results import Results
from mjwrap.system.state import NUMBERS, Evaluation

_RK4 = int(mujoco.mjtIntegrator.mjINT_RK4)


class Muscles(Results):
    """The results of the muscles that the engine plugin runs for one `MjData`, always those of the last evaluation.

    data: of a model that `install` or `load` returned. Names, units and signs are those of `MuscleSystem`, the order of
    muscles that of `mjwrap.plugin.read`. The results belong to the state at the last `mj_forward`, or at the start of
    the last `mj_step` (under RK4: at its last stage). Raises `StateError` if the model has no plugin; `time` also
    raises it before the first evaluation and after a change of `data`.
    """

    def __init__(self, data: mujoco.MjData) -> None:
        if not isinstance(data, mujoco.MjData):
            validation.of_type(data, "MjData", "data", StateError)
        self.data = data
        self._instances = instances(data.model)
        plan, muscles = read_instances(data.model._address, self._instances)
        super().__init__(
            Declarations(muscles, side_rule=choose_side_rule(data.model, None)),
            plan,
            data.model,
            Evaluation(plan.n, plan.node, len(plan.routes)),
        )
        self._transmits = any(
            configuration_at(data.model._address, i).mode == TRANSMISSION for i in self._instances
        )
        self._blocks: list[int] = []
        self._views: list[Evaluation] = []

    @property
    def time(self) -> float:
        """Simulation time [s] of all results."""
        data, first = self.data, self._instances[0]
        block = block_address(data, first)
        clock = np.ctypeslib.as_array(
            (ctypes.c_double * bk.CLOCK).from_address(block + int(head_of(block)[bk.A_CLOCK]))
        )
        if clock[bk.ACTED]:
            return float(data.time)
        ended = float(data.plugin_state[int(self.model.plugin_stateadr[first])])
        if ended == 0.0 or ended != data.time:
            raise StateError(
                "the muscles of this MjData have not been evaluated at its present state: call mj_step or mj_forward"
            )
        ahead = 0.0 if int(self.model.opt.integrator) == _RK4 else float(self.model.opt.timestep)
        return float(data.time) - ahead

    def poses(self, data: mujoco.MjData) -> mujoco.MjData:
        """Return the data with the poses of the results, which is `data` itself; `StateError` for another."""
        if data is not self.data:
            raise StateError("these Muscles belong to another MjData: make a Muscles(data) for each MjData")
        return data

    def _evaluation(self) -> Evaluation:
        blocks = [block_address(self.data, instance) for instance in self._instances]
        if blocks != self._blocks:
            self._views = [_view(block) for block in blocks]
            self._blocks = blocks
        if len(blocks) == 1 and not self._transmits:
            return self._views[0]
        joined, first = _joined(self._views), 0
        for block, view in zip(blocks, self._views, strict=True):
            transmit(self.data, block, joined.tension[first : first + len(view.status)])
            first += len(view.status)
        return joined


def _view(block: int) -> Evaluation:
    """Return the results in a block as arrays that share its memory."""
    head = head_of(block)
    n, nodes, routes = int(head[bk.MUSCLES]), int(head[bk.NODES]), int(head[bk.ROUTES])

    def array(name: str, kind: type[ctypes.c_double] | type[ctypes.c_int64], *shape: int) -> NDArray[Any]:
        start = block + int(head[bk.A_ROUTES + bk.ARRAYS.index(name)])
        return np.ctypeslib.as_array((kind * int(np.prod(shape))).from_address(start)).reshape(shape)

    view = Evaluation(n, array("node", ctypes.c_double, nodes, layout.ROW), routes)
    view.numbers = array(
        "activation", ctypes.c_double, len(NUMBERS), n
    )  # consecutive in the block, in this order
    view.activation, view.fiber, view.length, view.velocity, view.tension = view.numbers
    view.segments = array("seg", ctypes.c_double, nodes + routes, segments.SEGMENT)
    view.info = array("info", ctypes.c_double, routes, layout.INFO)
    view.count = array("count", ctypes.c_int64, routes)
    view.status = array("status", ctypes.c_int64, n)
    view.failures = array("failures", ctypes.c_int64, n)
    view.last_failure = view.status
    part = block + int(head[bk.A_POINTS])
    places = np.ctypeslib.as_array((ctypes.c_int64 * pp.HEAD).from_address(part))
    if places[pp.AXES]:
        slopes = ctypes.c_double * int(places[pp.AXES] * path_points.SLOPE)
        found = np.ctypeslib.as_array(slopes.from_address(part + int(places[pp.A_SLOPES])))
        view.slopes = found.reshape(-1, path_points.SLOPE)
    return view


def _joined(views: list[Evaluation]) -> Evaluation:
    """Return a copy of the results of several instances, one after the other."""
    nodes, routes = 0, sum(len(view.count) for view in views)
    n = sum(len(view.status) for view in views)
    joined = Evaluation(n, np.concatenate([view.node for view in views]), routes)
    joined.numbers = np.concatenate([view.numbers for view in views], axis=1)
    joined.activation, joined.fiber, joined.length, joined.velocity, joined.tension = joined.numbers
    for name in ("segments", "info", "count", "status", "failures", "last_failure"):
        setattr(joined, name, np.concatenate([getattr(view, name) for view in views]))
    joined.slopes = views[0].slopes  # of all moving sites of the model, in every instance
    row = 0
    for view in views:
        rows = slice(row, row + len(view.segments))
        joined.segments[rows, [segments.G_NEAR]] += nodes  # indices of nodes
        joined.segments[rows, [segments.G_FAR]] += nodes
        row, nodes = rows.stop, nodes + len(view.node)
    return joined
