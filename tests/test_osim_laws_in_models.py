"""The laws that OpenSim's models need, in a model: declared, kept when written, run in both ways of running."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import pytest
from hill_tables import OWN_CURVES

import mjwrap as mw

XML = """
<mujoco>
  <option timestep="1e-3" gravity="0 0 -1"/>
  <worldbody>
    <geom name="drum" type="cylinder" size=".02 .05" euler="90 0 0" pos="0 0 -.05" contype="0" conaffinity="0"/>
    <site name="a" pos="-.1 0 0"/> <site name="b" pos="-.12 0 .01"/>
    <body pos=".2 0 0">
      <joint name="slider" type="slide" axis="1 0 0" damping="20" stiffness="50"/>
      <geom size=".02" mass=".5" contype="0" conaffinity="0"/>
      <site name="to"/>
    </body>
  </worldbody>
</mujoco>
"""
HILL = {"max_isometric_force": 60.0, "optimal_fiber_length": 0.1, "tendon_slack_length": 0.2}
ELASTIC = {**HILL, "tendon_model": "elastic", "pennation_angle": 0.2}
LIGAMENT = (2, 1.05, 1.0, 1.05, 0.0, 0.0, 10.0, 0.0, 0.025, 1.0, 5.0, 0.0)
DECLARED: dict[str, tuple[str, dict[str, Any]]] = {
    "thelen": (
        "thelen_2003",
        ELASTIC | {"max_tendon_strain": 0.033, "active_shape": 0.5, "passive_shape": 4.0},
    ),
    "thelen_rigid": ("thelen_2003", HILL | {"minimum_activation": 0.02, "max_pennation": 1.3}),
    "shaped": ("millard_2012", ELASTIC | OWN_CURVES | {"minimum_activation": 0.01}),
    "undamped": ("millard_2012", ELASTIC | {"fiber_damping": 0.0}),
    "plain": ("millard_2012", ELASTIC),
    "smooth": ("degroote_fregly_2016", ELASTIC | {"minimum_activation": 0.05}),
    "band": ("ligament", {"pcsa_force": 20.0, "resting_length": 0.29, "ligament_curve": LIGAMENT}),
    "spring": ("path_spring", {"stiffness": 80.0, "resting_length": 0.28, "dissipation": 0.3}),
}
PASSIVE = ("band", "spring")


def document(names: Any = tuple(DECLARED)) -> str:
    """Return the scene with muscles that `muscle_xml` declares."""
    xml = XML
    for name in names:
        law, given = DECLARED[name]
        model = mujoco.MjModel.from_xml_string(xml)
        route = "a, drum, to" if name == "plain" else "b, to"
        text = mw.muscle_xml(model, name, route, law=law, parameters=given, driven=name not in PASSIVE)
        xml = mw.insert_xml(xml, text)
    return xml


def laws(model: mujoco.MjModel) -> dict[str, Any]:
    """Return the laws of a model's muscles by name."""
    return {each.name: each.parameters for each in mw.MuscleSystem(model).declarations}


def test_declarations_say_what_was_given() -> None:
    found = laws(mujoco.MjModel.from_xml_string(document()))
    assert set(found) == set(DECLARED)
    for name, (law, given) in DECLARED.items():
        assert found[name].law == law
        for key, value in given.items():
            wanted = tuple(map(float, value)) if isinstance(value, tuple) else value
            assert getattr(found[name], "tendon" if key == "tendon_model" else key) == wanted


def test_a_spec_keeps_what_set_laws_writes() -> None:
    spec = mujoco.MjSpec.from_string(document(["plain", "thelen"]))
    new = {
        "plain": mw.Thelen2003(70.0, 0.11, 0.2, max_lengthening_force=1.6, tendon="elastic"),
        "thelen": mw.Millard2012(70.0, 0.11, 0.2, tendon="elastic", **OWN_CURVES),
    }
    mw.set_laws(spec, new)
    assert laws(spec.compile()) == new
    again = mujoco.MjSpec.from_string(spec.to_xml())
    assert laws(again.compile()) == new


def test_the_plugin_runs_the_laws_as_the_muscle_system_does() -> None:
    xml = document()
    model, plugged = mujoco.MjModel.from_xml_string(xml), mw.install(mujoco.MjSpec.from_string(xml))
    data, other = mujoco.MjData(model), mujoco.MjData(plugged)
    muscles = mw.MuscleSystem(model)
    rng = np.random.default_rng(2)
    tensions = []
    for _ in range(60):
        data.ctrl[:] = other.ctrl[:] = rng.uniform(0.0, 1.0, model.nu)
        for _ in range(5):
            muscles.step(data)
            mujoco.mj_step(plugged, other)
        assert other.qpos == pytest.approx(data.qpos, rel=1e-12, abs=1e-14)
        assert other.act[: model.na] == pytest.approx(data.act, rel=1e-11, abs=1e-14)
        tensions.append(muscles.tension.copy())
    told = np.ptp(tensions, axis=0)
    assert (told > 1e-3).all(), dict(zip(muscles.names, told, strict=True))


