"""Side sites: the rules of MuJoCo 3 and 4, which of them a model follows, and that it keeps it."""

from __future__ import annotations

import math
import re
from pathlib import Path

import mujoco
import numpy as np
import pytest
from declared_models import compiled, element

import mjwrap as mw
from mjwrap.checking import check_model
from mjwrap.cli import main
from mjwrap.comparison import Outcome, compare_poses, verdict
from mjwrap.kernels import layout
from mjwrap.mjcf.side_rules import running_side_rule, turn_by_rule
from mjwrap.plugin import read, without_plugin
from mjwrap.system import CableSystem

Vector = np.ndarray
RUNNING = running_side_rule()
OTHER = 7 - RUNNING
RADIUS = 0.05
# End and side site can be put anywhere; the cylinder's axis is z.
FREE = """
<mujoco>
  <worldbody>
    <geom name="drum" type="cylinder" size=".05 .1" contype="0" conaffinity="0"/>
    <body name="a" pos=".1 0 0"><geom size=".01" mass="1" contype="0" conaffinity="0"/><site name="a"/>
      <joint name="ax" type="slide" axis="1 0 0"/><joint name="ay" type="slide" axis="0 1 0"/>
      <joint name="az" type="slide" axis="0 0 1"/></body>
    <body name="b" pos="-.1 0 0"><geom size=".01" mass="1" contype="0" conaffinity="0"/><site name="b"/>
      <joint name="bx" type="slide" axis="1 0 0"/><joint name="by" type="slide" axis="0 1 0"/>
      <joint name="bz" type="slide" axis="0 0 1"/></body>
    <body name="s" pos="0 .1 0"><geom size=".01" mass="1" contype="0" conaffinity="0"/><site name="s"/>
      <joint name="sx" type="slide" axis="1 0 0"/><joint name="sy" type="slide" axis="0 1 0"/>
      <joint name="sz" type="slide" axis="0 0 1"/></body>
  </worldbody>
  <tendon><spatial name="t"><site site="a"/><geom geom="drum" sidesite="s"/><site site="b"/></spatial></tendon>
  <actuator><muscle name="m" tendon="t" lengthrange=".1 .9"/></actuator>
</mujoco>
"""
# As at the teres major of myo_sim's arm: the side site is nearer to the middle of the long way round.
SHOULDER = """
<mujoco>
  <compiler angle="degree"/>
  <worldbody>
    <geom name="drum" type="cylinder" size=".045 .05" contype="0" conaffinity="0"/>
    <site name="a" pos=".06 0 0"/><site name="side" pos=".025 -.0433 0"/>
    <body><joint name="turn" axis="0 0 1" range="-35 30"/>
      <geom type="capsule" fromto="0 0 .01 .2 .1 .01" size=".01" mass=".5" contype="0" conaffinity="0"/>
      <site name="b" pos="-.0099 .0561 .01"/></body>
  </worldbody>
  <tendon><spatial name="t"><site site="a"/><geom geom="drum" sidesite="side"/><site site="b"/></spatial></tendon>
  <actuator><muscle name="m" tendon="t" lengthrange=".05 .4" force="20"/></actuator>
</mujoco>
"""


def winding(p: Vector, q: Vector) -> float:
    return math.atan2(p[0] * q[1] - p[1] * q[0], p[0] * q[0] + p[1] * q[1])


def touching(p: Vector, turn: int) -> Vector:
    """The point at which the tangent from p touches the circle, from where the string goes on with this turn."""
    reach = math.hypot(*p)
    angle = math.atan2(p[1], p[0]) + turn * math.acos(RADIUS / reach)
    return RADIUS * np.array([math.cos(angle), math.sin(angle)])


def crosses(p: Vector, q: Vector, r: Vector, s: Vector) -> bool:
    u, v, w = q - p, s - r, r - p
    determinant = u[0] * v[1] - u[1] * v[0]
    if determinant == 0.0:
        return False
    t, k = (w[0] * v[1] - w[1] * v[0]) / determinant, (w[0] * u[1] - w[1] * u[0]) / determinant
    return 0.0 <= t <= 1.0 and 0.0 <= k <= 1.0


