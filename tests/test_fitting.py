"""Fits find the surface that points lie on, wherever it stands, from all or a part of it, or say that they cannot."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

import mjwrap as mw
from mjwrap import fitting
from mjwrap.fitting import shapes
from mjwrap.mjcf import read_declarations

Array = np.ndarray[Any, np.dtype[np.float64]]
SEEDS = range(5)
EXACT = 1e-12  # [m] rounding of points some decimetres from the origin, through a least-squares fit

# Surface, and a random point of it (m, 3): written out here, apart from the package.
SURFACES: dict[str, mw.Sphere | Any] = {
    "sphere": mw.Sphere(0.03),
    "cylinder": mw.Cylinder(0.02, 0.05),
    "ellipsoid": mw.Ellipsoid((0.02, 0.03, 0.05)),
    "elliptic_cylinder": mw.EllipticCylinder((0.02, 0.03), 0.05),
    "torus": mw.Torus(0.04, 0.015),
    "cone": mw.Cone(0.03, 0.015, 0.05),
    "capsule": mw.Capsule(0.02, 0.04),
}
SHAPES = {
    "sphere": shapes.SPHERE,
    "cylinder": shapes.CYLINDER,
    "ellipsoid": shapes.ELLIPSOID,
    "elliptic_cylinder": shapes.ELLIPTIC_CYLINDER,
    "torus": shapes.TORUS,
    "cone": shapes.CONE,
    "capsule": shapes.CAPSULE,
}
SIZES = {
    "sphere": [0.03],
    "cylinder": [0.02],
    "ellipsoid": [0.02, 0.03, 0.05],
    "elliptic_cylinder": [0.02, 0.03],
    "torus": [0.04, 0.015],
    "cone": [0.0225, -0.15],
    "capsule": [0.02, 0.04],
}


def points_on(kind: str, rng: np.random.Generator, count: int, part: float = 1.0) -> Array:
    """Points on the surface of a kind; part: of the turns about its axes that they cover, about local x."""
    u = rng.uniform(-math.pi, math.pi, count) * part
    v = rng.uniform(-math.pi / 2, math.pi / 2, count) * part
    z = rng.uniform(-0.05, 0.05, count)
    circle = np.stack([np.cos(u), np.sin(u)], axis=-1)
    ball = np.stack([np.cos(v) * np.cos(u), np.cos(v) * np.sin(u), np.sin(v)], axis=-1)
    if kind == "sphere":
        return 0.03 * ball
    if kind == "ellipsoid":
        return ball * (0.02, 0.03, 0.05)
    if kind == "cylinder":
        return np.column_stack([0.02 * circle, z])
    if kind == "elliptic_cylinder":
        return np.column_stack([circle * (0.02, 0.03), z])
    if kind == "cone":
        return np.column_stack([circle * (0.0225 - 0.15 * z)[:, None], z])
    if kind == "torus":
        return np.column_stack([circle * (0.04 + 0.015 * np.cos(2 * v))[:, None], 0.015 * np.sin(2 * v)])
    ends = 0.02 * ball + np.column_stack([np.zeros((count, 2)), 0.04 * np.sign(ball[:, 2])])
    return np.where((np.abs(z) < 0.03)[:, None], np.column_stack([0.02 * circle, 0.04 / 0.03 * z]), ends)


def fit(kind: str, points: Array, **options: float) -> fitting.Fit:
    function: Callable[..., fitting.Fit] = getattr(mw, f"fit_{kind}")
    return function(points, **options)


def random_turn(rng: np.random.Generator) -> Rotation:
    return Rotation.from_quat(rng.normal(size=4))


def anywhere(points: Array, rng: np.random.Generator) -> Array:
    return random_turn(rng).apply(points) + rng.uniform(-0.3, 0.3, 3)


def radii(surface: Any) -> list[float]:
    """Sizes that do not depend on the frame chosen, nor on how far the points reach."""
    if isinstance(surface, mw.Ellipsoid | mw.EllipticCylinder):
        return sorted(surface.radii)
    if isinstance(surface, mw.Cone):
        slope = abs(surface.top_radius - surface.bottom_radius) / (2 * surface.half_length)
        return [slope]
    if isinstance(surface, mw.Cylinder):
        return [surface.radius]
    return list(surface.dims)


def half_length(found: fitting.Fit) -> float:
    assert isinstance(found.surface, mw.Cylinder | mw.EllipticCylinder | mw.Cone)
    return found.surface.half_length


# ------------------------------------------------------------------------------------- exact points


@pytest.mark.parametrize("part", [1.0, 0.6])
@pytest.mark.parametrize("kind", SURFACES)
def test_points_of_a_surface_give_the_surface_back(kind: str, part: float) -> None:
    """In any pose, from all of it or from two thirds of a turn each way."""
    if kind == "capsule" and part < 1:
        part = 0.9  # of a capsule without its two ends nobody can tell the length
    for seed in SEEDS:
        rng = np.random.default_rng(seed)
        found = fit(kind, anywhere(points_on(kind, rng, 300, part), rng))
        assert found.max_distance < EXACT
        assert found.rms <= found.max_distance
        # errors grow towards what the points do not show
        assert radii(found.surface) == pytest.approx(radii(SURFACES[kind]), abs=found.growth * 1e-13)
        assert 0.9 < found.growth < 300


@pytest.mark.parametrize("kind", ["cylinder", "elliptic_cylinder", "cone"])
def test_long_surfaces_are_as_long_as_the_points_reach(kind: str) -> None:
    rng = np.random.default_rng(3)
    x = points_on(kind, rng, 300)
    turn, shift = random_turn(rng), rng.uniform(-1, 1, 3)
    found = fit(kind, turn.apply(x) + shift)
    reach = x[:, 2]
    assert half_length(found) == pytest.approx(0.5 * np.ptp(reach), abs=EXACT)
    middle = turn.apply((0, 0, 0.5 * (reach.min() + reach.max()))) + shift
    assert found.pos == pytest.approx(middle, abs=EXACT)


def test_a_cone_ends_at_its_apex() -> None:
    """Points noisy about the tip reach beyond it; a surface does not."""
    rng = np.random.default_rng(4)
    z, u = rng.uniform(0, 0.1, 500), rng.uniform(0, 2 * math.pi, 500)
    x = np.column_stack([0.5 * z * np.cos(u), 0.5 * z * np.sin(u), z]) + rng.normal(size=(500, 3)) * 1e-3
    found = fit("cone", np.vstack([x, [(0, 0, -0.01)]]))
    surface = found.surface
    assert isinstance(surface, mw.Cone)
    assert min(surface.bottom_radius, surface.top_radius) == 0.0
    assert np.linalg.norm(found.pos) - surface.half_length == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize("kind", SURFACES)
def test_the_frame_is_turned_least(kind: str) -> None:
    """A surface that hardly turns keeps its frame; about its own axis it has none to keep."""
    rng = np.random.default_rng(5)
    small = Rotation.from_rotvec([0.1, -0.05, 0.08])
    found = fit(kind, small.apply(points_on(kind, rng, 300)))
    turn = Rotation.from_quat(np.roll(found.quat, -1))
    if kind in ("ellipsoid", "elliptic_cylinder"):
        assert (turn.inv() * small).magnitude() < 1e-9
    elif kind == "sphere":
        assert turn.magnitude() == 0.0
    else:
        assert turn.apply((0, 0, 1)) == pytest.approx(small.apply((0, 0, 1)), abs=1e-9)
        assert turn.as_rotvec()[2] == pytest.approx(0.0, abs=1e-12)


# ---------------------------------------------------------------------------------- noise, outliers


@pytest.mark.parametrize("kind", SURFACES)
def test_a_fit_is_better_than_the_surface_that_the_noise_was_added_to(kind: str) -> None:
    """Least squares leaves no more than the noise, and its unknowns' share less: m - k of m degrees of freedom."""
    count, noise = 400, 5e-4
    for seed in SEEDS:
        rng = np.random.default_rng(seed)
        x = points_on(kind, rng, count) + rng.normal(size=(count, 3)) * noise
        true = SHAPES[kind].nearest(x, np.array(SIZES[kind])).distance
        found = fit(kind, x)
        assert found.rms < math.sqrt(np.mean(true**2))
        assert found.rms == pytest.approx(noise, rel=0.15)  # four standard errors of a variance from 400


