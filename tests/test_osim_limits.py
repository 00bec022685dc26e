"""A clamp of an OpenSim coordinate: a range without a limit, as in OpenSim's motions, or a limit if that is asked."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path

import mujoco
import numpy as np
import pytest
from cli_runs import run_here
from osim_mechanics import written
from osim_scenes import chain

import mjwrap as mw

PENDULUM = """<?xml version="1.0" encoding="UTF-8"?>
<OpenSimDocument Version="40000"><Model name="clamped"><gravity>0 -9.81 0</gravity>
<BodySet><objects><Body name="rod"><mass>1</mass><mass_center>0 -0.5 0</mass_center>
  <inertia>0.3 0.1 0.3 0 0 0</inertia></Body></objects></BodySet>
<JointSet><objects><PinJoint name="hinge"><socket_parent_frame>/ground</socket_parent_frame>
  <socket_child_frame>/bodyset/rod</socket_child_frame>
  <coordinates><Coordinate name="angle"><default_value>0.25</default_value><default_speed_value>2</default_speed_value>
    <range>-0.3 0.3</range><clamped>true</clamped></Coordinate></coordinates></PinJoint></objects></JointSet>
</Model></OpenSimDocument>
"""
# The angle [rad] of this file after 0.1, 0.2, ... s: OpenSim 4.6's Manager with an accuracy of 1e-12. The coordinate is
# clamped (Coordinate::getClamped) and passes through its range.
THROUGH = (
    0.43621823020107153, 0.5850972162383046, 0.6850915764093849, 0.7290064458482213, 0.7138460280467338,
    0.6406325892482534,
)  # fmt: skip


@pytest.fixture
def pendulum(tmp_path: Path) -> Path:
    file = tmp_path / "clamped.osim"
    file.write_text(PENDULUM)
    return file


def motion(model: mujoco.MjModel) -> list[float]:
    """Return the angle after each tenth of a second."""
    data = mujoco.MjData(model)
    data.qvel[0] = 2.0
    found = []
    for k in range(1, 601):
        mujoco.mj_step(model, data)
        if k % 100 == 0:
            found.append(float(data.qpos[0]))
    return found


def test_a_clamped_coordinate_passes_through_its_range_as_in_opensim(pendulum: Path) -> None:
    """The error of RK4 at 1 ms is below 1e-11 rad; OpenSim's own accuracy is the larger part."""
    imported = mw.import_osim(pendulum)
    model = imported.spec.compile()
    assert model.jnt_range[0].tolist() == [-0.3, 0.3]
    np.testing.assert_allclose(motion(model), THROUGH, rtol=0, atol=1e-10)
    (entry,) = (entry for entry in imported.report.entries if entry.name == "angle")
    assert (entry.kind, entry.outcome) == ("clamped Coordinate", "exact")
    assert entry.text == "its joint has the range, but no limit"


def test_limits_stop_it_where_they_are_asked_for(pendulum: Path) -> None:
    imported = mw.import_osim(pendulum, limits=True)
    model = imported.spec.compile()
    assert model.jnt_limited[0]
    assert max(motion(model)) < 0.35
    (entry,) = (entry for entry in imported.report.entries if entry.name == "angle")
    assert (entry.kind, entry.outcome) == ("clamped Coordinate", "approximated")
    assert "a limit stops its joint" in entry.text


@pytest.mark.parametrize("limits", [False, True])
def test_only_clamped_coordinates_that_start_inside_are_limited(*, limits: bool) -> None:
    osim = chain(clamped=True, count=3, range=(-1.0, 0.7))
    found = written(osim, limits=limits)
    compiled = found.compile()
    assert compiled.jnt_limited.tolist() == [limits, limits, False]
    assert compiled.jnt_range.tolist() == [[-1.0, 0.7]] * 3
    kinds = Counter((e.kind, e.outcome) for e in found.report.entries if "Coordinate" in e.kind)
    stopped = {("clamped Coordinate", "approximated"): 2} if limits else {}
    assert kinds == {("clamped Coordinate", "exact"): 3 - 2 * limits} | stopped
    free = written(chain(clamped=False, count=3, range=(-1.0, 0.7)), limits=limits)
    assert not free.compile().jnt_limited.any()
    assert {e.kind for e in free.report.entries if "Coordinate" in e.kind} == {"unclamped Coordinate"}


def test_the_command_writes_limits_only_if_told(pendulum: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = pendulum.parent / "clamped.xml"
    ran = run_here("import", capsys, pendulum, "-o", out)
    assert (
        "limits:    none for 1 clamped coordinate, as in OpenSim's motions; --limits writes them" in ran.out
    )
    assert not mujoco.MjModel.from_xml_path(str(out)).jnt_limited[0]
    report = pendulum.parent / "report.json"
    ran = run_here("import", capsys, pendulum, "-o", out, "--limits", "--json", report)
    assert "limits:" not in ran.out
    assert "clamped Coordinate 'angle': a limit stops its joint" in ran.out
    assert mujoco.MjModel.from_xml_path(str(out)).jnt_limited[0]
    (entry,) = (each for each in json.loads(report.read_text())["entries"] if each["name"] == "angle")
    assert entry["outcome"] == "approximated"
