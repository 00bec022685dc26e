"""A recording shows the surfaces that paths run over, in the frames of their geoms, whatever those geoms look like."""

from __future__ import annotations

from collections import Counter
from typing import Any

import mujoco
import numpy as np
import pytest

import mjwrap as mw
from mjwrap.surfaces.triangles import surface_grid, triangles

pytest.importorskip("rerun", reason="recordings need the rerun-sdk package")

from declared_models import element
from made_up_runs import Muscles, read, recorder, states, static

from mjwrap.mjcf import read_declarations
from mjwrap.surfaces import Surface

XML = """
<mujoco>
  <worldbody>
    <site name="origin"/> <site name="insertion" pos="1 0 0"/> <site name="via"/>
    <body name="arm" pos="0 .5 .5">
      <joint name="hinge" axis="0 1 0"/>
      <geom name="drum" type="cylinder" size=".05 .12" rgba=".5 .6 .7 1" euler="90 0 0" group="3"/>
      <geom name="egg" type="ellipsoid" size=".03 .04 .05" rgba=".2 .4 .6 1"/>
      <geom name="pill" type="capsule" size=".02 .1" group="4"/>
      <geom name="peg" size=".001" pos=".1 .2 .3" euler="10 20 30" rgba="1 0 0 0" group="3"/>
      <geom name="other" size=".01" group="3"/>
    </body>
    <body mocap="true" pos="1 0 0"><geom size=".01"/></body>
  </worldbody>
  <custom>
    <numeric name="optimal_force" data="1"/>
    <numeric name="torus_size" data=".06 .02"/>
    <numeric name="cone_size" data=".04 0 .05"/>
    <numeric name="elliptic_cylinder_size" data=".02 .03"/>
    <numeric name="short_cylinder_size" data=".05 .03"/>
    <tuple name="mjwrap_rope">{route}<element objtype="numeric" objname="optimal_force"/></tuple>
  </custom>
</mujoco>
"""
GEOMS = ["drum", "egg", "pill"]
PEG = element("geom", "peg")
ROUTE = [
    element("site", "origin"),
    *(element("geom", name) for name in GEOMS),
    *(
        e
        for name in ("torus_size", "cone_size", "elliptic_cylinder_size")
        for e in (PEG, element("numeric", name))
    ),
    element("geom", "drum"),
    element("numeric", "short_cylinder_size"),
    element("site", "insertion"),
]
SURFACES = {
    "peg": mw.Torus(0.06, 0.02),
    r"peg\#1": mw.Cone(0.04, 0.0, 0.05),
    r"peg\#2": mw.EllipticCylinder((0.02, 0.03)),
    "drum": mw.Cylinder(0.05, 0.03),
}
ALL: list[Any] = [
    mw.Sphere(0.03),
    mw.Ellipsoid((0.02, 0.03, 0.05)),
    mw.Cylinder(0.03, 0.05),
    mw.Cylinder(0.03),
    mw.EllipticCylinder((0.02, 0.03), 0.05),
    mw.Torus(0.04, 0.01),
    mw.Cone(0.03, 0.01, 0.05),
    mw.Cone(0.0, 0.03, 0.05),
    mw.Capsule(0.02, 0.04),
]


def outside(surface: Any, p: Any) -> Any:
    """A function (m,) of points (m, 3) that is zero on the surface and grows outwards [m], written out here."""
    x, y, z = np.transpose(p)
    around = np.hypot(x, y)
    if isinstance(surface, mw.Sphere):
        return np.linalg.norm(p, axis=-1) - surface.radius
    if isinstance(surface, mw.Ellipsoid):
        return 0.02 * (np.linalg.norm(np.asarray(p) / surface.radii, axis=-1) - 1)
    if isinstance(surface, mw.EllipticCylinder):
        return 0.02 * (np.hypot(x / surface.radii[0], y / surface.radii[1]) - 1)
    if isinstance(surface, mw.Torus):
        return np.hypot(around - surface.major_radius, z) - surface.minor_radius
    if isinstance(surface, mw.Cone):
        share = 0.5 * (1 + z / surface.half_length)
        return around - ((1 - share) * surface.bottom_radius + share * surface.top_radius)
    if isinstance(surface, mw.Capsule):
        return np.hypot(around, np.maximum(np.abs(z) - surface.half_length, 0)) - surface.radius
    return around - surface.radius


