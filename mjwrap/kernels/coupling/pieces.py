"""Pick the piece of each coupling of joints that holds at a pose: one of several equalities of MuJoCo's."""

from __future__ import annotations

from typing import NamedTuple

from mjwrap.kernels.array_types import Floats, Ints
from mjwrap.kernels.compilation.jit import from_python


class Pieces(NamedTuple):
    """Couplings of several pieces each; coupling i has the terms term[i]:term[i + 1], the pieces piece[i]:piece[i + 1].

    The sum of its terms, weight · qpos[at], lies in one of its pieces, between which are its knots.
    """

    term: Ints  # (n + 1,)
    at: Ints  # (terms,)
    weight: Floats  # (terms,)
    piece: Ints  # (n + 1,)
    equality: Ints  # (pieces,) ids
    knots: Floats  # (pieces - n,) those of coupling i begin at piece[i] - i


@from_python
def switch_pieces(term, at, weight, piece, equality, knots, qpos, active):
    """Let only the equality of the piece that holds at qpos (nq,) be active (neq,); return whether one has changed.

    The other arguments are those of `Pieces`. A coupling of which no equality is active stays switched off.
    """
    changed = False
    for i in range(term.shape[0] - 1):
        first, last = piece[i], piece[i + 1]
        on = False
        for p in range(first, last):
            on = on or active[equality[p]] != 0
        if not on:
            continue
        x = 0.0
        for t in range(term[i], term[i + 1]):
            x += weight[t] * qpos[at[t]]
        holds = first
        while holds < last - 1 and knots[holds - i] <= x:
            holds += 1
        for p in range(first, last):
            value = 1 if p == holds else 0
            if active[equality[p]] != value:
                active[equality[p]] = value
                changed = True
    return changed
