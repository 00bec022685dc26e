"""The range of a joint that is not its limit counts wherever joints are moved over their ranges."""

from __future__ import annotations

import math
import re
import warnings
from pathlib import Path

import mujoco
import numpy as np
import pytest
from cli_runs import ELBOW, run_here

import mjwrap as mw
from mjwrap.calibration.joints import JointSpace
from mjwrap.checking import possible_mistakes
from mjwrap.checking.mistakes.joints import joint_mistakes
from mjwrap.checking.mistakes.pose import Posed
from mjwrap.mjcf.inside import shares_inside
from mjwrap.mjcf.joint_ranges import joint_range
from mjwrap.poses.joint_sweeps import PoseMaker
from mjwrap.runs.angles import check_position

ARM = """<mujoco><compiler angle="radian"/><worldbody><site name="a" pos="0 0 .2"/>
  <body><joint name="elbow" axis="0 1 0" range="-.2 1.3" limited="{}"/><geom size=".05"/><site name="b" pos=".03 0 0"/>
  </body></worldbody>
  <tendon><spatial name="t"><site site="a"/><site site="b"/></spatial></tendon>
  <actuator><muscle name="m" tendon="t" lengthrange=".1 .3" force="10"/></actuator></mujoco>"""
KINDS = ("hinge", "slide", "ball")


def chain(joints: list[tuple[str, float, float, str]], angle: str = "radian") -> mujoco.MjModel:
    """Return a chain of bodies with joints of the given kinds, ranges (as in the file) and words for `limited`."""
    text = '<body pos=".1 0 .2"><geom size=".1" mass="1"/>'
    bodies = "".join(
        f'<body pos="0 .1 .3"><joint name="j{i}" type="{kind}" axis="0 1 0" range="{low!r} {high!r}" {limited}/>'
        '<geom name="g{0}" type="cylinder" size=".05 .1" mass="1"/><site name="s{0}" pos=".04 0 .01"/>'.format(
            i
        )
        for i, (kind, low, high, limited) in enumerate(joints)
    )
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><compiler angle="{angle}"/><statistic extent="2"/><worldbody><site name="fixed" pos="0 .1 .55"/>'
        f'{text}<freejoint name="base"/>{bodies}{"</body>" * (len(joints) + 1)}</worldbody></mujoco>'
    )


def drawn(rng: np.random.Generator, limited: str = "") -> list[tuple[str, float, float, str]]:
    """Draw joints whose ranges increase; limited: the attribute of all, else one is drawn for each."""
    found = []
    for _ in range(6):
        kind = str(rng.choice(KINDS))
        low, high = np.sort(rng.uniform(-6.0, 6.0, 2)) if kind != "ball" else (0.0, rng.uniform(0.1, 3.1))
        word = str(rng.choice(["", 'limited="true"', 'limited="false"']))
        found.append((kind, float(low), float(high), limited or word))
    return found


@pytest.mark.parametrize("angle", ["radian", "degree"])
def test_range_of_random_joints_with_and_without_limits(angle: str) -> None:
    """MuJoCo converts the range of a limit to rad; one without a limit it keeps as it is written."""
    rng = np.random.default_rng(5)
    for _ in range(50):
        joints = drawn(rng)
        model = chain(joints, angle)
        assert joint_range(model, 0) is None  # the free joint
        for i, (kind, low, high, limited) in enumerate(joints, 1):
            converted = angle == "degree" and kind != "slide" and limited != 'limited="false"'
            scale = math.pi / 180.0 if converted else 1.0
            assert joint_range(model, i) == pytest.approx((scale * low, scale * high), rel=1e-15)


@pytest.mark.parametrize(
    ("kind", "low", "high"),
    [
        ("hinge", -45.0, 90.0),  # degrees, which MuJoCo has not converted
        ("hinge", -99999.9, 99999.9),
        ("hinge", -10.0, 10.0),  # OpenSim's default range
        ("hinge", 1.0, -1.0),
        ("hinge", 0.0, 0.0),
        ("slide", -99999.9, 99999.9),
        ("slide", 0.2, 0.1),
        ("ball", 0.0, 60.0),
        ("ball", 0.0, 0.0),
        ("ball", 0.5, 1.0),
    ],
)
def test_ranges_without_a_limit_that_cannot_be_meant_do_not_count(kind: str, low: float, high: float) -> None:
    model = chain([(kind, low, high, 'limited="false"')], "degree")
    assert joint_range(model, 1) is None
    bare = chain([(kind, 0.0, 0.0, 'limited="false"')], "degree")
    assert PoseMaker(model, model.qpos0).span(1) == PoseMaker(bare, bare.qpos0).span(1)


