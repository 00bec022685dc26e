"""The contact of a solved path with one obstacle."""

from __future__ import annotations

from dataclasses import dataclass

from mjwrap.paths.scene import Array


@dataclass(frozen=True)
class Contact:
    """The contact of a path with one obstacle.

    Attributes:
        active: whether the path touches it. A via point is always active, with P = Q.
        P: (3,) first contact point, world [m]; None if not active.
        Q: (3,) last contact point, world [m]; None if not active.
        arc_length: length of the geodesic from P to Q [m].
        second: second contact with the same surface, after a hollow that the path bridges (such as the hole of a
            torus); None if there is none.
    """

    active: bool
    P: Array | None
    Q: Array | None
    arc_length: float
    second: Contact | None = None
