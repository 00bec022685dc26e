"""What OpenSim says of a model at a number of poses, and along two motions; kept as JSON.

SI units; angles in rad. Arrays of a pose have the order of the names in `Reference`.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mjwrap.errors import OsimError

Array = NDArray[np.float64]
FORMAT = 1


@dataclass(frozen=True)
class PoseNumbers:
    """OpenSim's numbers at one pose; None where OpenSim gave none."""

    coordinates: dict[str, float]  # of all coordinates, those that follow others too
    bodies: dict[str, list[float]]  # position (3) [m] and rotation matrix (9, row by row) in ground
    mass: list[list[float]] | None  # reduced mass matrix, about the rates of `independent`
    lengths: dict[str, float]  # of all paths [m]
    moment_arms: dict[str, dict[str, float]]  # by path and independent coordinate [m]
    tensions: dict[str, list[float | None]]  # by muscle, at rest and the activations of `Reference` [N]
    wraps: dict[str, dict[str, list[float]]]  # by path and wrap object: arc and chord of its contact [m]


@dataclass(frozen=True)
class MotionNumbers:
    """A motion from the default pose at rest; excitation: the same of all muscles, None: no force but gravity."""

    time: list[float]  # [s]
    coordinates: dict[str, list[float]]
    excitation: float | None = None
    activation: dict[str, float] = field(default_factory=dict)  # at the start
    fiber_length: dict[str, float] = field(default_factory=dict)  # at the start [m]


@dataclass(frozen=True)
class Reference:
    """OpenSim's numbers of a model. sha256: of the .osim file; opensim: the version that computed them."""

    model: str
    sha256: str
    opensim: str
    independent: list[str]  # coordinates that are neither locked nor follow others
    activations: list[float]
    poses: list[PoseNumbers]
    passive: MotionNumbers | None
    driven: MotionNumbers | None
    notes: list[str]  # what OpenSim could not compute

    def save(self, path: str | Path) -> None:
        """Write the numbers as JSON, in full precision."""
        text = json.dumps({"format": FORMAT, **asdict(self)}, indent=None, separators=(",", ":"))
        Path(path).write_text(text + "\n", encoding="utf-8")


def sha256_of(path: str | Path) -> str:
    """Return the fingerprint by which numbers know the file that they are of."""
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()


def read_reference(path: str | Path) -> Reference:
    """Read numbers that `Reference.save` wrote; `OsimError` for a file that is none."""
    try:
        given = json.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise OsimError(f"cannot read '{path}': {(error.strerror or str(error)).lower()}") from None
    except ValueError:
        raise OsimError(f"'{path}' is not a file of OpenSim's numbers: it is not JSON") from None
    try:
        if given.pop("format") != FORMAT:
            raise OsimError(f"'{path}' was written by another version of mjwrap: compute the numbers anew")
        given["poses"] = [PoseNumbers(**pose) for pose in given["poses"]]
        for motion in ("passive", "driven"):
            given[motion] = None if given[motion] is None else MotionNumbers(**given[motion])
        return Reference(**given)
    except (AttributeError, KeyError, TypeError):
        raise OsimError(f"'{path}' is not a file of OpenSim's numbers: entries are missing") from None