@pytest.mark.parametrize("kind", SURFACES)
def test_distances_are_those_from_the_posed_surface(kind: str) -> None:
    """In the order of the points, in the frame that pos and quat give: by a search over the surface's points."""
    rng = np.random.default_rng(6)
    x = anywhere(points_on(kind, rng, 200) + rng.normal(size=(200, 3)) * 1e-3, rng)
    found = fit(kind, x)
    turn = Rotation.from_quat(np.roll(found.quat, -1))
    local = turn.inv().apply(x - found.pos)
    for k in range(0, 200, 23):
        if kind in ("cylinder", "elliptic_cylinder", "cone") and abs(local[k, 2]) > 0.8 * half_length(found):
            continue  # distances are to the surface without ends
        assert abs(found.distances[k]) == pytest.approx(searched_distance(found.surface, local[k]), abs=1e-8)


def searched_distance(surface: Any, point: Array) -> float:
    """Distance of a point (3,) from a surface, by minimisation over its two coordinates."""

    def at(uv: Array) -> Array:
        u, v = uv
        c, s = math.cos(u), math.sin(u)
        if isinstance(surface, mw.Torus):
            ring = surface.major_radius + surface.minor_radius * math.cos(v)
            return np.array([ring * c, ring * s, surface.minor_radius * math.sin(v)])
        if isinstance(surface, mw.Ellipsoid | mw.Sphere):
            axes = surface.radii if isinstance(surface, mw.Ellipsoid) else 3 * [surface.radius]
            return np.array(axes) * (math.cos(v) * c, math.cos(v) * s, math.sin(v))
        if isinstance(surface, mw.Capsule):
            if abs(v) < math.pi / 4:  # the cylinder, then the ends
                return np.array(
                    [surface.radius * c, surface.radius * s, surface.half_length * v / (math.pi / 4)]
                )
            rise = (abs(v) - math.pi / 4) * 2
            lift = math.copysign(surface.half_length + surface.radius * math.sin(rise), v)
            return np.array([surface.radius * math.cos(rise) * c, surface.radius * math.cos(rise) * s, lift])
        if isinstance(surface, mw.Cone):
            slope = (surface.top_radius - surface.bottom_radius) / (2 * surface.half_length)
            radius = 0.5 * (surface.top_radius + surface.bottom_radius) + slope * v
            return np.array([radius * c, radius * s, v])
        a, b = (surface.radius, surface.radius) if isinstance(surface, mw.Cylinder) else surface.radii
        return np.array([a * c, b * s, v])

    long = isinstance(surface, mw.Cylinder | mw.EllipticCylinder | mw.Cone)
    starts = [
        (u, v)
        for u in np.linspace(-math.pi, math.pi, 25)
        for v in (np.linspace(-0.06, 0.06, 13) if long else np.linspace(-math.pi, math.pi, 25))
        if long or isinstance(surface, mw.Torus) or abs(v) <= math.pi / 2
    ]
    starts.sort(key=lambda uv: float(np.linalg.norm(at(np.array(uv)) - point)))
    return min(
        math.sqrt(
            minimize(
                lambda uv: float(((at(uv) - point) ** 2).sum()) * 1e6,
                start,
                method="Nelder-Mead",
                options={"xatol": 1e-10, "fatol": 1e-13, "maxiter": 800},
            ).fun
            / 1e6
        )
        for start in starts[:4]
    )


