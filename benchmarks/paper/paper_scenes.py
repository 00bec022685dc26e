"""The scenes of Muñoz-Pepi et al. 2023 (doi 10.1109/LRA.2023.3313027), their Table I, and lengths in closed form.

The paper's centimetres are metres here. This file shares no code with mjwrap.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

CM = 0.01
ORIGIN = np.array([2.0, 0.0, -2.5]) * CM
INSERTION = np.array([-2.0, 0.0, -0.5]) * CM
RADIUS = 1.0 * CM
TIMES = 0.012 * np.arange(251)  # 0 … 3 s
AMPLITUDE = {1: 0.9 * CM, 2: 2.0 * CM}

TWO_RADIUS = 0.1 * CM  # the paper gives neither radii nor end points
TWO_WHY = (
    "radii 0.1 cm and the end points of cases 1 and 2, over (+y) the first cylinder and under the second, as in "
    "models/paper_two_cylinders: the centres are 0.5 cm apart and move by 0.15 cm, so that the cylinders never "
    "overlap, and each is touched at three poses in four, with lift-off and touchdown of both"
)


@dataclass(frozen=True)
class PaperRow:
    """One row of Table I: the method, its options here, and the paper's n_i, i_a, n_f, t_a [s] in cases 1 and 2."""

    label: str
    method: str
    options: dict[str, float | str]
    cases: dict[int, tuple[int, int, int, float]]


TABLE = [
    PaperRow("NR λ=0.08", "nr", {"lam": 0.08}, {1: (4273, 17, 47254, 18.07), 2: (4429, 17, 48970, 17.56)}),
    PaperRow("NR λ=0.1", "nr", {"lam": 0.1}, {1: (4870, 19, 53821, 21.51), 2: (4997, 19, 55218, 20.38)}),
    PaperRow("NR λ=0.5", "nr", {"lam": 0.5}, {1: (14382, 57, 158453, 69.36), 2: (15912, 63, 175283, 64.13)}),
    PaperRow(
        "BFGS step 1", "bfgs", {"step": 1.0}, {1: (4091, 16, 88672, 50.43), 2: (4386, 17, 94867, 54.96)}
    ),
    PaperRow(
        "BFGS Armijo", "bfgs", {"step": "armijo"}, {1: (3516, 14, 78423, 48.61), 2: (3872, 15, 85976, 54.23)}
    ),
    PaperRow(
        "BR step 1", "broyden", {"step": 1.0}, {1: (16772, 66, 19533, 3.53), 2: (16854, 67, 19615, 3.58)}
    ),
    PaperRow(
        "BR line search",
        "broyden",
        {"step": "line_search"},
        {1: (3464, 13, 10100, 5.30), 2: (3546, 14, 10264, 5.51)},
    ),
]
TWO_PAPER = (3297, 13, 6058, 9.17)


def centre(case: int, t: float) -> Array:
    """Return the cylinder's centre [m] at time t [s]."""
    return np.array([0.0, AMPLITUDE[case] * math.sin(2.0 * math.pi * t), 0.0])


def centre_velocity(case: int, t: float) -> Array:
    """Return the velocity of the cylinder's centre [m/s] at time t [s]."""
    return np.array([0.0, AMPLITUDE[case] * 2.0 * math.pi * math.cos(2.0 * math.pi * t), 0.0])


def two_centres(t: float) -> Array:
    """Return both cylinders' centres (2, 3) [m] at time t [s]."""
    first = 0.15 * math.sin(2.0 * math.pi * t)
    second = 0.15 * math.cos(2.0 * math.pi * (t + 0.24))
    return np.array([[0.0, first, 0.0], [-0.5, second, 0.0]]) * CM


def closed_form(case: int, t: float) -> tuple[float, bool]:
    """Return the exact length [m] and whether the path touches the cylinder, over which it runs on +y.

    Obstacle-set method (Garner & Pandy 2000): seen along the axis the path is two tangents and an arc of a circle;
    unroll that, and the path is the hypotenuse over the distance along the axis.
    """
    c = centre(case, t)
    o, i = ORIGIN - c, INSERTION - c
    to_origin, to_insertion = math.hypot(o[0], o[1]), math.hypot(i[0], i[1])
    first = math.atan2(o[1], o[0]) + math.acos(RADIUS / to_origin)  # anticlockwise, from +x over +y to −x
    last = math.atan2(i[1], i[0]) - math.acos(RADIUS / to_insertion)
    turn = math.remainder(last - first, 2.0 * math.pi)
    if turn <= 0.0:
        return float(np.linalg.norm(INSERTION - ORIGIN)), False
    flat = math.sqrt(to_origin**2 - RADIUS**2) + RADIUS * turn + math.sqrt(to_insertion**2 - RADIUS**2)
    return math.hypot(flat, float(i[2] - o[2])), True
