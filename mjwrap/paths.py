"""One path in space: obstacles with world poses in, a certified geodesic path out; no MuJoCo.

Everything is in SI units and world coordinates unless it says otherwise.
"""

from __future__ import annotations

import enum
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjwrap.errors import GeometryError
from mjwrap.kernels import chain, layout, polyline, segments
from mjwrap.surfaces import Surface

Array = NDArray[np.float64]

_MESSAGES = {
    "CONVERGED": "the path meets every tangency condition and is a local minimum of length",
    "NOT_CONVERGED": "no path was found that meets the tangency conditions",
    "ENDPOINT_INSIDE": "the origin, the insertion or a via point lies inside the surface next to it",
    "NOT_MINIMAL": "the tangent path found is not a local minimum of length; a string would slip off it",
    "PENETRATING": "surfaces overlap where the path would touch them, so a part of it lies inside one",
    "NON_FINITE": "a pose or an end point is not finite",
}


class Status(enum.IntEnum):
    """How the search for a path ended; only `CONVERGED` is a solution."""

    CONVERGED = layout.CONVERGED
    NOT_CONVERGED = layout.NOT_CONVERGED
    ENDPOINT_INSIDE = layout.ENDPOINT_INSIDE
    NOT_MINIMAL = layout.NOT_MINIMAL
    PENETRATING = layout.PENETRATING
    NON_FINITE = layout.NON_FINITE

    @property
    def message(self) -> str:
        """What the status means, in one clause."""
        return _MESSAGES[self.name]


def _vector(value: ArrayLike, size: int, what: str) -> tuple[float, ...]:
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise GeometryError(f"{what} must be {size} numbers, not {value!r}") from None
    if array.shape != (size,):
        raise GeometryError(f"{what} must have shape ({size},), not {array.shape}")
    if not np.isfinite(array).all():
        raise GeometryError(f"{what} must be finite, not {array.tolist()}")
    return tuple(array.tolist())


@dataclass(frozen=True)
class Obstacle:
    """A wrapping surface at a pose in the world.

    surface: a `Surface`; pos (3,): origin of its frame [m]; quat (4,): w, x, y, z, any length but zero; hint (3,) or
    None: a point in the surface's frame [m] near which the path should touch at a cold start. `GeometryError` for
    anything else.
    """

    surface: Surface
    pos: tuple[float, ...] = (0.0, 0.0, 0.0)
    quat: tuple[float, ...] = (1.0, 0.0, 0.0, 0.0)
    hint: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.surface, Surface):
            raise GeometryError(f"Obstacle: surface must be a Surface such as Cylinder, not {self.surface!r}")
        object.__setattr__(self, "pos", _vector(self.pos, 3, "Obstacle: pos"))
        object.__setattr__(self, "quat", _vector(self.quat, 4, "Obstacle: quat"))
        if not any(self.quat):
            raise GeometryError("Obstacle: quat must not be zero")
        if self.hint is not None:
            object.__setattr__(self, "hint", _vector(self.hint, 3, "Obstacle: hint"))


@dataclass(frozen=True)
class ViaPoint:
    """A point that the path runs through; it may stand anywhere among the obstacles.

    pos (3,): world coordinates [m], finite, else `GeometryError`.
    """

    pos: tuple[float, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "pos", _vector(self.pos, 3, "ViaPoint: pos"))


@dataclass(frozen=True)
class Contact:
    """Where a path touches one obstacle.

    active: whether it does; P, Q (3,): first and last contact point, world [m] (None where not active);
    arc_length: of the geodesic from P to Q [m]. A via point is always active, with P = Q.
    """

    active: bool
    P: Array | None
    Q: Array | None
    arc_length: float


def _pack(obstacles: Sequence[Obstacle | ViaPoint]) -> Array:
    """Return the kernels' rows for a list of obstacles, cold."""
    node = np.zeros((len(obstacles), layout.ROW))
    node[:, layout.S_MODE] = layout.COLD
    for k, obstacle in enumerate(obstacles):
        if not isinstance(obstacle, Obstacle | ViaPoint):
            raise GeometryError(f"obstacles[{k}] must be an Obstacle or a ViaPoint, not {obstacle!r}")
        node[k, layout.POS : layout.POS + 3] = obstacle.pos
        if isinstance(obstacle, ViaPoint):
            node[k, layout.KIND] = layout.VIA
            continue
        node[k, layout.KIND] = obstacle.surface.kind
        dims = obstacle.surface.dims
        node[k, layout.DIM : layout.DIM + len(dims)] = dims
        chain.set_rotation(node, k, *obstacle.quat)
        if obstacle.hint is not None:
            node[k, layout.HINT] = 1.0
            node[k, layout.HINT + 1 : layout.HINT + 4] = obstacle.hint
    return node


