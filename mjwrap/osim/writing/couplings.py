"""Couplings between joints as joint equalities: one for every piece of a function, only the present one active."""

from __future__ import annotations

from mjwrap.errors import OsimError
from mjwrap.osim.description.functions import Piecewise
from mjwrap.osim.writing.document import Document
from mjwrap.osim.writing.piece_algebra import shifted
from mjwrap.osim.writing.quartics import DEGREE, quartic_pieces
from mjwrap.osim.writing.sites import MOST_NUMBERS

TIMESTEP = 0.001  # [s]
# A joint equality has no term for the curvature of its function, so it has to correct fast: within two steps.
SOLREF = (2.0 * TIMESTEP, 1.0)
SOLIMP = (0.9999, 0.9999, 0.001, 0.5, 2.0)


def write_coupling(
    document: Document,
    follower: tuple[str, float],
    leader: tuple[str, float],
    function: Piecewise,
    extent: tuple[float, float],
) -> Piecewise:
    """Write follower = function(leader), both given as name and reference value of a joint; return the pieces written.

    extent: of the leader, within which functions of a degree above 4 are approximated to 1e-10.

    Raises:
        OsimError: the function has more pieces than MuJoCo can hold.
    """
    pieces = quartic_pieces(function, *extent)
    if len(pieces.origins) > MOST_NUMBERS:
        raise OsimError(
            f"joint '{follower[0]}' follows '{leader[0]}' by a function of {len(pieces.origins)} pieces; "
            f"MuJoCo holds {MOST_NUMBERS}"
        )
    (joint1, y), (joint2, x) = follower, leader
    present = int(pieces.piece(x))
    count = len(pieces.origins)
    names = []
    for piece in range(count):
        row = shifted(pieces, piece, x, DEGREE + 1)
        row[0] = 0.0 if piece == present else row[0] - y
        names.append(f"{joint1}_coupling" if count == 1 else f"{joint1}_coupling_{piece}")
        document.add("equality", "joint", name=names[-1], joint1=joint1, joint2=joint2, polycoef=row,
                     active=None if piece == present else False, solref=SOLREF, solimp=SOLIMP)  # fmt: skip
    if count > 1:
        knots = document.numeric(f"mjwrap_coupling_{joint1}_knots", pieces.breaks)
        record = document.add("custom", "tuple", name=f"mjwrap_coupling_{joint1}")
        for name in names:
            document.add(record, "element", objtype="equality", objname=name)
        document.add(record, "element", objtype="numeric", objname=knots)
    return pieces


def write_hold(document: Document, joint: str) -> None:
    """Write an equality that keeps a joint at its reference value."""
    document.add("equality", "joint", name=f"{joint}_locked", joint1=joint, polycoef=(0, 0, 0, 0, 0),
                 solref=SOLREF, solimp=SOLIMP)  # fmt: skip
