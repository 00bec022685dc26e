"""Poses, places and lengths of OpenSim models are those of OpenSim 4.6, frozen by benchmarks/osim/freeze_poses.py."""

import numpy as np
import pytest
from osim_frozen import frozen, model_path

import mjwrap as mw
from mjwrap.osim.description.bodies import Coupler
from mjwrap.osim.description.forces import Ligament, Muscle, PathActuator, PathSpring
from mjwrap.osim.description.functions import linear
from mjwrap.osim.kinematics import body_poses, complete, frame_pose, joint_motion, path_length, path_points
from mjwrap.osim.reading import read_osim

RECORDS = frozen("poses.json")
PULLING = (Muscle, Ligament, PathSpring, PathActuator)
TOLERANCE = 1e-12  # [m or 1]; chains of a dozen bodies reach 1e-14


def numbers(pose) -> list[float]:
    return [*pose.position, *pose.rotation.ravel()]


@pytest.mark.parametrize("name", RECORDS)
def test_poses_and_places(name):
    model = read_osim(model_path(name))
    for record in RECORDS[name]:
        values = complete(model, record["values"])
        assert values == pytest.approx(record["values"], abs=TOLERANCE)
        poses = body_poses(model, values)
        assert set(poses) == {"ground", *record["bodies"]}
        for body, wanted in record["bodies"].items():
            np.testing.assert_allclose(numbers(poses[body]), wanted, atol=TOLERANCE, rtol=0, err_msg=body)
        assert {wrap.name for wrap in model.wraps} == set(record["wraps"])
        for wrap in model.wraps:
            placed = frame_pose(poses, wrap.frame)
            np.testing.assert_allclose(
                numbers(placed), record["wraps"][wrap.name], atol=TOLERANCE, rtol=0, err_msg=wrap.name
            )
        assert {marker.name for marker in model.markers} == set(record["markers"])
        for marker in model.markers:
            placed = frame_pose(poses, marker.frame)
            np.testing.assert_allclose(
                placed.position, record["markers"][marker.name], atol=TOLERANCE, rtol=0
            )


@pytest.mark.parametrize("name", [name for name, records in RECORDS.items() if records[0]["lengths"]])
def test_lengths_without_wrap_objects(name):
    model = read_osim(model_path(name))
    paths = {force.name: force.path for force in model.forces if isinstance(force, PULLING)}
    for record in RECORDS[name]:
        values = complete(model, record["values"])
        poses = body_poses(model, values)
        for force, length in record["lengths"].items():
            if force in paths:
                assert path_length(paths[force], poses, values) == pytest.approx(length, abs=TOLERANCE), force


def test_conditional_points_belong_at_both_ends_of_their_range():
    model = read_osim(model_path("own_version_3.osim"))
    path = next(force.path for force in model.forces if isinstance(force, Muscle) and force.name == "m1")
    condition = path.points[1].condition
    assert condition is not None
    low, high = condition.range[0] - 1e-5, condition.range[1] + 1e-5  # OpenSim 4.6 has this tolerance
    counts = []
    for angle in (np.nextafter(low, -9.0), low, high, np.nextafter(high, 9.0)):
        values = complete(model, {"a1": angle})
        counts.append(len(path_points(path, body_poses(model, values), values)))
    assert counts == [3, 4, 4, 3]


def test_origin_of_an_ellipsoid_joint_stays_on_its_ellipsoid():
    joint = next(j for j in read_osim(model_path("own_joints.osim")).joints if j.kind == "EllipsoidJoint")
    assert joint.radii is not None
    rng = np.random.default_rng(0)
    for _ in range(50):
        motion = joint_motion(joint, {c.name: rng.uniform(-3.0, 3.0) for c in joint.coordinates})
        assert np.sum((motion.position / joint.radii) ** 2) == pytest.approx(1.0, abs=1e-13)


def test_couplers_give_way_to_no_value_and_form_no_loop():
    model = read_osim(model_path("own_version_3.osim"))
    values = complete(model, {"a1": 0.5, "d1": 7.0})
    assert values["d1"] == pytest.approx(1.5 * (2.0 * 0.5 + 0.1), abs=1e-15)
    with pytest.raises(mw.OsimError, match="coordinate 'a9' does not exist; coordinates: a1, a2"):
        complete(model, {"a9": 0.5})
    back = Coupler("back", "a1", ("d1",), linear(1.0))
    looped = type(model)(**{**vars(model), "constraints": (*model.constraints, back)})
    with pytest.raises(mw.OsimError, match="couplers form a loop: d1, a1"):
        complete(looped)


LOOP = """<OpenSimDocument Version="40000"><Model name="square"><Ground name="ground"/><BodySet><objects>
<Body name="a"><mass>1</mass></Body><Body name="b"><mass>1</mass></Body></objects></BodySet><JointSet><objects>
<PinJoint name="first"><coordinates><Coordinate name="p"/></coordinates>
<socket_parent_frame>/ground</socket_parent_frame><socket_child_frame>/bodyset/a</socket_child_frame></PinJoint>
<PinJoint name="back"><coordinates><Coordinate name="q"/></coordinates>
<socket_parent_frame>/bodyset/b</socket_parent_frame><socket_child_frame>tip</socket_child_frame>
<frames><PhysicalOffsetFrame name="tip"><socket_parent>/bodyset/a</socket_parent><translation>1 0 0</translation>
</PhysicalOffsetFrame></frames></PinJoint>
<PinJoint name="closing"><coordinates><Coordinate name="r"/></coordinates>
<socket_parent_frame>/ground</socket_parent_frame><socket_child_frame>/bodyset/b</socket_child_frame></PinJoint>
</objects></JointSet></Model></OpenSimDocument>"""


def test_a_joint_towards_ground_is_followed_backwards_and_one_that_closes_a_loop_is_left_open(tmp_path):
    """Closed form: a turns by p about ground's z, b by -q about the tip of a, 1 m along a's x."""
    (tmp_path / "loop.osim").write_text(LOOP)
    model = read_osim(tmp_path / "loop.osim")
    values = complete(model, {"p": 0.3, "q": 0.5, "r": 0.7})
    placed_from_ground = body_poses(model, values)["b"]
    np.testing.assert_allclose(placed_from_ground.rotation[:2, 0], [np.cos(0.7), np.sin(0.7)], atol=1e-15)
    chain = type(model)(**{**vars(model), "joints": model.joints[:2]})
    pose = body_poses(chain, values)["b"]
    np.testing.assert_allclose(pose.position, [np.cos(0.3), np.sin(0.3), 0.0], atol=1e-15)
    np.testing.assert_allclose(pose.rotation[:2, 0], [np.cos(-0.2), np.sin(-0.2)], atol=1e-15)
