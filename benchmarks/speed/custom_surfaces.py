"""Time of one geodesic on surfaces that a user wrote, beside the same built-in ones.

    python benchmarks/speed/custom_surfaces.py [--rounds 40] [--out out/custom_surfaces.json]

Rounds alternate between the surfaces, so that a change of the machine's pace meets them all. Minimum and median of the
rounds are printed.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from pathlib import Path
from typing import Any

import numba
import numpy as np

import mjwrap as mw
from mjwrap.kernels import layout as lay
from mjwrap.kernels.geometry import geodesics
from mjwrap.kernels.spans.chain import set_rotation
from mjwrap.surfaces.rows import write_surface

RADII = 0.05, 0.035, 0.025
RING, TUBE = 0.04, 0.012
COUNT = 200  # geodesics


def ellipsoid(x: float, y: float, z: float) -> float:
    a, b, c = RADII
    return (x / a) ** 2 + (y / b) ** 2 + (z / c) ** 2 - 1.0


def gradient(x: float, y: float, z: float) -> tuple[float, float, float]:
    a, b, c = RADII
    return 2.0 * x / a**2, 2.0 * y / b**2, 2.0 * z / c**2


def hessian(x: float, y: float, z: float) -> tuple[Any, Any, Any]:
    a, b, c = RADII
    return (2.0 / a**2, 0.0, 0.0), (0.0, 2.0 / b**2, 0.0), (0.0, 0.0, 2.0 / c**2)


def torus(u: float, v: float) -> tuple[float, float, float]:
    rho = RING + TUBE * math.cos(v)
    return rho * math.cos(u), rho * math.sin(u), TUBE * math.sin(v)


def ring(x: float, y: float, z: float) -> float:
    return (math.sqrt(x * x + y * y) - RING) ** 2 + z * z - TUBE**2


@numba.njit
def follow(node: Any, rounds: int) -> None:
    """Evaluate all geodesics so many times."""
    for _ in range(rounds):
        for k in range(node.shape[0]):
            geodesics.geodesic(k, node, 0.0, 0.0, 0.0)


def rows(surface: Any, size: float) -> Any:
    """Return rows with random geodesics, arcs of 0.2 to 2.5 sizes, the same for surfaces of the same shape."""
    rng = np.random.default_rng(1)
    node = np.zeros((COUNT, lay.ROW))
    write_surface(surface, node)
    for k in range(COUNT):
        set_rotation(node, k, 1.0, 0.0, 0.0, 0.0)
        node[k, lay.S_P : lay.S_P + 3] = rng.normal(size=3) * 0.05
        node[k, lay.S_T : lay.S_T + 3] = rng.normal(size=3)
        node[k, lay.S_ARC] = rng.uniform(0.2, 2.5) * size
        geodesics.displace(k, 0.0, 0.0, 0.0, 0.0, node)
    return node


def measure(rounds: int) -> dict[str, dict[str, float]]:
    """Return minimum and median time of one geodesic on every surface [us]."""
    box = (0.06, 0.04, 0.03)
    surfaces = {
        "ellipsoid, built in": (mw.Ellipsoid(RADII), min(RADII)),
        "ellipsoid, implicit": (mw.ImplicitSurface(ellipsoid, box), min(RADII)),
        "ellipsoid, implicit, derivatives by hand": (
            mw.ImplicitSurface(ellipsoid, box, gradient=gradient, hessian=hessian),
            min(RADII),
        ),
        "torus, built in": (mw.Torus(RING, TUBE), TUBE),
        "torus, implicit": (mw.ImplicitSurface(ring, (0.06, 0.06, 0.02)), TUBE),
        "torus, parametric": (mw.ParametricSurface(torus, (0.0, math.tau), (0.0, math.tau)), TUBE),
    }
    nodes = {name: rows(*surface) for name, surface in surfaces.items()}
    times: dict[str, list[float]] = {name: [] for name in nodes}
    for node in nodes.values():
        follow(node, 1)
    for _ in range(rounds):
        for name, node in nodes.items():
            started = time.perf_counter()
            follow(node, 3)
            times[name].append((time.perf_counter() - started) / (3 * COUNT) * 1e6)
    return {name: {"min": min(found), "median": float(np.median(found))} for name, found in times.items()}


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rounds", type=int, default=40)
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    found = measure(options.rounds)
    for name, time_of in found.items():
        print(f"{name:42} {time_of['min']:6.2f} us, median {time_of['median']:.2f}")
    if options.out:
        options.out.parent.mkdir(parents=True, exist_ok=True)
        options.out.write_text(json.dumps(found, indent=2) + "\n")


if __name__ == "__main__":
    main()
