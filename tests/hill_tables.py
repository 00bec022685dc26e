"""The tables made with OpenSim that muscles are tested against, and the muscles that they were made with."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mjcf_reading import Vector

import mjwrap as mw
from mjwrap.muscles.laws import parameter_row

HILL = Path(__file__).resolve().parents[2] / "shared" / "reference" / "hill"
SIZES = {
    "P1_parallel": (1000.0, 0.10, 0.20, 0.0),
    "P2_pennate_soleuslike": (3549.0, 0.05, 0.25, math.radians(25)),
    "P3_shorttendon": (600.0, 0.12, 0.03, math.radians(8)),
}
FiberLaw = mw.DeGrooteFregly2016 | mw.Millard2012 | mw.Thelen2003
LAWS: dict[str, type[mw.DeGrooteFregly2016] | type[mw.Millard2012]] = {
    "dgf": mw.DeGrooteFregly2016,
    "millard": mw.Millard2012,
}
# Parameters of a Millard muscle with curves of its own, in OpenSim's order.
OWN_CURVES: dict[str, Any] = {
    "active_force_length_curve": (0.35, 0.7, 1.7, 0.9, 0.05),
    "force_velocity_curve": (0.05, 0.3, 4.0, 0.06, 0.2, 1.5, 0.5, 0.8),
    "fiber_force_length_curve": (-0.05, 0.55, 0.15, 5.0, 0.6),
    "tendon_force_length_curve": (0.07, 25.0, 0.5, 0.7),
}


def shaped(*values: Any, **given: Any) -> mw.Millard2012:
    """Return a Millard muscle with curves of its own."""
    return mw.Millard2012(*values, **(OWN_CURVES | given))


# Every law with a fibre, also with curves of its own: for what holds for all of them.
EVERY_LAW: dict[str, Callable[..., FiberLaw]] = {**LAWS, "shaped": shaped, "thelen": mw.Thelen2003}


def table(name: str) -> dict[str, Vector]:
    """Return the columns of a reference table; skip the test where the reference is not there."""
    path = HILL / f"{name}.csv"
    if not path.exists():
        pytest.skip(
            f"the reference table {path.name} is not there; it is kept beside the repository, not in it"
        )
    head = path.read_text().splitlines()[0].split(",")
    texts = np.loadtxt(path, delimiter=",", skiprows=1, dtype=str)
    return {key: texts[:, i] if key == "params" else texts[:, i].astype(float) for i, key in enumerate(head)}


def elastic(name: str, sizes: str, damping: float) -> FiberLaw:
    """Return a muscle of the tables with an elastic tendon."""
    return LAWS[name](*SIZES[sizes], fiber_damping=damping, tendon="elastic")


def row(*laws: FiberLaw | mw.PathActuator) -> Vector:
    """Return the kernels' parameters of muscles, a row each."""
    return np.array([parameter_row(law) for law in laws])


def values(curve: object, at: Vector) -> Vector:
    """Return value and slope of a curve, (n, 2)."""
    assert callable(curve)
    return np.array([curve(float(x)) for x in at])
