"""Models with native muscles, as they are and with mjwrap's plugin, for the benchmarks that compare the two."""

from __future__ import annotations

import logging
import warnings
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

import mjwrap as mw
from mjwrap.runs.models import load_spec

ELBOW = Path(__file__).parents[2] / "models" / "elbow" / "elbow.xml"
HOME = "our elbow"  # needs no myo_sim
MODELS = {
    "elbow": "myoelbow", "hand": "myohand", "arm": "myoarm", "legs": "myolegs", "torso": "myotorso",
    "full body": "myofullbody",
}  # fmt: skip
MODES = ("wrench", "transmission")
Array = NDArray[np.float64]


def spec_of(label: str) -> mujoco.MjSpec:
    """Return a model by its label in the tables, with native muscles only."""
    if label != HOME:
        logging.getLogger("mujoco").setLevel(logging.ERROR)
        return load_spec(f"myo_sim:{MODELS[label]}")
    spec = mujoco.MjSpec.from_file(str(ELBOW))
    for element in list(spec.tuples):
        spec.delete(element)
    return spec


def compiled(label: str, mode: str | None, integrator: str = "Euler") -> mujoco.MjModel:
    """Return a model with its muscles in the plugin, or (mode None) as it is; `ModelError` for an unknown mode."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Attaching a spec with an empty prefix")
        model = spec_of(label).compile() if mode is None else mw.install(spec_of(label), mode)
    model.opt.integrator = int(getattr(mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}"))
    return model


def excitations(actuators: int, looks: int, interval: float, seed: int) -> Array:
    """Return smooth random controls (looks, actuators), one every `interval` [s]: three slow sines each, in 0..0.5."""
    rng = np.random.default_rng(seed)
    time = interval * np.arange(looks)[:, None, None]
    frequency, phase = rng.uniform(0.2, 2.0, (actuators, 3)), rng.uniform(0.0, 2.0 * np.pi, (actuators, 3))
    return 0.25 + 0.25 / 3.0 * np.sin(2.0 * np.pi * frequency * time + phase).sum(axis=2)
