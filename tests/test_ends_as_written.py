"""An end on the rim of a surface, written with six digits, lies on the surface: paths, takeover and winches."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest
from numpy.typing import ArrayLike

import mjwrap as mw
from mjwrap.cli.inspect.declared import table
from mjwrap.surfaces import Surface
from mjwrap.verification.scenes import height, local, nearest, random_surface

CASES = 50
Vector = tuple[float, ...]


def six(values: ArrayLike) -> Vector:
    """Return numbers as a file with six digits has them."""
    return tuple(float(f"{x:.6g}") for x in np.ravel(values))


def as_written(surface: Surface) -> Surface:
    if isinstance(surface, mw.Cone):
        return mw.Cone(*six([surface.bottom_radius, surface.top_radius, surface.half_length]))
    if isinstance(surface, mw.Ellipsoid | mw.EllipticCylinder):
        return type(surface)(six(surface.radii))  # pyright: ignore[reportArgumentType]
    return type(surface)(*(x for x in six(surface.dims) if math.isfinite(x)))


@pytest.mark.parametrize("letter", "cselkp")
def test_a_rounded_end_on_a_surface_has_the_path_of_its_exact_twin(letter: str) -> None:
    """Position, orientation, sizes and both ends are rounded: the end gets inside in about half of the scenes."""
    rng, inside, compared = np.random.default_rng(21), 0, 0
    while compared < CASES:
        exact = mw.Obstacle(
            random_surface(rng, letter), tuple(0.1 * rng.normal(size=3)), tuple(rng.normal(size=4))
        )
        origin = nearest(exact, nearest(exact, exact.pos + 0.04 * rng.normal(size=3)))[0]
        towards = rng.normal(size=3)
        insertion = exact.pos + towards / np.linalg.norm(towards) * rng.uniform(0.1, 0.3)
        if (
            isinstance(exact.surface, mw.Cone)
            and abs(local(exact, origin)[0, 2]) > 0.8 * exact.surface.half_length
        ):
            continue
        if height(exact, insertion[None])[0] < 0.01:
            continue
        compared += 1
        rounded = mw.Obstacle(as_written(exact.surface), six(exact.pos), six(exact.quat))
        inside += bool(height(rounded, np.array([six(origin)]))[0] < 0.0)
        twin = mw.solve_path(origin, insertion, [exact])
        path = mw.solve_path(six(origin), six(insertion), [rounded])
        assert twin.status == path.status
        assert path.length == pytest.approx(twin.length, rel=3e-5)
        back = mw.solve_path(six(insertion), six(origin), [rounded])
        assert back.length == pytest.approx(path.length, rel=1e-9)
    assert 10 < inside < CASES - 10


def winch(rng: np.random.Generator, kind: str) -> mujoco.MjSpec:
    """Return a drum that turns about z, with a rope from its rim to a load on a slide."""
    spec = mujoco.MjSpec()
    spec.compiler.LRopt.mode = int(mujoco.mjtLRMode.mjLRMODE_NONE)
    radius, angle = rng.uniform(0.02, 0.05), rng.uniform(0.0, 2.0 * math.pi)
    drum = spec.worldbody.add_body(pos=0.1 * rng.normal(size=3))
    drum.add_joint(type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 0, 1])
    shape = mujoco.mjtGeom.mjGEOM_CYLINDER if kind == "cylinder" else mujoco.mjtGeom.mjGEOM_SPHERE
    drum.add_geom(name="drum", type=shape, size=[radius, 0.2, 0.0], mass=1.0)
    drum.add_site(name="rim", pos=[radius * math.cos(angle), radius * math.sin(angle), 0.0])
    load = spec.worldbody.add_body(pos=drum.pos + np.array([0.5, 0.01, 0.0]))
    load.add_joint(type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[1, 0, 0])
    load.add_geom(size=[0.01, 0.0, 0.0], mass=1.0)
    load.add_site(name="hook")
    rope = spec.add_tendon(name="rope")
    rope.wrap_site("rim")
    rope.wrap_geom("drum", "")
    rope.wrap_site("hook")
    pull = spec.add_actuator(name="pull", trntype=mujoco.mjtTrn.mjTRN_TENDON, target="rope")
    pull.set_to_muscle(
        timeconst=[0.01, 0.04], tausmooth=0, range=[0.75, 1.05], force=10, scale=200, lmin=0.5, lmax=1.6, vmax=1.5,
        fpmax=1.3, fvmax=1.2,
    )  # fmt: skip
    pull.lengthrange = [0.1, 2.0]
    return spec


def test_a_winch_written_to_a_file_winds_as_before() -> None:
    """Over two turns; on the drum nothing is held inside, and `mjwrap inspect` would say so."""
    rng = np.random.default_rng(22)
    for _ in range(CASES):
        spec = winch(rng, "cylinder")
        exact, written = spec.compile(), mujoco.MjModel.from_xml_string(spec.to_xml())
        wound = []
        for model in (exact, written):
            muscles, data = mw.MuscleSystem(model), mujoco.MjData(model)
            assert muscles.n == 1
            assert "held inside" not in table(model, muscles.declarations)
            lengths = []
            for angle in np.linspace(0.0, 14.0, 57):
                data.qpos[0] = angle
                muscles.forward(data)
                assert not muscles.status.any()
                lengths.append(float(muscles.length[0]))
            wound.append(lengths)
        assert wound[1] == pytest.approx(wound[0], rel=3e-5)
        assert max(wound[0]) > wound[0][0] + 8.0 * exact.geom_size[0, 0]


def test_what_is_held_inside_is_listed() -> None:
    spec = winch(np.random.default_rng(23), "sphere")
    spec.site("rim").pos = 0.99 * spec.site("rim").pos
    model = spec.compile()
    assert "held inside" in table(model, mw.MuscleSystem(model).declarations)