@pytest.mark.parametrize("kind", ["sphere", "cylinder", "ellipsoid", "torus", "cone"])
def test_outliers_do_not_bend_a_fit_that_knows_their_scale(kind: str) -> None:
    """A tenth of the points stands a centimetre off. Plain least squares is drawn there; with a scale it is not."""
    rng = np.random.default_rng(7)
    x = points_on(kind, rng, 400) + rng.normal(size=(400, 3)) * 1e-4
    spur = x[:, 2] > np.quantile(x[:, 2], 0.9)
    x[spur, 0] += 0.01
    plain, robust = fit(kind, x), fit(kind, x, scale=2e-4)
    clean = ~spur
    left, bent = (math.sqrt(np.mean(f.distances[clean] ** 2)) for f in (robust, plain))
    assert left < 1.15e-4
    assert bent > 2 * left


def test_points_on_both_sides_have_signed_distances() -> None:
    x = points_on("sphere", np.random.default_rng(8), 100)
    x[:50] *= 1.1
    x[50:] *= 0.9
    found = fit("sphere", x)
    assert (found.distances[:50] > 0).all()
    assert (found.distances[50:] < 0).all()
    assert found.max_distance == pytest.approx(np.abs(found.distances).max())


# --------------------------------------------------------------------------------- derivatives


