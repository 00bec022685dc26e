"""A model from which the plugin is taken again is the one that was there before `install`; commands see that one."""

from __future__ import annotations

import copy
import json
from pathlib import Path

import mujoco
import numpy as np
import pytest
from test_plugin import SCENES, moving, spec_of, state_of

import mjwrap as mw
from mjwrap.cli.main import main
from mjwrap.plugin import install, without_plugin

# What only the instance itself, its name and its configuration, adds to a model, and the policy against sleep.
OF_THE_INSTANCE = ("plugin", "body_plugin", "tree_sleep_policy", "names", "name_")


def arrays(model: mujoco.MjModel) -> dict[str, np.ndarray]:
    """Return all arrays of a model by name, but for those that hold the plugin's instance and names."""
    found = {name: getattr(model, name) for name in dir(model) if not name.startswith("_")}
    return {
        name: np.array(value)
        for name, value in found.items()
        if isinstance(value, np.ndarray) and not name.startswith(OF_THE_INSTANCE)
    }


@pytest.mark.parametrize("mode", ["wrench", "transmission"])
@pytest.mark.parametrize("keep_tendons", [False, True])
@pytest.mark.parametrize("scene", SCENES)
def test_every_array_is_as_it_was(scene: str, keep_tendons: bool, mode: str) -> None:
    before = arrays(spec_of(SCENES[scene]).compile())
    after = arrays(without_plugin(install(spec_of(SCENES[scene]), mode, keep_tendons=keep_tendons)))
    assert len(before) > 300
    assert set(after) == set(before)
    different = [name for name in before if not np.array_equal(before[name], after[name], equal_nan=True)]
    assert not different


@pytest.mark.parametrize("mode", ["wrench", "transmission"])
def test_it_moves_as_the_model_did_and_the_installed_one_goes_on(mode: str) -> None:
    model = install(spec_of(SCENES["arm"]), mode)
    before = state_of(moving(model))
    plain, bare = spec_of(SCENES["arm"]).compile(), without_plugin(model)
    ends = []
    for each in (plain, bare, copy.copy(bare)):
        data = mujoco.MjData(each)
        data.ctrl[:] = 0.5
        mujoco.mj_step(each, data, nstep=50)
        ends.append(np.array(data.qpos))
    np.testing.assert_array_equal(ends[1], ends[0])
    np.testing.assert_array_equal(ends[2], ends[0])
    np.testing.assert_array_equal(state_of(moving(model)), before)
    muscles = [mw.MuscleSystem(each) for each in (plain, bare)]
    lengths = []
    for each, system in zip((plain, bare), muscles, strict=True):
        data = mujoco.MjData(each)
        system.forward(data)
        lengths.append(system.length.copy())
    np.testing.assert_array_equal(lengths[1], lengths[0])


def test_a_model_without_the_plugin_is_copied() -> None:
    model = spec_of(SCENES["arm"]).compile()
    copied = without_plugin(model)
    assert copied is not model
    assert all(
        np.array_equal(a, b, equal_nan=True)
        for a, b in zip(arrays(model).values(), arrays(copied).values(), strict=True)
    )


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """One model as it is, and with the plugin as MJB and as XML."""
    folder = tmp_path_factory.mktemp("forms")
    spec = spec_of(SCENES["arm"])
    found = {"plain": folder / "plain.xml", "MJB": folder / "arm.mjb", "XML": folder / "arm.xml"}
    found["plain"].write_text(SCENES["arm"])
    model = install(spec)
    mujoco.mj_saveModel(model, str(found["MJB"]))
    found["XML"].write_text(spec.to_xml())
    return found


@pytest.mark.parametrize("form", ["MJB", "XML"])
@pytest.mark.parametrize(
    "command", [["inspect"], ["check"], ["compare", "--duration", "0"], ["run", "--duration", "0.02"]]
)
def test_every_command_opens_it(
    command: list[str], form: str, files: dict[str, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    codes, reports = [], []
    for each in ("plain", form):
        report = tmp_path / f"{each}.json"
        codes.append(main([command[0], str(files[each]), *command[1:], "--json", str(report)]))
        reports.append(json.loads(report.read_text()))
    capsys.readouterr()
    assert codes[1] == codes[0]
    assert reports[1].keys() == reports[0].keys()


@pytest.mark.parametrize("mode", ["python", "wrench", "transmission"])
def test_a_run_of_an_mjb_uses_the_plugin_that_it_has(
    mode: str, files: dict[str, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    code = main(["run", str(files["MJB"]), "--duration", "0.02", "--mode", mode])
    told = capsys.readouterr()
    assert code == (2 if mode == "transmission" else 0)
    assert ("saved with mode 'wrench'" in told.err) == (mode == "transmission")
