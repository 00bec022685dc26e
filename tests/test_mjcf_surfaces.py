"""Every wrapping surface that a model can declare: read, planned for the kernels, kept through files, or refused."""

from __future__ import annotations

import math
from typing import Any

import mujoco
import pytest
from declared_models import ARM, EXTENSOR, HILL, MUSCLE, compiled, declared, element

import mjwrap as mw
from mjwrap.kernels import layout
from mjwrap.mjcf import MuscleDeclaration, read_declarations
from mjwrap.model.arrays import build_plan

ORIGIN, INSERTION = element("site", "origin"), element("site", "insertion")
WRAP_GEOMS = "elbow, egg, ulna, ball, palm, wrist"
KEYS = (
    "sphere_size, cylinder_size, ellipsoid_size, elliptic_cylinder_size, torus_size, cone_size, capsule_size"
)
# A box of which MuJoCo leaves the frame as it is: about its centre, and longest along z.
CORNERS = [(x, y, z) for x in (-0.05, 0.05) for y in (-0.1, 0.1) for z in (-0.2, 0.2)]

# A numeric's name and data, and the surface that they declare with its kind and sizes for the kernels.
DECLARED: dict[str, tuple[str, Any, int, list[float], float]] = {
    "sphere": ("sphere_size", mw.Sphere(0.03), layout.SPHERE, [0.03], 0.03),
    "cylinder": ("cylinder_size", mw.Cylinder(0.03), layout.CYLINDER, [0.03], 0.03),
    "short cylinder": ("cylinder_size", mw.Cylinder(0.03, 0.05), layout.CYLINDER, [0.03], 0.03),
    "ellipsoid": (
        "ellipsoid_size", mw.Ellipsoid((0.03, 0.02, 0.05)), layout.ELLIPSOID, [0.03, 0.02, 0.05], 0.02,
    ),
    "elliptic cylinder": (
        "elliptic_cylinder_size", mw.EllipticCylinder((0.03, 0.02)), layout.ELLIPTIC_CYLINDER,
        [0.03, 0.02, math.inf], 0.02,
    ),
    "short elliptic cylinder": (
        "elliptic_cylinder_size", mw.EllipticCylinder((0.02, 0.03), 0.05), layout.ELLIPTIC_CYLINDER,
        [0.02, 0.03, math.inf], 0.02,
    ),
    "torus": ("torus_size", mw.Torus(0.04, 0.01), layout.TORUS, [0.04, 0.01], 0.01),
    "cone": ("cone_size", mw.Cone(0.03, 0.01, 0.05), layout.CONE, [0.02, -0.2], 0.02),
    "capsule": ("capsule_size", mw.Capsule(0.02, 0.05), layout.CAPSULE, [0.02, 0.05], 0.02),
}  # fmt: skip
LIMITS = {"short cylinder": 0.05, "short elliptic cylinder": 0.05, "cone": 0.05}  # how far along z it exists
DATA = {
    "sphere": "0.03",
    "cylinder": "0.03",
    "short cylinder": "0.03 0.05",
    "ellipsoid": "0.03 0.02 0.05",
    "elliptic cylinder": "0.03 0.02",
    "short elliptic cylinder": "0.02 0.03 0.05",
    "torus": "0.04 0.01",
    "cone": "0.03 0.01 0.05",
    "capsule": "0.02 0.05",
}


def numeric(name: str, data: str) -> str:
    return f'<numeric name="{name}" data="{data}"/>'


def custom(*route: str, made: str = "") -> str:
    """The contents of <custom> for a rope along a route."""
    return made + declared([ORIGIN, *route, INSERTION], {"optimal_force": 10.0}, muscle="rope")


def only(model: mujoco.MjModel) -> MuscleDeclaration:
    (muscle,) = read_declarations(model).muscles
    return muscle


def rope(*route: str, made: str = "") -> MuscleDeclaration:
    return only(compiled(tendon="", actuator="", custom=custom(*route, made=made)))


def refused(*route: str, made: str = "") -> str:
    model = compiled(tendon="", actuator="", custom=custom(*route, made=made))
    with pytest.raises(mw.ModelError) as caught:
        read_declarations(model)
    return str(caught.value)


# --------------------------------------------------------------------------------------- geoms

GEOMS = {
    "elbow": mw.Cylinder(0.025),
    "ball": mw.Sphere(0.015),
    "egg": mw.Ellipsoid((0.01, 0.02, 0.01)),
    "ulna": mw.Capsule(0.015, 0.1),
}


@pytest.mark.parametrize("geom", GEOMS)
def test_geoms_that_are_surfaces_as_they_stand(geom: str) -> None:
    """MuJoCo's own sizes; a cylinder has no ends, as in MuJoCo."""
    muscle = rope(element("geom", geom))
    assert muscle.surfaces == [GEOMS[geom]]
    assert len(muscle.geoms) == 1


