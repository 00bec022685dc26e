"""Models of the myo_sim package."""

import mujoco
import pytest


def load_myo(name: str) -> mujoco.MjModel:
    """Return a model that myo_sim composes; a test that asks for one is skipped where the package is missing."""
    myo_sim = pytest.importorskip("myo_sim")
    with pytest.warns(UserWarning, match="empty prefix"):
        return myo_sim.load_model(name)
