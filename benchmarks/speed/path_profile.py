"""Profile of one warm pose: kernels called alone in compiled loops, and what limits their speed.

Each part is timed with every call waiting for the one before, as in the solver, and, for geodesics, with calls that do
not wait, so that they overlap in the processor: the difference is what several geodesics at once could gain. The
bound is the time that a pose's additions and multiplications would take at the core's measured rate of fused
multiply-adds, two operations each, in scalar and in vector instructions.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from time import thread_time as clock
from typing import Any

import numba
import numpy as np
from count_flops import MIDDLE, Counts, counts
from path_scenes import Scene
from path_solvers import WARM, Mjwrap

import mjwrap as mw
from mjwrap.kernels import layout
from mjwrap.kernels.geometry import geodesics
from mjwrap.kernels.spans import chain
from mjwrap.kernels.tangency import block_elimination, certify, tangency_error
from mjwrap.paths.scene import owners

njit: Any = numba.njit
solve_chain: Any = chain.solve_chain
LONG_ENOUGH = 2e4  # of a timed loop [us]
TRIES = 7
S_ARC, W_Q, W_L, W_Y = layout.S_ARC, layout.W_Q, layout.W_L, layout.W_Y
NOTHING = 0.0  # times any number: it changes no value, but the next call has to wait for it
BARELY = 1e-18  # times the number of the call: changes every call's value and waits for none


@njit
def _geodesics(count, k, waiting, barely, node):
    arc = node[k, S_ARC]
    for i in range(count):
        node[k, S_ARC] = arc + waiting * node[k, W_Q] + barely * i
        geodesics.geodesic(k, node, 0.0, 0.0, 0.0)


@njit
def _overlapping_geodesics(count, k, waiting, barely, node):
    arc = node[k, S_ARC]
    for i in range(count):
        node[k, S_ARC] = arc + barely * i
        geodesics.geodesic(k, node, 0.0, 0.0, 0.0)


@njit
def _evaluations(count, first, waiting, ends, node):
    arc = node[first, S_ARC]
    total = 0.0
    for _ in range(count):
        node[first, S_ARC] = arc + waiting * total
        total += tangency_error.evaluate(0, node.shape[0], ends, node)
    return total


@njit
def _steps(count, first, waiting, node):
    size = node[first, W_L]
    for _ in range(count):
        node[first, W_L] = size + waiting * node[first, W_Y]
        block_elimination.solve_newton_system(0, node.shape[0], node)


@njit
def _moves(count, touched, waiting, node):
    for _ in range(count):
        for k in touched:
            geodesics.displace(k, 0.0, 0.0, 0.0, waiting, node)


@njit
def _minima(count, first, waiting, node):
    size = node[first, W_L]
    for _ in range(count):
        node[first, W_L] = size + waiting * certify.is_local_minimum(0, node.shape[0], node)


@njit
def _solutions(count, waiting, ends, node, info):
    length = 0.0
    for _ in range(count):
        x = ends[0] + waiting * length
        solve_chain(0, node.shape[0], x, *ends[1:], node, 1e-10, False, info, 0)
        length = info[0, layout.I_LENGTH]


@njit
def _poses(count, pos, quat, node, before):
    for _ in range(count):
        for k in range(node.shape[0]):
            for i in range(3):
                node[k, layout.POS + i] = pos[0, k, i]
            chain.set_rotation(node, k, quat[0, k, 0], quat[0, k, 1], quat[0, k, 2], quat[0, k, 3])
        chain.extrapolate(node, before)


@njit
def _scalar_multiply_adds(count, x, y):
    a, b, c, d, e, f, g, h = x, y, x + 1.0, y + 1.0, x + 2.0, y + 2.0, x + 3.0, y + 3.0
    for _ in range(count):
        a, b, c, d = a * x + y, b * x + y, c * x + y, d * x + y
        e, f, g, h = e * x + y, f * x + y, g * x + y, h * x + y
    return a + b + c + d + e + f + g + h


@njit
def _vector_multiply_adds(count, values, x):
    for _ in range(count):
        for i in range(values.shape[0]):
            v = y = values[i]
            y = y * x + v
            y = y * x + v
            y = y * x + v
            y = y * x + v
            y = y * x + v
            y = y * x + v
            y = y * x + v
            y = y * x + v
            values[i] = y


# fused multiply-adds as in the kernels, nothing else that changes results
for _loop in (_scalar_multiply_adds, _vector_multiply_adds):
    _loop.targetoptions["fastmath"] = {"contract"}


def time_call(loop: Callable[..., object], *arguments: Any) -> float:
    """Return the shortest time of one of many calls in a compiled loop(count, *arguments) [us]."""
    loop(1, *arguments)  # compiles
    count = 16
    while True:
        began = clock()
        loop(count, *arguments)
        took = 1e6 * (clock() - began)
        if took > LONG_ENOUGH:
            break
        count *= 4
    times = []
    for _ in range(TRIES):
        began = clock()
        loop(count, *arguments)
        times.append(1e6 * (clock() - began) / count)
    return min(times)


def peak() -> tuple[float, float]:
    """Return the core's rates of fused multiply-adds, scalar and vector, two operations each [operations/us]."""
    values = np.full(256, 0.5)
    vector = time_call(_vector_multiply_adds, values, 0.5)
    return 16.0 / time_call(_scalar_multiply_adds, 0.5, 0.25), 16.0 * len(values) / vector


