"""Masses and inertias that MuJoCo accepts: what is not physical is joined to welded bodies, or changed a little."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mjwrap.osim.description.bodies import Body
from mjwrap.osim.description.functions import Array
from mjwrap.osim.writing.motions import evaluated
from mjwrap.osim.writing.tree import Branch

SMALLEST = 1e-9  # the least mass of a moving body, as a share of the model's mass
FRAME = 1e-12  # the same for a frame of a joint, which always carries a body
RADIUS = 0.1  # [m] the least inertia is that of the least mass at this distance


@dataclass(frozen=True)
class MassProperties:
    """Mass [kg], centre of mass (3,) [m] and inertia (3, 3) about it [kg m^2], in a body's frame."""

    mass: float
    center: Array
    inertia: Array

    def moved(self, transform: Array) -> MassProperties:
        """Return the same in the frame in which the body's own frame is at `transform` (4, 4)."""
        turn = transform[:3, :3]
        return MassProperties(self.mass, turn @ self.center + transform[:3, 3], turn @ self.inertia @ turn.T)

    def joined(self, other: MassProperties) -> MassProperties:
        """Return those of two bodies together."""
        mass = self.mass + other.mass
        if mass == 0.0:
            return MassProperties(0.0, self.center, self.inertia + other.inertia)
        center = (self.mass * self.center + other.mass * other.center) / mass
        inertia = np.zeros((3, 3))
        for part in (self, other):
            away = part.center - center
            inertia += part.inertia + part.mass * (away @ away * np.eye(3) - np.outer(away, away))
        return MassProperties(mass, center, inertia)

    def share(self, count: int) -> MassProperties:
        """Return those of one of several equal parts at the same place."""
        return MassProperties(self.mass / count, self.center, self.inertia / count)

    def principal(self) -> tuple[Array, Array]:
        """Return the principal moments (3,), ascending, and their axes as the columns of a rotation matrix (3, 3)."""
        moments, axes = np.linalg.eigh(0.5 * (self.inertia + self.inertia.T))
        if np.linalg.det(axes) < 0.0:
            axes[:, 0] *= -1.0
        return moments, axes

    @property
    def physical(self) -> bool:
        """Whether MuJoCo accepts the inertia of a moving body."""
        a, b, c = self.principal()[0]
        return a > 0.0 and a + b >= c * (1.0 + 4e-16) and self.mass > 0.0


EMPTY = MassProperties(0.0, np.zeros(3), np.zeros((3, 3)))


@dataclass(frozen=True)
class Written:
    """What is written for a branch: properties, None for nothing, and what was changed, if anything.

    joined_to: the body whose inertia includes this one's. original: principal moments (3,) of the file, where they are
    not those written.
    """

    properties: MassProperties | None
    joined_to: str = ""
    original: Array | None = None
    mass_added: float = 0.0


def written_inertias(bodies: tuple[Body, ...], branches: list[Branch]) -> dict[str, Written]:
    """Return what is written for every branch.

    The copies of a body that closes a loop share its mass, as in OpenSim. If a moving body's inertia is not physical,
    the bodies welded to it are counted with it, and a welded body whose inertia is not physical is counted with the
    one that carries it: both are exact. What is still not physical gets the nearest principal moments that are (in the
    sense of least squares), and at least a billionth of the model's mass, at 0.1 m.
    """
    total = sum(body.mass for body in bodies) or 1.0
    copies = {body.name: 1 for body in bodies}
    for branch in branches:
        if branch.copy_of and not branch.fixed:
            copies[branch.copy_of] += 1
    by_name = {body.name: body for body in bodies}
    own: dict[str, MassProperties] = {}
    for branch in branches:
        body = by_name.get(branch.copy_of or branch.body)
        if body is None or (branch.copy_of and branch.fixed):
            own[branch.body] = EMPTY
        else:
            whole = MassProperties(body.mass, body.mass_center, body.inertia)
            own[branch.body] = whole if copies[body.name] == 1 else whole.share(copies[body.name])
    joined: dict[str, str] = {}
    fixed = {branch.body: branch for branch in branches if branch.fixed and not branch.copy_of}
    for name in reversed(fixed):
        if not own[name].physical and own[name] is not EMPTY:
            _join(name, fixed[name], own, joined)
    for branch in branches:
        if not branch.fixed and not own[branch.body].physical:
            for name in reversed([n for n in fixed if n not in joined and _root(n, fixed) == branch.body]):
                _join(name, fixed[name], own, joined)
    out: dict[str, Written] = {}
    for branch in branches:
        name = branch.body
        properties = own[name]
        if name in joined or (branch.fixed and properties.mass == 0.0):
            out[name] = Written(None, joined.get(name, ""))
        elif branch.fixed or properties.physical:
            out[name] = Written(properties)
        else:
            out[name] = _nearest(properties, (SMALLEST if branch.copy_of or name in by_name else FRAME) * total)
    return out


def _root(name: str, fixed: dict[str, Branch]) -> str:
    while name in fixed:
        name = fixed[name].parent
    return name


def _join(name: str, branch: Branch, own: dict[str, MassProperties], joined: dict[str, str]) -> None:
    """Count a welded body with its parent; a massless one, or one welded to ground, needs no more."""
    if branch.parent in own:
        here = evaluated(branch.chain, lambda _: 0.0)
        own[branch.parent] = own[branch.parent].joined(own[name].moved(here))
        joined[name] = branch.parent
    else:
        joined[name] = "ground"


def _nearest(properties: MassProperties, least: float) -> Written:
    moments, axes = properties.principal()
    mass = max(properties.mass, least)
    floor = least * RADIUS**2
    if properties.mass >= least and moments[2] > 0.0:
        floor = min(floor, 1e-3 * moments[2])
    new = np.maximum(moments, floor)
    missing = new[2] - new[0] - new[1]
    if missing > -4e-16 * new[2]:
        new += np.array([1.0, 1.0, -1.0]) * (missing / 3.0 + 4e-16 * new[2])
    inertia = axes @ np.diag(new) @ axes.T
    return Written(MassProperties(mass, properties.center, inertia), "", moments, mass - properties.mass)
