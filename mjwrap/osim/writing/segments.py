"""Choose the segment of a path on which each wrap object lies, and the order of several on one segment.

An OpenSim wrap acts at every pose on the best segment of its range: the first that meets its solid, or else the one
that its side lengthens least. A muscle of mjwrap lists its surfaces in order. So the choice is made once, from sampled
poses; a surface without a side is listed on every segment on which it acts at some pose.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from mjwrap.osim.description.paths import Path
from mjwrap.osim.writing.segment_scan import Act, Sample, acts_of, best_act
from mjwrap.osim.writing.wraps import WrittenWrap


@dataclass
class Seat:
    """Where a wrap of a path was put, and at which share of the sampled poses what happens.

    gaps: it lies between points g and g + 1, for every g listed. acted: OpenSim's wrap acts. moved: on a segment that
    is not the first of `gaps`. missed: on none of `gaps`. several: it meets more than one segment, and OpenSim wraps
    the first. inside: an end of its segment is inside, and OpenSim does not wrap it. beyond: the path meets a cylinder
    only beyond its ends, and OpenSim does not wrap it. error: the largest difference of length that `missed` and
    `beyond` make [m].
    """

    wrap: str
    gaps: list[int] = field(default_factory=list)
    acted: float = 0.0
    moved: float = 0.0
    missed: float = 0.0
    several: float = 0.0
    inside: float = 0.0
    beyond: float = 0.0
    error: float = 0.0
    turned: float = 0.0  # it comes before one that is listed later (`wrap_order.py`)
    along: dict[int, float] = field(default_factory=dict)  # gap -> mean place on the segment, 0 to 1


def seat_wraps(path: Path, wraps: Mapping[str, WrittenWrap], poses: Sequence[Sample]) -> list[Seat]:
    """Return where every wrap of a path lies, in the file's order; every wrap has a segment."""
    return [_seat(path, k, wraps[wrap.object], poses) for k, wrap in enumerate(path.wraps)]


def _seat(path: Path, index: int, written: WrittenWrap, poses: Sequence[Sample]) -> Seat:
    wrap = path.wraps[index]
    seat = Seat(wrap.object)
    scans = [acts_of(path, wrap, written, pose) for pose in poses]
    chosen = [best_act(acts) for acts in scans]
    acting = [act for act in chosen if act is not None]
    total = max(len(poses), 1)
    seat.acted = len(acting) / total
    seat.several = sum(sum(act.hit and act.touched for act in acts) > 1 for acts in scans) / total
    seat.gaps = _covering(acting, several=not written.side) or [_nearest(path, index, scans)]
    seat.moved = sum(not act.first <= seat.gaps[0] < act.last for act in acting) / total
    missed = [act for act in acting if not _lies_in(act, seat.gaps)]
    beyond = [act for acts in scans for act in acts if act.beyond and _lies_in(act, seat.gaps)]
    seat.missed, seat.beyond = len(missed) / total, min(1.0, len(beyond) / total)
    seat.error = max((act.added for act in (*missed, *beyond)), default=0.0)
    for gap in seat.gaps:
        here = [act for acts in scans for act in acts if act.first <= gap < act.last]
        seat.inside = max(seat.inside, sum(act.inside for act in here) / total)
        places = [act.along for act in here if act.touched] or [act.along for act in here]
        seat.along[gap] = float(np.mean(places)) if places else 0.5
    seat.gaps.sort()
    return seat


def _lies_in(act: Act, gaps: Sequence[int]) -> bool:
    return any(act.first <= gap < act.last for gap in gaps)


def _covering(acting: Sequence[Act], several: bool) -> list[int]:
    """Return the gaps, most used first, that together hold all segments on which a wrap acts; or only the first."""
    left, gaps = list(acting), list[int]()
    while left and (several or not gaps):
        counts = Counter(gap for act in left for gap in range(act.first, act.last))
        most = max(counts.values())
        best = min(gap for gap, count in counts.items() if count == most)
        gaps.append(best)
        left = [act for act in left if not act.first <= best < act.last]
    return gaps


def _nearest(path: Path, index: int, scans: Sequence[Sequence[Act]]) -> int:
    """Return the gap of a wrap that never acts: the first of its range whose ends are never inside, if there is one."""
    wrap = path.wraps[index]
    bad = {gap for acts in scans for act in acts if act.inside for gap in range(act.first, act.last)}
    gaps = range(wrap.first, wrap.last)
    return next((gap for gap in gaps if gap not in bad), wrap.first)
