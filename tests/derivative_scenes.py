"""Random paths that touch all their obstacles, and the same path after a small motion of everything."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import mjwrap as mw
from mjwrap.verification.scenes import rotation

Array = NDArray[np.float64]
SPACING = 0.12  # from obstacle to obstacle [m]
SHORTEST = {"b": 5e-4, "v": -1.0, "C": -1.0, "S": -1.0}  # arcs [m], 2e-3 elsewhere
REACH = 0.04  # largest distance of an obstacle's points from its centre, cylinders' ends aside [m]
TIGHT = 1e-13  # tangency error asked for: difference quotients divide by steps of 1e-4

Surface = mw.Cylinder | mw.Sphere | mw.Ellipsoid | mw.EllipticCylinder | mw.Torus | mw.Cone | mw.Capsule
SURFACES: dict[str, Callable[[np.random.Generator], Surface]] = {
    "c": lambda rng: mw.Cylinder(rng.uniform(0.015, REACH)),
    "s": lambda rng: mw.Sphere(rng.uniform(0.015, REACH)),
    "e": lambda rng: mw.Ellipsoid(tuple(rng.uniform(0.015, REACH, 3))),
    "y": lambda rng: mw.EllipticCylinder(tuple(rng.uniform(0.015, REACH, 2))),
    "t": lambda rng: mw.Torus(rng.uniform(0.022, 0.028), rng.uniform(0.006, 0.012)),
    "k": lambda rng: mw.Cone(rng.uniform(0.025, REACH), rng.uniform(0.01, 0.02), 0.1),
    "p": lambda rng: mw.Capsule(rng.uniform(0.015, 0.025), 0.015),
}


def exponential(omega: Array) -> Array:
    """Return the quaternion w, x, y, z of a rotation vector [rad]."""
    angle = float(np.linalg.norm(omega))
    return np.r_[np.cos(angle / 2), 0.5 * np.sinc(angle / (2 * np.pi)) * omega]


def times(p: Array, q: Array) -> Array:
    """Return the product of two quaternions: q first, then p."""
    return np.r_[p[0] * q[0] - p[1:] @ q[1:], p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:])]


@dataclass
class Case:
    """A solved path; its slots are origin, obstacles and via points, insertion."""

    origin: Array
    insertion: Array
    row: list[mw.Obstacle | mw.ViaPoint]
    sol: mw.PathSolution

    @property
    def slots(self) -> int:
        """How many there are."""
        return len(self.row) + 2

    def places(self) -> Array:
        """Where the slots are, (n + 2, 3) [m]."""
        return np.array([self.origin, *(o.pos for o in self.row), self.insertion])

    def solve(self, direction: Array, step: float) -> mw.PathSolution:
        """Solve with every pose moved by step times direction (n + 2, 6): translation, rotation vector."""
        row: list[mw.Obstacle | mw.ViaPoint] = []
        for o, d in zip(self.row, direction[1:-1], strict=True):
            pos = tuple(o.pos + step * d[:3])
            if isinstance(o, mw.ViaPoint):
                row.append(mw.ViaPoint(pos))
            else:
                quat = times(exponential(step * d[3:]), np.array(o.quat))
                row.append(mw.Obstacle(o.surface, pos, tuple(quat), o.hint, o.inside))
        ends = self.origin + step * direction[0, :3], self.insertion + step * direction[-1, :3]
        return mw.solve_path(*ends, row, start=self.sol, tol=TIGHT)

    def moved(self, direction: Array, step: float) -> mw.PathSolution:
        """Return `solve`'s path, which must be on the same branch."""
        sol = self.solve(direction, step)
        assert self.same_contacts(sol)
        return sol

    def same_contacts(self, sol: mw.PathSolution) -> bool:
        """Return whether a path was found and touches the same obstacles."""
        return sol.converged and all(
            a.active == b.active and (a.second is None) == (b.second is None)
            for a, b in zip(sol.contacts, self.sol.contacts, strict=True)
        )

    def motion(self, rng: np.random.Generator) -> Array:
        """Return a random direction (n + 2, 6): about 0.05 m and 1 rad; points do not turn."""
        direction = rng.normal(size=(self.slots, 6)) * ([0.05] * 3 + [1.0] * 3)
        still = [isinstance(o, mw.ViaPoint) for o in self.row]
        direction[[True, *still, True], 3:] = 0.0
        return direction


