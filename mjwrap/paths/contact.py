"""The contact of a solved path with one obstacle."""

from __future__ import annotations

from dataclasses import dataclass, field

from mjwrap.paths.scene import Array


@dataclass(frozen=True)
class Contact:
    """The contact of a path with one obstacle.

    Attributes:
        active: whether the path touches it. A via point is always active, with P = Q.
        P: (3,) first contact point, world [m]; None if not active.
        Q: (3,) last contact point, world [m]; None if not active.
        arc_length: length of the geodesic from P to Q [m].
        touches: all contacts with the same surface in the order of the path, this one first; several where the path
            bridges a hollow (such as the hole of a torus). Empty if not active.
    """

    active: bool
    P: Array | None
    Q: Array | None
    arc_length: float
    touches: tuple[Contact, ...] = field(default=(), repr=False)

    @property
    def second(self) -> Contact | None:
        """The second contact with the same surface; None if there is none."""
        return self.touches[1] if len(self.touches) > 1 else None
