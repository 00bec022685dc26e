"""What is refused, and what a run did without a path, is told as it is, with the remedy where there is one."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

import mjwrap as mw
from mjwrap.comparison import compare_motion
from mjwrap.runs.excitation import Excitation

CASES = Path(__file__).resolve().parents[2] / "shared" / "cases"
# Two muscles on one string that share a force limit; `reason` takes other things that mjwrap cannot take over.
SHARED = """
<mujoco>
  <worldbody>
    <site name="o" pos="0 0 .3"/>
    <body name="arm"><joint name="j" axis="0 1 0" range="-60 60"/>
      <geom type="capsule" fromto="0 0 0 .2 0 0" size=".01" mass=".5"/><site name="i" pos=".1 0 .02"/></body>
  </worldbody>
  <tendon><spatial name="t" actuatorfrcrange="-60 0"><site site="o"/><site site="i"/></spatial></tendon>
  <actuator><muscle name="fast" tendon="t" lengthrange=".2 .4" force="50"/>
    <muscle name="slow" tendon="t" lengthrange=".2 .4" force="30"/></actuator>
</mujoco>
"""
BACK = """
<mujoco>
  <compiler autolimits="true"/>
  <default><joint limited="true" range="0 {most}" damping=".1"/></default>
  <worldbody>
    <site name="o" pos="-.15 0 0"/><site name="back" pos="0 -.15 0"/>
    <body><geom type="capsule" size=".045" fromto="0 0 0 .5 0 0"/><joint name="shoulder" axis="0 0 1"/>
      <geom name="drum" type="cylinder" size="{radius} .05" mass="0" contype="0" conaffinity="0"/>
      <site name="i" pos=".15 -.06 0"/></body>
  </worldbody>
  <tendon><spatial name="ext"><site site="o"/><geom geom="drum" sidesite="back"/><site site="i"/></spatial></tendon>
  <actuator><muscle name="ext" tendon="ext"/></actuator>