def test_a_marked_cylinder_is_as_long_as_it_is_drawn() -> None:
    assert rope(element("geom", "elbow", 0)).surfaces == [mw.Cylinder(0.025)]
    assert rope(element("geom", "elbow", 1)).surfaces == [mw.Cylinder(0.025, 0.04)]


def test_native_tendons_have_cylinders_without_ends_and_spheres() -> None:
    assert only(compiled()).surfaces == [mw.Cylinder(0.025), mw.Sphere(0.015)]
    by_tuple = compiled(custom=declared([element("actuator", "extensor")], HILL))
    assert only(by_tuple).surfaces == [mw.Cylinder(0.025), mw.Sphere(0.015)]


# ------------------------------------------------------------------------------------- numerics


@pytest.mark.parametrize("geom", ["crate", "ball", "ulna"])
@pytest.mark.parametrize("case", DECLARED)
def test_a_numeric_gives_the_geom_before_it_another_shape(case: str, geom: str) -> None:
    """Whatever that geom is, and before or after its hint."""
    key, surface, *_ = DECLARED[case]
    made, sizes = numeric(f"mjwrap_a_{key}", DATA[case]), element("numeric", f"mjwrap_a_{key}")
    hint = element("site", "elbow_side", 1)
    for route in ([sizes], [sizes, hint], [hint, sizes]):
        muscle = rope(element("geom", geom), *route, made=made)
        assert muscle.surfaces == [surface]
        (node,) = muscle.routes[0].nodes
        assert (node.hint_site >= 0) == (hint in route)


@pytest.mark.parametrize("case", DECLARED)
def test_the_plan_has_the_kernels_kind_and_sizes(case: str) -> None:
    key, _, kind, dims, size = DECLARED[case]
    model = compiled(
        tendon="",
        actuator="",
        custom=custom(
            element("geom", "crate"), element("numeric", f"a_{key}"), element("site", "elbow_side", 1),
            element("site", "via"),
            made=numeric(f"a_{key}", DATA[case]),
        ),
    )  # fmt: skip
    plan = build_plan(model, read_declarations(model).muscles)
    *rows, via = plan.node
    row = rows[0]
    assert row[layout.KIND] == kind
    assert row[layout.DIM : layout.DIM + len(dims)] == pytest.approx(dims, rel=1e-15)
    assert row[layout.SIZE] == size
    assert row[layout.Z_LIMIT] == LIMITS.get(case, math.inf)
    assert row[layout.S_MODE] == via[layout.S_MODE] == layout.COLD
    assert via[layout.KIND] == layout.VIA
    assert plan.links[0, 1] == model.geom("crate").id
    assert plan.links[-1, 0] == model.site("via").id
    assert [other[layout.TOUCH] for other in rows] == ([0.0, 1.0] if case == "torus" else [0.0])
    hints = plan.links[:, 2].tolist()
    assert hints == [model.site("elbow_side").id] + [-1] * len(rows)  # of the first row only
    for other in rows:
        assert (other[: layout.TOUCH] == row[: layout.TOUCH]).all()


def test_plans_of_native_muscles_are_as_before() -> None:
    model = compiled()
    plan = build_plan(model, read_declarations(model).muscles)
    kinds = [layout.CYLINDER, layout.VIA, layout.VIA, layout.SPHERE]
    assert plan.node[:, layout.KIND].tolist() == kinds
    assert plan.node[0, layout.DIM : layout.SIZE + 1].tolist() == [0.025, 0, 0, 0, 0.025]
    assert plan.node[0, layout.Z_LIMIT] == math.inf
    assert plan.node[3, [layout.DIM, layout.SIZE]].tolist() == [0.015, 0.015]


def test_one_numeric_serves_many_geoms_and_one_geom_many_shapes() -> None:
    made = numeric("a_torus_size", "0.04 0.01") + numeric("b_cone_size", "0.03 0.01 0.05")
    torus, cone = element("numeric", "a_torus_size"), element("numeric", "b_cone_size")
    crate, ball = element("geom", "crate"), element("geom", "ball")
    muscle = rope(crate, torus, ball, torus, crate, cone, ball, made=made)
    assert muscle.surfaces == [mw.Torus(0.04, 0.01)] * 2 + [mw.Cone(0.03, 0.01, 0.05), mw.Sphere(0.015)]


def test_a_mesh_that_stays_where_it_was_may_carry_a_surface() -> None:
    """Its frame is the file's when it is centred and its principal axes are x, y, z already."""
    muscle = only(with_mesh(CORNERS, element("numeric", "a_torus_size")))
    assert muscle.surfaces == [mw.Torus(0.04, 0.01)]


