"""Motions over surfaces of every shape: contacts come and go without a jump; pose and start alone count."""

from __future__ import annotations

import numpy as np
import pytest
from test_surface_paths import EXACT, crossing, every_surface

import mjwrap as mw
from mjwrap.verification.scenes import LETTERS, Array, check_path, height, random_scene


def rise(rng: np.random.Generator, letter: str, steps: int) -> tuple[Array, Array, mw.Obstacle, Array, Array]:
    """Return ends, a surface and its poses (steps, 1, 3), (steps, 1, 4): clear, wrapped, clear ...

    It sinks by up to 5 cm along the string's push, twice, and turns by about 0.05 rad. Steps of 41, 401, ... share
    every tenth pose.
    """
    while True:
        origin, insertion, obstacle = crossing(rng, letter)
        push = mw.solve_path(origin, insertion, [obstacle]).wrenches(1.0)[1, :3]
        time = np.linspace(0.0, 1.0, steps)[:, None, None]
        depth = 0.02 * (1.0 + np.cos(4.0 * np.pi * time)) * rng.uniform(0.8, 1.25)
        pos = np.array(obstacle.pos) + depth * push / np.linalg.norm(push)
        quat = np.array(obstacle.quat) + 0.05 * np.sin(2.0 * np.pi * time) * rng.normal(size=4)
        quat /= np.linalg.norm(quat, axis=2)[:, :, None]
        poses = [posed(obstacle, pos, quat, k) for k in range(0, steps, (steps - 1) // 40)]
        if all((height(pose, np.array([origin, insertion])) > 2e-3).all() for pose in poses):
            return origin, insertion, obstacle, pos, quat


def posed(obstacle: mw.Obstacle, pos: Array, quat: Array, k: int) -> mw.Obstacle:
    """Return a surface at pose k of its motion."""
    return mw.Obstacle(obstacle.surface, tuple(pos[k, 0]), tuple(quat[k, 0]))


def moved(pos: Array, quat: Array, reach: float) -> Array:
    """Return by how much points within reach of a surface's centre move from pose to pose, at most [m]."""
    turn = 2.0 * np.linalg.norm(np.diff(quat[:, 0], axis=0), axis=1) * 1.01
    return np.linalg.norm(np.diff(pos[:, 0], axis=0), axis=1) + reach * turn


@every_surface
def test_contacts_come_and_go_without_a_jump(letter: str) -> None:
    """Coarse and fine, forth and back: same lengths, which change by no more than both ends, seen from the surface."""
    rng = np.random.default_rng(41)
    freed = 0
    for _ in range(10):
        state = rng.bit_generator.state
        lengths = {}
        for steps in (41, 401):
            rng.bit_generator.state = state
            origin, insertion, obstacle, pos, quat = rise(rng, letter, steps)
            forth = mw.solve_sweep(origin, insertion, [obstacle], pos, quat)
            back = mw.solve_sweep(origin, insertion, [obstacle], pos[::-1], quat[::-1])
            assert forth.converged
            assert back.converged
            assert forth.length == pytest.approx(back.length[::-1], rel=EXACT)
            assert (np.abs(np.diff(forth.length)) <= 2.0 * moved(pos, quat, 0.25) + 1e-12).all()
            lengths[steps] = forth.length
        assert lengths[41] == pytest.approx(lengths[401][::10], rel=EXACT)
        straight = np.linalg.norm(insertion - origin) * (1.0 + EXACT)
        freed += (lengths[401] <= straight).any() and (lengths[401] > straight).any()
    assert freed >= 5


@every_surface
def test_a_contact_begins_and_ends_without_force(letter: str) -> None:
    """At touchdown and lift-off the string bends by no more than the surface moves in a step over the way to an end.

    A surface that reaches d across a straight line turns the string by d / a + d / b, a and b from the ends, at first
    order.
    """
    rng = np.random.default_rng(42)
    events = 0
    for _ in range(5):
        origin, insertion, obstacle, pos, quat = rise(rng, letter, 401)
        bound, sol, push = moved(pos, quat, 0.1), None, 0.0
        for k in range(len(pos)):
            was, push_before = sol, push
            sol = mw.solve_path(origin, insertion, [posed(obstacle, pos, quat, k)], start=sol)
            assert sol.converged
            push = float(np.linalg.norm(sol.wrenches(1.0)[1, :3]))
            if was is not None and was.contacts[0].active != sol.contacts[0].active:
                point = (sol if sol.contacts[0].active else was).contacts[0].P
                assert point is not None
                near = min(np.linalg.norm(point - end) for end in (origin, insertion))
                assert max(push, push_before) <= 2.0 * 2.0 * bound[k - 1] / near
                events += 1
    assert events >= 5


@every_surface
def test_a_path_depends_on_nothing_but_its_pose_and_start(letter: str) -> None:
    """Bit for bit, whatever was solved in between, by a call of its own or in a sweep."""
    rng = np.random.default_rng(43)
    for _ in range(10):
        origin, insertion, row = random_scene(rng, letter + rng.choice(list(LETTERS)), hints=True)
        start = mw.solve_path(origin, insertion, row)
        move = 2e-3 * rng.normal(size=3)
        cold, warm = start, mw.solve_path(origin + move, insertion, row, start=start)
        for _ in range(2):
            mw.solve_path(insertion, origin, row[::-1])
            mw.solve_path(origin - 10.0 * move, insertion, row, start=warm)
            again = mw.solve_path(origin, insertion, row)
            assert again.length == cold.length
            assert np.array_equal(again.wrenches(1.0), cold.wrenches(1.0))
            again = mw.solve_path(origin + move, insertion, row, start=start)
            assert again.length == warm.length
            assert np.array_equal(again.wrenches(1.0), warm.wrenches(1.0))
        poses = np.array([obstacle.pos for obstacle in row]), np.array([obstacle.quat for obstacle in row])
        pos, quat = (np.repeat(x[None], 3, axis=0) for x in poses)
        origins = np.array([origin, origin + move, origin])
        sweep = mw.solve_sweep(origins, insertion, row, pos, quat, warm=False)
        assert sweep.length[0] == cold.length == sweep.length[2]


@every_surface
def test_a_motion_forth_and_back_ends_where_it_began(letter: str) -> None:
    """Two surfaces, both touched all the time: same lengths on the way back.

    A string that slides off one because its path ceases to be a minimum has no reason to come back: one motion in six.
    """
    rng = np.random.default_rng(44)
    kept = 0
    for _ in range(6):
        while True:
            origin, insertion, row = random_scene(rng, letter + "c", hints=False)
            sol = mw.solve_path(origin, insertion, row)
            if sol.converged and all(contact.arc_length > 5e-3 for contact in sol.contacts):
                break
        time = np.sin(np.linspace(0.0, 2.0 * np.pi, 101))  # forth, back, beyond and back
        pos = np.array([o.pos for o in row]) + 2e-3 * time[:, None, None] * rng.normal(size=(2, 3))
        quat = np.array([o.quat for o in row]) + 0.02 * time[:, None, None] * rng.normal(size=(2, 4))
        sweep = mw.solve_sweep(origin, insertion, row, pos, quat)
        assert sweep.converged
        last, touched = sol, True
        for k in range(len(pos)):
            places = zip(row, pos[k], quat[k], strict=True)
            posed_row = [mw.Obstacle(o.surface, tuple(p), tuple(q)) for o, p, q in places]
            last = mw.solve_path(origin, insertion, posed_row, start=last)
            touched &= all(contact.active for contact in last.contacts)
        if not touched:
            continue
        kept += 1
        assert sweep.length[:51] == pytest.approx(sweep.length[50::-1], rel=EXACT)
        assert sweep.length[50:] == pytest.approx(sweep.length[:49:-1], rel=EXACT)
        assert sweep.length[0] == pytest.approx(sol.length, rel=EXACT)
    assert kept >= 5


@pytest.mark.parametrize("count", [1, 2, 3, 5])
def test_mixed_rows_without_hints_are_found_and_certified(count: int) -> None:
    rng = np.random.default_rng(45)
    for _ in range(15):
        origin, insertion, row = random_scene(rng, "".join(rng.choice(list(LETTERS), count)), hints=False)
        sol = mw.solve_path(origin, insertion, row)
        assert sol.converged
        check_path(origin, insertion, row, sol)
