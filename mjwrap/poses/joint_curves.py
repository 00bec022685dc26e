"""Lengths, moment arms, fibres and forces of muscles and cables over the position of one joint."""

from __future__ import annotations

import copy
import fnmatch
import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjwrap import html, validation
from mjwrap.errors import ModelError
from mjwrap.mjcf.inside import reference_pose
from mjwrap.mjcf.names import listed, name_of
from mjwrap.model.takeover import Takeover
from mjwrap.poses.angles import check_range
from mjwrap.poses.continuation import PathFollower, Place
from mjwrap.poses.joint_sweeps import PoseMaker
from mjwrap.poses.tendon_curves import native_tendons, tendon_rows
from mjwrap.system import CableSystem, is_cable
from mjwrap.text import counted_paths, nearest

Array = NDArray[np.float64]
_SINGLE = int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)
MOVED = 1e-9  # a joint moves a muscle if its length changes by more than this share of it
HALVINGS = 50  # of the interval in which a conditional path point comes or goes
# the quantities of `JointCurves`, with their units
QUANTITIES = {
    "length": "m",
    "moment_arm": "m",
    "fiber_length": "m",
    "normalized_fiber_length": "",
    "tendon_length": "m",
    "pennation": "rad",
    "tension": "N",
    "active_fiber_force": "N",
    "passive_fiber_force": "N",
    "moment": "N m",
}
# which of `FiberState` is which quantity
_FIBERS = {
    "fiber_length": "length",
    "normalized_fiber_length": "normalized_length",
    "tendon_length": "tendon_length",
    "pennation": "pennation",
    "active_fiber_force": "active_force_along_tendon",
    "passive_fiber_force": "passive_force_along_tendon",
}


@dataclass(frozen=True, eq=False)
class JointCurves:
    """Curves of n muscles and cables at T positions of a joint; `curves["moment_arm"]` is an array (T, n).

    Values are NaN where a muscle has no path, and where its law has no such quantity; cables have lengths and moment
    arms only.

    Attributes:
        joint: name of the joint.
        turns: whether the joint is a hinge; else it is a slide.
        at: (T,) positions of the joint [rad or m].
        names: n names of the muscles.
        values: arrays (T, n) by the names of `QUANTITIES`: lengths [m], moment arms [m, 1 for a slide], forces [N],
            moments [N m, N for a slide], pennation angles [rad]. Forces of fibres are those along the tendon.
        native: the same of MuJoCo's own tendons, "length" and "moment_arm"; empty unless asked for, NaN for muscles
            whose route MuJoCo's tendon does not have.
        follows: the joint that this joint follows by an equality, or "". The sweep moves it alone then.
        cables: names of those of the muscles that are cables: MuJoCo's own actuators pull them.
        edges: by muscle, the positions at which a conditional path point comes or goes, so that its length may jump.
    """

    joint: str
    turns: bool
    at: Array
    names: tuple[str, ...]
    values: Mapping[str, Array]
    native: Mapping[str, Array]
    follows: str = ""
    cables: tuple[str, ...] = ()
    edges: Mapping[str, tuple[float, ...]] = field(default_factory=dict)

    def __repr__(self) -> str:
        ends = (self.at[0], self.at[-1])
        low, high = (f"{math.degrees(x):.4g}°" if self.turns else f"{x:.4g} m" for x in ends)
        names = ", ".join(self.names[:6]) + ", ..." * (len(self.names) > 6)
        count = counted_paths(len(self.names), len(self.cables))
        return f"JointCurves({self.joint} from {low} to {high}, {len(self.at)} positions, {count}: {names})"

    def _repr_html_(self) -> str:
        shown = [(name, QUANTITIES[name]) for name in ("length", "moment_arm", "tension")]
        rows = [
            [name, *(_range(self.values[q][:, i]) for q, _ in shown)] for i, name in enumerate(self.names)
        ]
        head = "muscle" if len(self.cables) < len(self.names) else "cable"
        return html.table([head, *(f"{q} [{unit}]" for q, unit in shown)], rows, repr(self))

    def __getitem__(self, quantity: str) -> Array:
        if quantity not in self.values:
            raise ModelError(
                f"no quantity '{quantity}'{nearest(str(quantity), self.values)}; there are: {', '.join(self.values)}"
            )
        return self.values[quantity]


