"""Build the flat arrays of the kernels for all muscles of a model from its declarations."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.kernels import layout
from mjwrap.kernels.coupling import muscle_paths, path_points
from mjwrap.kernels.coupling.groups import Routes
from mjwrap.kernels.musculotendon import dispatch, dynamics
from mjwrap.kernels.musculotendon.groups import Muscles
from mjwrap.mjcf import ACTEARLY_DYNAMICS, MuscleDeclaration, Node, keeps_state
from mjwrap.model.path_points import PointPlan, plan_points
from mjwrap.muscles.laws import ActuatorForce, parameter_row
from mjwrap.surfaces.rows import surface_rows

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Plan:
    """Muscles, routes and nodes for the kernels in `mjwrap/kernels/coupling/muscle_paths.py`."""

    n: int
    node: Array  # (N, ROW), cold
    links: Ints  # (N, 4)
    routes: Ints  # (C, 8)
    weights: Array  # (C,)
    law: Ints  # (n,)
    params: Array  # (n, PARAMS)
    source: Ints  # (n,) source of the state
    index: Ints  # (n,) in act
    control: Ints  # (n,) in ctrl
    ctrl_low: Array  # (n,)
    ctrl_high: Array  # (n,)
    form: Ints  # (n,) of the activation dynamics
    times: Array  # (n, 5) constants of the activation dynamics
    integrates: bool  # whether mjwrap integrates a state
    output: (
        Ints  # (n,) output of the actuator whose length, velocity and moment mjwrap writes; -1: wrenches act
    )
    points: PointPlan | None = None  # moving and conditional points, if there are any

    @property
    def uses(self) -> Ints:
        """Where routes pass moving points, as in the kernels' `PathPoints`."""
        return self.points.uses if self.points else np.empty((0, path_points.USE), dtype=np.int64)

    def route_group(self) -> Routes:
        """Return the kernels' group of routes."""
        return Routes(self.routes, self.weights, self.links)

    def muscle_group(self, off: NDArray[np.bool_]) -> Muscles:
        """Return the kernels' group of muscles; off (n,): which muscles are switched off, read at every evaluation."""
        return Muscles(
            self.law, self.params, self.source, self.index, self.control, self.ctrl_low, self.ctrl_high,
            self.form, self.times, off,
        )  # fmt: skip


def _source(model: mujoco.MjModel, declared: MuscleDeclaration) -> tuple[int, int, int, float, float]:
    """Return the source of a muscle's state: source, index in act and in ctrl, limits of the control."""
    if declared.actuator < 0:
        direct = declared.parameters.states == 0
        return (dynamics.FROM_EXCITATION if direct else dynamics.STATE_IN_MJWRAP), 0, 0, -np.inf, np.inf
    actuator = declared.actuator
    if isinstance(declared.parameters, ActuatorForce) and not int(model.actuator_ctrlnum[actuator]):
        return dynamics.FROM_EXCITATION, 0, 0, -np.inf, np.inf
    states, control = int(model.actuator_actadr[actuator]), int(model.actuator_ctrladr[actuator])
    low, high = -np.inf, np.inf
    if model.actuator_ctrllimited[control]:
        low, high = (float(x) for x in model.actuator_ctrlrange[control])
    if isinstance(declared.parameters, ActuatorForce):
        kept, single = False, int(model.actuator_actnum[actuator]) > 0
    else:
        kept, single = keeps_state(model, actuator), int(model.actuator_actnum[actuator]) == 1
    if kept:
        return dynamics.STATE_IN_ACT, states, control, low, high
    if single:
        early = bool(model.actuator_actearly[actuator]) and not isinstance(declared.parameters, ActuatorForce)
        return dynamics.FROM_NEXT_ACT if early else dynamics.FROM_ACT, states, control, low, high
    return dynamics.FROM_CTRL, 0, control, low, high


