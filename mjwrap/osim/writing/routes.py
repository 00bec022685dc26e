"""Paths as the stops of a muscle's tuple: sites and surfaces in the order in which the path meets them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from mjwrap.osim.description.paths import Path, PathWrap
from mjwrap.osim.report import APPROXIMATED, EXACT, LEFT_OUT, Report
from mjwrap.osim.writing.segment_scan import Sample
from mjwrap.osim.writing.segments import Seat, seat_wraps
from mjwrap.osim.writing.sites import Elements, SiteWriter
from mjwrap.osim.writing.wrap_order import in_order
from mjwrap.osim.writing.wraps import WrittenWrap


@dataclass(frozen=True)
class Route:
    """A path as written: the elements of a tuple, and the sites that a tendon of MuJoCo's can run over."""

    elements: Elements
    sites: list[str]


class RouteWriter:
    """Writes paths; poses: those at which the places of wraps are chosen."""

    def __init__(
        self, report: Report, sites: SiteWriter, wraps: Mapping[str, WrittenWrap], poses: Sequence[Sample]
    ) -> None:
        self._report, self._sites, self._wraps, self._poses = report, sites, wraps, poses

    def route(self, owner: str, path: Path) -> Route | None:
        """Write the points of a path; None, with an entry in the report, where it cannot be a path of mjwrap's."""
        count = len(path.points)
        if count < 2:
            self._report.add(path.kind, owner, LEFT_OUT, "a path needs two points")
            return None
        stops = [self._sites.stop(owner, point, k in (0, count - 1)) for k, point in enumerate(path.points)]
        seats = self._seats(owner, path)
        elements: Elements = []
        for gap, stop in enumerate(stops):
            elements += stop.elements
            for seat in in_order(path, seats, gap, self._wraps, self._poses):
                elements += self._wraps[seat.wrap].elements
        for seat in seats:
            self._report_seat(f"{owner}/{seat.wrap}", path, seat)
        return Route(elements, [stop.site for stop in stops if stop.always])

    def _seats(self, owner: str, path: Path) -> list[Seat]:
        kept: list[Seat] = []
        used: list[PathWrap] = []
        for wrap in path.wraps:
            name = f"{owner}/{wrap.object}"
            if wrap.object not in self._wraps:
                self._report.add("PathWrap", name, LEFT_OUT, "its wrap object is left out")
            elif not wrap.first < wrap.last:
                self._report.add("PathWrap", name, LEFT_OUT, "its range has no segment, so it never acts")
            else:
                used.append(wrap)
        for seat in seat_wraps(replace(path, wraps=tuple(used)), self._wraps, self._poses):
            name = f"{owner}/{seat.wrap}"
            if not self._wraps[seat.wrap].wrap.active:
                self._report.add("PathWrap", name, LEFT_OUT, "its wrap object is not active in the file")
                continue
            reason = _never(seat)
            if reason:
                self._report.add("PathWrap", name, LEFT_OUT, reason)
                continue
            kept.append(seat)
        return kept

    def _report_seat(self, name: str, path: Path, seat: Seat) -> None:
        points = path.points
        places = " and ".join(f"{points[g].name} and {points[g + 1].name}" for g in seat.gaps)
        text = f"between {places}; acts at {seat.acted:.0%} of {len(self._poses)} sampled poses"
        remarks = [
            (seat.missed, "on another segment at {:.1%}, which is not kept"),
            (seat.moved * (len(seat.gaps) > 1), "it moves from one segment to another, at {:.1%}"),
            (seat.turned, "in another order with the other surfaces of its segment at {:.1%}"),
            (seat.several, "it meets several segments at {:.1%}, and OpenSim wraps the first"),
            (seat.inside, "an end of its segment is inside it at {:.1%}, where OpenSim does not wrap it"),
            (seat.beyond, "the path meets it only beyond the ends of the cylinder at {:.1%}, where OpenSim does not "
                          "wrap it and mjwrap does"),
        ]  # fmt: skip
        said = [remark.format(share) for share, remark in remarks if share > 0.0]
        outcome = APPROXIMATED if max(seat.missed, seat.inside, seat.beyond, seat.turned) > 0.0 else EXACT
        size = seat.error if max(seat.missed, seat.beyond) > 0.0 else float("nan")
        self._report.add("PathWrap", name, outcome, "; ".join([text, *said]), size, "m" * (size == size))


def _never(seat: Seat) -> str:
    """Return why OpenSim's wrap never acts although the path meets the surface, so that it is left out; or nothing."""
    if seat.acted > 0.0:
        return ""
    if seat.beyond > 0.0:
        return (
            f"the path meets the cylinder only beyond its ends, at {seat.beyond:.0%} of the sampled poses, and OpenSim "
            f"does not wrap it there"
        )
    if seat.inside >= 1.0:
        return "an end of its segment is inside it at every sampled pose, and OpenSim does not wrap it then"
    return ""