def test_an_activation_does_not_fall_below_the_least() -> None:
    model = mujoco.MjModel.from_xml_string(document(["smooth", "thelen", "plain"]))
    data, muscles = mujoco.MjData(model), mw.MuscleSystem(model)
    for _ in range(400):
        muscles.step(data)
    least = {"smooth": 0.05, "thelen": 0.01, "plain": 0.0}
    for name, activation in zip(muscles.names, muscles.activation, strict=True):
        assert activation == pytest.approx(least[name], abs=1e-6)
    assert data.act[::2] == pytest.approx([least[name] for name in muscles.names], abs=1e-6)


@pytest.mark.parametrize(
    ("law", "given", "words"),
    [
        ("thelen_2003", HILL | {"max_lengthening_force": 1.0}, "max_lengthening_force must be above 1"),
        (
            "thelen_2003",
            HILL | {"velocity_extrapolation": 0.5},
            "velocity_extrapolation must be above 0.714285714",
        ),
        ("thelen_2003", HILL | {"max_tendon_strain": -0.1}, "max_tendon_strain must be finite and positive"),
        ("millard_2012", HILL | {"minimum_activation": 1.0}, r"minimum_activation must be in \[0, 1\)"),
        ("millard_2012", HILL | {"max_pennation": 2.0}, "max_pennation must be in"),
        ("millard_2012", HILL | {"pennation_angle": 0.5, "max_pennation": 0.4}, "max_pennation must be in"),
        (
            "millard_2012",
            HILL | {"tendon_force_length_curve": (0.0,)},
            "strain_at_one_norm_force must be above 0",
        ),
        (
            "millard_2012",
            HILL | {"tendon_force_length_curve": (0.05, 10.0, 0.5, 0.5)},
            "stiffness_at_one_norm_force",
        ),
        (
            "millard_2012",
            HILL | {"fiber_force_length_curve": (0.0, 0.7, 3.0, 4.0, 0.5)},
            "stiffness_at_low_force",
        ),
        ("millard_2012", HILL | {"fiber_force_length_curve": (0.0, 0.7, 0.2)}, "2 or 5 numbers"),
        (
            "millard_2012",
            HILL | {"active_force_length_curve": (0.8, 0.7, 1.8, 0.8, 0.0)},
            "transition_norm_fiber",
        ),
        (
            "millard_2012",
            HILL | {"force_velocity_curve": (0, 0.25, 0.9, 0, 0.15, 1.4, 0.6, 0.9)},
            "isometric_slope",
        ),
        (
            "millard_2012",
            HILL | {"force_velocity_curve": (0, 0.25, 5, 0, 0.15, 1.4, 0.6, 1.9)},
            "eccentric_curviness",
        ),
        ("schutte_1993", HILL, "'schutte_1993' is not supported: .* splines in its file"),
        ("path_spring", {"stiffness": 1.0}, "needs resting_length"),
        (
            "ligament",
            {"pcsa_force": 1.0, "resting_length": 0.1, "ligament_curve": (1,)},
            "number P of pieces",
        ),
    ],
)
def test_unphysical_parameters_are_refused_by_name(law: str, given: dict[str, Any], words: str) -> None:
    model = mujoco.MjModel.from_xml_string(XML)
    with pytest.raises(mw.ModelError, match=words):
        mw.muscle_xml(
            model, "m", "a, to", law=law, parameters=given, driven=law in ("thelen_2003", "millard_2012")
        )


@pytest.mark.parametrize("name", PASSIVE)
def test_what_is_passive_has_no_actuator(name: str) -> None:
    law, given = DECLARED[name]
    with pytest.raises(mw.ModelError, match=f"law '{law}' is passive"):
        mw.muscle_xml(mujoco.MjModel.from_xml_string(XML), "m", "a, to", law=law, parameters=given)


def test_a_law_follows_from_the_numerics_alone() -> None:
    xml = document(["spring", "band"])
    for law in ("path_spring", "ligament"):
        assert f'data="{law}"' in xml
    lines = [line for line in xml.splitlines() if "_law" not in line]
    found = laws(mujoco.MjModel.from_xml_string("\n".join(lines)))
    assert {name: each.law for name, each in found.items()} == {"spring": "path_spring", "band": "ligament"}
