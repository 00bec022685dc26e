"""Read the equalities by which one joint follows others, and the tuples that join several of them to one coupling.

A polynomial of MuJoCo's has the degree 4 at most. So a spline is written as one equality for each of its pieces, of
which only one is active at a time, and a `<custom>` tuple whose name contains "mjwrap_coupling_" says what belongs
together: the equalities from low to high, then a numeric with the leader's positions between them. Piece i holds for
knots[i − 1] ≤ x < knots[i], the first and the last without end.
"""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.errors import ModelError
from mjwrap.mjcf.names import listed, name_of
from mjwrap.mjcf.tuple_names import declares_coupling
from mjwrap.text import counted

Array = NDArray[np.float64]
OBJ = mujoco.mjtObj
_JOINT, _TENDON = int(mujoco.mjtEq.mjEQ_JOINT), int(mujoco.mjtEq.mjEQ_TENDON)
_WRAP_JOINT = int(mujoco.mjtWrap.mjWRAP_JOINT)


class Coupling(NamedTuple):
    """A joint that follows others: q = qpos0 + Σ cᵢ (x − x₀)ⁱ, i = 0..4, where x is a sum of its leaders' positions.

    joint: id of the follower. leaders (m,), weights (m,): ids of the joints in x = Σ weight · position, and their
    factors; without leaders the follower is held. equalities (P,): ids, one for each piece, from low to high; knots
    (P − 1,): values of x between the pieces; coefficients (P, 5): c₀ to c₄. x₀ is x at qpos0.
    """

    joint: int
    leaders: tuple[int, ...]
    weights: tuple[float, ...]
    equalities: tuple[int, ...]
    knots: Array
    coefficients: Array

    @property
    def leader(self) -> int:
        """Id of the first leader, -1 if there is none."""
        return self.leaders[0] if self.leaders else -1


def equation(model: mujoco.MjModel, index: int) -> Coupling | None:
    """Return an equality as a coupling of one piece; None if it does not tie a single joint to a sum of joints.

    An equality of joints always does, one of tendons if both are fixed and the first has a single joint that is not in
    the second.
    """
    first, second = int(model.eq_obj1id[index]), int(model.eq_obj2id[index])
    given, kind = model.eq_data[index, :5].copy(), int(model.eq_type[index])
    none = np.zeros(0)
    if kind == _JOINT:
        leaders, weights = ((second,), (1.0,)) if second >= 0 else ((), ())
        return Coupling(first, leaders, weights, (index,), none, given[None])
    if kind != _TENDON:
        return None
    driven, driving = _terms(model, first), _terms(model, second) if second >= 0 else {}
    if driven is None or driving is None or len(driven) != 1 or driven.keys() & driving.keys():
        return None
    ((joint, factor),) = driven.items()
    return Coupling(joint, (*driving,), (*driving.values(),), (index,), none, given[None] / factor)


def _terms(model: mujoco.MjModel, tendon: int) -> dict[int, float] | None:
    """Return the joints of a fixed tendon with their factors, without those of factor 0; None for a spatial tendon."""
    first = int(model.tendon_adr[tendon])
    places = range(first, first + int(model.tendon_num[tendon]))
    if any(int(model.wrap_type[i]) != _WRAP_JOINT for i in places):
        return None
    return {int(model.wrap_objid[i]): float(model.wrap_prm[i]) for i in places if model.wrap_prm[i]}


def read_pieces(model: mujoco.MjModel) -> list[Coupling]:
    """Return the couplings that tuples declare, in their order; `ModelError`, which names the element, if wrong."""
    found: list[Coupling] = []
    owner: dict[int, str] = {}
    for index in range(model.ntuple):
        name = name_of(model, OBJ.mjOBJ_TUPLE, index)
        if not declares_coupling(name):
            continue
        try:
            coupling = _read_tuple(model, index)
            for equality in coupling.equalities:
                if equality in owner:
                    raise ModelError(
                        f"{_equality(model, equality)} is in tuple '{owner[equality]}' already; it can be a piece once"
                    )
                owner[equality] = name
        except ModelError as error:
            raise ModelError(f"tuple '{name}': {error}") from None
        found.append(coupling)
    return found


