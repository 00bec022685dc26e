"""Derivatives on every surface: paths are laid backwards, geodesics first and straight segments along their ends.

So no search takes part, and every surface is met with any curvatures. Newton's method alone follows small motions.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from derivative_scenes import SURFACES, Array, exponential

import mjwrap as mw
from mjwrap.kernels import layout as lay
from mjwrap.kernels.geometry import dispatch, geodesics
from mjwrap.kernels.solved import contact_rates, hessian
from mjwrap.kernels.tangency import newton
from mjwrap.paths.scene import pack
from mjwrap.verification.scenes import rotation

CASES = 50
STEP = 2e-4  # of the coarser quotient: 1e-5 m and 2e-4 rad
FLOOR = 2e-9  # of quotients at half of it: a tangency error of 1e-13 in some terms, mostly far less
CONTACTS = slice(lay.W_P, lay.W_Q + 3)


@dataclass
class Laid:
    """Rows of a path that touches all its obstacles, and its ends."""

    node: Array
    origin: Array
    insertion: Array

    def solved(self) -> Laid | None:
        """Return the path near this one by Newton's method, or None where there is none."""
        node = self.node.copy()
        ends = (*self.origin, 0.0, 0.0, 0.0, *(self.insertion - self.origin))
        error, _, _ = newton.newton(0, len(node), ends, node, 1e-13, 15)
        return Laid(node, self.origin, self.insertion) if error < 1e-12 else None

    def moved(self, direction: Array, step: float) -> Laid | None:
        """Return the path after every pose has moved by step times direction (n + 2, 6)."""
        node = self.node.copy()
        for row, d in zip(node, direction[1:-1], strict=True):
            row[lay.POS : lay.POS + 3] += step * d[:3]
            turned = rotation(exponential(step * d[3:])) @ row[lay.ROT : lay.ROT + 9].reshape(3, 3)
            row[lay.ROT : lay.ROT + 9] = turned.ravel()
        shift = step * direction[[0, -1], :3]
        return Laid(node, self.origin + shift[0], self.insertion + shift[1]).solved()

    def points(self) -> tuple[int, int, Array]:
        """Return number of stops, fault, and stops, as the kernels have them."""
        points = np.empty((len(self.node) + 2, hessian.POINT_ROW))
        (ax, ay, az), (bx, by, bz) = self.origin, self.insertion
        count, fault, _ = hessian.list_path_points(
            0, len(self.node), ax, ay, az, bx, by, bz, self.node, np.arange(len(self.node)), points
        )
        return count, fault, points

    def state(self) -> tuple[Array, Array]:
        """Return the gradient (n + 2, 6), and P, Q, s of every obstacle (n, 7)."""
        count, _, points = self.points()
        gradient = np.zeros((len(self.node) + 2, 6))
        hessian.add_gradient(count, points, gradient)
        contacts = self.node[:, CONTACTS] + np.tile(self.origin, 2)
        return gradient, np.c_[contacts, self.node[:, lay.S_ARC]]


def start(rng: np.random.Generator, surface: mw.Sphere | mw.Torus, row: Array) -> tuple[Array, Array, Array]:
    """Return a random point of a surface, a unit tangent and the normal there, in its own frame."""
    near = rng.normal(size=3) * 2.0 * surface.size
    if isinstance(surface, mw.Torus):
        near[2] = 0.0
        near *= surface.major_radius / np.linalg.norm(near)
        near += surface.minor_radius * rng.normal(size=3)
    elif isinstance(surface, mw.Cone):
        near[2] = rng.uniform(-0.02, 0.02)
    found = np.array(dispatch.project(row[None, :], 0, *near))
    tangent = np.cross(found[3:], rng.normal(size=3))
    return found[:3], tangent / np.linalg.norm(tangent), found[3:]


