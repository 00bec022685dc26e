"""The time step of an imported model: RK4's limit for tendons as springs and fibres as dampers, in closed form."""

from typing import Any

import mujoco
import numpy as np
import pytest
from osim_models import model_file

import mjwrap as mw
from mjwrap.osim.description.forces import Muscle
from mjwrap.osim.description.paths import Path
from mjwrap.osim.report import Report
from mjwrap.osim.writing.couplings import SOLIMP, SOLREF
from mjwrap.osim.writing.document import Document
from mjwrap.osim.writing.stable_step import PathLine, write_stable_step

FORCE, SLACK, STRAIN, OPTIMUM, SPEED = 1000.0, 0.2, 0.05, 0.1, 10.0
STIFFNESS = 1.4 * FORCE / (SLACK * STRAIN)
DAMPING = 0.5 * 5.0 * FORCE / (SPEED * OPTIMUM)


def muscle(rigid: bool) -> Muscle:
    given: dict[str, Any] = {
        "max_isometric_force": FORCE, "optimal_fiber_length": OPTIMUM, "tendon_slack_length": SLACK,
        "max_contraction_velocity": SPEED, "FmaxTendonStrain": STRAIN,
    }  # fmt: skip
    return Muscle("m", "Thelen2003Muscle", Path((), ()), given, {}, {}, rigid, True)


def written(mass: float, rigid: bool, count: int = 1) -> tuple[Document, Report]:
    """Return a mass on a slide that `count` equal muscles pull along it, and its report."""
    document, report = Document("slide"), Report("slide", 40000)
    document.section("option").set("timestep", "0.001")
    world = document.bodies["ground"]
    document.add(world, "site", name="fixed", pos=(-0.3, 0, 0))
    body = document.add(world, "body", name="cart")
    document.add(body, "joint", name="x", type="slide", axis=(1, 0, 0))
    document.add(body, "inertial", pos=(0, 0, 0), mass=mass, diaginertia=(1, 1, 1))
    document.add(body, "site", name="end")
    other = document.add(world, "body", name="other")
    document.add(other, "joint", name="y", type="slide", axis=(1, 0, 0))
    document.add(other, "inertial", pos=(0, 0, 0), mass=1.0, diaginertia=(1, 1, 1))
    document.add("equality", "joint", name="held", joint1="y", solref=SOLREF, solimp=SOLIMP)
    write_stable_step(
        document, document.compile(), report, [PathLine(muscle(rigid), ("fixed", "end"))] * count
    )
    return document, report


@pytest.mark.parametrize("rigid", [False, True], ids=["elastic", "rigid"])
@pytest.mark.parametrize("count", [1, 3])
@pytest.mark.parametrize("step", [5e-4, 2e-4, 1e-4])
def test_the_step_is_the_largest_one_below_eighty_percent_of_the_limit(rigid, count, step) -> None:
    rate = 0.8 * 2.78 / step
    exact = count * (DAMPING / rate if rigid else STIFFNESS / rate**2)
    for mass, expected in ((1.01 * exact, step), (0.99 * exact, {5e-4: 2e-4, 2e-4: 1e-4, 1e-4: 5e-5}[step])):
        document, report = written(mass, rigid, count)
        assert float(document.section("option").get("timestep", "")) == expected
        assert document.section("equality")[0].get("solref") == f"{2 * expected!r} 1"
        (entry,) = report.entries
        assert (entry.kind, entry.name, entry.size) == ("TimeStep", "m", expected)


def test_nothing_is_said_where_one_millisecond_is_enough() -> None:
    document, report = written(1.01 * STIFFNESS / (0.8 * 2780.0) ** 2, False)
    assert document.section("option").get("timestep") == "0.001"
    assert not report.entries


@pytest.mark.parametrize(
    ("name", "step"), [("test_wrapAllVis", 2e-4), ("gait10dof18musc", 1e-3), ("arm26", 1e-3)]
)
def test_steps_of_imported_models(name: str, step: float) -> None:
    imported = mw.import_osim(model_file(name), poses=5)
    assert imported.spec.option.timestep == step
    assert [entry.size for entry in imported.report.entries if entry.kind == "TimeStep"] == [step] * (
        step < 1e-3
    )


def test_the_limit_is_where_a_run_becomes_unstable(tmp_path) -> None:
    """The patella of this model hangs on an elastic tendon alone; the report says below 0.36 ms."""
    mw.import_osim(model_file("test_wrapAllVis")).save(tmp_path / "model.xml")
    speeds = {}
    for timestep in (2e-4, 3.3e-4, 5e-4, 1e-3):
        model = mw.load(tmp_path / "model.xml")
        model.opt.timestep = timestep
        data, random = mujoco.MjData(model), np.random.default_rng(0)
        mujoco.mj_resetDataKeyframe(model, data, 0)
        highest = 0.0
        for k in range(round(0.3 / timestep)):
            if k % round(0.05 / timestep) == 0:
                data.ctrl[:] = random.uniform(0.0, 1.0)
            mujoco.mj_step(model, data)
            highest = max(highest, float(np.abs(data.qvel).max()))
        speeds[timestep] = highest
    # of the elastic tendon's energy a free patella could reach a few hundred m/s and rad/s
    assert [speed > 1e4 for speed in speeds.values()] == [False, False, True, True], speeds
