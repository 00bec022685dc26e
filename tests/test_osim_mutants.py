"""Damaged .osim files through the importer: a named error, or a model that loads and whose muscles have forces."""

import warnings
from pathlib import Path

import mujoco
import numpy as np
import pytest
from osim_frozen import model_path
from osim_mutants import extreme, mutant

import mjwrap as mw
from mjwrap.mjcf.named_models import osim_file

LEG = "mjwrap:leg"
COUNTS = {  # mutants of each file: 300 of our own, 60 of public ones
    LEG: 143,
    "own_version_3.osim": 12,
    "own_version_4.osim": 110,
    "own_joints.osim": 20,
    "joint_kinds.osim": 15,
    "BushingForceModel_30000.osim": 20,
    "Tug_of_War_Millard.osim": 20,
    "knee_patella_ligament.osim": 20,
}


def check_import(imported: mw.Imported) -> None:
    """Assert that an imported model loads, and that it and its muscles have finite states and forces."""
    model = mujoco.MjModel.from_xml_string(imported.xml, imported.assets)
    data = mujoco.MjData(model)
    with warnings.catch_warnings():
        warnings.filterwarnings(
            "ignore", "Inertia matrix is too close to singular"
        )  # a mass of 1e-300 may be so
        mujoco.mj_forward(model, data)
        muscles = mw.MuscleSystem(model)
        muscles.reset(data)
        muscles.forward(data)
    assert np.isfinite(data.qacc).all()
    assert np.isfinite(muscles.length).all()
    assert np.isfinite(muscles.tension).all()


@pytest.mark.parametrize("name", COUNTS)
def test_mutants_are_imported_or_refused_by_name(name, tmp_path):
    text = (Path(osim_file(LEG)) if name == LEG else model_path(name)).read_text(encoding="utf-8")
    rng = np.random.default_rng(16)
    outcomes = {"imported": 0, "refused": 0}
    path = tmp_path / "mutant.osim"
    for _ in range(COUNTS[name]):
        path.write_text((mutant if rng.random() < 0.4 else extreme)(text, rng), encoding="utf-8")
        try:
            with warnings.catch_warnings():
                warnings.filterwarnings("ignore", "Inertia matrix is too close to singular")
                imported = mw.import_osim(path, poses=5)
        except mw.OsimError:
            outcomes["refused"] += 1
            continue
        check_import(imported)
        outcomes["imported"] += 1
    assert min(outcomes.values()) >= 2
