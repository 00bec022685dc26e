"""Skip marks for tests of features that only newer releases of MuJoCo have."""

from __future__ import annotations

from typing import Any

import mujoco
import pytest

VERSION = tuple(int(part) for part in mujoco.__version__.split(".")[:2])

batch: Any
try:
    from mujoco import batch
except ImportError:
    batch = None

needs_batch = pytest.mark.skipif(batch is None, reason="mujoco.batch exists since MuJoCo 3.17")
needs_kept_states = pytest.mark.skipif(
    VERSION < (3, 14), reason="MjSpec.recompile keeps the states of plugins since MuJoCo 3.14"
)
needs_felt_tendons = pytest.mark.skipif(
    VERSION < (3, 14), reason="MuJoCo's sensors of force feel actuators on tendons since MuJoCo 3.14"
)
WAYS = ["rollout", pytest.param("batch", marks=needs_batch)]  # what steps many environments
