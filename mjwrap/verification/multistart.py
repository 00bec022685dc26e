"""Search for the shortest taut path without the solver's code.

One surface: all paths (`multistart_single`), and for a torus also paths that bridge its hole. Up to FEW surfaces:
strings laid round them in many ways (`multistart_rows`). Longer rows: in addition every window of WINDOW neighbours of
a given path is searched again between fixed ends; if there is a shorter path through it, the whole path is polished
from that one. Only paths that the judge of `certificate.py` accepts are used.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

import mjwrap as mw
from mjwrap.verification.certificate import Case, findings
from mjwrap.verification.multistart_rows import finished, paths_over_row
from mjwrap.verification.multistart_single import paths_over_one
from mjwrap.verification.polish import Touch
from mjwrap.verification.shapes import Array, unit

FEW = 5  # number of surfaces whose ways round are tried together
WINDOW = 3  # number of neighbours that are searched together in a longer row
WINDOW_STRINGS = 32
SHORTER = 1e-6  # relative: smaller differences are ignored


def shortest(
    origin: Array,
    insertion: Array,
    obstacles: Sequence[mw.Obstacle],
    rng: np.random.Generator,
    start: Case | None = None,
) -> Case | None:
    """Return the shortest path found that the judge accepts, or None; start: a path to improve upon, in longer rows."""
    cases: list[Case] = []
    if len(obstacles) == 1:
        cases += paths_over_one(origin, insertion, obstacles[0])
    if len(obstacles) > 1 or isinstance(obstacles[0].surface, mw.Torus):
        if len(obstacles) <= FEW:
            cases += paths_over_row(origin, insertion, obstacles, rng)
        if start is not None and len(obstacles) > WINDOW:
            cases += improved(start, rng)
    return accepted(cases)


def accepted(cases: Sequence[Case]) -> Case | None:
    """Return the shortest of the paths that the judge accepts."""
    good = [case for case, reason in zip(cases, findings(cases), strict=True) if not reason]
    return min(good, key=lambda case: case.length, default=None)


def improved(case: Case, rng: np.random.Generator) -> list[Case]:
    """Return paths that are shorter in some window of a path's row."""
    n = len(case.obstacles)
    stops = [(k, P, Q, s) for k, contacts in enumerate(case.contacts) for P, Q, s in contacts]
    found = []
    for first in range(n - WINDOW + 1):
        before = [stop for stop in stops if stop[0] < first]
        after = [stop for stop in stops if stop[0] >= first + WINDOW]
        within = [stop for stop in stops if first <= stop[0] < first + WINDOW]
        a = before[-1][2] if before else case.origin
        b = after[0][1] if after else case.insertion
        low = before[-1][0] + 1 if before else 0
        high = after[0][0] if after else n
        points = [a, *(x for stop in within for x in stop[1:3]), b]
        present = sum(float(np.linalg.norm(y - x)) for x, y in zip(points[::2], points[1::2], strict=True))
        present += sum(stop[3] for stop in within)
        part = accepted(paths_over_row(a, b, case.obstacles[low:high], rng, WINDOW_STRINGS))
        if part is None or part.length > present - 0.1 * SHORTER * case.length:
            continue
        inner = [(low + k, P, Q, s) for k, contacts in enumerate(part.contacts) for P, Q, s in contacts]
        rough, point = [], case.origin
        for k, P, Q, s in [*before, *inner, *after]:
            rough.append(Touch(k, P, unit(P - point), s))
            point = Q
        found.append(rough)
    return finished(case.origin, case.insertion, case.obstacles, found)
