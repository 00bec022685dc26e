"""Odd .osim models: what is taken as OpenSim takes it, what is left out with a reason, and what is refused by name."""

import gzip

import mujoco
import numpy as np
import pytest

import mjwrap as mw

BODY = '<Body name="{}"><mass>1</mass><inertia>1 1 1 0 0 0</inertia>{}</Body>'
BALL = (
    '<WrapObjectSet><objects><WrapSphere name="ball"><radius>0.05</radius></WrapSphere>'
    '<WrapSphere name="other"><radius>0.02</radius><translation>0.2 0 0</translation></WrapSphere></objects>'
    "</WrapObjectSet>"
)
USED = (
    "<PathWrapSet><objects><PathWrap><wrap_object>ball</wrap_object><range>{0}</range></PathWrap>"
    "<PathWrap><wrap_object>other</wrap_object><range>{0}</range></PathWrap></objects></PathWrapSet>"
)
THELEN = "<Thelen2003Muscle name='m'>{}<{}>{}</{}></Thelen2003Muscle>"


def joint(parent: str, child: str, name: str = "j", coordinate: str = "q", kind: str = "PinJoint") -> str:
    return (
        f'<{kind} name="{name}"><socket_parent_frame>{parent}</socket_parent_frame><socket_child_frame>{child}'
        f'</socket_child_frame><coordinates><Coordinate name="{coordinate}"/></coordinates></{kind}>'
    )


def path(wraps: str = "", middle: str = "") -> str:
    point = '<{0} name="{1}"><socket_parent_frame>{2}</socket_parent_frame><location>{3}</location>{4}</{0}>'
    ends = (
        point.format("PathPoint", "p", "/ground", "-0.2 0.06 0", ""),
        point.format("PathPoint", "r", "/bodyset/a", "0.3 0.06 0", ""),
    )
    return (
        f"<GeometryPath><PathPointSet><objects>{ends[0]}{middle}{ends[1]}</objects></PathPointSet>{wraps}"
        "</GeometryPath>"
    )


def model(
    bodies: str = BODY.format("a", BALL),
    joints: str = joint("/ground", "/bodyset/a"),
    forces: str = "",
    more: str = "",
) -> str:
    return (
        f'<OpenSimDocument Version="40000"><Model name="m"><Ground name="ground"/><BodySet><objects>{bodies}</objects>'
        f"</BodySet><JointSet><objects>{joints}</objects></JointSet><ForceSet><objects>{forces}</objects></ForceSet>{more}"
        "</Model></OpenSimDocument>"
    )


@pytest.fixture
def imported(tmp_path):
    """Return a function that imports a text."""

    def run(text: str) -> mw.Imported:
        file = tmp_path / "model.osim"
        file.write_text(text, encoding="utf-8")
        found = mw.import_osim(file, poses=8)
        assert found.spec.compile().nbody > 1
        return found

    return run


def entries(found: mw.Imported, kind: str) -> list[tuple[str, str]]:
    return [(entry.outcome, entry.text) for entry in found.report.entries if entry.kind == kind]


def test_constraints_of_bodies_whose_joints_lead_to_ground(imported):
    bodies = BODY.format("a", BALL) + BODY.format("b", "")
    joints = joint("/bodyset/a", "/ground") + joint("/bodyset/b", "/bodyset/a", "k", "r")
    point = (
        '<ConstraintSet><objects><PointConstraint name="c"><socket_body_1>/ground</socket_body_1><socket_body_2>'
        "/bodyset/b</socket_body_2></PointConstraint></objects></ConstraintSet>"
    )
    pull = f'<PathActuator name="f">{path(USED.format("-1 -1"))}</PathActuator>'
    found = imported(model(bodies, joints, pull, point))
    assert found.spec.compile().neq == 1


def test_a_joint_that_closes_a_loop_with_ground_as_its_child(imported):
    bodies = BODY.format("a", "") + BODY.format("b", "")
    joints = (
        joint("/ground", "/bodyset/a")
        + joint("/bodyset/a", "/bodyset/b", "k", "r")
        + joint("/bodyset/b", "/ground", "l", "s")
    )
    found = imported(model(bodies, joints))
    assert [outcome for outcome, _ in entries(found, "PinJoint")] == ["exact"]
    compiled = found.spec.compile()
    assert compiled.body_mass.sum() == pytest.approx(2.0, rel=1e-12)  # the copy shares the mass of its body


def test_a_body_a_joint_and_a_coordinate_may_have_one_name(imported):
    text = model(BODY.format("a", ""), joint("/ground", "/bodyset/a", "a", "a"))
    limit = '<CoordinateActuator name="f"><coordinate>a</coordinate></CoordinateActuator>'
    compiled = imported(text.replace("<ForceSet><objects>", f"<ForceSet><objects>{limit}")).spec.compile()
    assert (compiled.body("a").id, compiled.joint("a").id, compiled.nu) == (1, 0, 1)


@pytest.mark.parametrize(
    ("tag", "value", "told"),
    [
        ("pennation_angle_at_optimal", 1000, "pennation_angle must be in"),
        ("KshapeActive", 0, "active_shape must be"),
        ("activation_time_constant", -1, "activation_time must be"),
    ],
)
def test_muscles_whose_law_refuses_their_numbers_are_left_out(imported, tag, value, told):
    found = imported(model(forces=THELEN.format(path(), tag, value, tag)))
    ((outcome, text),) = entries(found, "Thelen2003Muscle")
    assert outcome == "left out"
    assert told in text
    assert not mw.MuscleSystem(found.spec.compile()).names


