"""The order in which a path meets several wrap objects on one segment, as OpenSim finds it.

OpenSim adds its wraps one after the other, in the order of the file, each to the best of the straight pieces that the
ones before have left. So which comes first along the path may depend on the pose; most of the sampled poses decide.
"""

from __future__ import annotations

import functools
from collections import Counter
from collections.abc import Mapping, Sequence

from mjwrap.osim.description.paths import Path
from mjwrap.osim.kinematics import frame_pose, point_position
from mjwrap.osim.writing.segment_scan import Array, Sample, act_between, active_points, best_act
from mjwrap.osim.writing.segments import Seat
from mjwrap.osim.writing.wraps import WrittenWrap


def in_order(
    path: Path, seats: Sequence[Seat], gap: int, wraps: Mapping[str, WrittenWrap], samples: Sequence[Sample]
) -> list[Seat]:
    """Return the seats on a gap in the order of the path; `Seat.turned` says how often another one would be right."""
    here = [seat for seat in seats if gap in seat.gaps]
    if len(here) < 2:
        return here
    votes: Counter[tuple[str, str]] = Counter()
    for sample in samples:
        found = _met(path, here, gap, wraps, sample)
        votes.update((first, second) for k, first in enumerate(found) for second in found[k + 1 :])

    def compare(a: Seat, b: Seat) -> float:
        wanted = votes[b.wrap, a.wrap] - votes[a.wrap, b.wrap]
        return wanted or a.along.get(gap, 0.5) - b.along.get(gap, 0.5)

    ordered = sorted(
        here, key=functools.cmp_to_key(lambda a, b: (compare(a, b) > 0.0) - (compare(a, b) < 0.0))
    )
    for k, seat in enumerate(ordered):
        wrong = sum(votes[later.wrap, seat.wrap] for later in ordered[k + 1 :])
        seat.turned = max(seat.turned, wrong / max(len(samples), 1))
    return ordered


def _met(
    path: Path, seats: Sequence[Seat], gap: int, wraps: Mapping[str, WrittenWrap], sample: Sample
) -> list[str]:
    """Return the wraps that act on a gap at a pose, in the order in which the path meets them."""
    there = active_points(path, sample)
    first = max(k for k in there if k <= gap)
    last = min(k for k in there if k > gap)
    points = [point_position(path.points[k], sample.bodies, sample.values) for k in (first, last)]
    pieces: list[tuple[Array, Array]] = [(points[0], points[1])]
    found: list[str] = []
    for seat in seats:
        written = wraps[seat.wrap]
        frame = frame_pose(sample.bodies, written.wrap.frame)

        ends = [[frame.rotation.T @ (end - frame.position) for end in piece] for piece in pieces]
        acts = [act_between(written, k, k + 1, a, b) for k, (a, b) in enumerate(ends)]
        best = best_act(acts)
        if best is None or best.contact is None:
            continue
        start, end = pieces[best.first]
        P, Q = (frame.position + frame.rotation @ point for point in best.contact)
        pieces[best.first : best.first + 1] = [(start, P), (Q, end)]
        found.insert(best.first, seat.wrap)
    return found
