"""Curves of muscles over a joint: MuJoCo's own numbers, geometry by hand, differences, and balance of the fibres."""

import math

import mujoco
import numpy as np
import pytest
from cable_robot import CABLES
from cli_runs import ELBOW
from test_cli_analysis import KNEE

import mjwrap as mw

ARM = """
<mujoco>
  <compiler angle="radian"/>
  <worldbody><site name="o" pos="0 0 .3"/>
    <body><joint name="elbow" axis="0 1 0" range="-2 -.3"/><geom size=".02" pos="0 0 .2" mass="1"/>
      <site name="i" pos="0 0 .1"/></body></worldbody>
  <tendon><spatial name="flexor"><site site="o"/><site site="i"/></spatial></tendon>
  <actuator><muscle name="flexor" tendon="flexor" force="300" lengthrange=".2 .4"/></actuator>
</mujoco>
"""


def load(text: str) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(text)


def triangle(angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Length and moment arm of ARM's muscle by the law of cosines."""
    length = np.sqrt(0.09 + 0.01 - 0.06 * np.cos(angle))
    return length, -0.03 * np.sin(angle) / length


def test_a_triangle_has_its_lengths_and_moment_arms() -> None:
    curves = mw.curves(load(ARM), "elbow", samples=7)
    assert curves.at == pytest.approx(np.linspace(-2.0, -0.3, 7))
    length, arm = triangle(curves.at)
    assert curves["length"][:, 0] == pytest.approx(length, rel=1e-14)
    assert curves["moment_arm"][:, 0] == pytest.approx(arm, rel=1e-13)
    assert (curves.joint, curves.turns, curves.names, curves.follows) == ("elbow", True, ("flexor",), "")


def test_the_force_is_that_of_mujocos_actuator() -> None:
    """Tension at activation 0.4, and its passive part without activation, as MuJoCo computes them."""
    curves = mw.curves(load(ARM), "elbow", samples=5, activation=0.4)
    model = load(ARM)
    data = mujoco.MjData(model)
    for k, angle in enumerate(curves.at):
        for name, act in (("tension", 0.4), ("passive_fiber_force", 0.0)):
            data.qpos[0], data.act[0], data.ctrl[0] = angle, act, act
            mujoco.mj_forward(model, data)
            assert curves[name][k, 0] == pytest.approx(-data.actuator_force[0], rel=1e-12, abs=1e-12)
    both = curves["active_fiber_force"] + curves["passive_fiber_force"]
    assert both == pytest.approx(curves["tension"], rel=1e-12)
    assert curves["moment"] == pytest.approx(curves["moment_arm"] * curves["tension"], rel=1e-15)
    assert np.isnan(curves["fiber_length"]).all()
    assert np.isnan(curves["pennation"]).all()


def test_native_tendons_of_the_elbow_are_the_same() -> None:
    model = mujoco.MjModel.from_xml_path(ELBOW)
    limits = model.actuator_forcerange.copy()
    curves = mw.curves(model, "elbow_flexion", samples=21, native=True)
    assert len(curves.names) == 7
    for quantity in ("length", "moment_arm"):
        assert curves.native[quantity] == pytest.approx(curves[quantity], abs=1e-14)
    assert np.array_equal(model.actuator_forcerange, limits)  # the model's own muscles still pull


def test_cables_have_the_curves_of_mujocos_tendons() -> None:
    """Lengths and moment arms alone: their forces follow from controls."""
    curves = mw.curves(load(CABLES), "#2", ["*"], samples=9, span=(-0.6, 0.6), native=True)
    assert curves.cables == ("winch", "brake", "tackle", "leash")
    assert set(curves.names) > set(curves.cables)
    for quantity in ("length", "moment_arm"):
        assert curves[quantity] == pytest.approx(curves.native[quantity], abs=1e-12)
    for i, name in enumerate(curves.names):
        for quantity in ("tension", "moment", "active_fiber_force", "passive_fiber_force", "fiber_length"):
            values = np.isnan(curves[quantity][:, i])
            assert values.all() if name in curves.cables or quantity == "fiber_length" else not values.any()


def test_joints_that_follow_move_along() -> None:
    """The moment arm about the knee is minus the slope of the length, kneecap and all."""
    model = load(KNEE)
    curves = mw.curves(model, "knee", samples=401)
    slope = np.gradient(curves["length"][:, 0], curves.at)[1:-1]
    assert curves["moment_arm"][1:-1, 0] == pytest.approx(-slope, abs=1e-6)
    alone = mw.curves(model, "glide", samples=5, span=(-0.01, 0.01))
    assert (alone.follows, alone.turns) == ("knee", False)


@pytest.mark.parametrize("law", [mw.Millard2012, mw.DeGrooteFregly2016])
@pytest.mark.parametrize("tendon", ["rigid", "elastic"])
def test_fibres_balance_the_tendon(law: type, tendon: str) -> None:
    spec = mujoco.MjSpec.from_string(ARM)
    given = {"pennation_angle": 0.3, "fiber_damping": 0.1, "tendon": tendon}
    mw.set_laws(spec, {"flexor": law(500.0, 0.1, 0.2, **given)})
    model = spec.compile()
    found = {
        a: mw.curves(model, "elbow", samples=9, activation=a, span=(-2.0, -1.2)) for a in (0.0, 0.3, 0.6)
    }
    for curves in found.values():
        both = curves["active_fiber_force"] + curves["passive_fiber_force"]
        assert both == pytest.approx(curves["tension"], rel=1e-6, abs=1e-5)
        along = curves["fiber_length"] * np.cos(curves["pennation"])
        assert along + curves["tendon_length"] == pytest.approx(curves["length"], rel=1e-12)
        assert curves["fiber_length"] * np.sin(curves["pennation"]) == pytest.approx(
            0.1 * math.sin(0.3), rel=1e-12
        )
        assert curves["normalized_fiber_length"] == pytest.approx(curves["fiber_length"] / 0.1, rel=1e-14)
        assert (np.ptp(curves["tendon_length"]) > 1e-5) == (tendon == "elastic")
    if tendon == "rigid":
        ratio = found[0.6]["active_fiber_force"] / found[0.3]["active_fiber_force"]
        assert ratio == pytest.approx(np.full((9, 1), 2.0), rel=1e-12)
        assert found[0.6]["passive_fiber_force"] == pytest.approx(
            found[0.0]["passive_fiber_force"], rel=1e-12
        )


def test_the_pose_of_other_joints_counts() -> None:
    bent = np.array([0.4, -0.5, 0.03 * -0.5 + 0.01 * 0.25])
    at_rest, moved = (mw.curves(load(KNEE), "hip", "qu*", qpos=q, samples=3) for q in (None, bent))
    assert abs(at_rest["length"] - moved["length"]).max() > 1e-3


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("knee",), "no hinge or slide 'knee'; there are: elbow"),
        (("elbow", "BRA"), "no muscle 'BRA'; muscles: flexor"),
        (("elbow", None, {"samples": 1}), "samples"),
        (("elbow", None, {"span": (1.0, 0.0)}), "span"),
        (("elbow", None, {"activation": 2.0}), "activation"),
        (("elbow", None, {"qpos": [0.0, 0.0]}), r"qpos must have shape \(1,\)"),
    ],
)
def test_mistakes_are_named(arguments: tuple, told: str) -> None:
    joint, *rest = arguments
    options = rest[1] if len(rest) > 1 else {}
    with pytest.raises(mw.ModelError, match=told):
        mw.curves(load(ARM), joint, rest[0] if rest else None, **options)


def test_a_joint_that_moves_nothing_is_named() -> None:
    still = ARM.replace('<site name="i" pos="0 0 .1"/></body>', '</body><site name="i" pos="0 0 .1"/>')
    with pytest.raises(mw.ModelError, match="joint 'elbow' moves none of the muscles: flexor"):
        mw.curves(load(still), "elbow")


def test_a_quantity_that_does_not_exist_is_named() -> None:
    with pytest.raises(mw.ModelError, match="no quantity 'stiffness'; there are: length, moment_arm"):
        mw.curves(load(ARM), "elbow", samples=2)["stiffness"]
