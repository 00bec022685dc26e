"""Comparing with MuJoCo's tendons: equal where both are right, and planted faults found and put to the right side."""

import re
from collections.abc import Callable

import mujoco
import numpy as np
import pytest
from cli_runs import CASE2, ELBOW
from myo_models import load_myo

import mjwrap as mw
from mjwrap.checking import check_model
from mjwrap.comparison import (
    Outcome,
    PoseComparison,
    compare_motion,
    compare_poses,
    verdict,
    with_native_laws,
)
from mjwrap.comparison.paired_evaluation import Comparer
from mjwrap.comparison.tendons import WrapRecord, tendon_spans
from mjwrap.mjcf.side_rules import running_side_rule
from mjwrap.poses.continuity import Smallest, refine_jump
from mjwrap.poses.joint_sweeps import PoseMaker
from mjwrap.system import MuscleSystem

BALL = """
<mujoco>
  <worldbody>
    <geom name="ball" type="sphere" size=".03" contype="0" conaffinity="0"/>
    <site name="side" pos="0 0 .05"/>
    <site name="a" pos="-.1 0 .01"/>
    <body><joint name="slide" type="slide" axis="0 0 1" range="-.08 .08" limited="true"/>
      <geom size=".005" mass="1" contype="0" conaffinity="0"/><site name="b" pos=".1 .002 0"/></body>
  </worldbody>
  <tendon><spatial name="t"><site site="a"/><geom geom="ball" {side}/><site site="b"/></spatial></tendon>
  <actuator><muscle name="m" tendon="t" lengthrange=".1 .3"/></actuator>
</mujoco>
"""
ROUTE = """
<mujoco>
  <worldbody>
    <geom name="round" type="cylinder" size=".02 .1" contype="0" conaffinity="0"/>
    <geom name="ball" type="sphere" size=".02" pos=".3 0 .01" contype="0" conaffinity="0"/>
    <site name="a" pos="-.1 0 0"/><site name="b" pos=".1 .001 .03"/><site name="c" pos=".2 0 0"/>
    <body pos=".4 0 0"><joint name="h" axis="0 0 1" range="-.3 .3" limited="true"/>
      <geom size=".01" pos=".1 0 0" mass="1" contype="0" conaffinity="0"/>
      <site name="d" pos="0 .02 0"/><site name="e" pos=".1 .03 .02"/></body>
  </worldbody>
  <tendon>
    <spatial name="t">
      <site site="a"/><geom geom="round"/><site site="b"/><site site="c"/>
      <pulley divisor="2"/>
      <site site="c"/><geom geom="ball"/><site site="d"/>
      <pulley divisor="3"/>
      <site site="d"/><site site="e"/>
    </spatial>
  </tendon>
  <actuator><muscle name="m" tendon="t" lengthrange=".1 .9"/></actuator>
</mujoco>
"""
COUPLED = """
<mujoco>
  <worldbody>
    <site name="a" pos="0 0 .1"/>
    <body><joint name="leader" axis="0 1 0" range="-1 1" limited="true"/><geom size=".01" mass="1"/>
      <body pos=".1 0 0"><joint name="follower" axis="0 1 0" range="-2 2" limited="true"/>
        <geom size=".01" mass="1"/><site name="b" pos=".1 0 0"/></body></body>
    <body pos="1 0 0"><joint name="ball" type="ball"/><geom size=".01" mass="1" pos=".1 0 0"/></body>
    <body pos="2 0 0"><freejoint name="free"/><geom size=".01" mass="1"/></body>
  </worldbody>
  <tendon><spatial name="t"><site site="a"/><site site="b"/></spatial></tendon>
  <actuator><muscle name="m" tendon="t" lengthrange=".1 .9"/></actuator>
  <equality><joint joint1="follower" joint2="leader" polycoef=".1 .5 .3 0 0"/></equality>
</mujoco>
"""


LEAST = Smallest(1e-6, 1e-5)  # the smallest jumps to be found


def load(text: str) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(text)


def only(found: PoseComparison) -> tuple[str, str]:
    (summary,) = found.muscles.values()
    return verdict(summary, found.jumps)


