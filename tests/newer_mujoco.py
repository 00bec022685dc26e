"""What only newer releases of MuJoCo have: the tests of it are skipped where it is missing, and say so."""

from __future__ import annotations

from typing import Any

import pytest

batch: Any
try:
    from mujoco import batch
except ImportError:
    batch = None

needs_batch = pytest.mark.skipif(batch is None, reason="mujoco.batch exists since MuJoCo 3.17")
WAYS = ["rollout", pytest.param("batch", marks=needs_batch)]  # what steps many environments
