"""A damaged .osim file is read, or refused with an OsimError that names file, line and element; nothing else."""

import numpy as np
import pytest
from osim_frozen import DATA, PUBLIC
from osim_mutants import mutant

import mjwrap as mw
from mjwrap.osim.description.model import OsimModel
from mjwrap.osim.kinematics import body_poses, complete
from mjwrap.osim.reading import read_osim

MUTANTS = 40  # of each model
SOURCES = [
    *(DATA / name for name in ("own_joints.osim", "own_version_3.osim", "own_version_4.osim")),
    *(PUBLIC / name for name in ("arm26.osim", "leg6dof9musc.osim", "PathOnConstrainedBodyMomentArmTest.osim",
                                 "Tug_of_War_Millard.osim", "knee_patella_ligament.osim", "test_wrapAllVis.osim")),
]  # fmt: skip


@pytest.mark.parametrize("source", SOURCES, ids=lambda path: path.name)
def test_mutants_are_read_or_refused_by_name(source, tmp_path):
    if not source.exists():
        pytest.skip(f"the public model {source.name} is not in {PUBLIC}")
    text = source.read_text(encoding="utf-8")
    rng = np.random.default_rng(len(source.name))
    outcomes = {"read": 0, "refused": 0}
    path = tmp_path / "mutant.osim"
    for _ in range(MUTANTS):
        path.write_text(mutant(text, rng), encoding="utf-8")
        told = ""
        try:
            model = read_osim(path)
            assert isinstance(model, OsimModel)
            poses = body_poses(model, complete(model))
            assert set(poses) == {"ground", *(body.name for body in model.bodies)}
        except mw.OsimError as error:
            told = str(error)
        assert not told or "mutant.osim" in told or "couplers form a loop" in told
        outcomes["refused" if told else "read"] += 1
    assert outcomes["read"] > 3
    assert outcomes["refused"] > 3


GROUND = '<Ground name="ground"/>'
BODY = '<Body name="b"><mass>1</mass></Body>'
PIN = (
    '<PinJoint name="j"><socket_parent_frame>/ground</socket_parent_frame><socket_child_frame>/bodyset/b'
    '</socket_child_frame><coordinates><Coordinate name="q"/></coordinates></PinJoint>'
)
POINTS = (
    '<GeometryPath><PathPointSet><objects><PathPoint name="p"><socket_parent_frame>/ground</socket_parent_frame>'
    '</PathPoint><PathPoint name="r"><socket_parent_frame>/bodyset/b</socket_parent_frame></PathPoint></objects>'
    "</PathPointSet>{wraps}</GeometryPath>"
)
DOTS = POINTS.format(wraps="").replace("<PathPoint ", "<Dot ").replace("</PathPoint>", "</Dot>")


def document(body: str = BODY, joints: str = PIN, more: str = "", version: str = "40000") -> str:
    return (
        f'<OpenSimDocument Version="{version}">\n<Model name="m">{GROUND}\n'
        f"<BodySet><objects>{body}</objects></BodySet>\n"
        f"<JointSet><objects>{joints}</objects></JointSet>\n{more}</Model></OpenSimDocument>"
    )


def forces(inner: str) -> str:
    return document(more=f"<ForceSet><objects>{inner}</objects></ForceSet>")


def frame(name: str, parent: str) -> str:
    return f'<PhysicalOffsetFrame name="{name}"><socket_parent>{parent}</socket_parent></PhysicalOffsetFrame>'


LAUGHS = '<!DOCTYPE x [<!ENTITY a "lol"><!ENTITY b "&a;&a;&a;">]>' + document().replace("m<", "&b;<")