def twins(seed: int) -> tuple[mujoco.MjModel, mujoco.MjModel]:
    """Return a model with a limit at every joint, and the same without."""
    joints = drawn(np.random.default_rng(seed), 'limited="true"')
    return chain(joints), chain([(*joint[:3], 'limited="false"') for joint in joints])


@pytest.mark.parametrize("seed", range(12))
def test_joints_are_moved_over_the_same_range_with_and_without_limits(seed: int) -> None:
    limited, free = twins(seed)
    assert limited.jnt_limited[1:].all()
    assert not free.jnt_limited.any()
    makers = [PoseMaker(model, model.qpos0, seed) for model in (limited, free)]
    np.testing.assert_array_equal(makers[0].random(20).qpos, makers[1].random(20).qpos)
    np.testing.assert_array_equal(makers[0].middle(), makers[1].middle())
    for joint in makers[0].joints():
        for axis in makers[0].axes(joint):
            sweeps = [maker.sweep(joint, 5, axis) for maker in makers]
            np.testing.assert_array_equal(sweeps[0].qpos, sweeps[1].qpos)
            low, high = limited.jnt_range[joint]
            ball = limited.jnt_type[joint] == mujoco.mjtJoint.mjJNT_BALL
            assert sweeps[1].at[[0, -1]].tolist() == [-high if ball else low, high]
    spaces = [JointSpace(model, model.qpos0, {}) for model in (limited, free)]
    assert spaces[0].held == spaces[1].held == [0]
    u = np.random.default_rng(seed).uniform(0.0, 1.0, spaces[0].k)
    np.testing.assert_array_equal(spaces[0].pose(u), spaces[1].pose(u))


def test_shares_of_ends_inside_are_the_same_with_and_without_limits() -> None:
    some = 0
    for seed in range(12):
        pairs = [(geom, site) for geom in range(1, 7) for site in range(7)]
        limited, free = (shares_inside(model, pairs) for model in twins(seed))
        np.testing.assert_array_equal(limited, free)
        some += np.count_nonzero((limited > 0.0) & (limited < 1.0))
    assert some > 10


def without_limits() -> mujoco.MjModel:
    model = mujoco.MjModel.from_xml_path(ELBOW)
    model.jnt_limited[:] = 0
    return model


def test_length_ranges_mistakes_and_inspection_of_the_elbow_need_no_limit() -> None:
    limited, free = mujoco.MjModel.from_xml_path(ELBOW), without_limits()
    found = [mw.length_ranges(mw.MuscleSystem(model)) for model in (limited, free)]
    for name, one in found[0].items():
        other = found[1][name]
        assert not other.held
        assert (one.shortest, one.longest, one.poses) == (other.shortest, other.longest, other.poses)
        assert one.longest - one.shortest > 0.005
    told = [[str(m) for m in possible_mistakes(mw.MuscleSystem(model))] for model in (limited, free)]
    assert told[0] == told[1]


def test_a_narrow_range_is_a_mistake_only_as_a_limit() -> None:
    """A joint with such a limit hardly moves; one without a limit moves freely."""
    for limited, count in ((1, 1), (0, 0)):
        model = mujoco.MjModel.from_xml_path(ELBOW)
        model.jnt_range[0] = 0.0, 0.04
        model.jnt_limited[0] = limited
        found = list(joint_mistakes(Posed(mw.MuscleSystem(model), model.qpos0)))
        assert sum("hardly moves" in str(each) for each in found) == count


@pytest.mark.filterwarnings("default")
@pytest.mark.parametrize("limited", ["true", "false"])
def test_a_run_that_ends_outside_a_range_says_whether_it_is_a_limit(
    limited: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "arm.xml"
    file.write_text(ARM.format(limited))
    told = run_here("run", capsys, file, "--duration", "0.01", "--prescribe", "elbow=2.5").out
    found = re.search(r"elbow 143\.2°, outside its range of -11\.5° to 74\.5°(, which is no limit)?", told)
    assert found, told
    assert (found[1] is None) == (limited == "true")


def test_positions_outside_a_range_without_a_limit() -> None:
    """Only more than two turns outside are refused: such a joint may turn on, but 90 rad are no knee's."""
    model = without_limits()
    with pytest.raises(mw.ModelError, match=r"14\.3 turns, far outside the range.*write 90deg"):
        check_position(model, 0, 90.0, "start")
    with pytest.warns(UserWarning, match=r"outside the joint's range, 0 to 2\.26893 rad"):
        check_position(model, 0, 7.0, "start")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_position(model, 0, 2.0, "start")
    with pytest.raises(mw.ModelError, match=r"7 rad are 1\.11 turns, far outside"):
        check_position(mujoco.MjModel.from_xml_path(ELBOW), 0, 7.0, "start")
