"""Read the moving path points of a model: sites whose places in their bodies are functions of joints.

A tuple whose name contains "mjwrap_moving_" declares one: the site, then for every axis of its body along which it
moves a joint (prm 0, 1, 2: x, y, z) and a numeric with a piecewise polynomial in the joint's qpos.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.errors import ModelError
from mjwrap.mjcf.names import name_of
from mjwrap.mjcf.piecewise_numerics import read_pieces
from mjwrap.mjcf.tuple_names import MOVING

Array = NDArray[np.float64]
OBJ = mujoco.mjtObj
SCALAR = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))


class MovingAxis(NamedTuple):
    """A site's coordinate along one axis of its body, as a piecewise polynomial in a joint's qpos [m].

    site, joint: ids; axis: 0, 1, 2. Piece i holds for breaks[i - 1] <= q < breaks[i], and is Σ c_k (q - origin_i)^k.
    breaks (P - 1,), origins (P,) [rad or m]; coefficients (P, d + 1).
    """

    site: int
    axis: int
    joint: int
    breaks: Array
    origins: Array
    coefficients: Array


class MovingSite(NamedTuple):
    """A site that moves within its body, and the joints of which its place is a function; MuJoCo's ids."""

    site: int
    joints: tuple[int, ...]


def is_moving_tuple(name: str) -> bool:
    """Return whether a tuple of this name declares a moving site."""
    return MOVING in name


def read_moving_axes(model: mujoco.MjModel) -> list[MovingAxis]:
    """Return all axes along which sites move, by site and axis; `ModelError`, which names the tuple, if wrong."""
    found: dict[tuple[int, int], MovingAxis] = {}
    sites: dict[int, str] = {}
    for index in range(model.ntuple):
        name = name_of(model, OBJ.mjOBJ_TUPLE, index)
        if not is_moving_tuple(name):
            continue
        try:
            axes = _read_tuple(model, index)
        except ModelError as error:
            raise ModelError(f"tuple '{name}': {error}") from None
        site = axes[0].site
        if site in sites:
            raise ModelError(
                f"site '{name_of(model, OBJ.mjOBJ_SITE, site)}' is moved by two tuples: '{sites[site]}' and '{name}'"
            )
        sites[site] = name
        found |= {(axis.site, axis.axis): axis for axis in axes}
    return [found[key] for key in sorted(found)]


def _read_tuple(model: mujoco.MjModel, index: int) -> list[MovingAxis]:
    first = int(model.tuple_adr[index])
    places = range(first, first + int(model.tuple_size[index]))
    kinds = [OBJ(int(model.tuple_objtype[j])) for j in places]
    items = [int(model.tuple_objid[j]) for j in places]
    pairs = (len(kinds) - 1) // 2
    if pairs < 1 or kinds != [OBJ.mjOBJ_SITE, *([OBJ.mjOBJ_JOINT, OBJ.mjOBJ_NUMERIC] * pairs)]:
        there = ", ".join(kind.name.removeprefix("mjOBJ_").lower() for kind in kinds) or "nothing"
        raise ModelError(
            f"a moving point is a site, then for every axis that it moves along a joint and a numeric, not: {there}"
        )
    axes: dict[int, MovingAxis] = {}
    for k in range(1, len(kinds), 2):
        joint, numeric = items[k], items[k + 1]
        called, prm = name_of(model, OBJ.mjOBJ_JOINT, joint), float(model.tuple_objprm[first + k])
        check_scalar(model, joint, "moves a point")
        if prm not in (0.0, 1.0, 2.0):
            raise ModelError(
                f"joint '{called}' has prm={prm:g}; 0, 1 and 2 are the axes x, y and z of the body"
            )
        if int(prm) in axes:
            raise ModelError(f"axis {'xyz'[int(prm)]} is given twice, the second time with joint '{called}'")
        axes[int(prm)] = MovingAxis(items[0], int(prm), joint, *read_pieces(model, numeric))
    return list(axes.values())


def site_text(model: mujoco.MjModel, moving: Sequence[MovingSite], site: int) -> str:
    """Return the name of a site, and the joints with which it moves if it is one of `moving`."""
    joints = [name_of(model, OBJ.mjOBJ_JOINT, j) for each in moving if each.site == site for j in each.joints]
    name = name_of(model, OBJ.mjOBJ_SITE, site)
    return f"{name} (moves with {' and '.join(joints)})" if joints else name


def check_scalar(model: mujoco.MjModel, joint: int, what: str) -> None:
    """Raise `ModelError` for a ball or free joint, whose position is not one number."""
    if int(model.jnt_type[joint]) not in SCALAR:
        name = name_of(model, OBJ.mjOBJ_JOINT, joint)
        raise ModelError(f"joint '{name}' {what}, so it must be a hinge or a slide")