_SAVED = slice(layout.S_MODE, layout.S_MODE + layout.STATE)


class PathSolution:
    """The answer of `solve_path`: length, contacts, and on demand points, speed and wrenches.

    length [m]; status: `Status`; converged: status is CONVERGED; tangency_error: the norm of f over all touched
    obstacles (30); iterations: Newton steps; evaluations: evaluations of all residuals at once; contacts: one
    `Contact` per obstacle. Where the path was not found the length is that of the last iterate, never NaN.
    """

    def __init__(
        self, origin: tuple[float, ...], insertion: tuple[float, ...], node: Array, saved: Array
    ) -> None:
        self._origin, self._insertion, self._node, self._saved = origin, insertion, node, saved
        self._ends = (0, len(node), *origin, *insertion)
        self.length = 0.0
        self.status = Status.NOT_CONVERGED
        self.tangency_error = 0.0
        self.iterations = 0
        self.evaluations = 0
        self.contacts: list[Contact] = []
        self._segments = np.zeros((len(node) + 1, segments.SEGMENT))
        self._count = 0

    def _finish(self, info: Array, saved_before: Array) -> None:
        self.length = float(info[layout.I_LENGTH])
        self.status = Status(int(info[layout.I_STATUS]))
        self.tangency_error = float(info[layout.I_ERROR])
        self.iterations = int(info[layout.I_ITERATIONS])
        self.evaluations = int(info[layout.I_EVALUATIONS])
        self._saved = self._node[:, _SAVED].copy() if self.converged else saved_before
        self._count = segments.list_segments(*self._ends, self._node, self._segments, 0)
        self.contacts = [self._contact(k) for k in range(len(self._node))]

    def _contact(self, k: int) -> Contact:
        row = self._node[k]
        if row[layout.KIND] == layout.VIA:
            here = row[layout.POS : layout.POS + 3].copy()
            return Contact(True, here, here.copy(), 0.0)
        if row[layout.S_MODE] != layout.TOUCHED:
            return Contact(False, None, None, 0.0)
        base = np.array(self._origin)
        first, last = row[layout.W_P : layout.W_P + 3] + base, row[layout.W_Q : layout.W_Q + 3] + base
        return Contact(True, first, last, float(row[layout.S_ARC]))

    @property
    def converged(self) -> bool:
        """Whether the path was found and certified."""
        return self.status == Status.CONVERGED

    def __repr__(self) -> str:
        touched = sum(contact.active for contact in self.contacts)
        return (
            f"PathSolution({self.status.name}, length={self.length:.9g} m, {touched} of {len(self.contacts)} touched, "
            f"tangency error {self.tangency_error:.1e})"
        )

    def points(self, spacing: float | None = None) -> Array:
        """Return points along the path, (m, 3), world [m], at most `spacing` [m] apart.

        Without a spacing, straight segments have their end points only and geodesics a point every 0.1 rad of turning.
        """
        if spacing is not None and not (np.isfinite(spacing) and spacing > 0.0):
            raise GeometryError(f"spacing must be finite and positive [m], not {spacing!r}")
        step = 0.0 if spacing is None else float(spacing)
        count = polyline.polyline(*self._ends, self._node, step, np.empty((0, 3)), 0)
        out = np.empty((count, 3))
        polyline.polyline(*self._ends, self._node, step, out, 0)
        return out

    def speed(
        self, origin_velocity: ArrayLike, insertion_velocity: ArrayLike, twists: ArrayLike | None = None
    ) -> float:
        """Return the lengthening speed l̇ (17) [m/s], positive when the path grows.

        origin_velocity, insertion_velocity (3,) [m/s]; twists (n, 6), one per obstacle or via point: linear velocity of
        the pose's origin [m/s], then angular velocity [rad/s], world frame; None where nothing moves.
        """
        n = len(self._node)
        pos, twist = np.zeros((n + 2, 3)), np.zeros((n + 2, 6))
        pos[0], pos[1:-1], pos[-1] = self._origin, self._node[:, layout.POS : layout.POS + 3], self._insertion
        twist[0, :3] = _vector(origin_velocity, 3, "origin_velocity")
        twist[-1, :3] = _vector(insertion_velocity, 3, "insertion_velocity")
        if twists is not None:
            given = np.asarray(twists, dtype=np.float64)
            if given.size or n:
                if given.shape != (n, 6):
                    raise GeometryError(f"twists must have shape ({n}, 6), not {given.shape}")
                twist[1:-1] = given
        if not np.isfinite(twist).all():
            raise GeometryError("twists must be finite")
        return float(segments.lengthening_rate(self._count, self._segments, pos, twist))

    def wrenches(self, tension: float) -> Array:
        """Return what the path under `tension` [N] does to origin, each obstacle and insertion.

        (n + 2, 6): force [N], then moment about the world origin [N m], world frame. They sum to zero, and their power
        is -tension l̇ (method section 5).
        """
        if not np.isfinite(tension):
            raise GeometryError(f"tension must be finite [N], not {tension!r}")
        wrench = np.zeros((len(self._node) + 2, 6))
        segments.add_wrenches(self._count, self._segments, float(tension), wrench)
        return wrench