@pytest.mark.parametrize("kind", SHAPES)
def test_derivatives_of_distances_at_second_order(kind: str) -> None:
    """By all unknowns, away from the start of the step too, at points inside and outside."""
    from mjwrap.fitting.least_squares import Posed

    ratios = []
    for seed in range(50):
        rng = np.random.default_rng(seed)
        shape = SHAPES[kind]
        x = points_on(kind, rng, 20) * 30 * rng.uniform(0.95, 1.2, (20, 1))
        if kind == "capsule":  # the second derivative jumps where the cylinder ends
            x = x[np.abs(np.abs(x[:, 2]) - 1.2) > 0.1]
        sizes = np.array(SIZES[kind]) * ([30, 1] if kind == "cone" else 30)
        posed = Posed(shape, rng.normal(size=3), random_turn(rng).as_matrix(), sizes)
        x = x @ posed.rotation.T + posed.origin
        at = rng.uniform(-0.03, 0.03, shape.unknowns)
        exact = posed.derivative(at, x)
        for k, direction in enumerate(np.eye(shape.unknowns)):
            errors = []
            for h in (2e-3, 1e-3):
                ahead, behind = (posed.moved(at + s * h * direction).nearest(x).distance for s in (1, -1))
                errors.append(np.abs((ahead - behind) / (2 * h) - exact[:, k]).max())
            if errors[1] > 1e-9:
                ratios.append(errors[0] / errors[1])
            assert errors[1] < 1e-4
    assert np.median(ratios) == pytest.approx(4.0, abs=0.02)


# ------------------------------------------------------------------------------------- refusals


@pytest.mark.parametrize(
    ("points", "wanted"),
    [
        (np.zeros((20, 2)), "must have shape (m, 3), not (20, 2)"),
        ("many", "must have shape (m, 3)"),
        (np.full((20, 3), np.nan), "point 0 is not finite"),
        (np.random.default_rng(1).normal(size=(8, 3)), "needs at least 9 points, not 8"),
        (np.ones((20, 3)), "all 20 points are the same"),
    ],
)
def test_points_that_cannot_be_fitted(points: Any, wanted: str) -> None:
    with pytest.raises(mw.GeometryError) as caught:
        mw.fit_ellipsoid(points)
    assert "fit of an ellipsoid" in str(caught.value)
    assert wanted in str(caught.value)