def mujoco_length(a: Vector, b: Vector, side: Vector, rule: int) -> tuple[float, bool]:
    """The length of MuJoCo's tendon round the cylinder by a rule [m], and whether it goes through the cylinder."""
    straight = float(np.linalg.norm(b - a))
    a2, b2, s2 = a[:2], b[:2], side[:2]
    step = b2 - a2
    nearest = a2 + np.clip(-a2 @ step / (step @ step), 0.0, 1.0) * step
    clear = bool(np.hypot(*nearest) > RADIUS)
    ways = {turn: (touching(a2, turn), touching(b2, -turn)) for turn in (1, -1)}
    open_ways = [turn for turn, (p, q) in ways.items() if not crosses(a2, p, b2, q)]
    if rule == 4:
        laid = winding(a2, s2) + winding(s2, b2)
        stays = abs(laid - winding(a2, b2)) < math.pi
        turn = 1 if laid > 0.0 else -1
        if (clear and stays) or turn not in open_ways:
            return straight, not clear
    else:
        if clear and nearest @ s2 >= 0.0:
            return straight, False
        good = {turn: (p + q) @ s2 / np.linalg.norm(p + q) for turn, (p, q) in ways.items()}
        turn = max(open_ways, key=lambda turn: good[turn])
    p, q = ways[turn]
    arc = (turn * (math.atan2(q[1], q[0]) - math.atan2(p[1], p[0]))) % (2.0 * math.pi)
    flat = float(np.linalg.norm(p - a2) + RADIUS * arc + np.linalg.norm(b2 - q))
    return math.hypot(flat, b[2] - a[2]), False


def outside(rng: np.random.Generator) -> Vector:
    while True:
        point = rng.uniform(-0.2, 0.2, 3)
        if np.hypot(*point[:2]) > 1.02 * RADIUS:
            return point


def length_at(model: mujoco.MjModel, rule: int | None = None) -> float:
    """The length of mjwrap's path from a cold start at the reference pose, of a copy of the model."""
    muscles, data = mw.MuscleSystem(model, side_rule=rule), mujoco.MjData(model)
    muscles.forward(data)
    assert muscles.status.tolist() == [0]
    muscles.release()
    return float(muscles.length[0])


def scene(a: Vector, b: Vector, side: Vector) -> mujoco.MjModel:
    """A model whose reference pose has the ends and the side site at these points."""
    text = FREE
    for name, point in (("a", a), ("b", b), ("s", side)):
        at = " ".join(repr(float(x)) for x in point)
        text = re.sub(rf'<body name="{name}" pos="[^"]*"', f'<body name="{name}" pos="{at}"', text)
    return mujoco.MjModel.from_xml_string(text)


def test_mujoco_follows_the_rule_of_its_version_and_mjwrap_either_rule() -> None:
    """The running MuJoCo against the naive twins of both rules; then mjwrap, which can follow both."""
    rng, apart = np.random.default_rng(4), 0
    for _ in range(250):
        a, b, side = (outside(rng) for _ in range(3))
        model = scene(a, b, side)
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        mujoco.mj_tendon(model, data)
        lengths = {rule: mujoco_length(a, b, side, rule) for rule in (3, 4)}
        apart += abs(lengths[3][0] - lengths[4][0]) > 1e-9
        assert data.ten_length[0] == pytest.approx(lengths[RUNNING][0], abs=1e-12)
        for rule, (length, through) in lengths.items():
            turn = float(turn_by_rule(rule, RADIUS, a[None], b[None], side[None])[0])
            arc = abs(turn) - sum(math.acos(RADIUS / math.hypot(*x[:2])) for x in (a, b))
            flat = RADIUS * arc + sum(math.sqrt(x[0] ** 2 + x[1] ** 2 - RADIUS**2) for x in (a, b))
            told = math.hypot(flat, b[2] - a[2]) if arc > 0.0 else float(np.linalg.norm(b - a))
            if not through:  # MuJoCo's straight line through the cylinder is not followed
                assert told == pytest.approx(length, abs=1e-12)
                assert length_at(model, rule) == pytest.approx(length, abs=1e-12)
    assert apart > 40


