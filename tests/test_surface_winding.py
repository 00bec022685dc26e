"""Strings over a torus and a cone: through the hole or round, hooked, bridged; held, or slipped off the tip."""

from __future__ import annotations

import numpy as np
import pytest

import mjwrap as mw
from mjwrap.verification.scenes import Array, check_path, height, local

EXACT = 1e-12  # relative: two ways to the same path

# ------------------------------------------------------------------------------------- what a ring does to a string

RING = mw.Torus(0.04, 0.015)


def ring(hint: tuple[float, float, float] | None, *at: float) -> list[mw.Obstacle]:
    return [mw.Obstacle(RING, at or (0.0, 0.0, 0.0), hint=hint)]


def test_a_hint_leads_through_the_hole_or_round_the_outside() -> None:
    """A string along the axis through the tube of a ring is pushed to the side of the hint."""
    rng = np.random.default_rng(33)
    for _ in range(20):
        angle, height_1, height_2 = rng.uniform(0.0, 2.0 * np.pi), *rng.uniform(0.03, 0.1, 2)
        out = np.array([np.cos(angle), np.sin(angle), 0.0])
        origin, insertion = (rng.uniform(0.037, 0.043) * out + [0, 0, z] for z in (-height_1, height_2))
        for sign in (-1.0, 1.0):
            row = ring(tuple((0.04 + 0.015 * sign) * out))
            sol = mw.solve_path(origin, insertion, row)
            assert sol.converged
            check_path(origin, insertion, row, sol)
            for point in (sol.contacts[0].P, sol.contacts[0].Q):
                assert point is not None
                assert sign * (np.hypot(*point[:2]) - 0.04) > 0.0


def test_a_hint_leads_over_either_side_of_the_tube() -> None:
    """A string from the hole to the outside, in the plane of the ring, passes above or below the tube."""
    rng = np.random.default_rng(34)
    for _ in range(20):
        angle = rng.uniform(0.0, 2.0 * np.pi)
        out, along = (
            np.array([np.cos(angle), np.sin(angle), 0.0]),
            np.array([-np.sin(angle), np.cos(angle), 0.0]),
        )
        up = np.array([0.0, 0.0, 1.0])
        origin = rng.uniform(-0.005, 0.005) * out + rng.uniform(-0.002, 0.002) * up
        insertion = 0.1 * out + rng.uniform(-0.02, 0.02) * along + rng.uniform(-0.002, 0.002) * up
        for sign in (-1.0, 1.0):
            row = ring(tuple(0.04 * out + 0.015 * sign * up))
            sol = mw.solve_path(origin, insertion, row)
            assert sol.converged
            check_path(origin, insertion, row, sol)
            for point in (sol.contacts[0].P, sol.contacts[0].Q):
                assert point is not None
                assert sign * point[2] > 0.0


def test_a_hooked_string_stays_hooked_however_far_the_ring_moves() -> None:
    """Both ends are outside: the straight line between them is clear, but the string runs through the hole.

    One large move from the previous solution ends on the path that a hundred small ones lead to.
    """
    rng = np.random.default_rng(35)
    origin, insertion = np.array([0.1, 0.0, -0.03]), np.array([0.1, 0.005, 0.03])
    hooked = mw.solve_path(origin, insertion, ring((0.025, 0.0, 0.0)))
    assert hooked.converged
    check_path(origin, insertion, ring(None), hooked)
    assert (
        hooked.length > 0.15
    )  # 0.06 to the tube, as much back, and a half turn of it less what the slant saves
    free = mw.solve_path(origin, insertion, ring(None))
    assert not free.contacts[0].active
    for _ in range(20):
        far, turn = np.r_[rng.uniform(-0.03, 0.01), rng.uniform(-0.02, 0.02, 2)], rng.uniform(-0.3, 0.3, 3)
        step = hooked
        for share in np.linspace(0.01, 1.0, 100):
            there = [mw.Obstacle(RING, tuple(share * far), (1.0, *(share * turn)))]
            step = mw.solve_path(origin, insertion, there, start=step)
            assert step.converged
        jump = mw.solve_path(origin, insertion, there, start=hooked)
        assert jump.converged
        check_path(origin, insertion, there, jump)
        assert jump.length == pytest.approx(step.length, rel=EXACT)
        assert jump.length > 0.15


