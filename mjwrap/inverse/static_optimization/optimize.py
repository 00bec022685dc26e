"""Static optimisation: the muscle activations of least cost that give the moments of a motion."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjwrap import validation
from mjwrap.errors import StateError
from mjwrap.inverse.external_loads import ExternalLoads
from mjwrap.inverse.inverse_dynamics import generalized_forces
from mjwrap.inverse.motion import Motion
from mjwrap.inverse.muscle_analysis import MuscleAnalysis, muscle_analysis
from mjwrap.inverse.static_optimization.choices import activation_bounds, positive_by_name
from mjwrap.inverse.static_optimization.forces import (
    PENNATIONS,
    TENDONS,
    Forces,
    muscle_forces,
    pulling,
)
from mjwrap.inverse.static_optimization.programs import ACCEPTED, Optima, Programs, solve
from mjwrap.inverse.static_optimization.result import StaticOptimization
from mjwrap.kernels.optimization.problem import NON_FINITE, SOLVED
from mjwrap.system import MuscleSystem

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
SETTLED = 1e-9  # largest change of an activation with which relinearising ends
MAX_ROUNDS = 60
CAREFUL_ROUNDS = 20  # after which an activation goes only half of the way

# The habits of OpenSim's StaticOptimization as options of `static_optimization`. docs/static_optimization.md says how
# to get its accelerations, too.
OPENSIM_PARITY: dict[str, Any] = {"passive": False, "tendon": "rigid", "pennation": "opensim"}


def static_optimization(
    muscles: MuscleSystem,
    motion: Motion,
    *,
    loads: ExternalLoads | None = None,
    reserves: ArrayLike | Mapping[str, float] = 1.0,
    weights: ArrayLike | Mapping[str, float] | None = None,
    power: int = 2,
    passive: bool = True,
    bounds: tuple[ArrayLike, ArrayLike] = (0.0, 1.0),
    tendon: str = "model",
    pennation: str = "fiber",
    jobs: int | None = None,
) -> StaticOptimization:
    """Return the activations that give the generalised forces of a motion at the least cost, frame by frame.

    In every frame it minimises Σ w a² + Σ (r / ρ)² subject to Rᵀ F(a) + r = τ and low ≤ a ≤ high: R are the moment arms
    about the independent coordinates, F the tensions, r the reserves, τ the generalised forces of `inverse_dynamics`. F
    is affine in a with a rigid tendon. With an elastic one, and with Thelen's force-velocity curve, it is not: the
    optimisation is repeated with F linearised at its result until no activation changes by more than 1e-9. A tendon
    cannot push: where a damped fibre would, the muscle is either at its least activation, without tension, or above the
    activation from which it pulls.

    Args:
        muscles: of the model that moves. A smaller activation than the least one of a law counts as that, so it is
            the least bound.
        motion: its motion.
        loads: external forces, None for none.
        reserves: ρ > 0 [N m], [N], the generalised force that a reserve gives at the cost of a fully active muscle of
            weight 1: one number, (k,) numbers, or a dict by the name of a coordinate or a pattern ("pelvis*"), 1 for
            others. `math.inf` makes a reserve free: the coordinate asks nothing of the muscles.
        weights: w > 0, given in the same ways by the name of a muscle; None for 1.
        power: of the activations in the cost. Only 2 is solved.
        passive: whether muscles have passive forces; False needs rigid tendons. Ligaments and path springs have theirs
            in either case.
        bounds: least and largest activation within 0 and 1: numbers, or arrays (n,) or (T, n).
        tendon: "model", or "rigid" for all; the active force is then the activation times that at activation 1.
        pennation: "fiber"; or "opensim", with the pennation angles that OpenSim's static optimisation takes in error:
            at the length in optimal lengths for Millard's muscles, 0 for those of De Groote and Fregly.
        jobs: threads, None for all cores; results do not depend on how many.

    Returns:
        Activations, tensions, reserves, and which frames were solved, saturated or infeasible.

    Raises:
        StateError: motion, loads or options do not fit the model, or bounds contradict each other.
        ModelError: the engine plugin drives the model, or a load acts on an unknown body.
        PathError: a muscle has no path in some frame, and `muscles` is strict.
    """
    validation.of_type(muscles, "MuscleSystem", "muscles", StateError)
    validation.instance(motion, Motion, "motion", StateError, "a mw.Motion")
    validation.flag(passive, "passive", StateError)
    validation.choice(tendon, TENDONS, "tendon", StateError)
    validation.choice(pennation, PENNATIONS, "pennation", StateError)
    if not (validation.is_number(power) and float(power) == 2.0):
        raise StateError(f"power must be 2, the only one that is solved, not {validation.described(power)}")
    threads = _cores() if jobs is None else validation.whole(jobs, 1, "jobs", StateError)
    motion = motion.completed(muscles.model)
    names = tuple(muscles.names)
    low, high = activation_bounds(bounds, motion.time, names)
    cost = positive_by_name(1.0 if weights is None else weights, names, "weights", "muscle")
    analysis = muscle_analysis(muscles, motion, jobs=threads)
    limits = positive_by_name(reserves, analysis.coordinates, "reserves", "coordinate", unbounded=True)
    forces = muscle_forces(muscles, analysis, passive=passive, tendon=tendon, pennation=pennation)
    low = np.maximum(low, forces.least)
    high = np.maximum(low, high)
    given = Programs(
        analysis.moment_arm, forces.rest, forces.strength,
        generalized_forces(muscles.model, motion, loads, threads), cost, limits, low, high,
    )  # fmt: skip
    found, used, unsettled = _solve_all(given, forces, threads)
    return _result(analysis, given, used, found, unsettled)


def _cores() -> int:
    """Return the number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _solve_all(given: Programs, forces: Forces, jobs: int) -> tuple[Optima, Programs, Array]:
    """Return the optima, the programs that they solve, and by how much activations (T, n) still change."""
    used = _without_pushing(given, forces.rest, forces.strength)
    found = solve(used, jobs)
    change = np.zeros_like(given.low)
    if not forces.curved.any():
        return found, used, change
    open_frames = np.ones(len(given.low), dtype=np.bool_)
    for k in range(MAX_ROUNDS):
        some, at = _frames(given, open_frames), found.activation[open_frames]
        if k >= CAREFUL_ROUNDS:
            at -= 0.5 * change[open_frames]
        again = _without_pushing(some, *forces.subset(open_frames).near(at, jobs))
        better = solve(again, jobs)
        change[open_frames] = np.where(forces.curved, better.activation - at, 0.0)
        _put(found, better, open_frames)
        _put(used, again, open_frames)
        open_frames = np.abs(change).max(axis=1, initial=0.0) > SETTLED
        if not open_frames.any():
            break
    return found, used, change


