"""A contact of a solved path with one obstacle."""

from __future__ import annotations

from dataclasses import dataclass

from mjwrap.paths.scene import Array


@dataclass(frozen=True)
class Contact:
    """Where a path touches one obstacle.

    active: whether it does; P, Q (3,): first and last contact point, world [m] (None where not active);
    arc_length: of the geodesic from P to Q [m]; second: where the string touches the same surface again, behind a
    hollow that it bridges (through the air over a torus' hole), else None. A via point is always active, with P = Q.
    """

    active: bool
    P: Array | None
    Q: Array | None
    arc_length: float
    second: Contact | None = None