@pytest.mark.parametrize("kind", SURFACES)
@pytest.mark.parametrize("degenerate", ["plane", "line", "noisy plane"])
def test_points_in_a_plane_or_on_a_line_determine_nothing(kind: str, degenerate: str) -> None:
    rng = np.random.default_rng(9)
    x = (
        rng.uniform(-0.05, 0.05, (200, 3))
        * {"plane": (1, 1, 0), "line": (1, 0, 0), "noisy plane": (1, 1, 1e-6)}[degenerate]
    )
    with pytest.raises(mw.GeometryError, match=f"fit of an? {kind.replace('_', ' ')}: "):
        fit(kind, anywhere(x, rng))


@pytest.mark.parametrize("kind", ["cylinder", "ellipsoid", "cone"])
def test_a_circle_of_points_determines_only_a_sphere(kind: str) -> None:
    """Many cylinders, cones and ellipsoids run through it: their other sizes would be made up."""
    u = np.linspace(0, 2 * math.pi, 100)
    x = np.column_stack([0.03 * np.cos(u), 0.03 * np.sin(u), np.zeros(100)])
    with pytest.raises(mw.GeometryError):
        fit(kind, x)


def test_half_a_capsule_has_no_length() -> None:
    x = points_on("capsule", np.random.default_rng(10), 300)
    with pytest.raises(mw.GeometryError, match="more of"):
        fit("capsule", x[x[:, 2] > 0])


@pytest.mark.parametrize("scale", [0.0, -1.0, math.nan, math.inf])
def test_a_scale_must_be_positive(scale: float) -> None:
    with pytest.raises(mw.GeometryError, match="scale must be finite and positive"):
        mw.fit_sphere(points_on("sphere", np.random.default_rng(0), 20), scale=scale)


def test_growth_tells_how_little_the_points_say_of_the_rest() -> None:
    """The smaller the part of a sphere, the more an error of its points moves the other side; all of it: none does."""
    rng = np.random.default_rng(11)
    caps = [fit("sphere", points_on("sphere", rng, 400, part)).growth for part in (1.0, 0.5, 0.25, 0.12)]
    assert caps[0] < 2
    assert all(b > 2 * a for a, b in itertools.pairwise(caps))


# ------------------------------------------------------------------------------ into MJCF and paths


@pytest.mark.parametrize("kind", SURFACES)
def test_a_fit_becomes_an_obstacle_and_an_mjcf_geom(kind: str, tmp_path: Path) -> None:
    """Surface and pose survive to the last bit, through a file."""
    rng = np.random.default_rng(12)
    found = fit(kind, anywhere(points_on(kind, rng, 200), rng))
    obstacle = found.obstacle(hint=(0.0, 0.1, 0.0))
    assert (obstacle.surface, obstacle.pos, obstacle.quat) == (found.surface, found.pos, found.quat)
    xml = f"""
<mujoco>
  <worldbody>
    <site name="a" pos="1 0 0"/> <site name="b" pos="-1 0 0"/>
    <body name="bone" pos="1 2 3">{found.geom_xml("bone_wrap")}</body>
  </worldbody>
  <custom>
    <numeric name="mjwrap_rope_optimal_force" data="10"/> {found.numeric_xml("bone_wrap")}
    <tuple name="mjwrap_rope">
      <element objtype="site" objname="a"/> {found.elements_xml("bone_wrap")} <element objtype="site" objname="b"/>
      <element objtype="numeric" objname="mjwrap_rope_optimal_force"/>
    </tuple>
  </custom>
</mujoco>"""
    model = mujoco.MjModel.from_xml_string(xml)
    (muscle,) = read_declarations(model).muscles
    assert muscle.surfaces == [found.surface]
    geom = model.geom("bone_wrap")
    assert tuple(geom.pos) == found.pos
    assert geom.quat == pytest.approx(found.quat, abs=1e-15)
    assert (geom.contype, geom.conaffinity) == (0, 0)


# ------------------------------------------------------------------------------- points of meshes