def _without_pushing(given: Programs, rest: Array, strength: Array) -> Programs:
    """Return programs with the forces F₀ and F₁ (T, n), in which no muscle pushes."""
    rest, strength, low = pulling(rest, strength, given.low, given.high)
    return replace(given, force=rest, strength=strength, low=low)


def _frames(given: Programs, frames: Flags) -> Programs:
    """Return some of the frames (T,)."""
    per_frame = ("moment_arms", "force", "strength", "wanted", "low", "high")
    return replace(given, **{name: getattr(given, name)[frames] for name in per_frame})


def _put(whole: Optima | Programs, part: Optima | Programs, frames: Flags) -> None:
    """Write what was computed for some frames to their places."""
    names = ("force", "strength", "low") if isinstance(whole, Programs) else tuple(vars(whole))
    for name in names:
        getattr(whole, name)[frames] = getattr(part, name)


def _result(
    analysis: MuscleAnalysis, given: Programs, used: Programs, found: Optima, change: Array
) -> StaticOptimization:
    if (found.status == NON_FINITE).any():
        when = analysis.time[int(np.argmax(found.status == NON_FINITE))]
        raise StateError(f"moment arms, forces or moments at time {when:g} s are not finite")
    reasons = [""] * len(analysis.time)
    for t in np.flatnonzero(np.abs(change).max(axis=1, initial=0.0) > SETTLED):
        m = int(np.argmax(np.abs(change[t])))
        reasons[t] = (
            f"the tension of muscle '{analysis.names[m]}' is too far from affine: its activation still changed "
            f"by {abs(change[t, m]):.1e} after {MAX_ROUNDS} linearisations"
        )
    for t in np.flatnonzero(found.status != SOLVED):
        reasons[t] = (
            f"the optimum was found to {found.residual[t]:.1e} of its conditions only, not {ACCEPTED:g}"
        )
    idle = (used.low > given.low) & (found.activation <= used.low)
    tension = np.where(idle, 0.0, np.maximum(used.force + found.activation * used.strength, 0.0))
    return StaticOptimization(
        time=analysis.time, names=analysis.names, coordinates=analysis.coordinates,
        activation=np.where(idle, given.low, found.activation), tension=tension, reserve=found.reserve,
        moment=given.wanted, optimal_reserve=given.reserves, moment_arm=analysis.moment_arm,
        solved=np.array([not reason for reason in reasons]), reasons=tuple(reasons), residual=found.residual,
        saturated=(found.activation >= given.high) & (used.strength > 0.0),
        infeasible=found.infeasible, path_status=analysis.status,
    )  # fmt: skip
