"""Which muscles stand together in a recording: groups, given or by the body they move, and the joints they cross."""

from __future__ import annotations

import fnmatch
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from mjwrap.errors import RecordingError

MOST, LEAST = 12, 4  # groups that are made where none are given, and muscles in each but the last
OTHERS = "others"
FREE, BALL, SLIDE, HINGE = range(4)  # mjtJoint
_JOINT_EQUALITY = 2  # mjEQ_JOINT
_AXES = {FREE: ("x", "y", "z", "rx", "ry", "rz"), BALL: ("rx", "ry", "rz")}

Ints = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Group:
    """Muscles, by their numbers, that have their curves together."""

    name: str
    members: list[int]


@dataclass(frozen=True)
class Coordinate:
    """A joint, or one axis of it, and the muscles that cross it.

    turns: whether it is an angle; follows: whether an equality moves it with another joint; qpos: where its value is,
    -1 for an axis of a ball or free joint, which has none.
    """

    name: str
    dof: int
    muscles: list[int]
    turns: bool
    follows: bool
    qpos: int


def given_groups(wanted: Mapping[str, str | Iterable[str]], muscles: Sequence[str]) -> list[Group]:
    """Groups from patterns of muscle names (* and ? stand for anything); the rest are `others`.

    RecordingError where a pattern finds no muscle, or two groups the same one.
    """
    owner: dict[int, str] = {}
    for name, patterns in wanted.items():
        for pattern in [patterns] if isinstance(patterns, str) else patterns:
            found = [i for i, muscle in enumerate(muscles) if fnmatch.fnmatchcase(muscle, pattern)]
            if not found:
                raise RecordingError(
                    f"group '{name}': no muscle '{pattern}'; muscles: {', '.join(muscles) or 'none'}"
                )
            for i in found:
                if owner.setdefault(i, name) != name:
                    raise RecordingError(f"muscle '{muscles[i]}' is in two groups: '{owner[i]}' and '{name}'")
    members: dict[str, list[int]] = {name: [] for name in [*wanted, OTHERS]}
    for i in range(len(muscles)):
        members[owner.get(i, OTHERS)].append(i)
    return [Group(name, each) for name, each in members.items() if each]


def moved_groups(model: Any, declarations: Sequence[Any], body_names: Sequence[str]) -> list[Group]:
    """At most `MOST` groups, each named after the body that its muscles, or those of bodies beyond it, move.

    A muscle moves the body of its two ends that has more joints between it and the world. The smallest groups are
    joined with those of the next body towards the world until there are few enough.
    """
    depth = np.zeros(model.nbody, dtype=np.int64)
    for body in range(1, model.nbody):
        depth[body] = depth[model.body_parentid[body]] + (model.body_dofnum[body] > 0)
    moved = []
    for muscle in declarations:
        ends = [
            int(model.body_weldid[model.site_bodyid[s]]) for s in (muscle.insertion_site, muscle.origin_site)
        ]
        moved.append(max(ends, key=lambda body: depth[body]))
    owner = np.arange(model.nbody)
    for least in range(LEAST, LEAST + len(moved)):
        owner = _owners(model, np.bincount(moved, minlength=model.nbody), least)
        if len({int(owner[body]) for body in moved}) <= MOST:
            break
    members: dict[int, list[int]] = {}
    for i, body in enumerate(moved):
        members.setdefault(int(owner[body]), []).append(i)
    return [Group(body_names[body], members[body]) for body in sorted(members)]


def _owners(model: Any, counts: Ints, least: int) -> Ints:
    """For each body the one, on its way to the world, with which it forms a group of at least `least` muscles."""
    total = counts.copy()
    merged = np.zeros(model.nbody, dtype=np.bool_)
    for body in range(model.nbody - 1, 0, -1):  # children have higher numbers
        if total[body] < least:
            total[model.body_parentid[body]] += total[body]
            merged[body] = True
    owner = np.arange(model.nbody)
    for body in range(1, model.nbody):
        if merged[body]:
            owner[body] = owner[model.body_parentid[body]]
    return owner


def crossed_coordinates(
    model: Any, declarations: Sequence[Any], joint_names: Sequence[str]
) -> list[Coordinate]:
    """Every coordinate that some muscle crosses: that moves some of the bodies on its route and not all."""
    moves = np.zeros((model.nbody, model.nv), dtype=np.bool_)
    for body in range(1, model.nbody):
        moves[body] = moves[model.body_parentid[body]]
        first = int(model.body_dofadr[body])
        moves[body, first : first + int(model.body_dofnum[body])] = True
    crossing = np.zeros((len(declarations), model.nv), dtype=np.bool_)
    for i, muscle in enumerate(declarations):
        sites = [muscle.origin_site, muscle.insertion_site, *muscle.via_sites]
        bodies = [*model.site_bodyid[sites], *model.geom_bodyid[muscle.geoms]]
        crossing[i] = moves[bodies].any(axis=0) & ~moves[bodies].all(axis=0)
    followers = {
        int(model.eq_obj1id[i])
        for i in range(model.neq)
        if model.eq_type[i] == _JOINT_EQUALITY and model.eq_active0[i]
    }
    found = []
    for dof in np.flatnonzero(crossing.any(axis=0)):
        joint = int(model.dof_jntid[dof])
        kind, axis = int(model.jnt_type[joint]), int(dof - model.jnt_dofadr[joint])
        name = f"{joint_names[joint]} {_AXES[kind][axis]}" if kind in _AXES else joint_names[joint]
        turns = kind in (HINGE, BALL) or (kind == FREE and axis > 2)
        muscles = [int(i) for i in np.flatnonzero(crossing[:, dof])]
        qpos = -1 if kind in _AXES else int(model.jnt_qposadr[joint])
        found.append(Coordinate(name, int(dof), muscles, turns, joint in followers, qpos))
    return found
