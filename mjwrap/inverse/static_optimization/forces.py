"""Muscle forces as affine functions of activation, F₀ + a F₁, in every frame of a motion."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mjwrap.errors import StateError
from mjwrap.inverse.muscle_analysis import MuscleAnalysis
from mjwrap.inverse.static_optimization.programs import CHUNK
from mjwrap.inverse.threads import in_threads
from mjwrap.kernels.musculotendon.dispatch import DEGROOTE_FREGLY, MILLARD, PASSIVE, THELEN, has_fiber
from mjwrap.kernels.musculotendon.fiber import ELASTIC, HEIGHT, MIN_ACTIVATION, OPTIMAL, SLACK
from mjwrap.kernels.musculotendon.tangent import tangents
from mjwrap.system import MuscleSystem

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
TENDONS = ("model", "rigid")
PENNATIONS = ("fiber", "opensim")


@dataclass(frozen=True, eq=False)
class Forces:
    """What the forces of the muscles along a motion depend on.

    Attributes:
        law: (n,) codes of the laws.
        params: (n, PARAMS) their parameters.
        length: (T, n) [m].
        speed: (T, n) [m/s].
        rest: (T, n) F₀ with rigid tendons [N].
        strength: (T, n) F₁ with rigid tendons [N].
        curved: (n,) whether the force is not affine, so that F₀ and F₁ hold near one activation only.
        least: (n,) the activations as which smaller ones count.
    """

    law: NDArray[np.int64]
    params: Array
    length: Array
    speed: Array
    rest: Array
    strength: Array
    curved: Flags
    least: Array

    def near(self, activation: Array, jobs: int) -> tuple[Array, Array]:
        """Return F₀ and F₁ (T, n) [N] near activations (T, n), only the curved ones anew."""
        rest, strength = self.rest.copy(), self.strength.copy()
        some = np.flatnonzero(self.curved)
        law, params = self.law[some], np.ascontiguousarray(self.params[some])
        a, length, speed = (np.ascontiguousarray(x[:, some]) for x in (activation, self.length, self.speed))
        found = np.empty_like(a), np.empty_like(a)

        def run(begin: int) -> None:
            part = slice(begin, begin + CHUNK)
            tangents(law, params, a[part], length[part], speed[part], found[0][part], found[1][part])

        in_threads(run, range(0, len(a), CHUNK), jobs)
        rest[:, some], strength[:, some] = found
        return rest, strength

    def subset(self, frames: Flags) -> Forces:
        """Return the forces of some frames (T,)."""
        per_frame = ("length", "speed", "rest", "strength")
        return replace(self, **{name: getattr(self, name)[frames] for name in per_frame})


def muscle_forces(
    muscles: MuscleSystem, analysis: MuscleAnalysis, *, passive: bool, tendon: str, pennation: str
) -> Forces:
    """Return the forces along an analysed motion, which was made at activation 1; see `static_optimization`."""
    law, params = muscles._plan.law, muscles._plan.params
    fiber = np.array([has_fiber(code) for code in law], dtype=np.bool_)
    elastic = fiber & (params[:, ELASTIC] != 0.0)
    curved = (elastic | (law == THELEN)) & (tendon == "model")
    if not passive and (elastic & curved).any():
        name = muscles.names[int(np.argmax(elastic & curved))]
        raise StateError(
            f"passive=False: muscle '{name}' has an elastic tendon, whose balance needs its passive force; "
            "give tendon='rigid', too"
        )
    rest, strength = analysis.passive_force.copy(), analysis.active_force.copy()
    if not passive:
        rest[:, ~np.isin(law, PASSIVE)] = 0.0
    if pennation == "opensim":
        strength *= _opensim_pennation(law, params, analysis.length)
    least = np.where(fiber, params[:, MIN_ACTIVATION], 0.0)
    return Forces(law, params, analysis.length, analysis.velocity, rest, strength, curved, least)


def _opensim_pennation(law: NDArray[np.int64], params: Array, length: Array) -> Array:
    """Return OpenSim's active force along the tendon over the right one (T, n), with a rigid tendon.

    Its Millard muscles have their pennation angle at the fibre length in optimal lengths, as if that were metres
    (github.com/opensim-org/opensim-core/issues/4390); those of De Groote and Fregly have none.
    """
    factor = np.ones_like(length)
    some = np.flatnonzero(np.isin(law, (MILLARD, DEGROOTE_FREGLY)) & (params[:, HEIGHT] > 0.0))
    height, optimal = params[some, HEIGHT], params[some, OPTIMAL]
    along = np.maximum(length[:, some] - params[some, SLACK], 0.0)
    fiber = np.hypot(along, height)
    sine = np.where(law[some] == MILLARD, np.minimum(height * optimal / fiber, 1.0), 0.0)
    factor[:, some] = np.divide(
        np.sqrt(1.0 - sine * sine) * fiber, along, out=np.ones_like(along), where=along > 0.0
    )
    return factor


def pulling(rest: Array, strength: Array, low: Array, high: Array) -> tuple[Array, Array, Array]:
    """Return F₀, F₁ and least activations (T, n) with which no muscle pushes.

    Where F₀ < 0 a fibre is damped: it pulls only above some activation, which becomes the least one. Where even the
    largest activation is not enough, the muscle has no force.
    """
    pushes = rest < 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        needed = np.where(pushes, -rest / strength, 0.0)
    idle = pushes & ~(needed <= high)
    raised = np.where(idle, low, np.maximum(low, needed))
    return np.where(idle, 0.0, rest), np.where(idle, 0.0, strength), raised
