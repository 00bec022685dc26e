"""`check_model`: sound models pass, and each law, when it is broken on purpose, is the one that fails."""

from collections.abc import Callable
from typing import Any

import mujoco
import pytest
from cli_runs import CASE2, ENTERS, ROOT

import mjwrap as mw
from mjwrap.checking import Checks, check_model

EVERY_MODEL = [str(path) for path in sorted((ROOT / "models").glob("*/*.xml"))]


def check(path: str, poses: int = 5, samples: int = 21) -> Checks:
    return check_model(mujoco.MjModel.from_xml_path(path), poses=poses, samples=samples)


@pytest.mark.parametrize("path", EVERY_MODEL, ids=lambda path: path.split("/")[-1])
def test_a_sound_model_passes_every_check(path: str) -> None:
    found = check(path)
    assert found.table().count("pass") == len(found.checks) == 10, found.table()
    (arms,) = (c for c in found.checks if c.name == "moment_arm")
    assert arms.remarks == ["differences converge to it with order 2.00 (expected: 2)"]


def failed_when(monkeypatch: pytest.MonkeyPatch, name: str, spoil: Callable[[Any], Any]) -> set[str]:
    """Return the checks that fail where a result of MuscleSystem is spoilt."""
    sound: Any = getattr(mw.MuscleSystem, name)
    if isinstance(sound, property):
        get: Any = sound.fget
        monkeypatch.setattr(mw.MuscleSystem, name, property(lambda muscles: spoil(get(muscles))))
    else:
        monkeypatch.setattr(mw.MuscleSystem, name, lambda *arguments: spoil(sound(*arguments)))
    return {c.name for c in check(CASE2).failed}


@pytest.mark.parametrize(
    ("name", "spoil", "expected"),
    [
        ("velocity", lambda v: v + 1e-6, {"velocity", "power", "energy"}),
        ("length_jacobian", lambda j: j * (1 + 1e-6), {"moment_arm", "virtual_work"}),
        ("tension", lambda t: t * (1 + 1e-3), {"virtual_work", "power", "energy"}),
        ("forces", lambda pulls: pulls[:-1], {"balance"}),
        ("forces", lambda pulls: [(b, p, 1.001 * f) for b, p, f in pulls], {"power"}),
        ("tangency_error", lambda e: e + 2e-10, {"tangency"}),
        ("status", lambda s: s + 1, {"paths"}),
        ("status", lambda s: s + int(mw.Status.ENDPOINT_INSIDE), {"model"}),
    ],
)
def test_a_broken_law_is_noticed(
    name: str, spoil: Callable[[Any], Any], expected: set[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert failed_when(monkeypatch, name, spoil) == expected


def test_a_jump_is_noticed_and_placed(monkeypatch: pytest.MonkeyPatch) -> None:
    """A millimetre more wherever the muscle is longer than it is at one place of its sweep."""
    model = mujoco.MjModel.from_xml_path(CASE2)
    muscles, data = mw.MuscleSystem(model), mujoco.MjData(model)
    data.qpos[0] = 0.003
    muscles.forward(data)
    step, sound = float(muscles.length[0]), mw.MuscleSystem.length.fget
    assert sound is not None
    monkeypatch.setattr(mw.MuscleSystem, "length", property(lambda m: sound(m) + 1e-3 * (sound(m) > step)))
    (jumps,) = (c for c in check(CASE2).checks if c.name == "jumps")
    assert jumps.verdict == "FAIL"
    assert any("= 0.003000: length +1.000 mm" in remark for remark in jumps.remarks), jumps.remarks


def test_an_end_point_inside_a_surface_is_the_models_fault() -> None:
    found = check_model(mujoco.MjModel.from_xml_string(ENTERS), poses=2, samples=21)
    assert {c.name for c in found.failed} == {"model"}
    (told,) = (c.remarks for c in found.checks if c.name == "model")
    assert "site 'b' is inside geom 'ball'" in told[0]


FOLLOWS = """
<mujoco>
  <compiler angle="radian"/>
  <worldbody>
    <site name="from" pos="0 0 .1"/>
    <body><joint name="leader" axis="0 1 0" range="-1 1" limited="true"/><geom size=".01" mass="1"/>
      <geom name="ball" size=".03" pos=".107 0 .1" contype="0" conaffinity="0"/>
      <body pos=".1 0 0"><joint name="follower" axis="0 1 0" range="-2 2" limited="true"/>
        <geom size=".01" mass="1"/><site name="to" pos=".1 0 0"/></body></body>
  </worldbody>
  <tendon><spatial name="string"><site site="from"/><geom geom="ball"/><site site="to"/></spatial></tendon>
  <actuator><muscle name="muscle" tendon="string" lengthrange=".1 .9"/></actuator>
  <equality><joint joint1="follower" joint2="leader" polycoef=".1 .5 .3 0 0" active="{}"/></equality>
</mujoco>
"""


@pytest.mark.parametrize("coupled", [True, False])
def test_coupled_joints_go_where_motions_lead_them(coupled: bool) -> None:
    """The follower's own range would take the insertion into the ball; the coupling never does."""
    model = mujoco.MjModel.from_xml_string(FOLLOWS.format(str(coupled).lower()))
    found = check_model(model, poses=5, samples=41)
    assert found.facts["joints_that_follow"] == coupled
    assert [c.name for c in found.failed] == ([] if coupled else ["model"])


def test_a_model_without_muscles_is_refused() -> None:
    with pytest.raises(mw.ModelError, match="no muscles"):
        check_model(mujoco.MjModel.from_xml_string("<mujoco/>"))