@pytest.fixture(scope="module")
def content(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    model = mujoco.MjModel.from_xml_string(XML.format(route="".join(ROUTE)))
    muscles = Muscles.__new__(Muscles)
    muscles.n, muscles.names, muscles.time, muscles.row = 1, ["rope"], 0.0, -1
    declarations: Any = read_declarations(model).muscles
    muscles.declarations = declarations
    path = tmp_path_factory.mktemp("surfaces") / "run.rrd"
    with recorder(model, muscles, path) as record:
        for data in states(model, muscles, 2):
            record.log(data)
    return read(path)


def arm(content: dict[str, Any], kind: str, name: str, component: str) -> Any:
    return static(content, f"/world/bodies/arm/{kind}/{name}", component)


# ----------------------------------------------------------------------------------------- pictures


def test_geoms_that_are_the_surface_are_drawn_as_they_are_and_translucent(content: dict[str, Any]) -> None:
    assert arm(content, "geoms", "egg", "Ellipsoids3D:half_sizes") == [pytest.approx([0.03, 0.04, 0.05])]
    for name, component in (("drum", "Cylinders3D"), ("egg", "Ellipsoids3D"), ("pill", "Capsules3D")):
        (color,) = arm(content, "geoms", name, f"{component}:colors")
        assert color & 0xFF < 0x80


@pytest.mark.parametrize("name", SURFACES)
def test_declared_surfaces_are_drawn_beside_their_geom(content: dict[str, Any], name: str) -> None:
    """Right in shape, in the geom's frame and colour, translucent even where the geom is invisible."""
    surface: Any = SURFACES[name]
    vertices = np.array(arm(content, "surfaces", name, "Mesh3D:vertex_positions"))
    normals = np.array(arm(content, "surfaces", name, "Mesh3D:vertex_normals"))
    assert len(vertices) > 1000
    assert outside(surface, vertices) == pytest.approx(np.zeros(len(vertices)), abs=1e-8)  # single precision
    assert (outside(surface, vertices + 1e-4 * normals) > 0.5e-4).mean() > 0.99  # not at a tip
    (color,) = arm(content, "surfaces", name, "Mesh3D:albedo_factor")
    geom = name.split("\\")[0]
    assert color >> 8 == (0x8099B2 if geom == "drum" else 0xFF0000)
    assert 0x20 < color & 0xFF < 0x80
    for component in ("Transform3D:translation", "Transform3D:quaternion"):
        assert arm(content, "surfaces", name, component) == arm(content, "geoms", geom, component)


def test_no_surface_is_drawn_twice(content: dict[str, Any]) -> None:
    drawn = {path.rsplit("/", 1)[1] for path in content if "/surfaces/" in path}
    assert drawn == set(SURFACES)


def test_only_geoms_that_no_path_runs_over_are_hidden() -> None:
    from mjwrap.recording.scene import Scene

    model = mujoco.MjModel.from_xml_string(XML.format(route="".join(ROUTE)))
    muscles: Any = Muscles.__new__(Muscles)
    muscles.names, muscles.declarations = ["rope"], read_declarations(model).muscles
    scene = Scene(model, muscles)
    assert [path.rsplit("/", 1)[1] for path in scene.hidden] == ["peg", "other"]


# ------------------------------------------------------------------------------------------ meshes


@pytest.mark.parametrize("surface", ALL, ids=str)
def test_grids_lie_on_their_surface(surface: Any) -> None:
    grid = surface_grid(surface, 20, 15)
    assert grid.shape == (15, 20, 3)
    assert outside(surface, grid.reshape(-1, 3)) == pytest.approx(np.zeros(300), abs=1e-16)
    low, high = grid[..., 2].min(), grid[..., 2].max()
    half = {mw.Sphere: 0.03, mw.Ellipsoid: 0.05, mw.Torus: 0.01, mw.Capsule: 0.06}.get(type(surface), 0.05)
    if surface == mw.Cylinder(0.03):
        half = 0.12
    if not isinstance(surface, mw.Torus):
        assert (low, high) == pytest.approx((-half, half), abs=1e-16)


@pytest.mark.parametrize("surface", ALL, ids=str)
def test_triangles_are_one_sheet_that_faces_outwards(surface: Any) -> None:
    """Every edge belongs to two faces, in opposite directions; cylinders have two rims besides, a pointed cone one."""
    vertices, faces = triangles(surface_grid(surface, 20, 15))
    assert len(np.unique(vertices, axis=0)) == len(vertices)
    edges = Counter((int(a), int(b)) for face in faces for a, b in zip(face, np.roll(face, -1), strict=True))
    assert set(edges.values()) == {1}
    rim = [edge for edge in edges if edge[::-1] not in edges]
    closed = isinstance(surface, mw.Sphere | mw.Ellipsoid | mw.Torus | mw.Capsule)
    tips = isinstance(surface, mw.Cone) and 0.0 in (surface.bottom_radius, surface.top_radius)
    assert len(rim) == (0 if closed else 19 if tips else 38)
    shape = len(vertices) - (len(edges) + len(rim)) / 2 + len(faces)  # Euler's characteristic
    assert shape == (0 if isinstance(surface, mw.Torus) else 2 if closed else 1 if tips else 0)
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    middle = (a + b + c) / 3
    assert (outside(surface, middle + 1e-3 * normal) > outside(surface, middle)).all()


def test_a_cylinder_without_ends_is_as_long_as_asked() -> None:
    for surface in (mw.Cylinder(0.03), mw.EllipticCylinder((0.02, 0.03))):
        assert np.abs(surface_grid(surface, half_length=0.2)[..., 2]).max() == 0.2
        assert np.abs(surface_grid(surface)[..., 2]).max() == pytest.approx(0.12)


def test_surfaces_without_a_grid() -> None:
    class Own(Surface):
        kind = 99

    with pytest.raises(mw.GeometryError, match="Own has no grid"):
        surface_grid(Own())