@pytest.mark.parametrize("path", [ELBOW, CASE2], ids=["elbow", "case2"])
def test_true_geodesics_agree(path: str) -> None:
    """The promise of the package: 1e-9 in length, velocity and moment arm wherever MuJoCo's wrap is a true geodesic."""
    model = mujoco.MjModel.from_xml_path(path)
    found = compare_poses(model, samples=101)
    for summary in found.muscles.values():
        assert summary.counts == {"AGREE": summary.poses}
        assert summary.poses == 202
        assert (summary.agreement < 1e-9).all()
        assert verdict(summary, found.jumps).right == "both"
    assert found.jumps == []
    assert found.left_out == {}


def test_the_model_is_left_as_it_was() -> None:
    model = mujoco.MjModel.from_xml_path(ELBOW)
    before = model.actuator_forcerange.copy(), model.tuple_size.copy(), model.opt.disableflags
    compare_poses(model, samples=5)
    compare_motion(with_native_laws(model)[0], ["constant:0.2"], 0.01)
    assert np.array_equal(model.actuator_forcerange, before[0])
    assert np.array_equal(model.tuple_size, before[1])
    assert model.opt.disableflags == before[2]


def test_the_long_way_round_a_sphere_is_put_to_mujoco() -> None:
    """With a side site on the far side MuJoCo goes round the back of the ball and jumps to the front."""
    found = compare_poses(load(BALL.format(side='sidesite="side"')), samples=101)
    right, why = only(found)
    assert right == "mjwrap"
    assert "long way round the sphere" in why
    assert "geom 'ball'" in why
    assert found.total(Outcome.MUJOCO_NOT_GEODESIC) > 50
    assert found.total(Outcome.AGREE) > 50
    (jump,) = found.jumps
    assert jump.program == "MuJoCo"
    assert jump.other_smooth
    # where the centre lies between the end points: -0.010002 in MuJoCo 3.17, 2 µm further in 4.0, whose rule changed
    assert jump.at == pytest.approx(-0.010003, abs=2e-6)
    assert abs(jump.length) == pytest.approx(0.00119, abs=1e-5)
    without = compare_poses(load(BALL.format(side="")), samples=101)
    assert only(without)[0] == "both"


@pytest.mark.parametrize("kind", ["sphere", "cylinder"])
def test_a_string_held_inside_is_judged_as_the_shortest_that_meets_the_solid(kind: str) -> None:
    """MuJoCo's corner is where its Newton's method stopped; the string is taken through the solid and beside it."""
    text = BALL.format(side='sidesite="side"').replace('"0 0 .05"', '"0 0 .01"').replace("sphere", kind)
    model = load(
        text.replace('size=".03"', 'size=".03 .1" euler="90 0 0"').replace('"-.1 0 .01"', '"-.1 0 .03"')
    )
    found = compare_poses(model, samples=201)
    (summary,) = found.muscles.values()
    assert summary.counts == {"AGREE": summary.poses}
    assert (summary.agreement < [1e-12, 1e-6, 1e-6]).all()
    assert found.jumps == []
    assert only(found)[0] == "both"


def test_a_corner_in_the_wrong_place_is_put_to_mjwrap(monkeypatch: pytest.MonkeyPatch) -> None:
    own = MuscleSystem.contact_points
    text = (
        BALL.format(side='sidesite="side"')
        .replace('"0 0 .05"', '"0 0 .01"')
        .replace('"-.1 0 .01"', '"-.1 0 .05"')
    )

    def moved(self: MuscleSystem, i: int) -> np.ndarray:
        points = own(self, i)
        return points + points[..., [2, 1, 0]] * [1e-7, 0.0, -1e-7]  # turned about y

    monkeypatch.setattr(MuscleSystem, "contact_points", moved)
    found = compare_poses(load(text), samples=51)
    (summary,) = found.muscles.values()
    assert summary.counts["MJWRAP_WRONG"] > 10
    assert any("held inside" in words for words in summary.own_faults)


