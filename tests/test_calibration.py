"""Length ranges against searches of other kinds, fibres that span what was asked for, and planted faults found."""

import json
import math
from pathlib import Path

import mujoco
import numpy as np
import pytest
from cli_runs import ELBOW, run_here
from myo_models import load_myo
from scipy.optimize import differential_evolution

import mjwrap as mw
from mjwrap.calibration.joints import JointSpace
from mjwrap.poses.joint_sweeps import PoseMaker

SIDES = 4
REACH = 1.2  # [rad] of the shoulder
COUPLED = """
<mujoco>
  <compiler angle="radian" autolimits="true"/>
  <worldbody>
    {origins}
    <body>
      <joint name="shoulder" type="ball" range="0 {reach}"/> <geom size=".01" mass="1"/>
      <body pos="0 0 -.3">
        <joint name="elbow" axis="0 1 0" ref=".1" range="-.4 2.2"/> <geom size=".01" mass="1"/>
        <body pos="0 .01 -.25">
          <joint name="wrist" axis="1 0 .2"/> <geom size=".01" mass="1"/>
          <body pos="0 0 -.02">
            <joint name="thumb" axis="0 1 1"/> <joint name="fixed" type="slide"/> <geom size=".01" mass="1"/>
            {insertions}
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <equality>
    <joint joint1="thumb" joint2="wrist" polycoef="0 -.6 0 .1 0"/>
    <joint joint1="wrist" joint2="elbow" polycoef=".1 .5 .3 0 0"/>
    <joint joint1="fixed" polycoef=".01 0 0 0 0"/>
  </equality>
  <tendon>{tendons}</tendon>
  <actuator>{muscles}</actuator>
</mujoco>
"""


def coupled(seed: int) -> mujoco.MjModel:
    """Return an arm with a ball, a hinge, a row of followers and straight muscles between random places."""
    rng = np.random.default_rng(seed)
    parts: dict[str, str] = {"origins": "", "insertions": "", "tendons": "", "muscles": ""}
    for i in range(SIDES):
        a, b = rng.uniform(-0.15, 0.15, (2, 3))
        parts["origins"] += f'<site name="o{i}" pos="{a[0]} {a[1]} {a[2]}"/>'
        parts["insertions"] += f'<site name="i{i}" pos="{b[0]} {b[1]} {b[2]}"/>'
        parts["tendons"] += f'<spatial name="m{i}"><site site="o{i}"/><site site="i{i}"/></spatial>'
        parts["muscles"] += f'<muscle name="m{i}" tendon="m{i}" force="100" lengthrange=".1 .8"/>'
    return mujoco.MjModel.from_xml_string(COUPLED.format(reach=REACH, **parts))


def test_ranges_are_those_of_another_search() -> None:
    """Straight muscles over a ball, a hinge and two followers; differential evolution on MuJoCo's site positions."""
    model = coupled(1)
    data = mujoco.MjData(model)
    found = mw.length_ranges(mw.MuscleSystem(model))
    assert list(found) == [f"m{i}" for i in range(SIDES)]

    def length(y: np.ndarray, sign: float, i: int) -> float:
        azimuth, height, angle, elbow = y
        around = math.sqrt(1.0 - height * height)
        axis = np.array([around * math.cos(azimuth), around * math.sin(azimuth), height])
        mujoco.mju_axisAngle2Quat(data.qpos[:4], axis, angle)
        x = elbow - 0.1
        wrist = 0.1 + 0.5 * x + 0.3 * x * x
        data.qpos[4:] = elbow, wrist, -0.6 * wrist + 0.1 * wrist**3, 0.01
        mujoco.mj_kinematics(model, data)
        return sign * float(np.linalg.norm(data.site(f"o{i}").xpos - data.site(f"i{i}").xpos))

    options = {"seed": 0, "tol": 1e-4, "maxiter": 300, "popsize": 25}
    box = [(0.0, 2.0 * math.pi), (-1.0, 1.0), (0.0, REACH), (-0.4, 2.2)]
    for i in range(SIDES):
        mine = found[f"m{i}"]
        for sign, value in ((1.0, mine.shortest), (-1.0, mine.longest)):
            other = differential_evolution(length, box, args=(sign, i), **options)
            assert sign * value == pytest.approx(other.fun, abs=1e-5)
        assert (mine.without_path, mine.held) == ({}, ())
        assert mine.poses < 8000