BONE = """
<mujoco>
  <asset><mesh name="wedge" vertex="0 0 0  .1 0 0  0 .1 0  0 0 .1  .3 0 0"/></asset>
  <worldbody>
    <body name="bone" pos="1 2 3" euler="90 0 0">
      <geom name="bone" type="mesh" mesh="wedge" pos=".5 0 0" euler="0 0 90"/>
      <geom name="ball" size=".1"/>
    </body>
  </worldbody>
</mujoco>
"""
CORNERS = np.array([(0, 0, 0), (0.1, 0, 0), (0, 0.1, 0), (0, 0, 0.1), (0.3, 0, 0)])


def in_some_order(points: Array) -> Array:
    return points[np.lexsort(points.T.round(6))]


def test_mesh_points_are_in_the_frame_of_the_body_or_the_world() -> None:
    """Where the file puts them, though MuJoCo moves the mesh's own frame. Vertices are in single precision."""
    model = mujoco.MjModel.from_xml_string(BONE)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    in_body = CORNERS @ np.array([(0, -1, 0), (1, 0, 0), (0, 0, 1)]).T + (0.5, 0, 0)
    in_world = in_body @ np.array([(1, 0, 0), (0, 0, -1), (0, 1, 0)]).T + (1, 2, 3)
    index = model.geom("bone").id
    for geom in ("bone", index):
        assert in_some_order(mw.mesh_points(model, geom)) == pytest.approx(in_some_order(in_body), abs=1e-6)
        found = in_some_order(mw.mesh_points(model, geom, data=data))
        assert found == pytest.approx(in_some_order(in_world), abs=1e-6)


def test_regions_keep_a_part_of_the_points() -> None:
    model = mujoco.MjModel.from_xml_string(BONE)
    corners = mw.mesh_points(model, "bone")
    for region, keep in {
        fitting.in_box((0.4, 0.05, -0.05), (0.6, 0.35, 0.05)): lambda p: (p[1] > 0.05) & (abs(p[2]) < 0.05),
        fitting.in_ball((0.5, 0.0, 0.0), 0.2): lambda p: np.linalg.norm(p - (0.5, 0, 0)) < 0.2,
        fitting.beyond((0.5, 0.0, 0.05), (0.0, 0.0, 2.0)): lambda p: p[2] > 0.05,
    }.items():
        found = mw.mesh_points(model, "bone", region=region)
        expected = np.array([p for p in corners if keep(p)])
        assert 0 < len(found) < 5
        assert found == pytest.approx(expected)


@pytest.mark.parametrize("geom", ["ball", "bones", 1, 7, -1])
def test_a_geom_without_a_mesh(geom: str | int) -> None:
    model = mujoco.MjModel.from_xml_string(BONE)
    with pytest.raises(mw.ModelError) as caught:
        mw.mesh_points(model, geom)
    assert repr(geom) in str(caught.value)
    assert "mesh geoms: bone" in str(caught.value)


def test_regions_of_nonsense() -> None:
    with pytest.raises(mw.GeometryError, match="low must be 3 numbers"):
        fitting.in_box((0, 0), (1, 1, 1))
    with pytest.raises(mw.GeometryError, match="centre must be 3 numbers"):
        fitting.in_ball((0, math.nan, 0), 1.0)


# ------------------------------------------------------------------------------------ a real bone


@pytest.mark.myo
@pytest.mark.filterwarnings(
    "ignore:Attaching a spec with an empty prefix:UserWarning"
)  # myo_sim builds it so
def test_the_bone_of_the_docs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The page's own code and figures, which the tests of the docs leave out where myo_sim may be missing."""
    pytest.importorskip("myo_sim", reason="the humerus is myo_sim's")
    from test_docs import ROOT, run

    monkeypatch.chdir(tmp_path)  # MuJoCo logs its warnings into the working folder
    page = (ROOT / "docs" / "surfaces.md").read_text()
    (start,) = (m.end() for m in re.finditer("<!-- no-test: needs the myo-sim package.*-->\n", page))
    run("surfaces.md", page[start : page.index("![", start)])
