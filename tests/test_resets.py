"""A motion that becomes unstable: MuJoCo resets the data, and the step in which it does is an error that says when."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

import mjwrap as mw
from mjwrap.runs.engine import PluginEngine
from mjwrap.system.checks import ResetWatch

XML = """<mujoco><option timestep="0.01" integrator="{}"/><worldbody><site name="a" pos="0 0 .2"/>
<body><joint name="j" axis="0 1 0"/><geom size=".05" mass="1"/><site name="b" pos=".03 0 0"/></body></worldbody>
<tendon><spatial name="t"><site site="a"/><site site="b"/></spatial></tendon>
<actuator><muscle name="m" tendon="t" lengthrange=".1 .3" force="10"/>
<general name="burst" joint="j" gainprm="1e14"/></actuator></mujoco>"""
QACC = int(mujoco.mjtWarning.mjWARN_BADQACC)


@pytest.fixture(autouse=True)
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)  # MuJoCo writes a log


@pytest.mark.parametrize("integrator", ["Euler", "RK4", "implicit", "implicitfast"])
def test_every_reset_is_told_with_its_time(integrator: str) -> None:
    model = mujoco.MjModel.from_xml_string(XML.format(integrator))
    data, muscles = mujoco.MjData(model), mw.MuscleSystem(model)
    rng = np.random.default_rng(1)
    for _ in range(8):
        calm, last = (int(k) for k in rng.integers(1, 40, 2))
        data.ctrl[1] = 0.0
        muscles.step(data, calm)
        time = data.time
        data.ctrl[1] = 1.0
        with pytest.raises(
            mw.StateError, match=rf"unstable at about time {time:g} s and MuJoCo reset the data"
        ):
            muscles.step(data, last)
        assert data.time <= 1.5 * model.opt.timestep  # the reset ends the steps
        assert data.warning[QACC].number == 1


def test_the_plugin_tells_every_reset_too(tmp_path: Path) -> None:
    file = tmp_path / "m.xml"
    file.write_text(XML.format("Euler"))
    engine = PluginEngine(str(file), "wrench", strict=False)
    for count in (3, 7, 2):
        engine.data.ctrl[1] = 0.0
        for _ in range(count):
            engine.step()
        time = engine.data.time
        engine.data.ctrl[1] = 1.0
        with pytest.raises(mw.StateError, match=rf"unstable at about time {time:g} s"):
            engine.step()


def test_earlier_warnings_are_kept() -> None:
    data = mujoco.MjData(mujoco.MjModel.from_xml_string(XML.format("Euler")))
    data.warning[QACC].number = 3
    watch = ResetWatch(data)
    assert not watch.reset
    watch.end()
    assert data.warning[QACC].number == 3
    assert not watch.reset


def test_advance_says_that_the_data_were_reset() -> None:
    model = mujoco.MjModel.from_xml_string(XML.format("Euler"))
    data, muscles = mujoco.MjData(model), mw.MuscleSystem(model)
    muscles.step(data, 30)
    data.ctrl[1] = 1.0
    muscles.apply(data)
    mujoco.mj_step(model, data)
    with pytest.raises(mw.StateError, match=r"went back from 0\.3 s to 0\.01 s: the data were reset"):
        muscles.advance(data)
