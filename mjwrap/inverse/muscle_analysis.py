"""Lengths, velocities, moment arms and forces of muscles along a motion."""

from __future__ import annotations

import itertools
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjwrap import validation
from mjwrap.errors import PathError, StateError
from mjwrap.files import Table
from mjwrap.inverse.coordinates import IndependentCoordinates, refuse_loops
from mjwrap.inverse.kinematics import Kinematics
from mjwrap.inverse.motion import Motion
from mjwrap.kernels.coupling import path_points
from mjwrap.kernels.coupling.muscle_paths import R_MUSCLE, R_SURFACES
from mjwrap.kernels.inverse.muscle_frames import measure_frames
from mjwrap.paths import Status
from mjwrap.system import MuscleSystem
from mjwrap.system.evaluator import TOLERANCE
from mjwrap.system.state import Evaluation

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Share = tuple[int, int]  # the first route of a thread, and one behind its last
SURFACE_COST = 4  # of a route's surface, where a route without one has 1


@dataclass(frozen=True, eq=False)
class MuscleAnalysis:
    """Muscles along a motion of T frames: n muscles, k independent coordinates.

    Attributes:
        time: (T,) [s].
        names: (n,) of the muscles.
        coordinates: (k,) names, "knee", or "root[0]" for one of several degrees of freedom of a joint.
        length: (T, n) musculotendon lengths [m].
        velocity: (T, n) lengthening speeds [m/s].
        moment_arm: (T, n, k) −(J N) [m], about a translation [-]: times a tension, the generalised force about the
            coordinate, with that of all joints that follow it.
        active_force: (T, n) along the tendon at the given activation [N]; negative where a fibre shortens faster than
            a law's force-velocity curve is positive.
        passive_force: (T, n) along the tendon without activation [N]: elastic and damping; negative where a damped
            fibre would push. Tension is the sum of both, but never below zero.
        status: (T, n) codes of `mw.Status`. A muscle without a path keeps the values of its last valid one; before the
            first, they are zero.
    """

    time: Array
    names: tuple[str, ...]
    coordinates: tuple[str, ...]
    length: Array
    velocity: Array
    moment_arm: Array
    active_force: Array
    passive_force: Array
    status: Ints

    def tables(self) -> dict[str, Table]:
        """Return tables as of OpenSim's MuscleAnalysis, by its names: "Length", "MomentArm_knee_angle_r", ..."""
        whole = {
            "Length": self.length,
            "LengtheningSpeed": self.velocity,
            "ActiveFiberForceAlongTendon": self.active_force,
            "PassiveFiberForceAlongTendon": self.passive_force,
        }
        for i, name in enumerate(self.coordinates):
            whole[f"MomentArm_{name.replace('/', '_')}"] = self.moment_arm[:, :, i]
        return {
            name: Table(self.time, self.names, values, {"header": name, "inDegrees": "no"})
            for name, values in whole.items()
        }


