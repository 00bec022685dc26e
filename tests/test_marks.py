"""mjwrap's private marks in MuJoCo's arrays: MuJoCo carries them along, and its own numbers do not depend on them."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np
import pytest

from mjwrap.mjcf import marks, read_model
from mjwrap.plugin.callbacks import sync

XML = """
<mujoco>
  <worldbody>
    <site name="a" pos="0 0 1"/>
    <body name="arm">
      <joint name="hinge" axis="0 1 0"/><geom size=".1"/><site name="b" pos=".3 0 0"/><site name="c" pos=".4 0 .1"/>
    </body>
  </worldbody>
  <tendon>
    <spatial name="muscle" width=".004"><site site="a"/><site site="b"/><site site="c"/></spatial>
    <spatial name="motor"><site site="a"/><site site="c"/></spatial>
    <spatial name="affine"><site site="a"/><site site="b"/></spatial>
  </tendon>
  <actuator>
    <muscle name="muscle" tendon="muscle" force="100" lengthrange=".5 1.5"/>
    <muscle name="limited" tendon="muscle" force="100" lengthrange=".5 1.5" forcerange="-60 -1"/>
    <motor name="motor" tendon="motor"/>
    <position name="affine" tendon="affine" kp="3" kv=".1" forcerange="-2 5"/>
  </actuator>
