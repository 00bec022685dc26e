"""Inertias that MuJoCo refuses, massless bodies, and joined bodies."""

import dataclasses

import numpy as np
from osim_mechanics import written
from osim_scenes import ORIGIN, body, chain, frame, model, turning

from mjwrap.osim.description.bodies import (
    Body,
)
from mjwrap.osim.writing.inertias import MassProperties, written_inertias
from mjwrap.osim.writing.tree import branches_of


def test_the_nearest_physical_inertia_is_written():
    rng = np.random.default_rng(2)
    for _ in range(50):
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        small = rng.uniform(0.1, 1.0, 2)
        given = np.array([*np.sort(small), small.sum() + rng.uniform(0.1, 0.5)])
        odd = Body("b", 1.0, np.zeros(3), turn @ np.diag(given) @ turn.T)
        branches = branches_of(model([odd], [turning("j", ORIGIN, frame("b"))]))
        now = written_inertias((odd,), branches)["b"]
        assert now.properties is not None
        moments = now.properties.principal()[0]
        assert moments[0] + moments[1] >= moments[2]
        missing = given[2] - given[0] - given[1]
        np.testing.assert_allclose(
            moments, given + missing / 3.0 * np.array([1, 1, -1]), rtol=0.0, atol=1e-14
        )
        # No other physical set of moments is nearer.
        for other in given + rng.normal(0.0, 0.3, (100, 3)):
            if other[0] + other[1] >= other[2]:
                assert np.linalg.norm(other - given) > np.linalg.norm(moments - given) - 1e-12


def test_joined_mass_properties_are_those_of_both_bodies():
    rng = np.random.default_rng(3)
    points = rng.normal(size=(2, 4, 3))
    masses = rng.uniform(1.0, 2.0, (2, 4))

    def properties(points, masses):
        center = masses @ points / masses.sum()
        away = points - center
        parts = [m * (p @ p * np.eye(3) - np.outer(p, p)) for m, p in zip(masses, away, strict=True)]
        inertia = np.sum(parts, axis=0)
        return MassProperties(masses.sum(), center, inertia)

    joined = properties(points[0], masses[0]).joined(properties(points[1], masses[1]))
    wanted = properties(points.reshape(-1, 3), masses.ravel())
    np.testing.assert_allclose(joined.inertia, wanted.inertia, rtol=1e-13)
    np.testing.assert_allclose(joined.center, wanted.center, rtol=1e-13)


def test_a_massless_moving_body_gets_a_stated_mass():
    osim = chain()
    osim = dataclasses.replace(osim, bodies=(osim.bodies[0], body("b1", 0.0, 0.0), osim.bodies[2]))
    found = written(osim)
    assert found.compile().body("b1").mass[0] == 2e-9
    entry = next(entry for entry in found.report.entries if entry.name == "b1")
    assert entry.outcome == "approximated"
    assert "2e-09 kg" in entry.text
    assert entry.size < 1e-6
