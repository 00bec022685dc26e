"""The statuses with which the search for a path ends."""

from __future__ import annotations

import enum

from mjwrap.kernels import layout

_MESSAGES = {
    "CONVERGED": "the path meets every tangency condition and is a local minimum of length",
    "NOT_CONVERGED": "no path was found that meets the tangency conditions",
    "ENDPOINT_INSIDE": "the origin, the insertion or a via point lies inside the surface next to it",
    "NOT_MINIMAL": "the tangent path found is not a local minimum of length; a string would slip off it",
    "PENETRATING": "surfaces overlap where the path would touch them, so a part of it lies inside one",
    "NON_FINITE": "a pose or an end point is not finite",
    "OUT_OF_RANGE": "the path touches a surface beyond the end of it, where it does not exist",
    "NO_GEODESIC": "no geodesic leads round the surface that way; a string would slip off its end",
    "UNKNOWN_SURFACE": "the rows of a surface are of a kind that the kernels do not know: they were damaged",
}


class Status(enum.IntEnum):
    """How the search for a path ended; only `CONVERGED` is a solution."""

    CONVERGED = layout.CONVERGED
    NOT_CONVERGED = layout.NOT_CONVERGED
    ENDPOINT_INSIDE = layout.ENDPOINT_INSIDE
    NOT_MINIMAL = layout.NOT_MINIMAL
    PENETRATING = layout.PENETRATING
    NON_FINITE = layout.NON_FINITE
    OUT_OF_RANGE = layout.OUT_OF_RANGE
    NO_GEODESIC = layout.NO_GEODESIC
    UNKNOWN_SURFACE = layout.UNKNOWN_SURFACE

    @property
    def message(self) -> str:
        """What the status means, in one clause."""
        return _MESSAGES[self.name]