</mujoco>
"""
LIMITS = {
    "muscle": marks.ForceLimits(False, -mujoco.mjMAXVAL, mujoco.mjMAXVAL),
    "limited": marks.ForceLimits(True, -60.0, -1.0),
    "motor": marks.ForceLimits(False, -mujoco.mjMAXVAL, mujoco.mjMAXVAL),
    "affine": marks.ForceLimits(True, -2.0, 5.0),
}
Way = Callable[[mujoco.MjModel, Path], mujoco.MjModel]
SpecWay = Callable[[mujoco.MjSpec], mujoco.MjSpec]


def binary(model: mujoco.MjModel, folder: Path) -> mujoco.MjModel:
    path = folder / "marked.mjb"
    mujoco.mj_saveModel(model, str(path), None)
    return read_model(path)


def attached(spec: mujoco.MjSpec) -> mujoco.MjSpec:
    parent = mujoco.MjSpec.from_string(
        '<mujoco><worldbody><body name="under" pos="0 0 1"><geom size=".1"/></body></worldbody></mujoco>'
    )
    parent.attach(spec, frame=parent.body("under").add_frame(), prefix="left/")
    return parent


WAYS: dict[str, Way] = {
    "copy": lambda model, folder: copy.copy(model),
    "pickle": lambda model, folder: pickle.loads(pickle.dumps(model)),
    "MJB": binary,
}
SPEC_WAYS: dict[str, SpecWay] = {
    "compiled": lambda spec: spec,
    "copied": lambda spec: spec.copy(),
    "through XML": lambda spec: mujoco.MjSpec.from_string(spec.to_xml()),
    "attached": attached,
    "attached, through XML": lambda spec: mujoco.MjSpec.from_string(attached(spec).to_xml()),
}


def named(model: mujoco.MjModel, kind: mujoco.mjtObj, name: str) -> int:
    """The id of an element, with the prefix that it may have."""
    found = [mujoco.mj_name2id(model, kind, prefix + name) for prefix in ("", "left/")]
    return max(found)


def forces(model: mujoco.MjModel) -> np.ndarray:
    """What MuJoCo computes of tendons and actuators in random states."""
    data, rng, seen = mujoco.MjData(model), np.random.default_rng(0), []
    for _ in range(20):
        data.qpos[:] = rng.uniform(-1.0, 1.0, model.nq)
        data.qvel[:] = rng.normal(size=model.nv)
        data.act[:], data.ctrl[:] = rng.uniform(size=model.na), rng.uniform(size=model.nu)
        mujoco.mj_forward(model, data)
        seen.append(np.concatenate([data.actuator_force, data.act_dot, data.ten_length, data.qacc]))
    return np.array(seen)


# ------------------------------------------------------------------------------------- the entries are free


def test_the_column_is_the_last_and_muscles_do_not_reach_it() -> None:
    assert mujoco.mjNGAIN == mujoco.mjNBIAS == mujoco.mjNDYN == marks.COLUMN + 1 == sync.PRM
    model = mujoco.MjModel.from_xml_string(XML)
    for prm in (model.actuator_gainprm, model.actuator_biasprm, model.actuator_dynprm):
        assert prm[:, marks.COLUMN].tolist() == [0.0] * len(LIMITS)
    muscle = model.actuator_gainprm[0, : marks.COLUMN]
    assert np.count_nonzero(muscle) >= 8  # it uses the entries before


@pytest.mark.parametrize("field", ["actuator_gainprm", "actuator_biasprm", "actuator_dynprm"])
@pytest.mark.parametrize("mark", [1.0, -60.0, mujoco.mjMAXVAL])
def test_mujoco_computes_the_same_with_any_mark_in_the_column(field: str, mark: float) -> None:
    model = mujoco.MjModel.from_xml_string(XML)
    before = forces(model)
    getattr(model, field)[:, marks.COLUMN] = mark
    assert np.array_equal(forces(model), before)
    getattr(model, field)[0, 0] += 0.1  # what stands in the first entry does count
    assert not np.array_equal(forces(model), before)


def test_mujoco_computes_the_same_with_any_number_behind_a_site_and_any_width() -> None:
    model = mujoco.MjModel.from_xml_string(XML)
    before = forces(model)
    model.wrap_prm[:], model.tendon_width[:] = 3.0, 1e-10
    assert np.array_equal(forces(model), before)


# ------------------------------------------------------------------------------------------ marks in a model


@pytest.mark.parametrize("way", WAYS)
def test_a_disabled_actuator_is_known_in_a_copy_and_comes_back(way: str, tmp_path: Path) -> None:
    model = mujoco.MjModel.from_xml_string(XML)
    before, untouched = forces(model), copy.copy(model)
    for i in range(model.nactuator):
        marks.disable_force(model, i, marks.force_limits(model, i))
    twin = WAYS[way](model, tmp_path)
    assert not forces(twin)[:, : model.nactuator].any()
    found = marks.disabled_actuators(twin)
    assert {model.actuator(i).name: limits for i, limits in found.items()} == LIMITS
    assert marks.disabled_actuators(untouched) == {}
    for i, limits in found.items():
        marks.enable_force(twin, i, limits)
    assert np.array_equal(forces(twin), before)
    for field in ("forcelimited", "forcerange", "gainprm", "biasprm"):
        name = f"actuator_{field}"
        assert np.array_equal(getattr(twin, name), getattr(untouched, name))


@pytest.mark.parametrize("way", WAYS)
def test_removed_stops_and_curves_are_known_in_a_copy_and_come_back(way: str, tmp_path: Path) -> None:
    model = mujoco.MjModel.from_xml_string(XML)
    before, stops = forces(model), model.tendon_num.copy()
    marks.remove_curves(model, 0)
    for tendon in range(model.ntendon):
        marks.remove_stops(model, tendon)
    twin = WAYS[way](model, tmp_path)
    assert not forces(twin)[:, -model.ntendon - model.nv : -model.nv].any()  # lengths
    assert [marks.lacks_curves(twin, i) for i in range(4)] == [True, False, False, False]
    assert [marks.has_curves(twin, i) for i in range(4)] == [False, True, False, False]
    marks.restore_curves(twin, 0)
    for tendon in range(twin.ntendon):
        assert marks.lacks_stops(twin, tendon)
        marks.restore_stops(twin, tendon)
    assert np.array_equal(twin.tendon_num, stops)
    assert np.array_equal(forces(twin), before)


# ------------------------------------------------------------------------------------------- marks in a spec


@pytest.mark.parametrize("way", SPEC_WAYS)
def test_a_disabled_actuator_of_a_spec_is_known_however_it_is_compiled(way: str) -> None:
    spec = mujoco.MjSpec.from_string(XML)
    for element in spec.actuators:
        marks.disable_element(element, LIMITS[element.name])
    there = SPEC_WAYS[way](spec)
    model = there.compile()
    marks.zero_disabled_ranges(model)
    found = marks.disabled_actuators(model)
    kind = mujoco.mjtObj.mjOBJ_ACTUATOR
    assert {name: found[named(model, kind, name)] for name in LIMITS} == LIMITS
    for element in there.actuators:
        marks.enable_element(element)
    plain = mujoco.MjModel.from_xml_string(XML)
    again = there.compile()
    for field in ("forcelimited", "forcerange", "gainprm", "biasprm"):
        name = f"actuator_{field}"
        assert np.array_equal(getattr(again, name), getattr(plain, name)), field


@pytest.mark.parametrize("way", SPEC_WAYS)
def test_a_hidden_tendon_keeps_its_width_to_the_bit(way: str) -> None:
    spec = mujoco.MjSpec.from_string(XML)
    widths = [tendon.width for tendon in spec.tendons]
    for _ in range(2):  # hidden twice is hidden once
        for tendon in spec.tendons:
            marks.hide_tendon(tendon)
    there = SPEC_WAYS[way](spec)
    model = there.compile()
    assert np.all(model.tendon_width < marks.HIDDEN_BELOW)
    assert np.all(model.tendon_width > 0.0)
    for _ in range(2):
        for tendon in there.tendons:
            marks.show_tendon(tendon)
    shown = [tendon.width for tendon in there.tendons]
    if "XML" in way:  # MuJoCo writes six digits
        assert shown == pytest.approx(widths, rel=1e-5)
    else:
        assert shown == widths


@pytest.mark.parametrize("way", SPEC_WAYS)
def test_the_plugin_s_instance_is_found_behind_a_prefix(way: str) -> None:
    from mjwrap.plugin import install
    from mjwrap.plugin.spec.configuration import configuration_at

    spec = mujoco.MjSpec.from_string(XML)
    install(spec)
    model = SPEC_WAYS[way](spec).compile()
    (instance,) = marks.own_instances(model)
    prefix = "left/" if "attached" in way else ""
    found = configuration_at(model._address, instance)
    assert found.muscles == [prefix + "muscle", prefix + "limited"]
    assert found.mode == "wrench"
    assert model.plugin_stateadr[instance] >= 0
    assert model.nplugin == 1
    assert not marks.own_instances(mujoco.MjModel.from_xml_string(XML))