def test_the_tangent_is_the_derivative_of_the_pose() -> None:
    model = coupled(2)
    space = JointSpace(model, model.qpos0, {})
    rng = np.random.default_rng(0)
    assert space.k == 4
    for trial in range(50):
        u, direction = space.draw(rng, corner=False), rng.normal(size=space.k)
        if trial == 0:
            u[1:] = 1e-5  # next to no rotation of the ball, where the formula is a series
        exact = space.tangent(u, space.pose(u)) @ direction
        step, errors = np.zeros(model.nv), []
        for h in (1e-3, 1e-4):
            low, high = space.pose(u - h * direction), space.pose(u + h * direction)
            mujoco.mj_differentiatePos(model, step, 2.0 * h, low, high)
            errors.append(float(np.abs(step - exact).max()))
        assert errors[1] <= 0.011 * errors[0] + 1e-10


def test_a_dense_scan_of_the_elbow_stays_within_its_ranges() -> None:
    model = mujoco.MjModel.from_xml_path(ELBOW)
    muscles, data = mw.MuscleSystem(model), mujoco.MjData(model)
    muscles.forward(data)
    before = muscles.length
    found = mw.length_ranges(muscles)
    assert np.array_equal(muscles.length, before)
    scanned = []
    low, high = model.jnt_range[0].tolist()
    for angle in np.linspace(low, high, 2001):
        data.qpos[0] = angle
        muscles.forward(data)
        scanned.append(muscles.length)
    for i, name in enumerate(muscles.names):
        lengths = np.array(scanned)[:, i]
        assert found[name].shortest == pytest.approx(lengths.min(), abs=1e-6)
        assert found[name].longest == pytest.approx(lengths.max(), abs=1e-6)


PUSHED = """
<mujoco>
  <worldbody>
    <geom name="ball" type="sphere" size=".05" contype="0" conaffinity="0"/>
    <site name="origin" pos="0 .01 .2"/>
    <body pos=".2 0 0">
      <joint name="slide" type="slide" axis="1 0 0" {range}/>
      <geom size=".01" mass="1" contype="0" conaffinity="0"/>
      <site name="insertion"/>
    </body>
  </worldbody>
  <tendon>
    <spatial name="m"><site site="origin"/> <geom geom="ball"/> <site site="insertion"/></spatial>
  </tendon>
  <actuator><muscle name="m" tendon="m" force="100" lengthrange=".1 .3"/></actuator>
</mujoco>
"""


def test_poses_without_a_path_are_counted_and_not_used() -> None:
    model = mujoco.MjModel.from_xml_string(PUSHED.format(range='range="-.22 .1"'))
    muscles, data = mw.MuscleSystem(model), mujoco.MjData(model)
    found = mw.length_ranges(muscles)["m"]
    assert found.without_path.keys() == {"ENDPOINT_INSIDE"}
    assert 0 < found.without_path["ENDPOINT_INSIDE"] < found.poses
    for pose, length in ((found.shortest_pose, found.shortest), (found.longest_pose, found.longest)):
        data.qpos[:] = pose
        muscles.reset(data)
        muscles.forward(data)
        assert (muscles.status[0], muscles.length[0]) == (0, length)
    report = mw.implausible(muscles, ranges={"m": found})
    assert "ENDPOINT_INSIDE" in report.remarks["m"][0]

    inside = mw.length_ranges(muscles, ranges={"slide": (-0.23, -0.17)}, base=[-0.2])["m"]
    assert inside.without_path == {"ENDPOINT_INSIDE": inside.poses}
    assert np.isnan([inside.shortest, inside.longest, *inside.shortest_pose]).all()
    with pytest.raises(mw.ModelError, match="have a path"):
        mw.fit_fiber_and_slack(inside.shortest, inside.longest)


