"""Groups of muscles in a recording, given or formed by the body that they move, and the joints that they cross."""

from __future__ import annotations

import fnmatch
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from mjwrap import validation
from mjwrap.errors import RecordingError
from mjwrap.mjcf.couplings import read_couplings
from mjwrap.model.kinematic_tree import crossed_dofs

MOST, LEAST = 12, 4  # numbers of groups, and of muscles in each but the last, if no groups are given
OTHERS = "others"
FREE, BALL, SLIDE, HINGE = range(4)  # mjtJoint
_AXES = {FREE: ("x", "y", "z", "rx", "ry", "rz"), BALL: ("rx", "ry", "rz")}

Ints = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Group:
    """Muscles, by their indices, whose curves are shown together."""

    name: str
    members: list[int]


@dataclass(frozen=True)
class Coordinate:
    """A joint, or one axis of it, and the muscles that cross it.

    turns: whether it is an angle; follows: whether an equality moves it with another joint; qpos: index of its value,
    -1 for an axis of a ball or free joint, which has no value of its own.
    """

    name: str
    dof: int
    muscles: list[int]
    turns: bool
    follows: bool
    qpos: int


def given_groups(wanted: Mapping[str, str | Iterable[str]], muscles: Sequence[str]) -> list[Group]:
    """Return groups from patterns of muscle names (* and ? match any characters); the remaining muscles are `others`.

    Raises RecordingError if a pattern matches no muscle, or a muscle is in two groups.
    """
    wants = "a dict of patterns of muscle names by the name of the group"
    validation.instance(wanted, Mapping, "groups", RecordingError, wants)
    for name, patterns in wanted.items():
        each = f"groups[{name!r}]"
        validation.instance(patterns, str | Iterable, each, RecordingError, "a pattern of names, or several")
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
    """Return at most `MOST` groups, each named after the body that its muscles move, or after a body above that.

    A muscle moves that body of its two ends that has more joints between it and the world. The smallest groups are
    merged into those of the next body towards the world until there are few enough.
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
    """Return for each body the body, on the way to the world, whose group it joins: one of at least `least` muscles."""
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
    """Return every coordinate that a muscle crosses; see `crossed_dofs`."""
    crossing = crossed_dofs(model, declarations)
    followers = {coupling.joint for coupling in read_couplings(model)}
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
