"""Where the OpenSim models of the tests are: public ones beside the repository, if there, and small own ones."""

import json
from pathlib import Path
from typing import Any

import pytest

PUBLIC = Path(__file__).resolve().parents[2] / "shared" / "osim"
DATA = Path(__file__).parent / "data" / "osim"


def model_path(name: str) -> Path:
    """Return the path of a model of either folder; a public one that is absent skips the test."""
    if (DATA / name).exists():
        return DATA / name
    if not (PUBLIC / name).exists():
        pytest.skip(f"the public model {name} is not in {PUBLIC}")
    return PUBLIC / name


def frozen(name: str) -> Any:
    """Return the records of a file that benchmarks/osim/freeze_poses.py made with OpenSim 4.6."""
    return json.loads((DATA / name).read_text())["records"]