</mujoco>
"""


def round_the_back(q: float, radius: float) -> float:
    """Length of a planar string round the side of `back`: two tangents and an arc [m]."""
    to_origin, to_insertion = 0.15, np.hypot(0.15, 0.06)
    between = 2.0 * np.pi + np.arctan2(-0.06, 0.15) + q - np.pi
    angle = between - np.arccos(radius / to_origin) - np.arccos(radius / to_insertion)
    if angle <= 0.0:  # it leaves the drum
        return float(
            np.hypot(-0.15 - to_insertion * np.cos(between + np.pi), to_insertion * np.sin(between + np.pi))
        )
    return float(np.sqrt(to_origin**2 - radius**2) + np.sqrt(to_insertion**2 - radius**2) + radius * angle)


@pytest.mark.parametrize("mode", ["wrench", "transmission"])
def test_a_refusal_names_each_native_muscle_with_the_reason(mode: str) -> None:
    native = mw.MuscleSystem(mujoco.MjModel.from_xml_string(SHARED)).native
    assert set(native) == {"fast", "slow"}
    if mode == "transmission":
        mw.install(mujoco.MjSpec.from_string(SHARED), mode)  # MuJoCo itself limits their force there
        return
    with pytest.raises(mw.ModelError) as refused:
        mw.install(mujoco.MjSpec.from_string(SHARED), mode)
    for name, reason in native.items():
        assert f"{name}: {reason}" in str(refused.value)


@pytest.mark.parametrize("wrong", [mujoco.MjModel.from_xml_string(SHARED), None, "model.xml"])
def test_ranges_of_something_else_are_a_named_error(wrong: object) -> None:
    with pytest.raises(mw.ModelError, match="expected a MuscleSystem"):
        mw.length_ranges(wrong)  # pyright: ignore[reportArgumentType]
    with pytest.raises(mw.ModelError, match="expected an MjSpec"):
        mw.set_length_ranges(wrong)  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize("radius", [0.06, 0.08, 0.1, 0.12])
@pytest.mark.parametrize(("most", "gear"), [(40, 1.0), (90, 2.0), (120, 0.5)])
def test_ranges_are_those_of_the_geodesic_path(radius: float, most: int, gear: float) -> None:
    """MuJoCo 4.0 finds none at some of these, where its tendon jumps; its compiler must not look for them."""
    text = BACK.format(radius=radius, most=most).replace('tendon="ext"/>', f'tendon="ext" gear="{gear}"/>')
    spec = mujoco.MjSpec.from_string(text)
    mode = spec.compiler.LRopt.mode
    found = mw.set_length_ranges(spec)["ext"]
    lengths = [round_the_back(q, radius) for q in np.linspace(0.0, np.deg2rad(most), 2001)]
    assert (found.shortest, found.longest) == pytest.approx((min(lengths), max(lengths)), abs=1e-9)
    assert spec.compiler.LRopt.mode == mode
    model = mw.install(spec)
    np.testing.assert_allclose(
        model.actuator_lengthrange[0], (gear * found.shortest, gear * found.longest), rtol=1e-12
    )


def test_ranges_that_are_given_stay_and_an_error_changes_nothing() -> None:
    spec = mujoco.MjSpec.from_string(
        BACK.format(radius=0.1, most=90).replace('tendon="ext"/>', 'tendon="ext" lengthrange="1 2"/>')
    )
    assert mw.set_length_ranges(spec) == {}
    assert spec.actuators[0].lengthrange.tolist() == [1.0, 2.0]
    fixed = mujoco.MjSpec.from_string(SHARED.replace('lengthrange=".2 .4"', ""))
    with pytest.raises(mw.ModelError, match="limits the forces"):
        mw.set_length_ranges(fixed)
    assert [each.lengthrange.tolist() for each in fixed.actuators] == [[0.0, 0.0]] * 2


def test_a_range_that_mujoco_does_not_find_names_the_remedy(tmp_path: Path) -> None:
    """A joint without limits and a string that can grow without end."""
    text = BACK.format(radius=0.1, most=90).replace(
        'limited="true" range="0 90"', 'type="slide" limited="false"'
    )
    (tmp_path / "m.xml").write_text(text)
    for call in (lambda: mw.load(tmp_path / "m.xml"), lambda: mw.install(mujoco.MjSpec.from_string(text))):
        with pytest.raises(mw.ModelError, match=r"mw\.set_length_ranges"):
            call()


@pytest.mark.skipif(not CASES.is_dir(), reason="needs the shared cases beside the checkout")
def test_a_comparison_says_what_acted_where_there_was_no_path() -> None:
    model = mujoco.MjModel.from_xml_path(str(CASES / "29_held_claim" / "model.xml"))
    seconds = 1.0
    motion = compare_motion(model, ["random"], seconds)
    muscles, data = mw.MuscleSystem(model), mujoco.MjData(model)
    excitation, failed, held = Excitation(muscles, ["random"], 0), 0, 0
    for _ in range(round(seconds / model.opt.timestep)):
        excitation.write(data)
        muscles.step(data)
        failed += int(muscles.status[2] != 0)
        held += int(muscles.held[2])
    assert 0 < held < failed
    (line,) = motion.paths.splitlines()
    assert line.startswith(f"m3: {failed} steps without a path")
    continued = f"its length was continued from the surface at {failed - held} steps"
    assert line.endswith(f"; its last valid force was kept at {held} steps, {continued}")


# A load that moves into the ball over which its string runs, deeper than half the radius.
DIVING = """
<mujoco>
  <option gravity="0 0 0" timestep="{step}" integrator="{integrator}"/>
  <worldbody>
    <geom name="ball" type="sphere" size=".1" contype="0" conaffinity="0"/><site name="a" pos="-.3 .02 .1"/>
    <body name="load" pos=".2 0 .02"><joint name="x" type="slide" axis="1 0 0"/>
      <geom size=".02" mass="1" contype="0" conaffinity="0"/><site name="b"/></body>
  </worldbody>
  <tendon><spatial name="t"><site site="a"/><geom geom="ball"/><site site="b"/></spatial></tendon>
  <actuator><muscle name="m" tendon="t" lengthrange=".2 .6" force="10"/></actuator>
  <keyframe><key name="out" qvel="-2"/><key name="in" qpos="-.19" qvel="1"/></keyframe>
</mujoco>
"""


@pytest.mark.parametrize("integrator", ["Euler", "RK4"])
@pytest.mark.parametrize("key", ["out", "in"])
def test_what_acted_is_counted_at_every_stage(
    integrator: str, key: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A step counts as held if a stage of it was; before its first path a muscle has no force to keep."""
    model = mujoco.MjModel.from_xml_string(DIVING.format(step=0.004, integrator=integrator))
    stages: list[tuple[bool, bool, bool]] = []
    sound = mw.MuscleSystem._act

    def act(self: mw.MuscleSystem, *given: object, **named: object) -> None:
        sound(self, *given, **named)  # pyright: ignore[reportArgumentType]
        held = bool(self.held[0])
        stages.append((bool(self.status[0]), held and self.tension[0] > 0.0, held and self.length[0] == 0.0))

    monkeypatch.setattr(mw.MuscleSystem, "_act", act)
    motion = compare_motion(model, ["constant:1"], 0.12, key=model.key(key).id)
    each = 4 if integrator == "RK4" else 1
    steps = np.array(stages).reshape(-1, each, 3).any(axis=1)
    failed, kept, forceless = (int(x) for x in steps.sum(axis=0))
    assert failed > 0
    assert (kept > 0, forceless > 0) == (key == "out", key == "in")
    (line,) = motion.paths.splitlines()
    assert line.startswith(f"m: {failed} steps without a path; last reason:")
    words = ("its last valid force was kept", "it had no force, because it had had no path before")
    for count, what in zip((kept, forceless), words, strict=True):
        assert (what in line) == (count > 0)
        if 0 < count < failed:
            assert f"{what} at {count} step" in line