def test_a_range_without_a_segment_never_acts(imported):
    found = imported(model(forces=f'<PathActuator name="f">{path(USED.format("2 2"))}</PathActuator>'))
    assert entries(found, "PathWrap") == [("left out", "its range has no segment, so it never acts")] * 2


def test_a_path_with_conditional_ends_over_two_surfaces(imported):
    when = "<range>5 6</range><socket_coordinate>/jointset/j/q</socket_coordinate></ConditionalPathPoint>"
    text = path(USED.format("-1 -1"))
    first = text.index("<PathPoint "), text.index("</PathPoint>")
    text = text[: first[0]] + "<Conditional" + text[first[0] + 1 : first[1]] + when + text[first[1] + 12 :]
    found = imported(model(forces=f'<PathActuator name="f">{text}</PathActuator>'))
    assert len(entries(found, "PathWrap")) == 2
    assert entries(found, "note on GeometryPath")[0][0] == "approximated"


def test_what_is_not_read_is_in_the_report(imported):
    more = (
        '<ConstraintSet><objects><GearConstraint name="g"/></objects></ConstraintSet>'
        '<ControllerSet><objects><PrescribedController name="pc"/></objects></ControllerSet>'
    )
    found = imported(model(more=more))
    assert entries(found, "GearConstraint")[0][0] == "left out"
    assert entries(found, "PrescribedController") == [("left out", "mjwrap does not import this class")]


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (("<mass>1<", "<mass>1e31<"), "mass of Body 'a': 1e31 is larger than any number of a model"),
        (("0 0 0<", "1e308 0 0<"), "inertia of Body 'a': 1e308 is larger than any number of a model"),
        (("0.05<", "1e-20<"), "WrapSphere 'ball': its dimensions must lie between 1e-09 and 1e\\+09 m"),
        (('"q"/>', '"q"><range>nan 1</range></Coordinate>'), "must be a number, not nan"),
        (("</Model>", '</Model><Model name="n"/>'), "Model 'n': is a second model"),
    ],
)
def test_refusals_name_the_element(imported, change, told):
    with pytest.raises(mw.OsimError, match=told):
        imported(model().replace(change[0], change[1], 1))


def test_packed_and_empty_files_and_folders_that_are_none(tmp_path):
    file = tmp_path / "model.osim"
    file.write_bytes(gzip.compress(model().encode()))
    with pytest.raises(mw.OsimError, match="is compressed; unpack it first"):
        mw.import_osim(file)
    file.write_bytes(b"\n")
    with pytest.raises(mw.OsimError, match="is empty"):
        mw.import_osim(file)
    file.write_text(model())
    with pytest.raises(mw.OsimError, match=r"meshes: '.*nowhere' is not a folder"):
        mw.import_osim(file, meshes=[tmp_path / "nowhere"])


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
def test_encodings_and_line_ends(tmp_path, encoding):
    plain, other = tmp_path / "plain.osim", tmp_path / "other.osim"
    plain.write_text(model())
    other.write_bytes(model().replace("><", ">\r\n<").encode(encoding))
    assert mw.import_osim(other).xml == mw.import_osim(plain).xml


def test_a_body_called_world(imported):
    compiled = imported(model(BODY.format("world", ""), joint("/ground", "/bodyset/world"))).spec.compile()
    data = mujoco.MjData(compiled)
    mujoco.mj_forward(compiled, data)
    assert compiled.body("world_").id == 1
    assert np.isfinite(data.qacc).all()


# OpenSim 4.6: Schutte1993Muscle_Deprecated with its default curves, max_isometric_force 1000 N, tendon_slack_length
# 0.2 m, pennation 0.2 rad, path length 0.3 m, at equilibrium by computeEquilibrium; optimal fibre length 0.1 m / x:
# x -> tension at activations 0.05 and 1 [share of max_isometric_force].
SCHUTTE = {0.6: (0.0310, 0.5262), 1.0: (0.0681, 0.9812), 1.3: (0.2063, 0.8247), 2.0: (3.2862, 3.3178)}


@pytest.mark.parametrize("stretch", SCHUTTE)
def test_how_far_a_schutte_muscle_is_from_its_law(imported, stretch):
    numbers = {
        "max_isometric_force": 1000,
        "optimal_fiber_length": 0.1 / stretch,
        "tendon_slack_length": 0.2,
        "pennation_angle_at_optimal": 0.2,
    }
    given = "".join(f"<{tag}>{value}</{tag}>" for tag, value in numbers.items())
    line = (
        path().replace("-0.2 0.06 0", "0 0 0").replace("0.3 0.06 0", "0 0 0.3")
    )  # along the hinge: always 0.3 m
    kind = "Schutte1993Muscle_Deprecated"
    found = imported(model(forces=f'<{kind} name="m">{line}{given}</{kind}>'))
    (entry,) = [entry for entry in found.report.entries if entry.kind == kind]
    compiled = found.spec.compile()
    law = mw.MuscleSystem(compiled)["m"].parameters
    ours = [mw.simulate_muscle(law, [0.0], 0.3, activation=a).tension[0] / 1000.0 for a in (0.05, 1.0)]
    size = np.abs(np.array(ours) - SCHUTTE[stretch]).max()
    assert (entry.outcome, entry.unit) == ("approximated", "F_max")
    assert entry.size == pytest.approx(size, abs=1e-4)  # the frozen numbers have four digits
