"""Activation dynamics of imported De Groote–Fregly muscles: OpenSim's, with the smoothing of the file.

`benchmarks/osim/freeze_activation.py` made tests/data/osim/activation.json; it says how.
"""

import json

import mujoco
import numpy as np
import pytest
from osim_models import FROZEN

import mjwrap as mw
from mjwrap.kernels.musculotendon import activation_dynamics

RATES = json.loads((FROZEN / "activation.json").read_text())["muscles"]


@pytest.fixture(scope="module")
def muscles() -> mw.MuscleSystem:
    imported = mw.import_osim(FROZEN / "own_activation.osim")
    return mw.MuscleSystem(mujoco.MjModel.from_xml_string(imported.xml))


@pytest.mark.parametrize("name", RATES)
def test_rates_are_opensims(name: str, muscles: mw.MuscleSystem) -> None:
    """Tanh has an argument of 0.1 (u - a) in OpenSim unless the file says otherwise; in the paper it is 10 (u - a)."""
    dynamics = muscles.declarations[muscles.index(name)].activation
    a, u, wanted = np.array(RATES[name]).T
    found = [
        activation_dynamics.rate(dynamics.form, *each, *dynamics.row()) for each in zip(u, a, strict=True)
    ]
    np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-9)


def test_smoothing_and_times_are_those_of_the_file(muscles: mw.MuscleSystem) -> None:
    rows = {name: muscles.declarations[muscles.index(name)].activation.row() for name in RATES}
    assert rows == {
        "usual": (0.015, 0.06, 0.1), "slow": (0.022, 0.081, 0.1), "sharp": (0.015, 0.06, 10.0),
        "between": (0.01, 0.06, 1.3),
    }  # fmt: skip
