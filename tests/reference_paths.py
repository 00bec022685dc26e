"""Exact paths that lie beside the project: made by direct constrained minimisation (spectral curves, IPOPT)."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

REFERENCE = Path(__file__).resolve().parents[2] / "shared" / "reference" / "paths.json"


def reference_scene(name: str) -> dict[str, Any]:
    """Return one scene of exact paths, made by direct constrained minimisation (spectral curves, IPOPT)."""
    if not REFERENCE.exists():
        pytest.skip(
            "the table of exact reference paths is not part of a clone; it lies beside the project's own"
        )
    return json.loads(REFERENCE.read_text())[name]