def with_mesh(corners: list[tuple[float, ...]], *after: str) -> mujoco.MjModel:
    """A rope over a mesh geom, with the elements that follow it."""
    vertices = " ".join(str(x) for corner in corners for x in corner)
    xml = f"""
<mujoco>
  <asset><mesh name="bone" vertex="{vertices}"/></asset>
  <worldbody>
    <site name="origin"/> <site name="insertion" pos="1 0 0"/>
    <geom name="bone" type="mesh" mesh="bone"/> <geom name="ball" size=".1"/>
  </worldbody>
  <custom>{custom(element("geom", "bone"), *after, made=numeric("a_torus_size", "0.04 0.01"))}</custom>
</mujoco>"""
    return mujoco.MjModel.from_xml_string(xml)


# ------------------------------------------------------------------------------ through files


def everything() -> str:
    """The contents of <custom> for a muscle over every surface."""
    made, route = "", []
    for k, (case, (key, *_)) in enumerate(DECLARED.items()):
        made += numeric(f"mjwrap_{k}_{key}", DATA[case])
        route += [element("geom", "crate"), element("numeric", f"mjwrap_{k}_{key}")]
    return custom(*route, element("geom", "egg"), element("geom", "elbow", 1), made=made)


ALL = [surface for _, surface, *_ in DECLARED.values()] + [
    mw.Ellipsoid((0.01, 0.02, 0.01)),
    mw.Cylinder(0.025, 0.04),
]


def test_surfaces_survive_saving() -> None:
    model = compiled(tendon="", actuator="", custom=everything())
    assert only(model).surfaces == ALL
    spec = mujoco.MjSpec.from_string(ARM.format(tendon="", actuator="", custom=everything(), option=""))
    spec.compile()
    assert only(mujoco.MjModel.from_xml_string(spec.to_xml())).surfaces == ALL


@pytest.mark.parametrize("affixes", [("left_", ""), ("torus_", "_cone"), ("", "_max_isometric")])
@pytest.mark.filterwarnings("ignore:Attaching a spec with an empty prefix:UserWarning")
def test_surfaces_survive_attaching(affixes: tuple[str, str], tmp_path: Any, monkeypatch: Any) -> None:
    """Under prefixes and suffixes that are words of this field too."""
    monkeypatch.chdir(tmp_path)  # MuJoCo logs its warnings into the working folder
    prefix, suffix = affixes
    parent = mujoco.MjSpec()
    child = mujoco.MjSpec.from_string(
        ARM.format(tendon=EXTENSOR, actuator=MUSCLE, custom=everything(), option="")
    )
    parent.attach(child, prefix=prefix, suffix=suffix, frame=parent.worldbody.add_frame())
    native, free = read_declarations(parent.compile()).muscles
    assert native.surfaces == [mw.Cylinder(0.025), mw.Sphere(0.015)]
    assert free.surfaces == ALL


# ------------------------------------------------------------------------------------- refusals

