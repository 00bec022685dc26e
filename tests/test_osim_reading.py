"""What the reader takes from .osim files: old versions as OpenSim upgrades them, defaults, units, frames and names."""

import dataclasses
import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from osim_frozen import frozen, model_path

from mjwrap.osim.description.forces import Bushing, HuntCrossley, LimitForce, Muscle, OtherForce
from mjwrap.osim.description.model import OsimModel
from mjwrap.osim.description.rotations import body_fixed_xyz
from mjwrap.osim.reading import read_osim

MUSCLES = frozen("muscle_parameters.json")
HEAD = '<OpenSimDocument Version="40000"><Model name="m"><Ground name="ground"/>'
BODY = '<BodySet><objects><Body name="b"><mass>1</mass></Body></objects></BodySet>'
PIN = (
    '<JointSet><objects><PinJoint name="j"><socket_parent_frame>/ground</socket_parent_frame><socket_child_frame>'
    '/bodyset/b</socket_child_frame><coordinates><Coordinate name="q"/></coordinates></PinJoint></objects></JointSet>'
)
OLD_SOCKET = "connector_parent_frame_connectee_name"
END = "</Model></OpenSimDocument>"


def named(model: OsimModel, name: str) -> Any:
    return next(force for force in model.forces if force.name == name)


def read_text(tmp_path, text: str) -> OsimModel:
    (tmp_path / "model.osim").write_text(text, encoding="utf-8")
    return read_osim(tmp_path / "model.osim")


def differences(first: Any, second: Any, place: str = "") -> Iterator[str]:
    """Yield the places at which two descriptions differ by more than the six digits of OpenSim's converter."""
    if dataclasses.is_dataclass(first) and type(first) is type(second):
        for field in dataclasses.fields(first):
            if field.name not in ("version", "notes") and not (place.endswith(("parent", "child"))):
                yield from differences(
                    getattr(first, field.name), getattr(second, field.name), f"{place}.{field.name}"
                )
    elif isinstance(first, np.ndarray):
        if first.shape != second.shape or not np.allclose(first, second, atol=1e-6, rtol=1e-6):
            yield place
    elif isinstance(first, tuple) and isinstance(second, tuple) and len(first) == len(second):
        for i, (one, other) in enumerate(zip(first, second, strict=True)):
            yield from differences(one, other, f"{place}[{i}]")
    elif isinstance(first, dict) and isinstance(second, dict) and first.keys() == second.keys():
        for key in first:
            yield from differences(first[key], second[key], f"{place}[{key}]")
    elif isinstance(first, float):
        assert isinstance(second, float)
        if not math.isclose(first, second, rel_tol=1e-6, abs_tol=1e-6):
            yield place
    elif first != second:
        yield place


def test_a_file_of_version_3_reads_as_opensim_upgrades_it():
    """Bodies, joints, all constraints, forces, contacts, meshes and markers; `<defaults>` included."""
    old = read_osim(model_path("own_version_3.osim"))
    new = read_osim(model_path("upgraded_version_3.osim"))
    assert (old.version, new.version > 40000) == (30000, True)
    assert list(differences(old, new)) == []
    assert len(new.constraints) == 5
    assert len(new.forces) == 10


def test_joint_frames_of_a_file_of_version_3():
    joint = read_osim(model_path("own_version_3.osim")).joints[0]
    assert (joint.parent.body, joint.child.body) == ("ground", "a")
    np.testing.assert_allclose(joint.parent.position, [0.1, 0.2, 0.3])
    np.testing.assert_allclose(joint.parent.rotation, body_fixed_xyz([0.4, 0.5, 0.6]), atol=1e-15)
    np.testing.assert_allclose(joint.child.position, [0.3, 0.2, 0.1])
    np.testing.assert_allclose(joint.child.rotation, body_fixed_xyz([0.1, 0.1, 0.2]), atol=1e-15)


@pytest.mark.parametrize("name", MUSCLES)
def test_muscle_parameters_and_curves_are_those_of_opensim(name):
    model = read_osim(model_path(name))
    for muscle_name, record in MUSCLES[name].items():
        muscle = named(model, muscle_name)
        assert isinstance(muscle, Muscle)
        assert muscle.kind == record["kind"]
        wanted = dict(record["parameters"])
        assert muscle.active == wanted.pop("appliesForce")
        assert muscle.control_range == (wanted.pop("min_control"), wanted.pop("max_control"))
        assert muscle.rigid_tendon == wanted["ignore_tendon_compliance"]
        assert muscle.parameters == wanted
        assert muscle.curves.keys() == record["curves"].keys()
        for kind, values in record["curves"].items():
            assert muscle.curves[kind] == pytest.approx(values, rel=1e-15), kind