def test_a_string_bridges_the_hole_of_a_ring() -> None:
    """It touches the ring twice, and what follows from the path holds with both contacts."""
    rng = np.random.default_rng(36)
    for _ in range(20):
        origin = np.array([-0.1, *rng.uniform(-0.01, 0.01, 2)])
        insertion = np.array([0.1, *rng.uniform(-0.01, 0.01, 2)])
        row = ring((-0.04, 0.0, 0.015))
        sol = mw.solve_path(origin, insertion, row)
        assert sol.converged
        check_path(origin, insertion, row, sol)
        first, second = sol.contacts[0], sol.contacts[0].second
        assert second is not None
        assert second.second is None
        for contact, side in ((first, -1.0), (second, 1.0)):
            assert contact.active
            assert contact.arc_length > 0.0
            for point in (contact.P, contact.Q):
                assert point is not None
                assert abs(height(row[0], point[None])[0]) < 1e-12
                assert side * point[0] > 0.0
                assert point[2] > 0.0
        wrench = sol.wrenches(7.0)
        assert np.abs(wrench.sum(axis=0)).max() <= 1e-12 * 7.0
        u, v, shift = rng.normal(size=(3, 3))

        def length(t: float, move: tuple = (origin, insertion, u, v, shift, sol)) -> float:
            a, b, du, dv, w, start = move
            moved = mw.solve_path(a + t * du, b + t * dv, ring(None, *(t * w)), start=start, tol=1e-13)
            assert moved.contacts[0].second is not None
            return moved.length

        speed = sol.speed(u, v, np.r_[shift, 0.0, 0.0, 0.0][None])
        assert wrench[0, :3] @ u + wrench[1, :3] @ shift + wrench[2, :3] @ v == pytest.approx(-7.0 * speed)
        coarse, fine = (abs((length(h) - length(-h)) / (2 * h) - speed) for h in (5e-5, 2.5e-5))
        assert fine <= coarse / 3.0 + 1e-10 * abs(speed) + 1e-11  # second order; rounding of l over h
        assert fine <= 1e-3 * max(abs(speed), 0.1)


# ------------------------------------------------------------------------------------- what a cone does to a string


def developed(cone: mw.Obstacle, origin: Array, insertion: Array, sol: mw.PathSolution) -> float:
    """Return the angle that a path covers, seen from the apex of a cone [rad].

    The cone and the tangent planes in which the straight segments lie unroll to one plane, and a tangent path to a
    straight line of it: there is none beyond half a turn. The cosine law gives the angle of each of the three parts.
    """
    middle, slope, _ = cone.surface.dims
    contact = sol.contacts[0]
    assert contact.P is not None
    assert contact.Q is not None
    from_apex = local(cone, np.array([origin, contact.P, contact.Q, insertion])) - (0.0, 0.0, -middle / slope)
    far = np.linalg.norm(from_apex, axis=1)
    part = np.array(
        [np.linalg.norm(contact.P - origin), contact.arc_length, np.linalg.norm(insertion - contact.Q)]
    )
    return float(np.arccos((far[:-1] ** 2 + far[1:] ** 2 - part**2) / (2.0 * far[:-1] * far[1:])).sum())


def pulled_to_the_tip(rng: np.random.Generator) -> tuple[mw.Obstacle, Array, Array]:
    """Return a pointed cone, the string behind it, and both ends (201, 3), in front of it, which move past its tip."""
    bottom, half = rng.uniform(0.03, 0.045), rng.uniform(0.05, 0.15)
    side, low = 0.5 * bottom + rng.uniform(0.002, 0.02), rng.uniform(-0.3, 0.3) * half
    rise = np.linspace(0.0, 2.0 * half, 201)[:, None] * (0.0, 0.0, 1.0)
    cone = mw.Obstacle(mw.Cone(bottom, 0.0, half), hint=(-0.02, 0.0, low))
    return cone, rise + np.array((0.02, side, low)), rise + np.array((0.025, -side, low))


def test_a_string_wound_round_a_cone_holds_until_it_must_slip() -> None:
    rng = np.random.default_rng(37)
    for _ in range(10):
        cone, origins, insertions = pulled_to_the_tip(rng)
        sol, last = None, 0.0
        for k, (origin, insertion) in enumerate(zip(origins, insertions, strict=True)):
            sol = mw.solve_path(origin, insertion, [cone], start=sol)
            assert np.isfinite(sol.length)
            if not (sol.converged and sol.contacts[0].active):
                break
            if k % 10 == 0:
                check_path(origin, insertion, [cone], sol)
            before, last = last, developed(cone, origin, insertion, sol)
        assert last < np.pi
        assert (
            last + 2.0 * (last - before) > np.pi
        )  # the next step, or the one after as it speeds up, is beyond


def test_a_string_that_slips_off_a_cone_has_a_status() -> None:
    """Where a path holds, its length follows its ends; where it slips off, the status says so."""
    rng = np.random.default_rng(37)
    for _ in range(10):
        cone, origins, insertions = pulled_to_the_tip(rng)
        sol, before = None, None
        step = float(np.linalg.norm(origins[1] - origins[0]))
        for origin, insertion in zip(origins, insertions, strict=True):
            sol = mw.solve_path(origin, insertion, [cone], start=sol)
            assert sol.status in (mw.Status.CONVERGED, mw.Status.NO_GEODESIC)
            if not sol.converged:
                break
            assert before is None or abs(sol.length - before) <= 2.0 * step + 1e-12
            before = sol.length
        assert sol is not None
        assert not sol.converged
