"""Declarations survive saving, attaching under a prefix or suffix, and both kinds of files."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import mujoco
import pytest
from declared_models import ARM, HILL, MUSCLE, PULLEYS, ROW, declared, element, numerics
from mjcf_reading import MODELS

import mjwrap as mw
from mjwrap.mjcf import names, read_declarations, read_model

SITE, GEOM = mujoco.mjtObj.mjOBJ_SITE, mujoco.mjtObj.mjOBJ_GEOM


def described(model: mujoco.MjModel, prefix: str = "", suffix: str = "") -> list[tuple[object, ...]]:
    """All that is declared, by names without prefix and suffix, so that models can be compared."""

    def plain(kind: mujoco.mjtObj, index: int) -> str:
        name = mujoco.mj_id2name(model, kind, index) if index >= 0 else ""
        assert name.startswith(prefix) or not name
        return name.removeprefix(prefix).removesuffix(suffix)

    found = []
    for muscle in read_declarations(model).muscles:
        if not (muscle.name.startswith(prefix) and muscle.name.endswith(suffix)):
            continue
        routes = [
            (
                plain(SITE, route.origin),
                [(plain(SITE, n.site), plain(GEOM, n.geom), plain(SITE, n.hint_site)) for n in route.nodes],
                plain(SITE, route.insertion),
                route.weight,
            )
            for route in muscle.routes
        ]
        name, law = muscle.name.removeprefix(prefix).removesuffix(suffix), muscle.parameters
        if isinstance(
            law, mw.MuJoCoMuscle
        ):  # acc0 is not declared: the compiler computes it from the inertias
            law = replace(law, acc0=0.0)
        found.append((name, routes, law, muscle.activation))
    return found


def everything() -> str:
    """A model with a native muscle, a tuple with an actuator, and one without."""
    made, named = numerics(HILL | {"activation_time_constants": (0.02, 0.06)}, "free")
    custom = made + f'<tuple name="mjwrap_free">{"".join(ROW)}{named}</tuple>'
    custom += declared([element("actuator", "b"), *ROW], {"optimal_force": 70.0}, "path_actuator", "b")
    second = '<muscle name="b" tendon="extensor" lengthrange="0.3 0.6"/>'
    return ARM.format(tendon=PULLEYS, actuator=MUSCLE + second, custom=custom, option="")


def test_saving_a_spec_keeps_declarations() -> None:
    spec = mujoco.MjSpec.from_string(everything())
    model = spec.compile()
    again = mujoco.MjModel.from_xml_string(spec.to_xml())
    assert len(described(model)) == 3
    assert described(again) == described(model)


@pytest.mark.filterwarnings(
    "ignore:Attaching a spec with an empty prefix:UserWarning"
)  # that is what is tested
@pytest.mark.parametrize("affixes", [("left_", ""), ("", "_r"), ("left_", "_r")])
def test_attaching_keeps_declarations_under_prefix_and_suffix(
    affixes: tuple[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)  # MuJoCo logs its warnings into the working folder
    prefix, suffix = affixes
    alone = described(mujoco.MjModel.from_xml_string(everything()))
    parent = mujoco.MjSpec()
    for place, extra in enumerate(("", "2")):
        child = mujoco.MjSpec.from_string(everything())
        frame = parent.worldbody.add_frame(pos=[0, place, 0])
        parent.attach(child, prefix=extra + prefix, suffix=suffix + extra, frame=frame)
    model = parent.compile()
    assert len(read_declarations(model).muscles) == 6
    assert described(model, prefix, suffix) == alone
    assert described(model, "2" + prefix, suffix + "2") == alone


def test_models_are_read_from_xml_and_binary_files(tmp_path: Path) -> None:
    source = MODELS / "elbow" / "elbow.xml"
    model = read_model(source)
    assert described(read_model(os.fspath(source))) == described(model)
    mujoco.mj_saveModel(model, str(tmp_path / "elbow.mjb"), None)
    assert described(read_model(tmp_path / "elbow.mjb")) == described(model)
    assert names(model, SITE, 2) == ["head_side", "elbow_side"]