TORUS = numeric("a_torus_size", "0.04 0.01")
CASES = {
    "no surface": ([element("geom", "crate")], ["geom 'crate' is of type box", WRAP_GEOMS, KEYS]),
    "after a site": (
        [element("site", "via"), element("numeric", "a_torus_size")],
        ["numeric 'a_torus_size' declares a surface and must directly follow a geom, not site 'via'", WRAP_GEOMS],
    ),
    "two shapes": (
        [element("geom", "ball"), element("numeric", "a_torus_size"), element("numeric", "a_torus_size")],
        ["numeric 'a_torus_size'", "not geom 'ball' with sizes"],
    ),
    "two shapes and a hint": (
        [
            element("geom", "ball"), element("site", "via", 1), element("numeric", "a_torus_size"),
            element("numeric", "a_torus_size"),
        ],
        ["not geom 'ball' with a hint and sizes"],
    ),
    "a finite sphere": ([element("geom", "ball", 1)], ["geom 'ball' has prm=1", "this one is sphere"]),
    "a finite torus": (
        [element("geom", "elbow", 1), element("numeric", "a_torus_size")],
        ["geom 'elbow' has prm=1", "declared by a numeric"],
    ),
    "strange prm": ([element("geom", "elbow", 3)], ["geom 'elbow' has prm=3", "1 a cylinder as long as it is drawn"]),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_routes_without_sense(case: str) -> None:
    route, parts = CASES[case]
    text = refused(*route, made=TORUS)
    assert "rope'" in text
    for part in parts:
        assert part in text


def test_a_shape_at_the_head_of_a_tuple() -> None:
    made = TORUS + declared(
        [element("numeric", "a_torus_size"), ORIGIN, INSERTION], {"optimal_force": 1.0}, muscle="rope"
    )
    model = compiled(tendon="", actuator="", custom=made)
    with pytest.raises(mw.ModelError, match="must directly follow a geom, not nothing"):
        read_declarations(model)


VALUES = {
    "sphere_size": ("0.1 0.2", "must have 1 value [m], radius, not 2"),
    "cylinder_size": ("1 2 3", "must have 1 to 2 values [m], radius half_length, not 3"),
    "ellipsoid_size": ("0.1 0.2", "must have 3 values [m], radius_x radius_y radius_z, not 2"),
    "elliptic_cylinder_size": ("0.1", "must have 2 to 3 values [m], radius_x radius_y half_length, not 1"),
    "torus_size": ("0.1", "must have 2 values [m], major_radius minor_radius, not 1"),
    "cone_size": ("0.1 0.2", "must have 3 values [m], bottom_radius top_radius half_length, not 2"),
    "capsule_size": ("0.1 0.2 0.3", "must have 2 values [m], radius half_length, not 3"),
}


@pytest.mark.parametrize("key", VALUES)
def test_numbers_of_values(key: str) -> None:
    data, wanted = VALUES[key]
    text = refused(element("geom", "crate"), element("numeric", f"b_{key}"), made=numeric(f"b_{key}", data))
    assert f"muscle 'rope': numeric 'b_{key}' {wanted}" in text


SENSELESS = {
    "torus": ("torus_size", "0.01 0.04", "Torus: minor_radius must be smaller than major_radius"),
    "cone": ("cone_size", "0.02 0.02 0.1", "Cone: radii 0.02 and 0.02"),
    "ellipsoid": (
        "ellipsoid_size",
        "0.02 0 0.1",
        "Ellipsoid: radii must be finite and positive [m], not 0.0",
    ),
    "negative": ("sphere_size", "-1", "Sphere: radius must be finite and positive [m], not -1.0"),
}


@pytest.mark.parametrize("case", SENSELESS)
def test_sizes_without_sense(case: str) -> None:
    key, data, wanted = SENSELESS[case]
    text = refused(element("geom", "crate"), element("numeric", f"b_{key}"), made=numeric(f"b_{key}", data))
    assert f"muscle 'rope': geom 'crate', numeric 'b_{key}': {wanted}" in text


@pytest.mark.parametrize("name", ["a_torus_size_cone_size", "torus_size_optimal_force"])
def test_names_that_say_two_things(name: str) -> None:
    text = refused(element("geom", "crate"), element("numeric", name), made=numeric(name, "1"))
    assert (
        f"tuple 'mjwrap_rope': numeric '{name}' must contain only one of these in its name: torus_size, "
        in text
    )


def test_unknown_numerics_list_shapes_too() -> None:
    text = refused(element("geom", "ball"), element("numeric", "a_ring"), made=numeric("a_ring", "1"))
    assert "numeric 'a_ring' must contain exactly one of these in its name: max_isometric_force" in text
    assert KEYS in text


@pytest.mark.parametrize("geom", ["egg", "ulna"])
@pytest.mark.parametrize("size", [0.0, -0.01, math.nan, math.inf])
def test_geoms_whose_size_was_changed_in_memory(geom: str, size: float) -> None:
    model = compiled(tendon="", actuator="", custom=custom(element("geom", geom)))
    model.geom(geom).size[1] = size
    with pytest.raises(
        mw.ModelError, match=rf"muscle 'rope': geom '{geom}': \w+: .*must be finite and positive"
    ):
        read_declarations(model)


def test_a_mesh_is_not_smooth() -> None:
    with pytest.raises(mw.ModelError) as caught:
        read_declarations(with_mesh(CORNERS))
    text = str(caught.value)
    assert "geom 'bone' is of type mesh" in text
    assert "mjwrap.fit_ellipsoid(mjwrap.mesh_points(model, 'bone'))" in text
    assert "geoms to wrap: ball" in text


MOVED = {
    "off its centre": [(x + 0.01, y, z) for x, y, z in CORNERS],
    "axes in another order": [(z, y, x) for x, y, z in CORNERS],
}


@pytest.mark.parametrize("how", MOVED)
def test_a_mesh_whose_frame_was_moved_carries_no_surface(how: str) -> None:
    """The compiled frame is not the file's, and a surface in it would stand elsewhere than written."""
    with pytest.raises(mw.ModelError) as caught:
        read_declarations(with_mesh(MOVED[how], element("numeric", "a_torus_size")))
    assert "geom 'bone' is a mesh whose frame MuJoCo has moved" in str(caught.value)
    assert "'a_torus_size' would not be where the file says" in str(caught.value)
