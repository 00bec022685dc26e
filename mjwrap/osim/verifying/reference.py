"""What OpenSim says of a model at a number of poses, and along two motions; kept as JSON.

SI units; angles in rad. Arrays of a pose have the order of the names in `Reference`.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjwrap.errors import OsimError

Array = NDArray[np.float64]
FORMAT = 3


@dataclass(frozen=True)
class PoseNumbers:
    """OpenSim's numbers at one pose; None where OpenSim gave none."""

    coordinates: dict[str, float]  # of all coordinates, those that follow others too
    bodies: dict[str, list[float]]  # position (3) [m] and rotation matrix (9, row by row) in ground
    mass: list[list[float]] | None  # reduced mass matrix, about the rates of `independent`
    lengths: dict[str, float]  # of all paths [m]
    moment_arms: dict[str, dict[str, float]]  # by path and independent coordinate [m]
    tensions: dict[str, list[float | None]]  # by muscle, at rest and the activations of `Reference` [N]
    wraps: dict[
        str, dict[str, list[float]]
    ]  # by path and wrap object: arc and chord of its contact [m], and its kink
    slopes: dict[
        str, dict[str, list[float]]
    ]  # by path over surfaces and coordinate: slopes of the length on either side
    segments: dict[
        str, dict[str, list[str]]
    ]  # by path and wrap object: the path points before and after its contact
    speeds: list[list[float]] | None = (
        None  # OpenSim's speeds u from the rates of all coordinates, in their order, where they are not the same
    )


@dataclass(frozen=True)
class MotionSample:
    """OpenSim's state in a driven motion, and what it says of the muscles there; `lengthening` is its rate of `lengths`
    by differences, `velocities` the rate that it states."""

    frame: int
    speeds: dict[str, float]  # of all coordinates [rad/s, m/s]
    accelerations: dict[str, float]  # of all coordinates [rad/s², m/s²]
    activation: dict[str, float]
    fiber_length: dict[str, float]  # [m]
    lengths: dict[str, float]  # [m]
    lengthening: dict[str, float]  # [m/s]
    velocities: dict[str, float]  # [m/s]
    tensions: dict[str, float]  # [N]


@dataclass(frozen=True)
class MotionNumbers:
    """A motion; excitation: the same of all muscles, None: no force but gravity acts."""

    time: list[float]  # [s]
    coordinates: dict[str, list[float]]
    excitation: float | None = None
    activation: dict[str, float] = field(default_factory=dict)  # at the start
    fiber_length: dict[str, float] = field(default_factory=dict)  # at the start [m]
    speeds: dict[str, float] = field(default_factory=dict)  # at the start [rad/s, m/s]
    energy: list[float] = field(default_factory=list)  # kinetic and potential, of a passive motion [J]
    samples: list[MotionSample] = field(default_factory=list)  # of a driven motion


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
    if isinstance(given, dict) and given.get("format", FORMAT) != FORMAT:
        raise OsimError(f"'{path}' was written by another version of mjwrap: compute the numbers anew")
    try:
        del given["format"]
        given["poses"] = [PoseNumbers(**pose) for pose in given["poses"]]
        for motion in ("passive", "driven"):
            given[motion] = None if given[motion] is None else _motion(given[motion])
        found = Reference(**given)
        fault = _fault(found)
    except (AttributeError, KeyError, TypeError, ValueError):
        raise OsimError(
            f"'{path}' is not a file of OpenSim's numbers: entries are missing or damaged"
        ) from None
    if fault:
        raise OsimError(f"'{path}' is not a file of OpenSim's numbers: {fault}")
    return found


def _motion(given: dict[str, Any]) -> MotionNumbers:
    samples = [MotionSample(**sample) for sample in given.pop("samples")]
    return MotionNumbers(**given, samples=samples)


def _fault(found: Reference) -> str:
    """Return what is wrong with the shapes and numbers of a reference, or an empty string."""
    count = len(found.activations)
    for k, pose in enumerate(found.poses):
        checked: list[tuple[str, object, tuple[int, ...]]] = [
            ("coordinates", list(pose.coordinates.values()), (len(pose.coordinates),)),
            ("lengths", list(pose.lengths.values()), (len(pose.lengths),)),
            ("bodies", list(pose.bodies.values()), (len(pose.bodies), 12) if pose.bodies else (0,)),
            ("moment arms", [a for arms in pose.moment_arms.values() for a in arms.values()], (-1,)),
        ]
        checked += [("wraps", w, (3,)) for wraps in pose.wraps.values() for w in wraps.values()]
        checked += [("slopes", s, (2,)) for slopes in pose.slopes.values() for s in slopes.values()]
        checked += [
            ("tensions", [0.0 if t is None else t for t in ts], (count,)) for ts in pose.tensions.values()
        ]
        if pose.speeds is not None:
            checked.append(("speeds", pose.speeds, (len(pose.coordinates),) * 2))
        if pose.mass is not None:
            checked.append(("mass", pose.mass, (len(found.independent),) * 2))
        for what, values, shape in checked:
            if not _fits(values, shape, finite=what != "wraps"):
                return f"{what} of pose {k} have a wrong size or are not numbers"
        if missing := [name for name in found.independent if name not in pose.coordinates]:
            return f"pose {k} lacks coordinate '{missing[0]}'"
    for motion in (found.passive, found.driven):
        for name, values in ({} if motion is None else motion.coordinates).items():
            if motion is not None and not _fits(values, (len(motion.time),)):
                return f"coordinate '{name}' of a motion has a wrong size or is not a number"
        for sample in [] if motion is None else motion.samples:
            if not 0 <= sample.frame < len(motion.time if motion else ()):
                return f"sample {sample.frame} of a motion has no frame"
            for numbers in asdict(sample).values():
                if isinstance(numbers, dict) and not _fits(list(numbers.values()), (len(numbers),)):
                    return f"sample {sample.frame} of a motion has entries that are not numbers"
    return ""


def _fits(values: object, shape: tuple[int, ...], finite: bool = True) -> bool:
    try:
        array = np.array(values, dtype=np.float64)
    except ValueError:  # rows of different lengths
        return False
    fits = array.ndim == len(shape) and all(w in (-1, n) for w, n in zip(shape, array.shape, strict=True))
    return fits and bool(not finite or np.isfinite(array).all())