def muscle_analysis(
    muscles: MuscleSystem, motion: Motion, *, activation: ArrayLike = 1.0, jobs: int = 1
) -> MuscleAnalysis:
    """Return lengths, velocities, moment arms and forces of all muscles along a motion.

    All frames are evaluated in compiled code, each from the paths of the frame before; the first as after `reset`. The
    state of `muscles` and of any mjData is not used. Forces are those with a rigid tendon of slack length, also where a
    muscle's tendon is elastic, because a motion alone does not say how far it is stretched.

    Args:
        muscles: of the model that moves.
        motion: its motion.
        activation: of the active force: one, one for each muscle (n,), or also for each frame (T, n).
        jobs: threads, among which the muscles are divided; results do not depend on how many.

    Returns:
        The analysis.

    Raises:
        StateError: the motion or the activations do not fit the model.
        ModelError: a connect or weld closes a loop.
        PathError: a muscle has no path at some frame, and `muscles` is strict.
    """
    validation.of_type(muscles, "MuscleSystem", "muscles", StateError)
    validation.instance(motion, Motion, "motion", StateError, "a mw.Motion")
    jobs = validation.whole(jobs, 1, "jobs", StateError)
    model, plan = muscles.model, muscles._plan
    refuse_loops(model, "take `MuscleSystem.moment_arms` at each pose, which includes what it ties")
    whole = motion.completed(model)
    independent = IndependentCoordinates(model)
    frames, n, k = len(whole), plan.n, len(independent.dofs)
    drive = _activations(activation, frames, n)
    followers = independent.followers()
    last = Evaluation(n, plan.node.copy(), len(plan.routes))
    found = MuscleAnalysis(
        whole.time, tuple(muscles.names), independent.names,
        np.zeros((frames, n)), np.zeros((frames, n)), np.zeros((frames, n, k)),
        np.zeros((frames, n)), np.zeros((frames, n)), np.zeros((frames, n), dtype=np.int64),
    )  # fmt: skip
    points = plan.points.group() if plan.points else None
    kinematics = Kinematics(
        model,
        ("site_xpos", "geom_xpos", "geom_xmat", "cvel", "subtree_com", "cdof")
        + (("xpos", "xmat") if points else ()),
    )
    shares = _shares(plan.routes, jobs)
    with ThreadPoolExecutor(len(shares)) if len(shares) > 1 else _Here() as pool:
        for first, end in kinematics.blocks(whole):
            block, some = slice(first, end), kinematics.array
            slopes = np.zeros((end - first, len(last.slopes), path_points.SLOPE))
            active = np.ones((end - first, len(plan.routes)), dtype=np.int64)
            if points is not None:
                slopes = np.zeros((end - first, len(points.axes), path_points.SLOPE))
                kinematics.place_points(points, whole.qpos[block], slopes, active)
            shared = (
                *plan.route_group(), plan.law, plan.params,
                *(some(name) for name in ("site_xpos", "geom_xpos", "geom_xmat", "cvel", "subtree_com")),
                muscles._root, muscles._last_dof, muscles._dofs[2], some("cdof"), whole.qvel[block],
                plan.uses, slopes, active, TOLERANCE, *last.paths,
                drive[block], independent.dofs, *followers, independent.matrices(whole.qpos[block]),
            )  # fmt: skip
            results = (
                last.length, last.velocity, last.status,
                found.length[block], found.velocity[block], found.moment_arm[block],
                found.active_force[block], found.passive_force[block], found.status[block],
            )  # fmt: skip

            def evaluate(share: Share, shared: Any = shared, results: Any = results) -> None:
                given: tuple[Any, ...] = (*share, *shared, np.zeros(model.nv), *results)
                measure_frames(*given)

            list(pool.map(evaluate, shares))
    if muscles.strict and found.status.any():
        t, m = np.argwhere(found.status)[0]
        why = Status(int(found.status[t, m])).name.lower()
        raise PathError(f"muscle '{found.names[m]}' at time {whole.time[t]:g} s: no path ({why})")
    return found


class _Here:
    """The part of an executor that is used, without a thread."""

    map = staticmethod(map)

    def __enter__(self) -> _Here:
        return self

    def __exit__(self, *_: object) -> None:
        pass


def _activations(given: ArrayLike, frames: int, n: int) -> Array:
    """Return activations (T, n); `StateError` if they do not fit or are not within 0 and 1."""
    values = validation.numbers(given, "activation", StateError)
    if values.shape not in ((), (n,), (frames, n)):
        raise StateError(f"activation must be one number, ({n},) or ({frames}, {n}), not {values.shape}")
    if not ((values >= 0.0) & (values <= 1.0)).all():
        raise StateError("activation must be within 0 and 1")
    return np.ascontiguousarray(np.broadcast_to(values, (frames, n)))


def _shares(routes: Ints, jobs: int) -> list[Share]:
    """Divide routes among threads at the borders of muscles."""
    if not len(routes):
        return []
    cost = np.cumsum(1 + SURFACE_COST * routes[:, R_SURFACES])
    borders = np.append(np.flatnonzero(np.diff(routes[:, R_MUSCLE])) + 1, len(routes))
    wanted = cost[-1] * np.arange(1, jobs + 1) / jobs
    ends = borders[np.minimum(np.searchsorted(cost[borders - 1], wanted), len(borders) - 1)]
    cuts = [0, *np.unique(ends).tolist()]
    return list(itertools.pairwise(cuts))