@pytest.mark.parametrize("rule", [3, 4])
def test_cold_starts_elsewhere_are_those_of_a_motion_from_the_reference_pose(rule: int) -> None:
    """Ends that turn about the axis by less than half a turn together, and move in and out."""
    rng, wrapped = np.random.default_rng(9), 0
    for _ in range(60):
        a, b, side = (outside(rng) for _ in range(3))
        model = scene(a, b, side)
        muscles, data = mw.MuscleSystem(model, side_rule=rule), mujoco.MjData(model)
        angles, reach = rng.uniform(-1.4, 1.4, 2), rng.uniform(0.9, 1.4, 2)
        muscles.forward(data)
        for share in np.linspace(0.0, 1.0, 41):
            for k, point in enumerate((a, b)):
                cos, sin = math.cos(share * angles[k]), math.sin(share * angles[k])
                out = max(1.0 + share * (reach[k] - 1.0), 1.01 * RADIUS / math.hypot(*point[:2]))
                moved = out * np.array([cos * point[0] - sin * point[1], sin * point[0] + cos * point[1]])
                data.qpos[3 * k : 3 * k + 2] = moved - point[:2]
            data.qpos[6:] = share * rng.uniform(
                -0.1, 0.1, 3
            )  # where the side site is by then does not matter
            muscles.forward(data)
        assert muscles.status[0] == 0
        if abs(muscles._last.node[0, layout.S_SWEEP]) > 2.0 * math.pi:
            continue  # more than a turn is followed in small steps only
        warm = muscles.length[0]
        muscles.reset(data)
        muscles.forward(data)
        assert muscles.length[0] == pytest.approx(warm, abs=1e-12)
        wrapped += len(muscles.contact_points(0))
    assert wrapped > 20


def test_a_muscle_starts_on_the_running_mujocos_side_and_stays_there() -> None:
    """At the reference pose, after a reset, in both modes of the plugin, in compare and in check."""
    plain = mujoco.MjModel.from_xml_string(SHOULDER)
    data = mujoco.MjData(plain)
    mujoco.mj_forward(plain, data)
    native = float(data.ten_length[0])
    assert abs(length_at(plain, 3) - length_at(plain, 4)) > 0.01  # the two rules differ here
    assert length_at(plain) == pytest.approx(native, abs=1e-12)
    assert mw.MuscleSystem(plain).side_rule == RUNNING
    muscles = mw.MuscleSystem(plain)
    before = None
    for angle in np.linspace(0.0, 1.0, 101):  # to where the other rule would agree, and back
        data.qpos[0] = angle
        muscles.forward(data)
        assert before is None or abs(muscles.length[0] - before) < 2e-3
        before = muscles.length[0]
    mujoco.mj_resetData(plain, data)
    muscles.reset(data)
    muscles.forward(data)
    assert muscles.length[0] == pytest.approx(native, abs=1e-12)
    muscles.release()
    for mode in ("wrench", "transmission"):
        for rule in (None, 3, 4):
            model = mw.install(mujoco.MjSpec.from_string(SHOULDER), mode, side_rule=rule)
            driven = mujoco.MjData(model)
            mujoco.mj_forward(model, driven)
            assert read(driven).length[0] == length_at(plain, rule)
            mujoco.mj_step(model, driven, 50)
            mujoco.mj_resetData(model, driven)
            mujoco.mj_forward(model, driven)
            assert read(driven).length[0] == length_at(plain, rule)
    found = compare_poses(plain, samples=21, bases=2)
    (summary,) = found.muscles.values()
    assert summary.at_fault == 0
    assert summary.counts["AGREE"] > 0.5 * summary.poses
    assert check_model(plain, poses=5, samples=21).failed == []
    other = compare_poses(plain, samples=21, bases=2, side_rule=OTHER)
    (summary,) = other.muscles.values()
    assert (other.side_rule, summary.at_fault) == (OTHER, 0)
    assert summary.counts["OTHER_BRANCH"] > 0.5 * summary.poses
    assert "to which its rule for side sites (side_rule)" in verdict(summary, other.jumps).why
    assert check_model(plain, poses=5, samples=21, side_rule=OTHER).failed == []