REFUSED = {
    "empty": ("", "is empty"),
    "no XML": ("solid cube", "is not well-formed XML"),
    "cut": (document()[:-30], "is not well-formed XML: .*; the file may be cut off or damaged"),
    "another root": ("<mujoco/>", "is not an OpenSim file: its root is <mujoco>"),
    "no version": ("<OpenSimDocument/>", "has no version number"),
    "too old": (document(version="10903"), "has document version 10903, older than OpenSim 2.0"),
    "no model": ('<OpenSimDocument Version="40000"/>', "has no <Model>"),
    "entities": (LAUGHS, "line 1: has a <!DOCTYPE>, which may define entities"),
    "unknown entity": (document().replace("<mass>1", "<mass>&one;"), "'&one;' is not a number"),
    "deep": ("<OpenSimDocument>" + "<a>" * 100_000, "lies inside 60 other elements"),
    "mass": (document(BODY.replace("1", "heavy")), r"line 3: mass of Body 'b': 'heavy' is not a number"),
    "no mass": (document('<Body name="b"/>'), "Body 'b': <mass> is missing"),
    "negative mass": (document(BODY.replace("1", "-1")), "Body 'b': its mass must not be negative, not -1"),
    "count": (
        document('<Body name="b"><mass>1</mass><inertia>1 1 1</inertia></Body>'),
        "inertia of Body 'b': must be 6 numbers, not 3",
    ),
    "two bodies": (document(BODY + BODY), "another body has the same name"),
    "body class": (document("<Blob name='b'/>"), "bodies of class Blob cannot be read"),
    "joint class": (
        document(joints=PIN.replace("PinJoint", "HelixJoint")),
        "joints of class HelixJoint cannot be read; classes",
    ),
    "joint to itself": (
        document(joints=PIN.replace("/ground", "/bodyset/b")),
        "PinJoint 'j': both its frames are on 'b'",
    ),
    "coordinate count": (
        document(joints=PIN.replace('<Coordinate name="q"/>', "")),
        "PinJoint 'j': has 0 coordinates; a PinJoint has 1",
    ),
    "unknown frame": (
        document(joints=PIN.replace("/bodyset/b", "/bodyset/c")),
        "PinJoint 'j': frame '/bodyset/c' does not exist; there are: b",
    ),
    "no socket": (
        document(joints=PIN.replace("socket_parent_frame", "socket_parent")),
        "PinJoint 'j': <socket_parent_frame> is missing or empty",
    ),
    "circle of bodies": (
        document(
            BODY + BODY.replace('"b"', '"c"'),
            PIN.replace("/ground", "/bodyset/c")
            + PIN.replace("/bodyset/b", "/bodyset/c")
            .replace("/ground", "/bodyset/b")
            .replace('"j"', '"k"')
            .replace('"q"', '"r"'),
        ),
        "bodies form a loop: b, c; join one of them to ground",
    ),
    "circle of frames": (
        document(more=f"<components>{frame('x', '/y')}{frame('y', '/x')}</components>").replace(
            "/bodyset/b", "/x"
        ),
        "PhysicalOffsetFrame 'x': frames form a loop: 'x' on 'y' on 'x'",
    ),
    "frame on itself": (
        document(more=f"<components>{frame('x', '/x')}</components>").replace("/bodyset/b", "/x"),
        "frames form a loop: 'x' on 'x'",
    ),
    "range": (
        document(joints=PIN.replace('"q"/>', '"q"><range>1 -1</range></Coordinate>')),
        "Coordinate 'q': its range ends at -1, below its start 1",
    ),
    "flag": (
        document(joints=PIN.replace('"q"/>', '"q"><locked>maybe</locked></Coordinate>')),
        "locked of Coordinate 'q': must be true or false, not 'maybe'",
    ),
    "no path": (forces('<PathSpring name="s"/>'), "PathSpring 's': has no path"),
    "one point": (
        forces('<PathActuator name="s"><GeometryPath/></PathActuator>'),
        "GeometryPath of PathActuator 's': has 0 points; a path needs two",
    ),
    "unknown wrap": (
        forces(
            '<PathActuator name="s">'
            + POINTS.format(
                wraps='<PathWrapSet><objects><PathWrap name="w"><wrap_object>bone</wrap_object></PathWrap>'
                "</objects></PathWrapSet>"
            )
            + "</PathActuator>"
        ),
        "PathWrap 'w': wrap object 'bone' does not exist; there are: none",
    ),
    "point class": (
        forces('<PathActuator name="s">' + DOTS + "</PathActuator>"),
        "Dot 'p': path points of class Dot cannot be read",
    ),
    "unknown coordinate": (
        forces('<CoordinateActuator name="a"><coordinate>knee</coordinate></CoordinateActuator>'),
        "CoordinateActuator 'a': coordinate 'knee' does not exist; there are: q",
    ),
    "muscle": (
        forces(
            f'<Thelen2003Muscle name="m">{POINTS.format(wraps="")}'
            "<optimal_fiber_length>0</optimal_fiber_length></Thelen2003Muscle>"
        ),
        "Thelen2003Muscle 'm': optimal_fiber_length must be positive, not 0",
    ),
    "half a curve": (
        forces(
            f'<Millard2012EquilibriumMuscle name="m">{POINTS.format(wraps="")}'
            "<TendonForceLengthCurve><curviness>0.5</curviness></TendonForceLengthCurve></Millard2012EquilibriumMuscle>"
        ),
        "gives curviness only; stiffness_at_one_norm_force, norm_force_at_toe_end, curviness must be given all or none",
    ),
    "contact": (
        forces(
            '<HuntCrossleyForce name="h"><HuntCrossleyForce::ContactParametersSet><objects>'
            "<HuntCrossleyForce::ContactParameters><geometry>ball</geometry></HuntCrossleyForce::ContactParameters>"
            "</objects></HuntCrossleyForce::ContactParametersSet></HuntCrossleyForce>"
        ),
        "HuntCrossleyForce 'h': contact geometry 'ball' does not exist; there are: none",
    ),
    "set of a file": (
        document(more='<MarkerSet file="markers.xml"/>'),
        "its file .*markers.xml cannot be read: No such file",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_errors_name_file_element_and_remedy(case, tmp_path):
    text, told = REFUSED[case]
    path = tmp_path / "model.osim"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(mw.OsimError, match=told) as caught:
        read_osim(path)
    assert str(path) in str(caught.value)


def test_files_that_are_not_there_or_not_text(tmp_path):
    with pytest.raises(mw.OsimError, match="cannot be read: No such file"):
        read_osim(tmp_path / "absent.osim")
    with pytest.raises(mw.OsimError, match="cannot be read: Is a directory"):
        read_osim(tmp_path)
    (tmp_path / "noise.osim").write_bytes(np.random.default_rng(0).bytes(5000))
    with pytest.raises(mw.OsimError, match="is not well-formed XML"):
        read_osim(tmp_path / "noise.osim")
