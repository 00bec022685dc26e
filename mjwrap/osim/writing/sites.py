"""Path points as sites: fixed ones, moving ones with their functions, and conditions under which a point counts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mjwrap.osim.description.functions import Piecewise
from mjwrap.osim.description.paths import Condition, MovingLocation, PathPoint
from mjwrap.osim.report import APPROXIMATED, EXACT, Report
from mjwrap.osim.writing.document import Document
from mjwrap.osim.writing.drivers import Drivers
from mjwrap.osim.writing.piece_algebra import composed, flattened, preimage, weighted_sum
from mjwrap.osim.writing.unique_names import UniqueNames, plain_name

MOST_NUMBERS = 500  # that a numeric can hold in MuJoCo 3
NEGLIGIBLE = 1e-12  # [m, 1] rotations of frames are rounded

Driver = tuple[str, Piecewise | None]  # see `Drivers.driver`
Elements = list[dict[str, object]]


@dataclass(frozen=True)
class Stop:
    """A point of a path as written: its site, and the elements of a muscle's tuple that list it."""

    site: str
    elements: Elements
    always: bool  # whether it belongs to the path at every pose


class SiteWriter:
    """Writes path points as sites."""

    def __init__(self, document: Document, report: Report, drivers: Drivers) -> None:
        self._document, self._report, self._drivers = document, report, drivers.driver
        self._defaults = drivers.values
        self._sites = UniqueNames(document, "site")
        self._numerics = UniqueNames(document, "numeric", section="custom")

    def site(self, body: str, name: str, position: np.ndarray, group: int | None = None) -> str:
        """Write a site on an OpenSim body, at a position (3,) in its frame; return its name."""
        unique = self._sites.new(name)
        self._document.add(self._document.bodies[body], "site", name=unique, pos=position, group=group)
        return unique

    def stop(self, owner: str, point: PathPoint, end: bool = False) -> Stop:
        """Write a point of a muscle's path; the ends of a path always belong to it."""
        plain = plain_name(point.name)
        name = plain if owner in plain else f"{owner}_{plain}" if plain else f"{owner}_point"
        if point.moving is None:
            site = self.site(point.frame.body, name, point.frame.position)
            if point.condition is None:
                self._report.add("PathPoint", point.name or site, EXACT, f"site '{site}'")
        else:
            site = self._moving_site(owner, name, point, point.moving)
        elements: Elements = [{"objtype": "site", "objname": site}]
        if point.condition is not None and not end:
            more = self._condition(owner, site, point.condition)
            elements += more
            return Stop(site, elements, not more)
        if point.condition is not None:
            self._report.add("ConditionalPathPoint", site, APPROXIMATED,
                             f"it always belongs to the path of {owner}, because it is its end")  # fmt: skip
        return Stop(site, elements, True)

    def _moving_site(self, owner: str, name: str, point: PathPoint, moving: MovingLocation) -> str:
        names, functions = moving.coordinates, moving.functions
        here = np.array([float(f(self._defaults.get(c, 0.0))) for c, f in zip(names, functions, strict=True)])
        frame = point.frame
        site = self.site(frame.body, name, frame.position + frame.rotation @ here)
        elements: Elements = []
        worst = 0.0
        for axis in range(3):
            weights = [float(w) if abs(w) > NEGLIGIBLE else 0.0 for w in frame.rotation[axis]]
            moves = [k for k in range(3) if weights[k] != 0.0 and names[k] and not functions[k].is_constant]
            if not moves:
                continue
            driver = self._driver_of({names[k] for k in moves})
            if driver is None:
                self._report.add("MovingPathPoint", point.name or site, APPROXIMATED,
                                 f"its axis {'xyz'[axis]} stays as by default: no single joint moves it")  # fmt: skip
                continue
            joint, inner = driver
            fixed = float(frame.position[axis]) + sum(
                weights[k] * float(here[k]) for k in range(3) if k not in moves
            )
            total = weighted_sum([functions[k] for k in moves], [weights[k] for k in moves], fixed)
            if inner is not None:
                total = composed(total, inner)
            data = flattened(total)
            if len(data) > MOST_NUMBERS:
                self._report.add("MovingPathPoint", point.name or site, APPROXIMATED,
                                 f"its axis {'xyz'[axis]} stays at the default pose: its function has "
                                 f"{len(data)} numbers, and MuJoCo reads at most {MOST_NUMBERS}")  # fmt: skip
                continue
            worst = max(worst, total.error)
            numeric = self._numerics.new(f"mjwrap_moving_{site}_{'xyz'[axis]}")
            self._document.numeric(numeric, data)
            elements += [
                {"objtype": "joint", "objname": joint, "prm": axis},
                {"objtype": "numeric", "objname": numeric},
            ]
        if elements:
            record = self._document.add("custom", "tuple", name=f"mjwrap_moving_{site}")
            for element in ({"objtype": "site", "objname": site}, *elements):
                self._document.add(record, "element", **element)
        outcome = EXACT if worst == 0.0 else APPROXIMATED
        self._report.add("MovingPathPoint", point.name or site, outcome, f"site '{site}' of {owner}, moved by "
                         f"{' and '.join(dict.fromkeys(n for n in names if n)) or 'nothing'}", worst, "m")  # fmt: skip
        return site

    def _driver_of(self, coordinates: set[str]) -> Driver | None:
        return self._drivers(coordinates.pop()) if len(coordinates) == 1 else None

    def _condition(self, owner: str, site: str, condition: Condition) -> Elements:
        driver = self._drivers(condition.coordinate)
        low, high = condition.held
        held = (low, high) if driver is None or driver[1] is None else preimage(driver[1], low, high)
        low, high = condition.range
        if driver is None or held is None:
            inside = low <= self._defaults.get(condition.coordinate, 0.0) <= high
            self._report.add("ConditionalPathPoint", site, APPROXIMATED,
                             f"it always belongs to the path of {owner}: no joint gives the coordinate "
                             f"{condition.coordinate}" + " (inside at the default pose)" * inside)  # fmt: skip
            return []
        numeric = self._numerics.new(f"mjwrap_{site}_active_range")
        self._document.numeric(numeric, held)
        self._report.add("ConditionalPathPoint", site, EXACT,
                         f"of {owner}, where {condition.coordinate} is in [{low:.6g}, {high:.6g}]; the length can "
                         f"jump there, as in OpenSim")  # fmt: skip
        return [
            {"objtype": "joint", "objname": driver[0]},
            {"objtype": "numeric", "objname": numeric},
        ]