def test_a_route_with_pulleys_is_read_as_mujoco_walks_it() -> None:
    """Weights, contact points and end points of every span add up to ten_length."""
    model = load(ROUTE)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert [span.weight for span in tendon_spans(model, data, 0)] == [1.0, 1.0, 0.5, pytest.approx(1 / 3)]
    record = WrapRecord(model, 9)
    lengths = []
    for k, angle in enumerate(np.linspace(-0.3, 0.3, 9)):
        data.qpos[0] = angle
        mujoco.mj_forward(model, data)
        record.keep(k, data)
        lengths.append(float(data.ten_length[0]))
    points = record.points(0, tendon_spans(model, data, 0))
    assert points[0].touched.all()
    assert not points[1].touched.any()
    for span, at in zip(tendon_spans(model, data, 0), points, strict=True):
        for site, end in ((span.start, at.a), (span.end, at.b)):
            if model.site_bodyid[site] == 0:
                assert np.array_equal(end, np.tile(model.site_pos[site], (9, 1)))
    found = compare_poses(model, samples=51)
    (summary,) = found.muscles.values()
    assert summary.counts == {"AGREE": summary.poses}  # which also means that the parts add up
    assert np.ptp(lengths) > 0.005


@pytest.mark.parametrize(
    ("spoil", "outcome"),
    [
        (
            lambda length, velocity, jacobian, status: (length + 1e-6, velocity, jacobian, status),
            Outcome.MJWRAP_WRONG,
        ),
        (
            lambda length, velocity, jacobian, status: (length, velocity, jacobian + 1e-6, status),
            Outcome.UNEXPLAINED,
        ),
        (
            lambda length, velocity, jacobian, status: (length, velocity + 1e-6, jacobian, status),
            Outcome.UNEXPLAINED,
        ),
        (
            lambda length, velocity, jacobian, status: (length, velocity, jacobian, status + 1),
            Outcome.MJWRAP_FAILED,
        ),
    ],
    ids=["length", "jacobian", "velocity", "status"],
)
def test_a_fault_of_mjwrap_is_put_to_mjwrap(
    spoil: Callable[..., object], outcome: Outcome, monkeypatch: pytest.MonkeyPatch
) -> None:
    sound = Comparer.mjwrap_at
    monkeypatch.setattr(Comparer, "mjwrap_at", lambda self, qpos, qvel: spoil(*sound(self, qpos, qvel)))
    found = compare_poses(mujoco.MjModel.from_xml_path(CASE2), samples=11)
    assert found.total(outcome) == found.poses == found.at_fault
    assert only(found)[0] == "MuJoCo"
    (summary,) = found.muscles.values()
    assert len(summary.bad_poses) == found.poses
    assert summary.bad_poses[0][3].keys() == {"cylinder_y"}