def lay_path(rng: np.random.Generator, kinds: str) -> Laid:
    """Return a random path over one obstacle per letter of `SURFACES`, curved towards the string at both contacts."""
    surfaces = [SURFACES[letter](rng) for letter in kinds]
    node = pack([mw.Obstacle(surface) for surface in surfaces])
    node = node[node[:, lay.TOUCH] == 0.0]  # no surface twice
    node[:, lay.S_MODE] = lay.TOUCHED
    here, heading = np.zeros(3), np.array([1.0, 0.0, 0.0])
    for surface, row in zip(surfaces, node, strict=True):
        here = here + rng.uniform(0.03, 0.08) * heading
        while True:
            point, tangent, normal = start(rng, surface, row)  # type: ignore[arg-type]
            row[lay.S_P : lay.S_P + 7] = *point, *tangent, rng.uniform(0.3, 1.2) * surface.size
            geodesics.geodesic(0, row[None, :], 0.0, 0.0, 0.0)
            if min(row[lay.W_KP], row[lay.W_KQ]) > 1.0:
                break
        side = np.cross(heading, rng.normal(size=3))
        side /= np.linalg.norm(side)
        local, world = (np.c_[t, n, np.cross(t, n)] for t, n in ((tangent, normal), (heading, side)))
        turn = world @ local.T
        row[lay.ROT : lay.ROT + 9] = turn.ravel()
        row[lay.POS : lay.POS + 3] = here - turn @ point
        geodesics.geodesic(0, row[None, :], 0.0, 0.0, 0.0)
        here, heading = row[lay.W_Q : lay.W_Q + 3].copy(), row[lay.W_TQ : lay.W_TQ + 3].copy()
    return Laid(node, np.zeros(3), here + rng.uniform(0.03, 0.08) * heading)


def derivatives_of(path: Laid, direction: Array) -> tuple[Array, Array] | None:
    """Return the rates along a direction of what `state` returns, or None for a string that slips off."""
    count, fault, points = path.points()
    if fault != hessian.NO_FAULT:
        return None
    slots = len(path.node) + 2
    rate, contacts = np.zeros((slots, 6)), np.zeros((slots - 2, 7))
    hessian.add_stiffness_times(count, direction, points, rate)
    rate[:, 3:] -= 0.5 * np.cross(path.state()[0][:, 3:], direction[:, 3:])
    assert (
        contact_rates.contact_rates(count, direction, np.ones(slots - 2), points, contacts)[0]
        == hessian.NO_FAULT
    )
    return rate, contacts


@pytest.mark.parametrize("kinds", [*SURFACES, "etk", "pyce"])
def test_rates_of_gradient_and_contacts_at_second_order(kinds: str) -> None:
    """A string that is about to slip runs away within a step: contacts faster than 1 m/s, at 0.05 m/s, are left out."""
    rng = np.random.default_rng(51)
    errors = []
    while len(errors) < CASES:
        path = lay_path(rng, kinds).solved()
        assert path is not None
        direction = rng.normal(size=(len(kinds) + 2, 6)) * ([0.05] * 3 + [1.0] * 3)
        direction[[0, -1], 3:] = 0.0
        exact = derivatives_of(path, direction)
        if exact is None:
            continue
        sides = [path.moved(direction, h) for h in (STEP, -STEP, STEP / 2, -STEP / 2)]
        good = [side.state() for side in sides if side is not None]
        if len(good) < 4 or np.abs(good[0][1] - good[1][1]).max() > 2 * STEP:
            continue
        pair = []
        for what in (0, 1):
            coarse, fine = (
                float(np.abs((good[i][what] - good[i + 1][what]) / h - exact[what]).max())
                for i, h in ((0, 2 * STEP), (2, STEP))
            )
            assert fine <= coarse / 3.5 + FLOOR
            assert fine <= 1e-2 * np.abs(exact[what]).max() + FLOOR
            pair.append(coarse / fine if coarse > 100 * FLOOR else np.nan)
        errors.append(pair)
    assert (np.isfinite(errors).sum(axis=0) > CASES // 4).any()
    assert np.nanmedian(errors) == pytest.approx(4.0, abs=0.05)


@pytest.mark.parametrize("kinds", [*SURFACES, "etk", "pyce"])
def test_hessian_is_symmetric(kinds: str) -> None:
    rng = np.random.default_rng(52)
    sound = 0
    for _ in range(CASES):
        path = lay_path(rng, kinds)
        count, fault, points = path.points()
        if fault != hessian.NO_FAULT:
            continue
        sound += 1
        slots = len(kinds) + 2
        work, matrix = np.empty((2, slots, 6)), np.empty((6 * slots, 6 * slots))
        hessian.stiffness(count, points, work[0], work[1], matrix)
        assert np.abs(matrix - matrix.T).max() <= 1e-12 * np.abs(matrix).max()
    assert sound > CASES // 4