def test_a_joint_without_a_range_is_held_and_named() -> None:
    model = mujoco.MjModel.from_xml_string(PUSHED.format(range=""))
    muscles = mw.MuscleSystem(model)
    held = mw.length_ranges(muscles, base=[0.05])["m"]
    assert held.held == ("slide",)
    assert held.shortest == held.longest == pytest.approx(math.hypot(0.25, 0.01, 0.2), abs=1e-12)
    freed = mw.length_ranges(muscles, ranges={"slide": (0.0, 0.1)})["m"]
    assert freed.held == ()
    assert freed.longest == pytest.approx(math.hypot(0.3, 0.01, 0.2), abs=1e-12)
    fixed = mw.length_ranges(muscles, ranges={"slide": (0.1, 0.1)})["m"]
    assert (fixed.shortest, fixed.held) == (freed.longest, ())
    for ranges, message in (
        ({"slip": (0.0, 1.0)}, "no joint 'slip'.*slide"),
        ({"slide": (1.0, 0.0)}, "'slide' must be finite and not decreasing"),
    ):
        with pytest.raises(mw.ModelError, match=message):
            mw.length_ranges(muscles, ranges=ranges)
    with pytest.raises(mw.ModelError, match="no muscle 'n'"):
        mw.length_ranges(muscles, names=["n"])


def normalised(length: float, optimal: float, slack: float, angle: float) -> float:
    """Return the normalised fibre length of a rigid tendon and constant fibre height, from its right triangle."""
    return math.sqrt((length - slack) ** 2 + (optimal * math.sin(angle)) ** 2) / optimal


def test_the_fibre_spans_what_was_asked_for_or_is_widened_evenly() -> None:
    rng = np.random.default_rng(0)
    exact = 0
    for _ in range(500):
        shortest = rng.uniform(0.05, 0.5)
        longest = shortest * rng.uniform(1.02, 3.0)
        low = rng.uniform(0.45, 0.9)
        high = low + rng.uniform(0.1, 1.0)
        angle, share = rng.uniform(0.0, math.asin(0.9 * low)), rng.uniform(0.0, 0.2)
        fit = mw.fit_fiber_and_slack(
            shortest, longest, fiber_range=(low, high), pennation_angle=angle, least_slack=share
        )
        found = [
            normalised(length, fit.optimal_fiber_length, fit.tendon_slack_length, angle)
            for length in (shortest, longest)
        ]
        assert fit.fiber_range == pytest.approx(found, rel=1e-9)
        if fit.exact:
            exact += 1
            assert found == pytest.approx([low, high], rel=1e-9)
            assert fit.tendon_slack_length >= share * shortest
        else:
            assert fit.implied_slack_length < share * shortest == fit.tendon_slack_length
            assert low - found[0] == pytest.approx(found[1] - high, abs=1e-9)
            assert found[0] < low
            assert "would need a tendon slack length" in fit.sentence
    assert 100 < exact < 400


@pytest.mark.parametrize(
    ("lengths", "options", "message"),
    [
        ((0.2, 0.2), {}, "increasing"),
        ((0.2, 0.3), {"fiber_range": (1.0, 0.9)}, "must increase"),
        ((0.2, 0.3), {"fiber_range": (0.5, 1.0), "pennation_angle": 0.6}, "fibre's height"),
        ((0.2, 0.3), {"least_slack": 1.0}, "least_slack"),
    ],
)
def test_a_fit_that_cannot_be_is_refused(lengths: tuple, options: dict, message: str) -> None:
    with pytest.raises(mw.ModelError, match=message):
        mw.fit_fiber_and_slack(*lengths, **options)


def test_a_hill_muscle_has_mujocos_fibre() -> None:
    """At every length the normalised lengths and velocities are those of `mju_muscleGain`, gear included."""
    prm, lengths, gear, acc0 = (0.6, 1.3, -1.0, 300.0, 0.5, 1.6, 4.0, 1.3, 1.2), (0.5, 0.8), 2.0, 1.5
    law = mw.MuJoCoMuscle(prm, lengths, acc0, gear, (-120.0, 0.0))
    hill = mw.hill_from_mujoco(law)
    muscle = hill.muscle
    optimal = (0.8 - 0.5) / (1.3 - 0.6)  # in the actuator's own length, MuJoCo's L0
    assert hill.fiber.exact
    assert muscle.max_isometric_force == pytest.approx(gear * 300.0 / acc0, rel=1e-14)
    for length in np.linspace(0.25, 0.4, 7):
        theirs = prm[0] + (gear * length - lengths[0]) / optimal
        mine = normalised(length, muscle.optimal_fiber_length, muscle.tendon_slack_length, 0.0)
        assert mine == pytest.approx(theirs, rel=1e-12)
    v = 0.3
    mine = v / (muscle.max_contraction_velocity * muscle.optimal_fiber_length)
    assert mine == pytest.approx(gear * v / (prm[6] * optimal), rel=1e-12)
    assert hill.notes == (
        "the actuator's force range limits its tension to 240 N; the Hill-type muscle's is not",
    )

    mended = mw.hill_from_mujoco(mw.MuJoCoMuscle(prm, (0.1, 0.8), acc0), least_slack=0.1)
    assert mended.fiber.implied_slack_length == pytest.approx(0.1 - 0.6 * 1.0, rel=1e-12)
    assert mended.muscle.tendon_slack_length == pytest.approx(0.01)
    assert mended.notes == (mended.fiber.sentence,)
    fastest = mended.muscle.max_contraction_velocity * mended.muscle.optimal_fiber_length
    assert fastest == pytest.approx(4.0, rel=1e-12)