def test_a_jump_of_mjwrap_is_found_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where `mjwrap check` finds it, too: both walk alike."""
    sound = mw.MuscleSystem.length

    def torn(self: mw.MuscleSystem) -> np.ndarray:
        assert sound.fget is not None
        length: np.ndarray = sound.fget(self)
        return length + 1e-4 * (self._last.scratch.qpos[0] > 0.00123)

    monkeypatch.setattr(mw.MuscleSystem, "length", property(torn))
    found = compare_poses(mujoco.MjModel.from_xml_path(CASE2), samples=51)
    (jump,) = found.jumps
    assert (jump.program, jump.muscle, jump.sweep) == ("mjwrap", "muscle", "cylinder_y")
    assert jump.at == pytest.approx(0.00123, abs=1e-9)
    assert jump.length == pytest.approx(1e-4, rel=1e-6)
    assert "mjwrap jumps 1 time, by up to 0.1 mm" in only(found)[1]
    checks = check_model(mujoco.MjModel.from_xml_path(CASE2), poses=1, samples=51)
    (told,) = next(check for check in checks.checks if check.name == "jumps").remarks
    assert "cylinder_y = 0.001230: length +0.100 mm" in told


def test_muscles_that_cannot_be_compared_say_why() -> None:
    model = mujoco.MjModel.from_xml_path(CASE2.replace("case2", "two_cylinders"))
    found = compare_poses(model, samples=5)
    assert found.muscles == {}
    assert "placeholder" in found.left_out["muscle"]
    with pytest.raises(mw.ModelError, match=r"no muscle 'sartorius'; muscles: muscle"):
        compare_poses(model, names=["sartorius"])


def test_coupled_joints_follow_and_tangents_are_derivatives() -> None:
    model = load(COUPLED)
    poses = PoseMaker(model, model.qpos0)
    names = [model.joint(j).name for j in poses.joints()]
    assert names == ["leader", "follower", "ball"]
    leader, follower = 0, 1
    for x in np.linspace(-1.0, 1.0, 50):
        qpos, tangent = poses.place(leader, 0, x)
        assert qpos[follower] == pytest.approx(0.1 + 0.5 * x + 0.3 * x * x, abs=1e-15)
        for joint, axis in ((0, 0), (1, 0), (2, 0), (2, 1), (2, 2)):
            qpos, tangent = poses.place(joint, axis, x)
            step, errors = np.zeros(model.nv), []
            for h in (1e-2, 1e-3):
                low, high = poses.place(joint, axis, x - h)[0], poses.place(joint, axis, x + h)[0]
                mujoco.mj_differentiatePos(model, step, 2 * h, low, high)
                errors.append(np.abs(step - tangent).max())
            assert errors[1] <= 0.011 * errors[0] + 1e-12
    drawn = poses.random(20)
    assert np.array_equal(drawn.qpos, PoseMaker(model, model.qpos0).random(20).qpos)
    assert np.allclose(drawn.qpos[:, 1], 0.1 + 0.5 * drawn.qpos[:, 0] + 0.3 * drawn.qpos[:, 0] ** 2)
    assert np.allclose(np.linalg.norm(drawn.qpos[:, 2:6], axis=1), 1.0)
    assert np.array_equal(drawn.qpos[:, 6:], np.tile(model.qpos0[6:], (20, 1)))
    assert poses.middle()[0] == 0.0
    (summary,) = compare_poses(model, samples=11).muscles.values()
    assert summary.counts == {"AGREE": summary.poses}
    assert [poses.follows(j) for j in poses.joints()] == [False, True, False]
    assert [poses.sweep(j, 3).alone for j in poses.joints()] == [False, True, False]


def test_a_joint_that_an_equality_holds_is_drawn_there() -> None:
    held = '<joint joint1="follower" polycoef=".1 0 0 0 0"/>'
    model = load(re.sub(r'<joint joint1="follower".*/>', held, COUPLED))
    poses = PoseMaker(model, model.qpos0)
    assert model.qpos0[1] != poses.base[1] == 0.1
    assert (poses.random(20).qpos[:, 1] == 0.1).all()


def jump_at(place: float, length: float, slope: float) -> Callable[[float], tuple[float, float]]:
    def probe(at: float) -> tuple[float, float]:
        beyond = at > place
        return np.sin(at) + beyond * (length + slope * (at - place)), np.cos(at) + beyond * slope

    return probe


def test_jumps_are_found_where_they_are_and_as_large() -> None:
    rng = np.random.default_rng(7)
    for _ in range(50):
        place, length, slope = rng.uniform(0.1, 0.9), 10 ** rng.uniform(-5, -1), 10 ** rng.uniform(-4, 0)
        low = place - rng.uniform(0.0, 0.01)  # an interval of a sweep in a hundred steps
        bend = -float(np.sin(low))
        for size, way in (((length, 0.0), None), ((0.0, slope), bend), ((length, slope), None)):
            found = refine_jump(jump_at(place, *size), low, low + 0.01, 1.0, way, LEAST)
            assert found is not None
            assert found[0] == pytest.approx(place, abs=2e-9)
            assert found[1:] == pytest.approx(size, rel=1e-3, abs=1e-8)


@pytest.mark.parametrize("width", [1e-2, 1e-4, 1e-6])
def test_a_steep_stretch_is_no_jump(width: float) -> None:
    def probe(at: float) -> tuple[float, float]:
        x = np.clip((at - 0.3717) / width, -500.0, 1e9)
        rise = 0.01 * width * np.logaddexp(0.0, x)  # the slope rises from 0 to 0.01 within the width
        return rise, 0.01 / (1.0 + np.exp(-x))

    for bend in (0.0, None):
        assert refine_jump(probe, 0.37, 0.38, 1.0, bend, LEAST) is None


def test_a_slope_that_grows_without_bound_is_no_jump() -> None:
    def probe(at: float) -> tuple[float, float]:
        x = max(at - 0.3717, 1e-300)
        return 0.1 * x**1.5, 0.15 * x**0.5

    for bend in (0.0, None):
        assert refine_jump(probe, 0.37, 0.38, 1.0, bend, LEAST) is None


def test_with_one_law_both_move_alike() -> None:
    model, changed = with_native_laws(mujoco.MjModel.from_xml_path(ELBOW))
    assert len(changed) == 7
    muscles = mw.MuscleSystem(model)  # it holds the model's actuators still; the comparison must not mind
    assert {muscle.law for muscle in muscles.declarations} == {"mujoco"}
    motion = compare_motion(model, ["random:1"], 0.5)
    assert motion.time[-1] == pytest.approx(0.5)
    assert np.ptp(motion.native[:, 0]) > 0.3
    assert abs(motion.worst()[1]) < 1e-9
    assert motion.stopped == motion.paths == ""


def test_another_law_moves_otherwise() -> None:
    motion = compare_motion(mujoco.MjModel.from_xml_path(ELBOW), ["random:1"], 0.2)
    dof, gap, when = motion.worst()
    assert dof == "elbow_flexion"
    assert abs(gap) > 1e-3
    assert 0.0 < when < 0.201
    assert motion.difference[:, 0] == pytest.approx(motion.mjwrap[:, 0] - motion.native[:, 0], abs=1e-15)


def test_a_native_run_that_blows_up_is_told() -> None:
    text = BALL.format(side="").replace('name="slide"', 'name="slide" stiffness="1e12"')
    model = load(text)
    motion = compare_motion(model, ["constant:1"], 1.0, qpos=np.array([0.05]))
    assert "became unstable" in motion.stopped
    assert np.isfinite(motion.difference).all()


@pytest.mark.myo
def test_the_elbow_of_myo_sim_agrees() -> None:
    myo_sim = pytest.importorskip("myo_sim")
    for name, joints in (("elbow", 1), ("myoelbow_2dof", 2)):
        model = mujoco.MjModel.from_xml_path(str(myo_sim.get_xml_path(name)))
        assert model.njnt == joints
        found = compare_poses(model, samples=201)
        for summary in found.muscles.values():
            assert summary.counts == {"AGREE": summary.poses}
            assert (summary.agreement < 1e-9).all()
        assert found.jumps == []
        assert len(found.muscles) == 6
        assert abs(compare_motion(model, ["random:2"], 0.5).worst()[1]) < 1e-9


@pytest.mark.myo
@pytest.mark.slow
@pytest.mark.filterwarnings(
    "ignore:Attaching a spec with an empty prefix:UserWarning"
)  # myo_sim builds it so
def test_the_jumps_of_the_arm_of_myo_sim_are_mujocos() -> None:
    """Along smooth sweeps a tendon goes over to the other side of a cylinder; mjwrap's path does not jump.

    In MuJoCo 3 the latissimus, in MuJoCo 4, whose side rule is another one, the supinator.
    """
    model = load_myo("myoarm_r")
    found = compare_poses(model, names=["LAT1", "LAT2", "LAT3", "BRA", "TRIlong", "SUP"], samples=51)
    assert {jump.program for jump in found.jumps} == {"MuJoCo"}
    if running_side_rule() == 3:
        muscle, sweep, base, size = "LAT3", "elv_angle_r", 1, -0.0144
    else:
        muscle, sweep, base, size = "SUP", "pro_sup_r", 0, -0.0285
    lengths = [j.length for j in found.jumps if (j.muscle, j.sweep, j.base) == (muscle, sweep, base)]
    assert lengths == [pytest.approx(size, abs=1e-4)]
    assert found.at_fault == 0
    for summary in found.muscles.values():
        assert summary.counts["AGREE"] > 0.9 * summary.poses
        assert (summary.agreement < 1e-9).all()