def _activation(model: mujoco.MjModel, declared: MuscleDeclaration, source: int) -> tuple[int, list[float]]:
    """Return form and constants of a muscle's activation dynamics: mjwrap's own, or of an actuator with actearly."""
    if source != dynamics.FROM_NEXT_ACT:
        return declared.activation.form, [*declared.activation.row(), 0.0, 0.0]
    actuator = declared.actuator
    low, high = -np.inf, np.inf
    if model.actuator_actlimited[actuator]:
        low, high = (float(x) for x in model.actuator_actrange[actuator])
    constants = [float(x) for x in model.actuator_dynprm[actuator, :3]]
    return ACTEARLY_DYNAMICS[int(model.actuator_dyntype[actuator])], [*constants, low, high]


def kernel_rows(node: Node) -> list[Array]:
    """Return the kernels' rows of a stop, for a cold start; several if a string may touch its surface several times."""
    if node.surface is not None:
        rows = surface_rows(node.surface, node.inside, node.side)
        rows[:, layout.HINT_TURN] = node.turn
        return list(rows)
    row = np.zeros(layout.ROW)
    row[layout.KIND], row[layout.S_MODE] = layout.VIA, layout.COLD
    return [row]


def build_plan(model: mujoco.MjModel, muscles: list[MuscleDeclaration]) -> Plan:
    """Return the kernels' arrays for a list of muscles."""
    links: list[tuple[int, int, int, int]] = []
    rows: list[Array] = []
    routes: list[tuple[int, ...]] = []
    weights: list[float] = []
    for m, declared in enumerate(muscles):
        for route in declared.routes:
            first = len(links)
            for node in route.nodes:
                found = kernel_rows(node)
                on_geom = node.geom >= 0
                body = int(model.geom_bodyid[node.geom] if on_geom else model.site_bodyid[node.site])
                for k, row in enumerate(found):
                    rows.append(row)
                    links.append((node.site, node.geom, node.hint_site if k == 0 else -1, body))
            bodies = int(model.site_bodyid[route.origin]), int(model.site_bodyid[route.insertion])
            surfaces = sum(geom >= 0 for _, geom, _, _ in links[first:])
            routes.append((first, len(links), route.origin, route.insertion, *bodies, m, surfaces))
            weights.append(route.weight)
    n = len(muscles)
    outputs = [
        int(model.actuator_outadr[m.actuator]) if isinstance(m.parameters, ActuatorForce) else -1
        for m in muscles
    ]
    sources = [_source(model, declared) for declared in muscles]
    activations = [
        _activation(model, declared, source[0]) for declared, source in zip(muscles, sources, strict=True)
    ]
    route_rows = np.array(routes, dtype=np.int64).reshape(-1, muscle_paths.ROUTE)
    link_rows = np.array(links, dtype=np.int64).reshape(-1, 4)
    return Plan(
        n=n,
        node=np.array(rows).reshape(-1, layout.ROW),
        links=link_rows,
        routes=route_rows,
        weights=np.array(weights, dtype=np.float64),
        law=np.array([declared.parameters.code for declared in muscles], dtype=np.int64),
        params=np.array([parameter_row(m.parameters) for m in muscles]).reshape(n, dispatch.PARAMS),
        source=np.array([s[0] for s in sources], dtype=np.int64),
        index=np.array([s[1] for s in sources], dtype=np.int64),
        control=np.array([s[2] for s in sources], dtype=np.int64),
        ctrl_low=np.array([s[3] for s in sources], dtype=np.float64),
        ctrl_high=np.array([s[4] for s in sources], dtype=np.float64),
        form=np.array([form for form, _ in activations], dtype=np.int64),
        times=np.array([row for _, row in activations], dtype=np.float64).reshape(-1, dynamics.TIMES),
        output=np.array(outputs, dtype=np.int64),
        points=plan_points(model, muscles, route_rows, link_rows),
        integrates=any(s[0] in (dynamics.STATE_IN_MJWRAP, dynamics.STATE_IN_ACT) for s in sources),
    )
