"""solve_sweep: a whole motion in one compiled loop."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjwrap import validation
from mjwrap.errors import GeometryError
from mjwrap.kernels import layout
from mjwrap.kernels.spans import chain
from mjwrap.paths.scene import Array, Obstacle, owners, pack
from mjwrap.paths.status import Status


@dataclass(frozen=True)
class SweepSolution:
    """The result of `solve_sweep`, one entry per pose.

    Attributes:
        length: (T,) lengths [m].
        status: (T,) codes of `Status`.
        tangency_error: (T,) norms of the tangency residuals.
        iterations: (T,) Newton steps.
        evaluations: (T,) evaluations of all residuals.
        converged: whether every pose converged.
    """

    length: Array
    status: NDArray[np.int64]
    tangency_error: Array
    iterations: NDArray[np.int64]
    evaluations: NDArray[np.int64]

    def __repr__(self) -> str:
        good = int((self.status == Status.CONVERGED).sum())
        share = "all" if good == len(self.status) else f"{good}"
        span = f", length {self.length.min():.6g} to {self.length.max():.6g} m" if len(self.length) else ""
        return f"SweepSolution({len(self.status)} poses, {share} converged{span})"

    @property
    def converged(self) -> bool:
        """Whether every pose has a certified path."""
        return bool((self.status == Status.CONVERGED).all())


def _motion(value: ArrayLike, shape: tuple[int, ...], what: str) -> Array:
    try:
        array = np.array(np.broadcast_to(np.asarray(value, dtype=np.float64), shape), order="C")
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
    """Solve the path at every pose of a motion, in one compiled loop.

    Args:
        origin: (T, 3) or (3,) first point of the path, world [m].
        insertion: (T, 3) or (3,) last point of the path, world [m].
        obstacles: n obstacles and via points. Their own poses are not used.
        pos: (T, n, 3) positions of the obstacles, world [m].
        quat: (T, n, 4) orientations of the obstacles, w, x, y, z.
        warm: start each pose from the previous ones, and keep their branch; otherwise each pose is a cold start.
        tol: largest tangency error of a solution.

    Returns:
        Length, status and cost of every pose.

    Raises:
        GeometryError: an array has a wrong shape or is not finite.
    """
    tol = validation.positive(tol, "tol", GeometryError)
    validation.flag(warm, "warm", GeometryError)
    node, owner = pack(obstacles), owners(obstacles)
    n = len(obstacles)
    shape = validation.numbers(pos, "pos", GeometryError).shape
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
        where.take(
            owner, axis=1
        ),  # contiguous for any number of obstacles, so that the kernel is compiled once
        turned.take(owner, axis=1),
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