def _start(start: PathSolution | None, node: Array) -> None:
    if start is None:
        return
    if not isinstance(start, PathSolution):
        raise GeometryError(f"start must be the PathSolution of an earlier solve, not {start!r}")
    if not np.array_equal(start._node[:, layout.KIND], node[:, layout.KIND]):
        raise GeometryError("start belongs to a path over other obstacles: number and kinds must be the same")
    node[:, _SAVED] = start._saved


def solve_path(
    origin: ArrayLike,
    insertion: ArrayLike,
    obstacles: Sequence[Obstacle | ViaPoint] = (),
    *,
    method: str = "newton",
    start: PathSolution | None = None,
    tol: float = 1e-10,
    **options: Any,
) -> PathSolution:
    """Find the C1 geodesic path of a taut string from origin to insertion over a row of obstacles.

    origin, insertion (3,): world [m]; obstacles: in the order in which the path meets them, each touched or not; start:
    an earlier solution for the same obstacles elsewhere, whose branch (side, winding) is kept; tol: largest tangency
    error. method: "newton", or the paper's "nr", "bfgs", "broyden" with their own options (`mjwrap.methods`).
    Raises `GeometryError` for input that describes no scene; a path that cannot be found is a status of the result.
    """
    if not (np.isfinite(tol) and tol > 0.0):
        raise GeometryError(f"tol must be finite and positive, not {tol!r}")
    here, there = _vector(origin, 3, "origin"), _vector(insertion, 3, "insertion")
    node = _pack(obstacles)
    _start(start, node)
    before = node[:, _SAVED].copy()
    solution = PathSolution(here, there, node, before)
    info = np.zeros((1, layout.INFO))
    if method == "newton":
        if options:
            raise GeometryError(f"method 'newton' has no options; got {', '.join(options)}")
        direct = start is None
        chain.solve_chain(*solution._ends, node, float(tol), direct, info, 0)
    else:
        _solve_with(method, here, there, obstacles, node, start, float(tol), options, info)
    solution._finish(info[0], before)
    return solution


def _solve_with(
    method: str,
    origin: tuple[float, ...],
    insertion: tuple[float, ...],
    obstacles: Sequence[Obstacle | ViaPoint],
    node: Array,
    start: PathSolution | None,
    tol: float,
    options: dict[str, Any],
    info: Array,
) -> None:
    """Solve span after span with one of the paper's methods and evaluate the result with the kernels."""
    from mjwrap import methods

    if method not in methods.METHODS:
        raise GeometryError(f"method {method!r} is none of: newton, {', '.join(methods.METHODS)}")
    good, iterations, evaluations = True, 0, 0
    stops = [k for k, obstacle in enumerate(obstacles) if isinstance(obstacle, ViaPoint)] + [len(obstacles)]
    first, here = 0, np.array(origin)
    for stop in stops:
        there = np.array(insertion) if stop == len(obstacles) else np.array(obstacles[stop].pos)
        if stop > first:
            result = _solve_span_with(
                method, here, there, obstacles[first:stop], node[first:stop], start is not None, tol, options
            )
            good = good and result.converged
            iterations += result.iterations
            evaluations += result.evaluations
        first, here = stop + 1, there
    chain.evaluate_chain(0, len(node), *origin, *insertion, node, info, 0)
    good = good and info[0, layout.I_ERROR] <= tol
    info[0, layout.I_STATUS] = layout.CONVERGED if good else layout.NOT_CONVERGED
    info[0, layout.I_ITERATIONS] = iterations
    info[0, layout.I_EVALUATIONS] = evaluations