PLANTED = {  # what a muscle of 0.2 to 0.4 m over the slide's range shows: its parameters, and all kinds
    "sane": ((500, 0.2, 0.1), set()),
    "weak": ((0.5, 0.2, 0.1), {"no force"}),
    "strong": ((3e4, 0.2, 0.1), {"huge force"}),
    "short": ((500, 0.3, 0.01), {"short tendon"}),
    "long": ((500, 0.015, 0.39), {"long tendon", "short fibre"}),
    "crowded": ((500, 0.2, 0.15), {"short fibre"}),
    "stretched": ((500, 0.12, 0.1), {"long fibre", "passive at rest"}),
    "loose": ((500, 0.2, 0.5), {"slack throughout"}),
}


def planted() -> mujoco.MjModel:
    """Return straight muscles of 0.2 to 0.4 m, 0.3 m at rest, of which all but the sane have a fault."""
    custom, tendons = "", ""
    for name, ((force, optimal, slack), _) in PLANTED.items():
        tendons += f'<spatial name="{name}"><site site="origin"/><site site="insertion"/></spatial>'
        elements = f'<element objtype="tendon" objname="{name}"/>'
        for key, value in (
            ("max_isometric_force", force),
            ("optimal_fiber_length", optimal),
            ("tendon_slack_length", slack),
        ):
            custom += f'<numeric name="{name}_{key}" data="{value}"/>'
            elements += f'<element objtype="numeric" objname="{name}_{key}"/>'
        custom += f'<tuple name="mjwrap_{name}">{elements}</tuple>'
    natives = {"kept": ".19 .41", "exceeded": ".21 .39", "negative": ".19 .7"}
    muscles = ""
    for name, lengths in natives.items():
        tendons += f'<spatial name="{name}"><site site="origin"/><site site="insertion"/></spatial>'
        muscles += (
            f'<muscle name="{name}" tendon="{name}" force="500" range=".5 1.3" lengthrange="{lengths}"/>'
        )
    return mujoco.MjModel.from_xml_string(f"""
    <mujoco>
      <worldbody>
        <site name="origin"/>
        <body pos=".3 0 0">
          <joint name="slide" type="slide" axis="1 0 0" range="-.1 .1"/> <geom size=".01" mass="1"/>
          <site name="insertion"/>
        </body>
      </worldbody>
      <tendon>{tendons}</tendon> <actuator>{muscles}</actuator> <custom>{custom}</custom>
    </mujoco>""")


def test_planted_faults_are_found_and_nothing_else() -> None:
    report = mw.implausible(mw.MuscleSystem(planted()))
    found = {name: {f.kind for f in report.findings if f.muscle == name} for name in PLANTED}
    assert found == {name: kinds for name, (_, kinds) in PLANTED.items()}
    others = {f.muscle: f for f in report.findings if f.muscle not in PLANTED}
    assert len(report.findings) == sum(len(kinds) for kinds in found.values()) + 2
    assert set(others) == {"exceeded", "negative"}
    assert others["exceeded"].kind == mw.Implausible.LENGTH_RANGE
    assert others["exceeded"].value == pytest.approx(0.01 / 0.18, abs=1e-6)
    assert others["negative"].value == pytest.approx(0.19 - 0.5 * (0.7 - 0.19) / 0.8, rel=1e-12)
    (stretched,) = (f for f in report.of(mw.Implausible.LONG_FIBER) if f.muscle == "stretched")
    assert stretched.value == pytest.approx((0.4 - 0.1) / 0.12, abs=1e-6)
    told = json.loads(json.dumps(report.as_dict(), allow_nan=False))["findings"]
    assert [f["kind"] for f in told if f["muscle"] == "weak"] == ["no force"]
    assert report.remarks == {}