def test_defaults_give_the_values_that_an_element_lacks():
    model = read_osim(model_path("own_version_3.osim"))
    muscle = named(model, "m1")
    assert muscle.parameters["max_isometric_force"] == 777.0
    assert muscle.parameters["FmaxTendonStrain"] == 0.05
    assert [wrap.dimensions for wrap in model.wraps if wrap.name == "c"] == [(0.123, 0.3)]
    coordinates = {coordinate.name: coordinate for coordinate in model.coordinates}
    assert coordinates["a1"].clamped
    assert coordinates["a1"].range == (-1.0, 1.0)
    assert coordinates["a2"].range == (-2.0, 2.0)


def test_coordinates_have_their_flags_and_prescribed_motion():
    coordinates = {c.name: c for c in read_osim(model_path("own_version_3.osim")).coordinates}
    assert coordinates["a2"].default == 0.3
    assert coordinates["b2"].locked
    assert coordinates["a3"].prescribed is not None
    assert coordinates["a3"].prescribed(2.0) == 4.0
    assert coordinates["a1"].prescribed is None
    assert [coordinates[name].motion for name in ("a1", "b1", "b2")] == [
        "rotational",
        "coupled",
        "translational",
    ]


def test_limit_forces_of_angles_are_in_radians():
    limit = named(read_osim(model_path("own_version_3.osim")), "clf")
    assert isinstance(limit, LimitForce)
    degree = math.pi / 180.0
    told = dataclasses.astuple(limit)[2:8]
    assert told == pytest.approx(
        (90 * degree, -45 * degree, 2 / degree, 3 / degree, 0.1 / degree, 10 * degree)
    )


def test_a_ligament_without_a_curve_has_opensims(tmp_path):
    path = "".join(
        f'<PathPoint name="{body}"><socket_parent_frame>/{body}</socket_parent_frame></PathPoint>'
        for body in ("ground", "bodyset/b")
    )
    force = (
        f'<ForceSet><objects><Ligament name="l"><GeometryPath><PathPointSet><objects>{path}</objects></PathPointSet>'
        "</GeometryPath><resting_length>0.1</resting_length></Ligament></objects></ForceSet>"
    )
    ligament = named(read_text(tmp_path, HEAD + BODY + PIN + force + END), "l")
    wanted = [-3.2306612054232605e-05, 0.009490495275649737, 0.12, 1.7075513639847175, 2.0043435968913625]
    assert ligament.curve([0.9, 1.05, 1.2, 1.55, 2.0]) == pytest.approx(wanted, abs=1e-14)  # of OpenSim 4.6


def test_a_schutte_muscle_has_opensims_curves_where_it_lists_none():
    muscle = named(read_osim(model_path("own_version_3.osim")), "m2")
    assert muscle.splines["tendon_force_length_curve"](2.0) == 4.0  # of the file
    assert muscle.splines["active_force_length_curve"](1.045) == 0.993333
    assert muscle.splines["passive_force_length_curve"](1.55) == pytest.approx(1.7075513639847175, abs=1e-14)
    assert (muscle.parameters["activation1"], muscle.parameters["time_scale"]) == (7.0, 0.05)


def test_nested_frames_lead_to_their_body():
    model = read_osim(model_path("own_version_4.osim"))
    first = np.array([0.3, 0.2, 0.1]), body_fixed_xyz([-0.1, 0.2, -0.3])
    second = np.array([0.1, 0.2, 0.3]), body_fixed_xyz([0.1, -0.2, 0.3])
    wrap = next(wrap for wrap in model.wraps if wrap.name == "wc")
    rotation = first[1] @ second[1]
    position = first[0] + first[1] @ second[0] + rotation @ [0.4, 0.5, 0.6]
    assert wrap.frame.body == "b"
    np.testing.assert_allclose(wrap.frame.position, position, atol=1e-15)
    np.testing.assert_allclose(wrap.frame.rotation, rotation @ body_fixed_xyz([0.1, 0.2, 0.3]), atol=1e-15)
    assert wrap.quadrant == "+y"
    shapes = {mesh.primitive: mesh.size for mesh in model.bodies[0].meshes}
    assert shapes == {"Brick": (1, 2, 3), "Sphere": (0.3,), "Cylinder": (0.1, 0.7), "Ellipsoid": (1, 2, 3)}
    assert model.bodies[0].meshes[0].opacity == 0.0
    assert any((note.kind, note.name) == ("Cone", "co") for note in model.notes)


def test_wraps_keep_their_range_and_method():
    path = named(read_osim(model_path("own_version_3.osim")), "m1").path
    assert [(wrap.object, wrap.first, wrap.last, wrap.method) for wrap in path.wraps] == [
        ("c", 1, 2, "midpoint"),
        ("s", 0, 3, "hybrid"),
    ]
    moving = path.points[2].moving
    assert moving.coordinates == ("a1", "a1", "")
    assert moving.functions[0](1.0) == 2.0
    assert moving.functions[2](9.0) == 0.4


