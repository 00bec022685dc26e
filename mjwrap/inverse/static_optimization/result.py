"""The result of a static optimisation: activations, forces, reserves, what limits them, and tables."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mjwrap.files import Table
from mjwrap.text import aligned, counted

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
LISTED = 10  # lines of each part of the report


@dataclass(frozen=True, eq=False)
class StaticOptimization:
    """Activations and forces of n muscles, and reserves of k independent coordinates, in T frames.

    Attributes:
        time: (T,) [s].
        names: (n,) of the muscles.
        coordinates: (k,) names of the independent coordinates, as of `MuscleAnalysis`.
        activation: (T, n).
        tension: (T, n) [N], not negative.
        reserve: (T, k) generalised forces of the reserves [N m], [N].
        moment: (T, k) generalised forces that the motion needs, of muscles and reserves together [N m], [N].
        optimal_reserve: (k,) ρ, the reserve that costs as much as a fully active muscle of weight 1 [N m], [N].
        moment_arm: (T, n, k) [m], [-]: moment = moment_armᵀ tension + reserve.
        solved: (T,) whether the frame was solved to the stated accuracy.
        reasons: (T,) why it was not; empty where it was.
        residual: (T,) largest residual of the conditions for an optimum, each over the sum of the sizes of its terms.
        saturated: (T, n) whether an activation is at its largest.
        infeasible: (T,) whether it is proved that the muscles alone, within their bounds, cannot give these moments.
        path_status: (T, n) codes of `mw.Status`; a muscle without a path keeps the values of its last valid one.
    """

    time: Array
    names: tuple[str, ...]
    coordinates: tuple[str, ...]
    activation: Array
    tension: Array
    reserve: Array
    moment: Array
    optimal_reserve: Array
    moment_arm: Array
    solved: Flags
    reasons: tuple[str, ...]
    residual: Array
    saturated: Flags
    infeasible: Flags
    path_status: NDArray[np.int64]

    @property
    def reserve_share(self) -> Array:
        """Largest reserve of each coordinate (k,) over the largest generalised force that is needed; 0 if none is."""
        needed = np.abs(self.moment).max(axis=0, initial=0.0)
        used = np.abs(self.reserve).max(axis=0, initial=0.0)
        return np.divide(used, needed, out=np.zeros_like(used), where=needed > 0.0)

    def tables(self) -> dict[str, Table]:
        """Return tables with the names and columns of OpenSim's: muscles, then reserves as "COORDINATE_reserve".

        "StaticOptimization_activation" has activations, and reserves over the optimal ones;
        "StaticOptimization_force" has tensions [N] and reserves [N m], [N].
        """
        columns = (*self.names, *(f"{name}_reserve" for name in self.coordinates))
        found = {}
        activation = self.activation, self.reserve / self.optimal_reserve
        force = self.tension, self.reserve
        for name, values in (("activation", activation), ("force", force)):
            title = f"StaticOptimization_{name}"
            header = {"header": title, "inDegrees": "no"}
            found[title] = Table(self.time, columns, np.hstack(values), header)
        return found

    def report(self) -> str:
        """Return a text: frames that were not solved, muscles at their bounds, reserves, and muscles without a path."""
        frames = len(self.time)
        lines = [f"{counted(frames, 'frame')}: {int(self.solved.sum())} solved"]
        bad = np.flatnonzero(~self.solved)
        lines += [f"  not solved at {self.time[t]:g} s: {self.reasons[t]}" for t in bad[:LISTED]]
        lines += _more(len(bad))
        if self.infeasible.any():
            short = np.flatnonzero(self.infeasible)
            lines.append(
                f"{counted(len(short), 'frame')} where the muscles alone are too weak, from {self.time[short[0]]:g} to "
                f"{self.time[short[-1]]:g} s"
            )
        lines += self._listing(
            "muscles at their largest activation", "frames", self.names, self.saturated.sum(axis=0)
        )
        shares = 100.0 * self.reserve_share
        lines += self._listing("largest reserve over largest moment", "%", self.coordinates, shares)
        lost = (self.path_status != 0).sum(axis=0)
        lines += self._listing("muscles without a path", "frames", self.names, lost)
        return "\n".join(lines)

    @staticmethod
    def _listing(title: str, unit: str, names: tuple[str, ...], values: Array) -> list[str]:
        """Return a title and the largest values by name, nothing if all are zero."""
        order = [int(i) for i in np.argsort(-values, kind="stable") if values[i] > 0]
        rows = [[f"  {names[i]}", f"{values[i]:.3g}", unit] for i in order[:LISTED]]
        return [f"{title}:", *aligned(rows), *_more(len(order))] if rows else []


def _more(count: int) -> list[str]:
    return [f"  and {count - LISTED} more"] if count > LISTED else []
