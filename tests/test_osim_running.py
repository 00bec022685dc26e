"""Every OpenSim model at hand imports, loads in plain MuJoCo and with mjwrap's muscles, and runs."""

import mujoco
import numpy as np
import pytest
from osim_models import MODELS, compiled, imported

import mjwrap as mw

NAMES = sorted(file.stem for file in MODELS.glob("*.osim")) if MODELS.exists() else []
# In this file a patella of 0.1 kg moves freely, under a muscle that is stretched to 31 kN at the default pose.
TORN = {"test_wrapAllVis"}
# Its joints have wide ranges without limits: random excitation takes muscles' ends inside the thorax.
SHORT = {"ThoracoscapularShoulderModel": 0.05}


@pytest.mark.parametrize("name", NAMES)
def test_models_load_and_run(name, tmp_path):
    found = imported(name)
    assert all(entry.text for entry in found.report.entries if entry.outcome == "left out")
    model = compiled(name)
    plain = mujoco.MjData(model)
    mujoco.mj_step(model, plain)
    assert np.isfinite(plain.qpos).all()
    if not any(model.tuple(i).name.startswith("mjwrap_") for i in range(model.ntuple)):
        return  # nothing for mjwrap to do
    found.save(tmp_path / "model.xml")
    installed = mw.load(tmp_path / "model.xml")
    data, random = mujoco.MjData(installed), np.random.default_rng(4)
    seconds = 0.0 if name in TORN else SHORT.get(name, 2.0)
    for k in range(round(seconds / installed.opt.timestep)):
        if k % 100 == 0:
            data.ctrl[:] = random.uniform(0.0, 1.0, installed.nu)
        mujoco.mj_step(installed, data)
    assert np.isfinite(data.qpos).all()
    assert np.isfinite(data.act).all()
    assert data.warning[mujoco.mjtWarning.mjWARN_BADQACC].number == 0