def test_contacts_bushings_and_what_is_only_named():
    model = read_osim(model_path("own_version_4.osim"))
    bushing, contact = named(model, "bu"), named(model, "ss")
    assert isinstance(bushing, Bushing)
    np.testing.assert_allclose(bushing.second.position, [0.1, 0.1, 0.2])
    assert isinstance(contact, HuntCrossley)
    assert contact.shapes == ("csp", "hs")
    assert (contact.parameters["stiffness"], contact.parameters["hertz_smoothing"]) == (3.0, 300.0)
    assert named(model, "pps") == OtherForce("pps", "PointToPointSpring")
    old = named(read_osim(model_path("own_version_3.osim")), "hc")
    assert old.shapes == ("cs", "chs")
    assert old.by_shape["chs"]["stiffness"] == 1e6


def test_constraints_that_are_switched_off_are_noted():
    model = read_osim(model_path("own_version_4.osim"))
    assert model.constraints == ()
    said = {(note.kind, note.name): note.text for note in model.notes}
    assert "switched off" in said["WeldConstraint", "wc1"]


def test_a_body_without_joint_moves_freely_under_opensims_names(tmp_path):
    model = read_text(tmp_path, HEAD + BODY + END)
    assert [joint.name for joint in model.joints] == ["free_b"]
    assert [c.name for c in model.coordinates] == [f"free_b_coord_{i}" for i in range(6)]
    assert any("moves freely" in note.text for note in model.notes)


def test_coordinates_with_one_name_get_names_of_their_own_and_paths_tell_them_apart(tmp_path):
    second = PIN.replace('"j"', '"k"').replace("/bodyset/b", "/bodyset/c").replace("/ground", "/bodyset/b")
    joints = PIN.replace("</objects></JointSet>", "") + second.replace("<JointSet><objects>", "")
    bodies = BODY.replace("</objects>", '<Body name="c"><mass>1</mass></Body></objects>')
    force = "<ForceSet><objects>" + "".join(
        f'<CoordinateActuator name="f{i}"><coordinate>{path}</coordinate></CoordinateActuator>'
        for i, path in enumerate(("q", "/jointset/j/q", "/jointset/k/q"))
    )
    model = read_text(tmp_path, HEAD + bodies + joints + force + "</objects></ForceSet>" + END)
    assert [c.name for c in model.coordinates] == ["q", "k_q"]
    assert [named(model, name).coordinate for name in ("f0", "f1", "f2")] == ["q", "q", "k_q"]


@pytest.mark.parametrize(
    ("what", "text"),
    [
        ("comments with two hyphens", HEAD + "<!-- a -- b --->" + BODY + PIN + END),
        ("a bare ampersand", HEAD + "<credits>A & B</credits>" + BODY + PIN + END),
        ("blanks before the declaration", '\n <?xml version="1.0"?>' + HEAD + BODY + PIN + END),
        ("the connectors of 4.0's beta", HEAD + BODY + PIN.replace("socket_parent_frame", OLD_SOCKET) + END),
        ("paths from the model's name on", HEAD + BODY + PIN.replace("/bodyset/b", "/m/bodyset/b") + END),
        ("relative paths", HEAD + BODY + PIN.replace("/bodyset/b", "../../bodyset/b") + END),
        ("plain names", HEAD + BODY + PIN.replace("/bodyset/b", "b").replace("/ground", "ground") + END),
    ],
    ids=lambda value: value if len(value) < 40 else "",
)  # fmt: skip
def test_what_opensims_parser_allows(what, text, tmp_path):
    model = read_text(tmp_path, text)
    assert [joint.child.body for joint in model.joints] == ["b"]


def test_files_in_other_encodings(tmp_path):
    text = HEAD + "<credits>Müller</credits>" + BODY + PIN + END
    for encoding in ("latin-1", "utf-8-sig", "utf-16"):
        (tmp_path / "model.osim").write_bytes(text.encode(encoding))
        assert read_osim(tmp_path / "model.osim").credits == "Müller"


def test_sets_of_other_files_are_read_beside_the_model(tmp_path):
    (tmp_path / "markers.xml").write_text(
        '<OpenSimDocument Version="40000"><MarkerSet name="markerset"><objects><Marker name="tip"><socket_parent_frame>'
        "/bodyset/b</socket_parent_frame></Marker></objects></MarkerSet></OpenSimDocument>"
    )
    model = read_text(tmp_path, HEAD + BODY + PIN + '<MarkerSet file="markers.xml"/>' + END)
    assert [(marker.name, marker.frame.body) for marker in model.markers] == [("tip", "b")]