def test_a_start_on_the_other_side_than_the_rule_means_is_put_to_mjwrap(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Paths of the other rule, under the name of this one."""

    def turned(model: mujoco.MjModel, **options: object) -> CableSystem:
        muscles = CableSystem(model)
        wrong = CableSystem(model, side_rule=OTHER)
        muscles._plan.node[:] = wrong._plan.node
        return muscles

    monkeypatch.setattr("mjwrap.comparison.pose_comparison.CableSystem", turned)
    found = compare_poses(mujoco.MjModel.from_xml_string(SHOULDER), samples=11, bases=0)
    assert found.total(Outcome.WRONG_SIDE) > 5
    assert found.at_fault > 5


@pytest.mark.parametrize("rule", [3, 4])
def test_an_installed_model_keeps_its_rule(rule: int, tmp_path: Path) -> None:
    """Saved as XML or MJB and opened again, installed again, attached, and without its plugin."""
    plain = mujoco.MjModel.from_xml_string(SHOULDER)
    expected = length_at(plain, rule)

    def length(model: mujoco.MjModel) -> float:
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        return float(read(data).length[0])

    spec = mujoco.MjSpec.from_string(SHOULDER)
    model = mw.install(spec, side_rule=rule)
    assert length(model) == expected
    assert length(mw.install(spec)) == expected  # keeps the rule of the first install
    xml, mjb = tmp_path / "saved.xml", tmp_path / "saved.mjb"
    xml.write_text(spec.to_xml())
    mujoco.mj_saveModel(model, str(mjb))
    assert length(mujoco.MjModel.from_xml_path(str(xml))) == pytest.approx(expected, abs=1e-12)
    assert length(mw.load(xml)) == pytest.approx(expected, abs=1e-12)
    assert length(mw.load(xml, side_rule=7 - rule)) == pytest.approx(length_at(plain, 7 - rule), abs=1e-12)
    assert length(mw.load(mjb)) == length(mw.load(mjb, side_rule=rule)) == expected
    with pytest.raises(
        mw.ModelError, match=f"saved with side_rule {rule}, and an MJB file cannot be changed"
    ):
        mw.load(mjb, side_rule=7 - rule)
    assert length_at(without_plugin(model)) == expected
    assert length_at(without_plugin(model), 7 - rule) == length_at(plain, 7 - rule)
    parent = mujoco.MjSpec.from_string(
        "<mujoco><worldbody><body name='base'><geom size='.1'/></body></worldbody></mujoco>"
    )
    parent.attach(spec, prefix="left_", frame=parent.worldbody.add_frame())
    assert length(parent.compile()) == expected
    together = mw.install(parent, side_rule=7 - rule)
    assert length(together) == expected  # the attached model's own rule
    assert mw.plugin.Muscles(mujoco.MjData(together)).side_rule == rule
    assert length_at(without_plugin(together)) == expected


def test_a_model_from_before_rules_were_stored_has_mujoco_3s() -> None:
    spec = mujoco.MjSpec.from_string(SHOULDER)
    mw.install(spec, side_rule=4)
    xml = spec.to_xml()
    assert xml.count('<config key="side_rule" value="4"/>') == 1
    old = mujoco.MjModel.from_xml_string(xml.replace('<config key="side_rule" value="4"/>', ""))
    data = mujoco.MjData(old)
    mujoco.mj_forward(old, data)
    assert read(data).length[0] == pytest.approx(
        length_at(mujoco.MjModel.from_xml_string(SHOULDER), 3), abs=1e-12
    )


def test_the_hints_of_a_tuple_are_the_authors() -> None:
    """A hint that a tuple lists means the same under every rule; the route of a tendon follows the rule."""
    listed = "".join(
        [element("site", "a"), element("geom", "drum"), element("site", "side", 1), element("site", "b")]
    )
    own = '<numeric name="mjwrap_m_optimal_force" data="10"/><tuple name="mjwrap_m">{}'
    own += element("numeric", "mjwrap_m_optimal_force") + "</tuple>"

    def model(stops: str) -> mujoco.MjModel:
        custom = f"<custom>{own.format(element('actuator', 'm') + stops)}</custom></mujoco>"
        return mujoco.MjModel.from_xml_string(SHOULDER.replace("</mujoco>", custom))

    plain = mujoco.MjModel.from_xml_string(SHOULDER)
    for rule in (3, 4):
        assert length_at(model(listed), rule) == length_at(plain, 3)
        assert length_at(model(""), rule) == length_at(plain, rule)


@pytest.mark.parametrize("wrong", [2, 5, "4", 0.5])
def test_a_rule_that_does_not_exist_is_refused(wrong: object) -> None:
    model = mujoco.MjModel.from_xml_string(SHOULDER)
    for call in (
        lambda: mw.MuscleSystem(model, side_rule=wrong),  # pyright: ignore[reportArgumentType]
        lambda: mw.install(mujoco.MjSpec.from_string(SHOULDER), side_rule=wrong),  # pyright: ignore[reportArgumentType]
        lambda: mw.load("nowhere.xml", side_rule=wrong),  # pyright: ignore[reportArgumentType]
    ):
        with pytest.raises(mw.ModelError, match=r"side_rule .* does not exist; it is 3, 4, or None"):
            call()


def test_the_commands_take_a_rule(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = tmp_path / "shoulder.xml"
    model.write_text(SHOULDER)
    given = ["--side-rule", str(OTHER)]
    assert main(["compare", str(model), "--samples", "5", "--bases", "0", "--duration", "0.01", *given]) == 0
    assert f"mjwrap with MuJoCo {OTHER}'s rule for side sites" in capsys.readouterr().out
    lengths = {}
    for mode in ("python", "wrench"):
        table = tmp_path / f"{mode}.npz"
        run = [
            "run",
            str(model),
            "--duration",
            "0.01",
            "--mode",
            mode,
            "--out",
            str(table),
            "--columns",
            "qpos,length",
        ]
        assert main([*run, *given]) == 0
        lengths[mode] = mw.read_table(table)["length:m"]
    expected = length_at(mujoco.MjModel.from_xml_string(SHOULDER), OTHER)
    assert lengths["python"][0] == lengths["wrench"][0] == expected
    again = tmp_path / "again.npz"
    replay = [
        "replay",
        str(tmp_path / "wrench.npz"),
        "--model",
        str(model),
        "--out",
        str(again),
        "--columns",
        "length",
    ]
    assert main([*replay, *given]) == 0
    assert mw.read_table(again)["length:m"] == pytest.approx(lengths["wrench"], abs=1e-12)
    assert main(["check", str(model), "--poses", "2", "--samples", "5", *given]) == 0
    with pytest.raises(SystemExit):
        main(["run", str(model), "--side-rule", "5"])


def test_other_kinds_of_routes_are_not_touched_by_the_rule() -> None:
    """Without a side site, and on a sphere, where only one way round is stable."""
    for tendon in ('<geom geom="elbow"/>', '<geom geom="ball" sidesite="ball_side"/>'):
        text = f'<spatial name="extensor"><site site="via"/>{tendon}<site site="insertion"/></spatial>'
        model = compiled(tendon=text)
        assert length_at(model, 3) == length_at(model, 4)