@dataclass
class Part:
    """A share of a pose: what it is, the time of one call [us], calls a pose."""

    name: str
    each: float
    times: float


@dataclass
class Solved:
    """A solved pose as kernels have it.

    node: its rows; owner, touched: which surface each row belongs to, which rows are touched; ends, outside: the end
    points as spans and as chains take them.
    """

    node: Any
    owner: Any
    touched: Any
    ends: tuple[float, ...]
    outside: tuple[float, ...]


def solved(scene: Scene) -> Solved:
    """Solve one pose of a scene."""
    pos, quat = scene.motion()
    j = int(MIDDLE * scene.poses)
    row = [
        mw.Obstacle(surface, pos[j, k], quat[j, k], scene.hints[k])
        for k, surface in enumerate(scene.surfaces)
    ]
    node = mw.solve_path(scene.origin, scene.insertion, row)._node.copy()
    here, there = tuple(map(float, scene.origin)), tuple(map(float, scene.insertion))
    ends = (*here, 0.0, 0.0, 0.0, *map(float, scene.insertion - scene.origin))
    touched = np.flatnonzero(node[:, layout.S_MODE] == layout.TOUCHED)
    return Solved(node, owners(row), touched, ends, here + there)


def parts(scene: Scene) -> tuple[list[Part], list[tuple[str, float, float]], float]:
    """Return the parts of a warm pose, every kind's geodesic (waiting, overlapping), and the whole pose [us]."""
    at = solved(scene)
    first, copy, info = at.touched[0], at.node.copy, np.zeros((1, layout.INFO))
    shapes = {type(scene.surfaces[at.owner[k]]).__name__: k for k in at.touched}
    single = [
        (
            kind,
            time_call(_geodesics, k, NOTHING, 0.0, copy()),
            time_call(_overlapping_geodesics, k, NOTHING, BARELY, copy()),
        )
        for kind, k in shapes.items()
    ]
    evaluation = time_call(_evaluations, first, NOTHING, at.ends, copy())
    again = time_call(_solutions, NOTHING, at.outside, copy(), info)
    least = time_call(_minima, first, NOTHING, copy())
    step, move = time_call(_steps, first, NOTHING, copy()), time_call(_moves, at.touched, NOTHING, copy())
    saved = at.node[:, layout.S_MODE : layout.S_MODE + layout.STATE].copy()
    pos, quat = (np.ascontiguousarray(part[:1, at.owner]) for part in scene.motion())
    read = time_call(_poses, pos, quat, copy(), saved)
    run = Mjwrap(scene, WARM)
    run.sweep()
    sweeps = [run.sweep() for _ in range(5)]
    notes = sweeps[0].notes
    whole = float(np.median([np.median(sweep.samples) for sweep in sweeps]))
    found = [
        Part("evaluation of all geodesics and segments", evaluation, notes["evaluations"]),
        Part("solving for a Newton step", step, notes["iterations"]),
        Part("moving the geodesics", move, notes["iterations"]),
        Part("certificate: local minimum", least, 1.0),
        Part("certificate: side and clearance; bookkeeping", again - evaluation - least, 1.0),
        Part("reading a pose, extrapolating", read, 1.0),
    ]
    return found, single, whole


def _text(count: Counts, took: float, scalar: float, vector: float) -> str:
    sums = count["add"] + count["mul"]
    return (
        f"{sums:,.0f} add/mul, {count['div']:,.0f} div, {count['sqrt']:,.0f} sqrt, {count['call']:,.0f} calls; "
        f"{sums / took / scalar:.0%} scalar, {sums / took / vector:.0%} vector"
    )


def profile(scene: Scene) -> None:
    """Print where the time of a warm pose goes, and what bounds it."""
    found, single, whole = parts(scene)
    flops = counts(scene)
    scalar, vector = peak()
    print(f"\n{scene.name}: {whole:.3f} us a warm pose")
    print(f"  {'':48}{'us each':>9}{'a pose':>8}{'us a pose':>11}{'share':>8}")
    for part in found:
        took = part.each * part.times
        print(f"  {part.name:48}{part.each:9.3f}{part.times:8.2f}{took:11.3f}{took / whole:8.0%}")
    rest = whole - sum(part.each * part.times for part in found)
    print(f"  {'the rest, measured as the difference':48}{'':17}{rest:11.3f}{rest / whole:8.0%}")
    print(f"  {'one geodesic':24}{'us waiting':>12}{'overlapping':>13}   operations, shares of the peaks")
    for kind, waiting, overlapping in single:
        print(
            f"  {kind:24}{waiting:12.3f}{overlapping:13.3f}   {_text(flops[kind], waiting, scalar, vector)}"
        )
    print(f"  {'the whole pose':49}   {_text(flops['pose'], whole, scalar, vector)}")
    sums = flops["pose"]["add"] + flops["pose"]["mul"]
    print(
        f"  peaks of this core: {scalar / 1e3:.1f} Gflop/s scalar, {vector / 1e3:.1f} vector; at them a pose's "
        f"additions and multiplications take {sums / scalar:.3f} us, {sums / vector:.3f} us"
    )
