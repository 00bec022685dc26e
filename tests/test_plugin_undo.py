"""An `install` that fails leaves the spec as it was: text and motion, whatever it had done before."""

import re
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
import pytest
from native_twins import ELBOW

import mjwrap as mw
from mjwrap.plugin import installing

# that a spec may have a plugin cannot be taken back; it means nothing without an instance
MENTION = r'\n *<extension>\s*<plugin plugin="mjwrap.muscles"/>\s*</extension>\n'


@pytest.mark.parametrize("before", [None, "wrench", "transmission"])
@pytest.mark.parametrize("after", ["wrench", "transmission"])
@pytest.mark.parametrize(
    "stage", ["read_declarations", "disable_actuators", "check_moment_columns", "add_instance", "_compile"]
)
def test_a_failed_install_changes_nothing(
    monkeypatch: pytest.MonkeyPatch, before: str | None, after: str, stage: str
) -> None:
    spec = mujoco.MjSpec.from_file(str(ELBOW))
    if before:
        mw.install(spec, before)
    text, end = spec.to_xml(), moved(spec)
    whole: Callable[..., Any] = getattr(installing, stage)
    calls = 0

    def broken(*given: Any, **named: Any) -> Any:
        nonlocal calls
        calls += 1
        result = whole(*given, **named)
        if stage != "_compile" or calls == 2:  # the one at the end
            raise mw.ModelError("broken on purpose")
        return result

    monkeypatch.setattr(installing, stage, broken)
    with pytest.raises(mw.ModelError, match="broken on purpose"):
        mw.install(spec, after)
    assert calls
    assert re.sub(MENTION, "", spec.to_xml()) == text
    np.testing.assert_array_equal(moved(spec), end)
    monkeypatch.undo()
    mw.install(spec, after)  # and nothing is in the way of the next one


def moved(spec: mujoco.MjSpec) -> np.ndarray:
    """Where the model is after 50 steps."""
    model = spec.compile()
    data = mujoco.MjData(model)
    data.ctrl[:] = 0.5
    mujoco.mj_step(model, data, 50)
    return data.qpos.copy()