def _solve_span_with(
    method: str,
    origin: Array,
    insertion: Array,
    obstacles: Sequence[Obstacle | ViaPoint],
    node: Array,
    warm: bool,
    tol: float,
    options: dict[str, Any],
) -> Any:
    """Run one of the paper's methods between two points and write its geodesics to the rows `node`."""
    from mjwrap import methods

    n = len(node)
    pos = node[:, layout.POS : layout.POS + 3].copy()
    rot = node[:, layout.ROT : layout.ROT + 9].reshape(n, 3, 3).copy()
    P, t = slice(layout.S_P, layout.S_P + 3), slice(layout.S_T, layout.S_T + 3)
    given = None
    if warm:
        given = (
            np.einsum("kij,kj->ki", rot, node[:, P]) + pos,
            np.einsum("kij,kj->ki", rot, node[:, t]),
            node[:, layout.S_ARC].copy(),
            node[:, layout.S_MODE] == layout.TOUCHED,
        )
    surfaces = [obstacle.surface for obstacle in obstacles if isinstance(obstacle, Obstacle)]
    result = methods.solve_chain(method, origin, insertion, surfaces, pos, rot, given, tol, **options)
    node[:, layout.S_MODE] = np.where(result.active, layout.TOUCHED, layout.FREE)
    node[:, P] = np.einsum("kji,kj->ki", rot, result.P - pos)
    node[:, t] = np.einsum("kji,kj->ki", rot, result.t)
    node[:, layout.S_ARC] = np.where(result.active, result.s, 0.0)
    return result


@dataclass(frozen=True)
class SweepSolution:
    """The answer of `solve_sweep`, one entry per pose.

    length (T,) [m]; status (T,): codes of `Status`; tangency_error (T,); iterations, evaluations (T,): what each pose
    cost; converged: whether every pose did.
    """

    length: Array
    status: NDArray[np.int64]
    tangency_error: Array
    iterations: NDArray[np.int64]
    evaluations: NDArray[np.int64]

    @property
    def converged(self) -> bool:
        """Whether every pose has a certified path."""
        return bool((self.status == Status.CONVERGED).all())


def _motion(value: ArrayLike, shape: tuple[int, ...], what: str) -> Array:
    try:
        array = np.ascontiguousarray(np.broadcast_to(np.asarray(value, dtype=np.float64), shape))
    except (TypeError, ValueError):
        raise GeometryError(f"{what} must have shape {shape}, not {np.shape(value)}") from None
    if not np.isfinite(array).all():
        pose = int(np.argwhere(~np.isfinite(array))[0][0])
        raise GeometryError(f"{what} must be finite; pose {pose} is not")
    return array


def solve_sweep(
    origin: ArrayLike,
    insertion: ArrayLike,
    obstacles: Sequence[Obstacle],
    pos: ArrayLike,
    quat: ArrayLike,
    *,
    warm: bool = True,
    tol: float = 1e-10,
) -> SweepSolution:
    """Solve a whole motion in one compiled loop.

    origin, insertion (T, 3) or (3,): world [m]; obstacles: n surfaces (and via points), whose own poses are not used;
    pos (T, n, 3), quat (T, n, 4) w, x, y, z: their poses. warm: each pose starts from the ones before and keeps their
    branch, else each starts cold. Raises `GeometryError` for arrays of other shapes or not finite.
    """
    n = len(obstacles)
    node = _pack(obstacles)
    shape = np.shape(pos)
    if len(shape) != 3 or shape[1:] != (n, 3):
        raise GeometryError(f"pos must have shape (T, {n}, 3), not {shape}")
    poses = shape[0]
    where = _motion(pos, (poses, n, 3), "pos")
    turned = _motion(quat, (poses, n, 4), "quat")
    if n and not turned.any(axis=2).all():
        raise GeometryError("quat must not be zero")
    info = np.zeros((poses, layout.INFO))
    chain.solve_motion(
        _motion(origin, (poses, 3), "origin"),
        _motion(insertion, (poses, 3), "insertion"),
        where,
        turned,
        node,
        bool(warm),
        float(tol),
        info,
    )
    return SweepSolution(
        info[:, layout.I_LENGTH].copy(),
        info[:, layout.I_STATUS].astype(np.int64),
        info[:, layout.I_ERROR].copy(),
        info[:, layout.I_ITERATIONS].astype(np.int64),
        info[:, layout.I_EVALUATIONS].astype(np.int64),
    )