def _range(values: Array) -> str:
    good = values[np.isfinite(values)]
    return f"{good.min():.4g} to {good.max():.4g}" if good.size else "-"


def curves(
    model: mujoco.MjModel,
    joint: str,
    muscles: Sequence[str] | str | None = None,
    *,
    samples: int = 91,
    span: tuple[float, float] | None = None,
    qpos: ArrayLike | None = None,
    activation: float = 1.0,
    native: bool = False,
    side_rule: int | None = None,
) -> JointCurves:
    """Return lengths, moment arms, fibres and forces of muscles and cables over the position of one joint.

    Joints that are coupled to the joint follow it, so that moment arms are those of the coupled motion: −dl/dq, with
    OpenSim's sign. Paths are followed from the reference pose, as in a motion. Muscles are at rest; fibres with elastic
    tendons are in static equilibrium at the activation.

    Args:
        model: the model.
        joint: name of a hinge or slide.
        muscles: patterns of names (`*` and `?` match any characters); None for all muscles and cables that the joint
            moves.
        samples: number of positions, at least 2.
        span: first and last position [rad or m]; None for the joint's range.
        qpos: (nq,) pose of the other joints; None for qpos0.
        activation: of all muscles, 0 to 1.
        native: whether to evaluate MuJoCo's own tendons, too.
        side_rule: as for `MuscleSystem`.

    Returns:
        The curves.

    Raises:
        ModelError: there is no such joint or muscle, the joint moves no muscle, an argument is out of its range, or
            only degrees can explain the span.
    """
    validation.of_type(model, "MjModel", "model", ModelError)
    validation.instance(joint, str, "joint", ModelError, "the name of a hinge or slide")
    index = _joint(model, joint)
    samples = validation.whole(samples, 2, "samples", ModelError)
    _check(model, muscles, span, qpos, activation)
    validation.flag(native, "native", ModelError)
    if span is not None:
        check_range(model, index, *span)
    with Takeover(model).original_limits():
        model = copy.copy(model)  # its actuators are disabled below
    system = CableSystem(model, side_rule=side_rule)
    base = np.array(model.qpos0 if qpos is None else qpos, dtype=np.float64)
    maker = PoseMaker(model, base)
    low, high = maker.span(index) if span is None else span
    data = mujoco.MjData(model)
    _activate(system, data, activation)
    follower = PathFollower(system, data)
    at = np.linspace(low, high, samples)
    follower.move_to(reference_pose(model).qpos.copy(), maker.place(index, 0, low)[0])
    rows: list[dict[str, Array]] = []

    def look(_: float) -> None:
        fibers = system.fiber_state()
        row = {name: getattr(fibers, attribute) for name, attribute in _FIBERS.items()}
        rows.append(row | {"tension": system.tension})

    trace = follower.trace(lambda value: maker.place(index, 0, value), at, look)
    chosen = _chosen(system, muscles, joint, trace.length, trace.slope)
    bad = ~trace.good
    values = {"length": trace.length, "moment_arm": -trace.slope}
    values |= {name: np.array([row[name] for row in rows]) for name in rows[0]}
    values["moment"] = values["moment_arm"] * values["tension"]
    cables = [is_cable(muscle) for muscle in system.declarations]
    for name in set(QUANTITIES) - {"length", "moment_arm"}:
        values[name][:, cables] = np.nan  # their forces follow from controls, not from an activation
    found = {name: np.where(bad, np.nan, values[name])[:, chosen] for name in QUANTITIES}
    own: dict[str, Array] = {}
    if native:
        tendons = native_tendons(system)
        length, slope = tendon_rows(model, [maker.place(index, 0, value) for value in at.tolist()])
        which = [tendons.get(system.names[i], -1) for i in chosen]
        none = np.full(samples, np.nan)
        for name, rows_of in (("length", length), ("moment_arm", -slope)):
            own[name] = np.stack([rows_of[:, t] if t >= 0 else none for t in which], axis=1)
    leader = maker.leader(index)
    return JointCurves(
        joint,
        int(model.jnt_type[index]) == _SINGLE[0],
        at,
        tuple(system.names[i] for i in chosen),
        found,
        own,
        "" if leader is None else leader,
        tuple(system.names[i] for i in chosen if cables[i]),
        _edges(follower, system, lambda value: maker.place(index, 0, value), at, chosen),
    )


