"""The statuses of a path, and their messages."""

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
    "OUT_OF_RANGE": "the path touches a surface beyond the end of the surface",
    "NO_GEODESIC": "there is no geodesic round the surface on that side; a string would slip off its end",
    "UNKNOWN_SURFACE": "the rows of a surface are damaged: the kernels do not know its kind",
}


class Status(enum.IntEnum):
    """The status of a path; only `CONVERGED` is a solution."""

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
        """The meaning of the status, in one clause."""
        return _MESSAGES[self.name]
