"""The results of an evaluation: the numbers of each muscle, and its path in space."""

from __future__ import annotations

import operator
from collections.abc import Iterator
from typing import Any, SupportsIndex

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap import plots, validation
from mjwrap.errors import GeometryError
from mjwrap.kernels import layout
from mjwrap.kernels.coupling import drawn_paths, muscle_paths
from mjwrap.kernels.solved import segments
from mjwrap.kernels.spans import end_inside, hinted_sides
from mjwrap.mjcf import Declarations, MuscleDeclaration
from mjwrap.mjcf.names import listed, name_of
from mjwrap.model.arrays import Plan
from mjwrap.model.kinematic_tree import last_dofs
from mjwrap.paths import Status
from mjwrap.system.history import History
from mjwrap.system.muscle_view import MuscleView, label, system_html, system_text
from mjwrap.system.state import Evaluation
from mjwrap.text import nearest

Array = NDArray[np.float64]
_GEOM = mujoco.mjtObj.mjOBJ_GEOM


class Results:
    """Lengths, velocities, tensions, statuses and paths at the last evaluation, as copies.

    declarations: the declaration of each muscle; native: muscle actuators that stay with MuJoCo, with the reasons;
    side_rule: by which the side sites of tendons pick the way round a cylinder, 3 or 4.
    """

    def __init__(self, found: Declarations, plan: Plan, model: mujoco.MjModel, last: Evaluation) -> None:
        self.model = model
        self.declarations: list[MuscleDeclaration] = found.muscles
        self.native: dict[str, str] = found.native
        self.side_rule: int = found.side_rule
        self._plan = plan
        self._last = last
        self._root = np.asarray(model.body_rootid, dtype=np.int64)
        self._parent = np.asarray(model.body_parentid, dtype=np.int64)
        self._last_dof = last_dofs(model)
        self._dofs = tuple(
            np.asarray(a, dtype=np.int64) for a in (model.body_dofadr, model.body_dofnum, model.dof_parentid)
        )

    def _evaluation(self) -> Evaluation:
        """Return the last evaluation itself, not a copy."""
        return self._last

    @property
    def n(self) -> int:
        """Number of muscles."""
        return self._plan.n

    @property
    def names(self) -> list[str]:
        """Names of the muscles, in the order of all arrays."""
        return [muscle.name for muscle in self.declarations]

    @property
    def evaluated(self) -> bool:
        """Whether the muscles have been evaluated since they were made or reset; before that all numbers are 0."""
        state = self._evaluation()
        return not self.n or bool(state.evaluated or state.count.any() or state.status.any())

    @property
    def length(self) -> Array:
        """Musculotendon lengths (n,) [m]."""
        return self._evaluation().length.copy()

    @property
    def velocity(self) -> Array:
        """Lengthening speeds (n,) [m/s]."""
        return self._evaluation().velocity.copy()

    @property
    def tension(self) -> Array:
        """Tensions (n,) [N], never negative."""
        return self._evaluation().tension.copy()

    @property
    def activation(self) -> Array:
        """Activations (n,) [-]."""
        return self._evaluation().activation.copy()

    @property
    def fiber_length(self) -> Array:
        """Fibre lengths (n,) [m], measured along the (pennate) fibre; 0 for a law without fibres."""
        return self._evaluation().fiber.copy()

    @property
    def status(self) -> NDArray[np.int64]:
        """Codes of `mjwrap.Status` (n,)."""
        return self._evaluation().status.copy()

    @property
    def held(self) -> NDArray[np.bool_]:
        """Whether each muscle (n,) has no path and keeps its last valid length, velocity and tension.

        False also if an end lies inside a surface but the length is continued from the surface.
        """
        status, error = self._evaluation().status, self.tangency_error
        return (status != Status.CONVERGED) & (
            (status != Status.ENDPOINT_INSIDE) | (error >= end_inside.NO_SUBSTITUTE)
        )

    @property
    def hints_met(self) -> NDArray[np.bool_]:
        """Whether each muscle (n,) passes its surfaces on the sides of their hints or side sites; false without a path.

        A path stays valid where this is false: `unmet_hints` says why that happens.
        """
        met = self.status == Status.CONVERGED
        met[[i for i in range(self.n) if met[i] and self.unmet_hints(i)]] = False
        return met

    def unmet_hints(self, i: int) -> list[str]:
        """Return the names of the geoms that muscle i passes on another side than their hint asks for.

        A string slips off a sphere, or off an ellipsoid past a fold, to the other side, and a path may have been led
        there by the motion since its cold start. Empty for a muscle without a path.
        """
        state, plan = self._evaluation(), self._plan
        if state.status[self._known(i)] != Status.CONVERGED:
            return []
        found: list[str] = []
        for c in np.flatnonzero(plan.routes[:, muscle_paths.R_MUSCLE] == i):
            lo, hi = (int(x) for x in plan.routes[c, [muscle_paths.R_LO, muscle_paths.R_HI]])
            drawn = state.segments[lo + int(c) : lo + int(c) + int(state.count[c])]
            if not len(drawn) or not state.node[lo:hi, layout.HINT].any():
                continue
            node, (first, last) = state.node[lo:hi].copy(), (drawn[0], drawn[-1])
            ox, oy, oz = first[segments.G_A : segments.G_A + 3].tolist()
            ix, iy, iz = last[segments.G_B : segments.G_B + 3].tolist()
            hinted_sides.mark_unmet_hints(0, hi - lo, ox, oy, oz, ix, iy, iz, node)
            geoms = plan.links[lo:hi, muscle_paths.L_GEOM][node[:, layout.HINT] == layout.UNMET_HINT]
            found += [name_of(self.model, _GEOM, int(geom)) for geom in geoms]
        return found

    @property
    def iterations(self) -> NDArray[np.int64]:
        """Iterations (n,) of the search for the paths, summed over all routes of a muscle."""
        counts = self._evaluation().info[:, layout.I_ITERATIONS]
        return np.bincount(self._plan.routes[:, muscle_paths.R_MUSCLE], counts, self.n).astype(np.int64)

    @property
    def tangency_error(self) -> Array:
        """Tangency errors (n,), the largest of each muscle's routes; 0 if it touches no surface."""
        found = np.zeros(self.n)
        errors = self._evaluation().info[:, layout.I_ERROR]
        np.maximum.at(found, self._plan.routes[:, muscle_paths.R_MUSCLE], errors)
        return found

    @property
    def time(self) -> float:
        """Simulation time [s] of all results."""
        return self._evaluation().time

    @property
    def failures(self) -> NDArray[np.int64]:
        """Number of steps (n,) at which a muscle had no path."""
        return self._evaluation().failures.copy()

    def index(self, name: str) -> int:
        """Return the index of a muscle by name; `GeometryError`, which lists the names, if there is no such muscle."""
        names = self.names
        if not isinstance(name, str):
            raise GeometryError(
                f"no muscle of the name {validation.described(name)}; muscles: {listed(names)}"
            )
        if name not in names:
            raise GeometryError(f"no muscle '{name}'{nearest(name, names)}; muscles: {listed(names)}")
        return names.index(name)

    def __getitem__(self, muscle: str | SupportsIndex) -> MuscleView:
        """Return a view of one muscle, by name or number; `GeometryError`, with near names, if there is none."""
        if isinstance(muscle, str):
            return MuscleView(self, self.index(muscle))
        try:
            place = operator.index(muscle)
        except TypeError:
            shown = validation.described(muscle)
            raise GeometryError(f"muscle must be a name or a whole number, not {shown}") from None
        return MuscleView(self, self._known(place + self.n if -self.n <= place < 0 else place))

    def __iter__(self) -> Iterator[MuscleView]:
        """Yield a view of every muscle, in the order of all arrays."""
        return (MuscleView(self, i) for i in range(self.n))

    def __contains__(self, name: object) -> bool:
        """Return whether there is a muscle of this name."""
        return name in self.names

    def __len__(self) -> int:
        """Return the number of muscles."""
        return self.n

    def __bool__(self) -> bool:
        """Return True, also without muscles: `if muscles` asks whether there is a system."""
        return True

    def __repr__(self) -> str:
        return system_text(self)

    def _repr_html_(self) -> str:
        return system_html(self)

    def reason(self, i: int) -> str:
        """Return why muscle i last had no path, naming the elements; empty if it always had one."""
        i = self._known(i)
        code = int(self._evaluation().last_failure[i])
        detail = self._evaluation().details[i]
        return (Status(code).message + (f" ({detail})" if detail else "")) if code else ""

    def report(self) -> str:
        """Return a line for each muscle that had no path at some steps, with the last reason; empty if none."""
        lines = []
        for i, count in enumerate(self.failures):
            if count:
                lines.append(
                    f"{self.names[i]}: {count} step{'s' if count != 1 else ''} without a path; "
                    f"last reason: {self.reason(i)}"
                )
        return "\n".join(lines)

    def _known(self, i: int) -> int:
        if not (isinstance(i, int | np.integer) and 0 <= i < self.n):
            raise GeometryError(
                f"i: muscle {validation.described(i)} does not exist; "
                f"there are {self.n}: {', '.join(self.names) or 'none'}"
            )
        return int(i)

    def _polylines(self, spacing: float | None, only: int) -> tuple[Array, NDArray[np.int64]]:
        step = 0.0 if spacing is None else validation.positive(spacing, "spacing", GeometryError, "m")
        state = self._evaluation()
        starts = np.zeros(self.n + 1, dtype=np.int64)
        given = (self._plan.routes, state.node, state.segments, state.count, state.info, step, only)
        out = np.empty((drawn_paths.polylines(*given, np.empty((0, 3)), starts), 3))
        drawn_paths.polylines(*given, out, starts)
        return out, starts

    def _contacts(self, only: int) -> tuple[Array, NDArray[np.int64]]:
        state = self._evaluation()
        starts = np.zeros(self.n + 1, dtype=np.int64)
        given = (self._plan.routes, state.node, state.segments, state.count, only)
        out = np.empty((drawn_paths.contacts(*given, np.empty((0, 3)), starts), 3))
        drawn_paths.contacts(*given, out, starts)
        return out, starts

    def points(self, i: int, spacing: float | None = None) -> Array:
        """Return the polyline of muscle i, (m, 3), world [m], at the last evaluation; empty before the first.

        spacing [m]: largest distance between points; None: chosen by the curvature. A row of NaN separates routes that
        pulleys join, so that a plot has no line between them. A muscle without a path is drawn along its last valid
        path. If an end lies inside a surface, the drawing starts at that end.
        """
        return self._polylines(spacing, self._known(i))[0]

    def polylines(self, spacing: float | None = None) -> tuple[Array, NDArray[np.int64]]:
        """Return the polylines of all muscles: points (m, 3), starts (n + 1,); muscle i has starts[i]:starts[i + 1].

        A row of NaN separates routes of a muscle that pulleys join.
        """
        return self._polylines(spacing, -1)

    def plot(self, axes: Any = None) -> Any:
        """Draw all paths at the last evaluation in space with matplotlib, and return the axes.

        A muscle without a path is drawn along its last valid one, and its label has its status. axes: 3D axes to draw
        into; None for a new figure. Raises `MissingPackageError` without matplotlib, `GeometryError` for other axes,
        and `StateError` before the first evaluation.
        """
        paths = [(label(self, i), self.points(i)) for i in range(self.n)]
        return plots.draw_paths(paths, self.contacts()[0], [], axes)

    def contact_points(self, i: int) -> Array:
        """Return the first and last contact point (k, 2, 3) of every obstacle that muscle i touches, world [m]."""
        return self._contacts(self._known(i))[0].reshape(-1, 2, 3)

    def contacts(self) -> tuple[Array, NDArray[np.int64]]:
        """Return the contact points of all muscles, P and Q in turn: points (m, 3), starts (n + 1,)."""
        return self._contacts(-1)

    def poses(self, data: mujoco.MjData) -> mujoco.MjData:
        """Return the data with the poses at which the results were computed: `data` itself."""
        return data

    def history(
        self, rows: int, muscles: NDArray[np.int64] | None = None, dofs: NDArray[np.int64] | None = None
    ) -> History:
        """Return storage for `rows` states and frames of the muscles, with the moment arms of pairs (muscles, dofs)."""
        tree = self._last_dof, self._dofs[2], self._root
        return History(self.model, self._plan, tree, self._evaluation, rows, muscles, dofs)

    def forces(self, i: int) -> list[tuple[int, Array, Array]]:
        """Return the forces of muscle i at the last evaluation: (body id, point (3,) [m], force (3,) [N]), world."""
        state, plan = self._evaluation(), self._plan
        found = []
        for c in np.flatnonzero(plan.routes[:, muscle_paths.R_MUSCLE] == self._known(i)):
            pull = state.tension[i] * plan.weights[c]
            first = int(plan.routes[c, muscle_paths.R_LO]) + int(c)
            for row in state.segments[first : first + int(state.count[c])]:
                force = pull * row[segments.G_E : segments.G_E + 3]
                for column, sign, index in ((segments.G_A, 1.0, row[0]), (segments.G_B, -1.0, row[1])):
                    body = int(muscle_paths.end_body(plan.routes, plan.links, c, int(index)))
                    found.append((body, row[column : column + 3].copy(), sign * force))
        return found
