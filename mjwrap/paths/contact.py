"""The contact of a solved path with one obstacle."""

from __future__ import annotations

from dataclasses import dataclass, field

from mjwrap import html
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

    def __repr__(self) -> str:
        if not self.active or self.P is None or self.Q is None:
            return "Contact(not touched)"
        first, last = (f"({', '.join(f'{x:.6g}' for x in p)})" for p in (self.P, self.Q))
        more = f", {len(self.touches)} touches" if len(self.touches) > 1 else ""
        if first == last and self.arc_length == 0.0:
            return f"Contact(at {first} m{more})"
        return f"Contact({first} to {last} m, arc {self.arc_length:.6g} m{more})"

    def _repr_html_(self) -> str:
        if not self.active:
            return html.facts([("touched", "no")], "Contact")
        touches = self.touches or (self,)
        points = [
            [f"{x:.6g}" for x in p] if p is not None else ["", "", ""] for t in touches for p in (t.P, t.Q)
        ]
        rows = [
            [f"{name}", *row, f"{touches[k // 2].arc_length:.6g}" if k % 2 == 0 else ""]
            for k, (name, row) in enumerate(zip(("first", "last") * len(touches), points, strict=True))
        ]
        return html.table(["contact point", "x [m]", "y [m]", "z [m]", "arc length [m]"], rows)