def make_case(origin: Array, insertion: Array, row: list[mw.Obstacle | mw.ViaPoint]) -> Case:
    """Return the solved case."""
    origin, insertion = np.array(origin, dtype=float), np.array(insertion, dtype=float)
    return Case(origin, insertion, row, mw.solve_path(origin, insertion, row, tol=TIGHT))


def random_obstacle(rng: np.random.Generator, letter: str, x: float) -> mw.Obstacle | mw.ViaPoint:
    """Return an obstacle near (x, 0, 0) at any angle: of `SURFACES`, "b" for a ring lying flat, "v" for a via point.

    "C" and "S" hold the string to a cylinder and a sphere beside it.
    """
    y, z = rng.uniform(-0.02, 0.02, 2)
    if letter == "v":
        return mw.ViaPoint((x, y, z))
    if letter == "b":  # the string passes above the hole, over both sides of the tube
        ring = mw.Torus(rng.uniform(0.022, 0.028), rng.uniform(0.006, 0.012))
        quat = np.r_[1.0, 0.05 * rng.normal(size=3)]
        return mw.Obstacle(
            ring, (x, 0.2 * y, -rng.uniform(0.3, 0.7) * ring.minor_radius), tuple(quat), (0, 0, 0.02)
        )
    quat = rng.normal(size=4)
    if letter in "CS":
        surface = SURFACES[letter.lower()](rng)
        beside = (x, surface.size + rng.uniform(0.015, 0.05), z)
        if letter == "C":
            quat = np.r_[1.0, 0.2 * rng.normal(size=3)]
        return mw.Obstacle(surface, beside, tuple(quat), inside=True)
    if letter in "cyk":  # axes of long ones stay clear of the neighbours
        quat = np.r_[1.0, 0.2 * rng.normal(size=3)]
    return mw.Obstacle(SURFACES[letter](rng), (x, y, z), tuple(quat))


def random_case(rng: np.random.Generator, kinds: str) -> Case:
    """Return a path along x that touches an obstacle for every letter of `random_obstacle`, rings lying flat twice.

    Kept away from where its derivatives jump: from lift-off, from obstacles that overlap, from seams of capsules.
    """
    while True:
        row = [random_obstacle(rng, letter, SPACING * (k + 1)) for k, letter in enumerate(kinds)]
        spread = 0.005 if "b" in kinds else 0.03
        origin, insertion = (
            np.array([x, *rng.uniform(-spread, spread, 2)]) for x in (0.0, SPACING * (len(kinds) + 1))
        )
        case = make_case(origin, insertion, row)
        if not (case.sol.converged and all(contact.active for contact in case.sol.contacts)):
            continue
        long_enough = all(
            touch.arc_length > SHORTEST.get(letter, 2e-3)
            for letter, contact in zip(kinds, case.sol.contacts, strict=True)
            for touch in touches([contact])
        )
        twice = [contact.second is not None for contact in case.sol.contacts]
        bridged = all(second for letter, second in zip(kinds, twice, strict=True) if letter == "b")
        if long_enough and bridged and free_lengths(case).min() > 5e-3 and clear_of_seams(case):
            return case


def touches(contacts: Sequence[mw.Contact]) -> list[mw.Contact]:
    """Return all contacts in order, second ones included."""
    return [c for contact in contacts for c in (contact, contact.second) if c is not None]


def free_lengths(case: Case) -> Array:
    """Return the lengths of the straight segments of a path that touches everything [m]."""
    found = touches(case.sol.contacts)
    leave, arrive = [case.origin, *(c.Q for c in found)], [*(c.P for c in found), case.insertion]
    return np.linalg.norm(np.subtract(arrive, leave), axis=1)  # type: ignore[arg-type]


def clear_of_seams(case: Case) -> bool:
    """Return whether no contact point lies near where a capsule's curvature jumps."""
    for obstacle, contact in zip(case.row, case.sol.contacts, strict=True):
        if isinstance(obstacle, mw.Obstacle) and isinstance(obstacle.surface, mw.Capsule):
            axis = rotation(obstacle.quat)[:, 2]
            heights = [abs(np.subtract(x, obstacle.pos) @ axis) for x in (contact.P, contact.Q)]  # type: ignore[arg-type]
            if min(abs(height - obstacle.surface.half_length) for height in heights) < 1e-3:
                return False
    return True