def _edges(
    follower: PathFollower, muscles: CableSystem, place: Place, at: Array, chosen: Sequence[int]
) -> dict[str, tuple[float, ...]]:
    """Return the conditional edges of the chosen muscles, by name."""
    found: dict[str, list[float]] = {}
    declared = [(int(i), muscles.declarations[i]) for i in chosen]
    conditional = {i: muscle.name for i, muscle in declared if any(route.when for route in muscle.routes)}
    for before, after in itertools.pairwise(at.tolist() if conditional else []):
        for i, name in conditional.items():
            low, high = before, after
            if not follower.is_conditional_edge(place, i, low, high):
                continue
            for _ in range(HALVINGS):
                middle = 0.5 * (low + high)
                if follower.is_conditional_edge(place, i, low, middle):
                    high = middle
                else:
                    low = middle
            found.setdefault(name, []).append(0.5 * (low + high))
    return {name: tuple(places) for name, places in found.items()}


def _joint(model: mujoco.MjModel, name: str) -> int:
    single = {
        name_of(model, mujoco.mjtObj.mjOBJ_JOINT, j): j
        for j in range(model.njnt)
        if int(model.jnt_type[j]) in _SINGLE
    }
    if name not in single:
        raise ModelError(f"no hinge or slide '{name}'{nearest(name, single)}; there are: {listed(single)}")
    return single[name]


def _check(
    model: mujoco.MjModel,
    muscles: Sequence[str] | str | None,
    span: tuple[float, float] | None,
    qpos: ArrayLike | None,
    activation: float,
) -> None:
    if muscles is not None and not isinstance(muscles, str):
        validation.sequence(muscles, "muscles", ModelError, "patterns of names")
        good = all(isinstance(pattern, str) for pattern in muscles)
        validation.require(good, "muscles", "patterns of names", muscles, ModelError)
    if span is not None:
        low, high = validation.several(span, 2, "span", ModelError)
        if not (math.isfinite(low) and math.isfinite(high) and high > low):
            raise ModelError(f"the span must be two finite numbers, the second one larger, not {span!r}")
    if qpos is not None:
        shape = validation.numbers(qpos, "qpos", ModelError).shape
        if shape != (model.nq,):
            raise ModelError(f"qpos must have shape ({model.nq},), not {shape}")
    if not 0.0 <= validation.finite(activation, "activation", ModelError) <= 1.0:
        raise ModelError(f"activation must lie between 0 and 1, not {activation!r}")


def _activate(system: CableSystem, data: mujoco.MjData, activation: float) -> None:
    """Set excitation and activation of all muscles; fibre lengths of 0 mean static equilibrium.

    The controls of cables stay 0: they may be lengths, speeds or forces.
    """
    model, branch = system.model, system.branch(data)
    own = branch[len(branch) - 2 * system.n :].reshape(-1, 2)
    own[:] = activation, 0.0
    for i, muscle in enumerate(system.declarations):
        system.excitation[i] = activation
        if muscle.actuator < 0 or is_cable(muscle):
            continue
        data.ctrl[model.actuator_ctrladr[muscle.actuator]] = activation
        if model.actuator_actnum[muscle.actuator]:
            data.act[model.actuator_actadr[muscle.actuator]] = activation
    system.set_branch(data, branch)


def _chosen(
    system: CableSystem, wanted: Sequence[str] | str | None, joint: str, length: Array, slope: Array
) -> list[int]:
    """Return the indices of the muscles that the patterns match, or of those that the joint moves."""
    known = system.names
    if not known:
        raise ModelError("the model has no muscle or cable with a path of mjwrap")
    if wanted is None:
        moved = np.abs(slope).max(axis=0) > MOVED * np.abs(length).max(axis=0)
        if not moved.any():
            raise ModelError(f"joint '{joint}' moves none of the muscles: {listed(known)}")
        return np.flatnonzero(moved).tolist()
    found: list[int] = []
    for pattern in [wanted] if isinstance(wanted, str) else wanted:
        fit = [known.index(pattern)] if pattern in known else []
        fit = fit or [i for i, name in enumerate(known) if fnmatch.fnmatchcase(name, pattern)]
        if not fit:
            raise ModelError(f"no muscle '{pattern}'{nearest(pattern, known)}; muscles: {listed(known)}")
        found += [i for i in fit if i not in found]
    return found