def _read_tuple(model: mujoco.MjModel, index: int) -> Coupling:
    first = int(model.tuple_adr[index])
    places = range(first, first + int(model.tuple_size[index]))
    elements = [(OBJ(int(model.tuple_objtype[j])), int(model.tuple_objid[j])) for j in places]
    for kind, item in elements:
        if kind not in (OBJ.mjOBJ_EQUALITY, OBJ.mjOBJ_NUMERIC):
            what = kind.name.removeprefix("mjOBJ_").lower()
            raise ModelError(
                f"{what} '{name_of(model, kind, item)}' cannot be used; it lists equalities, one for each piece from "
                f"low to high, and then a numeric with the leader's positions between them"
            )
    equalities = tuple(item for kind, item in elements if kind == OBJ.mjOBJ_EQUALITY)
    pieces = [_piece(model, equality) for equality in equalities]
    if not pieces:
        raise ModelError("it lists no equality; it needs one for each piece of the coupling")
    _check_alike(model, pieces)
    numerics = [item for kind, item in elements if kind == OBJ.mjOBJ_NUMERIC]
    knots = _read_knots(model, numerics, len(pieces))
    _check_active(model, equalities)
    coefficients = np.concatenate([piece.coefficients for piece in pieces])
    return pieces[0]._replace(equalities=equalities, knots=knots, coefficients=coefficients)


def _piece(model: mujoco.MjModel, index: int) -> Coupling:
    piece = equation(model, index)
    if piece is None:
        kind = mujoco.mjtEq(int(model.eq_type[index])).name.removeprefix("mjEQ_").lower()
        raise ModelError(
            f"{_equality(model, index)} (type '{kind}') does not couple joints; a piece is an equality of joints, or "
            f"of two fixed tendons of which the first has a single joint"
        )
    return piece


def _check_alike(model: mujoco.MjModel, pieces: list[Coupling]) -> None:
    """Raise `ModelError` unless all pieces have the follower and the leaders of the first."""
    first = pieces[0]
    for piece in pieces[1:]:
        if piece.joint == first.joint and piece.leaders == first.leaders and piece.weights == first.weights:
            continue
        here, there = _equality(model, piece.equalities[0]), _equality(model, first.equalities[0])
        if piece.joint != first.joint:
            mine, other = (name_of(model, OBJ.mjOBJ_JOINT, each.joint) for each in (piece, first))
            raise ModelError(
                f"{here} moves joint '{mine}', {there} joint '{other}'; all pieces move one joint"
            )
        if dict(zip(piece.leaders, piece.weights, strict=True)) != dict(
            zip(first.leaders, first.weights, strict=True)
        ):
            raise ModelError(
                f"{here} has the leaders {_leaders(model, piece)}, {there} {_leaders(model, first)}; all pieces have "
                f"the same leaders, with the same factors"
            )
    if len(pieces) > 1 and not first.leaders:
        raise ModelError(f"{_equality(model, first.equalities[0])} has no leader, so it cannot have pieces")
    if len({piece.equalities[0] for piece in pieces}) < len(pieces):
        raise ModelError("it lists an equality twice")


def _read_knots(model: mujoco.MjModel, numerics: list[int], pieces: int) -> Array:
    """Return the knots between pieces."""
    wanted = pieces - 1
    if len(numerics) > 1 or len(numerics) < min(wanted, 1):
        raise ModelError(
            f"it lists {counted(len(numerics), 'numeric')} for {counted(pieces, 'piece')}; it needs one, with the "
            f"leader's positions between the pieces"
        )
    if not numerics:
        return np.zeros(0)
    name = name_of(model, OBJ.mjOBJ_NUMERIC, numerics[0])
    first, size = int(model.numeric_adr[numerics[0]]), int(model.numeric_size[numerics[0]])
    if size != wanted:
        raise ModelError(
            f"numeric '{name}' has {counted(size, 'value')}; {counted(pieces, 'piece')} need {wanted}, one less than "
            f"there are equalities"
        )
    knots = model.numeric_data[first : first + size].copy()
    if not (np.isfinite(knots).all() and (np.diff(knots) > 0.0).all()):
        shown = " ".join(f"{knot:g}" for knot in knots)
        raise ModelError(f"numeric '{name}' must have finite, increasing values, not {shown}")
    return knots


def _check_active(model: mujoco.MjModel, equalities: tuple[int, ...]) -> None:
    active = [_equality(model, e) for e in equalities if model.eq_active0[e]]
    if len(active) > 1:
        raise ModelError(
            f"{listed(active)} are all active at the start; only the piece that holds at the model's default pose may "
            f"be, and the others need active='false'"
        )


def _equality(model: mujoco.MjModel, index: int) -> str:
    return f"equality '{name_of(model, OBJ.mjOBJ_EQUALITY, index)}'"


def _leaders(model: mujoco.MjModel, coupling: Coupling) -> str:
    names = (name_of(model, OBJ.mjOBJ_JOINT, joint) for joint in coupling.leaders)
    return listed(f"'{name}' (times {w:g})" for name, w in zip(names, coupling.weights, strict=True))
