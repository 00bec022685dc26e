"""The protocol of a solver of bench_paths.py, and the result of one of its timed sweeps."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from path_scenes import Array


@dataclass
class Sweep:
    """One timed sweep over m poses of a scene.

    mean, samples: of the time per new pose [us]; length (m,) [m]; failed (m,): poses that the solver itself gives up;
    at (m,): which poses of the scene they are; notes: figures of the solver's own.
    """

    mean: float
    samples: Array
    length: Array
    failed: NDArray[np.bool_]
    at: NDArray[np.int64]
    notes: dict[str, float] = field(default_factory=dict)


class Solver(Protocol):
    """A solver set up for one scene.

    against: the solver whose time its own is set in relation to; other_side: it is told no side, so that it may find a
    shorter path than the others.
    """

    name: str
    against: str
    other_side: bool

    def sweep(self) -> Sweep:
        """Run and time the whole sweep once."""
        ...