def test_limits_and_the_rest_pose_are_the_callers() -> None:
    muscles = mw.MuscleSystem(planted())
    loose = mw.ParameterLimits((-99.0, 99.0), (0.0, 99.0), 1e3, 9.0, (0.0, 1e9))
    kinds = {f.kind for f in mw.implausible(muscles, limits=loose).findings}
    assert kinds == {mw.Implausible.NEGATIVE_TENDON, mw.Implausible.SLACK}
    there = mw.implausible(muscles, ranges={}, rest=[-0.1])
    assert there.of(mw.Implausible.PASSIVE_AT_REST) == []
    with pytest.raises(mw.StateError, match="shape"):
        mw.implausible(muscles, ranges={}, rest=[0.0, 0.0])


@pytest.mark.parametrize("law", [mw.DeGrooteFregly2016, mw.Millard2012])
def test_an_elastic_tendon_is_judged_as_a_rigid_one(
    law: type[mw.DeGrooteFregly2016 | mw.Millard2012],
) -> None:
    reports = []
    for tendon in ("rigid", "elastic"):
        spec = mujoco.MjSpec.from_file(ELBOW)
        mw.set_laws(spec, {"BRA": law(987.0, 0.0858, 0.005, tendon=tendon)})
        reports.append(mw.implausible(mw.MuscleSystem(spec.compile())))
    rigid, elastic = reports
    assert rigid.findings == elastic.findings
    assert {f.kind for f in elastic.findings} == {"long fibre", "passive at rest"}


@pytest.mark.myo
@pytest.mark.slow
@pytest.mark.filterwarnings(
    "ignore:Attaching a spec with an empty prefix:UserWarning"
)  # myo_sim builds it so
def test_the_full_body_has_160_negative_tendons() -> None:
    """Counted from the model's own arrays, the 44 muscles that stay with MuJoCo included."""
    model = load_myo("myofullbody")
    low, high = model.actuator_lengthrange.T
    first, last = model.actuator_gainprm[:, :2].T
    negative = np.flatnonzero(low - first * (high - low) / (last - first) < 0.0)
    assert (len(negative), model.nu) == (160, 416)
    report = mw.implausible(mw.MuscleSystem(model), ranges={})
    found = [finding.muscle for finding in report.of(mw.Implausible.NEGATIVE_TENDON)]
    assert sorted(found) == sorted(model.actuator(i).name for i in negative)


@pytest.mark.myo
@pytest.mark.slow
@pytest.mark.filterwarnings(
    "ignore:Attaching a spec with an empty prefix:UserWarning"
)  # myo_sim builds it so
def test_random_poses_of_the_arm_stay_within_its_ranges() -> None:
    """Up to eight variables move a muscle: thousands of poses drawn at random get less far than the search."""
    model = load_myo("myoarm_r")
    muscles, data = mw.MuscleSystem(model), mujoco.MjData(model)
    found = mw.length_ranges(muscles)
    assert mw.length_ranges(muscles, names=["BRA"])["BRA"].held == ()
    lengths = []
    for qpos in PoseMaker(model, model.qpos0, seed=9).random(3000).qpos:
        data.qpos[:] = qpos
        muscles.reset(data)
        muscles.forward(data)
        lengths.append(np.where(muscles.status == 0, muscles.length, np.nan))
    low, high = np.nanmin(lengths, axis=0), np.nanmax(lengths, axis=0)
    shortest = np.array([found[name].shortest for name in muscles.names])
    longest = np.array([found[name].longest for name in muscles.names])
    span = longest - shortest
    assert ((shortest - low) / span).max() < 1e-3
    assert ((high - longest) / span).max() < 1e-3
    assert ((high - low) / span).mean() < 0.97


def test_the_command_prints_the_report(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    path = tmp_path / "planted.mjb"
    mujoco.mj_saveModel(planted(), str(path))
    facts = tmp_path / "report.json"
    ran = run_here("inspect", capsys, path, "--json", facts)
    assert ran.code == 0
    assert "loose" in ran.out
    assert "slack throughout" in ran.out
    read = json.loads(facts.read_text())
    assert {f["muscle"] for f in read["findings"]} == set(PLANTED) - {"sane"} | {"exceeded", "negative"}
    assert run_here("inspect", capsys, path, "--strict", "--quick").code == 1
    wrong = run_here("inspect", capsys, path, "--range", "slip=0,1")
    assert wrong.code == 2
    assert "slide" in wrong.err
