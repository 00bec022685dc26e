"""Compute a `Reference` with the opensim package."""

from __future__ import annotations

import importlib
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjwrap.errors import OsimError
from mjwrap.osim.verifying.opensim_motions import coordinate_places, opensim_motion
from mjwrap.osim.verifying.opensim_paths import contacts, length_slopes, path_of, segments
from mjwrap.osim.verifying.reference import MotionNumbers, PoseNumbers, Reference, sha256_of
from mjwrap.osim.verifying.scholz import scholz_length
from mjwrap.osim.verifying.stops import TouchingRoute

Array = NDArray[np.float64]
ACTIVATIONS = (0.05, 0.5, 1.0)
WIDEST = {
    1: math.pi,
    2: 1.0,
}  # half width of random values [rad, m], by OpenSim's type of a coordinate's motion
ASSEMBLED = 1e-10  # largest error of OpenSim's constraints at a pose [m or rad]
HALVINGS = 8  # how often a pose is drawn nearer to the default one
RANK, MOVES = (
    1e-10,
    1e-9,
)  # shares of the largest singular value, and of a coordinate's own motion, that count
SAME = 1e-12  # difference of speeds from the coordinates' rates that is rounding
PASSIVE, DRIVEN = 0.3, 0.5  # durations of motions [s]
EXCITATION = 0.2


def has_opensim() -> bool:
    """Whether the opensim package can be imported."""
    try:
        importlib.import_module("opensim")
    except (ImportError, OSError):
        return False
    return True


def opensim_geodesic() -> Callable[[TouchingRoute], float | None] | None:
    """Return a function that returns the length of OpenSim's geodesic over a route's stops [m], or None where OpenSim
    has none; None without the opensim package."""
    if not has_opensim():
        return None
    opensim: Any = importlib.import_module("opensim")
    opensim.Logger.setLevelString("off")

    def length(route: TouchingRoute) -> float | None:
        try:
            return scholz_length(opensim, route)
        except RuntimeError:
            return None

    return length


def compute_reference(
    path: str | Path,
    poses: int = 50,
    arms: int = 10,
    seed: int = 0,
    motions: bool = True,
    progress: Callable[[int, int], object] | None = None,
) -> Reference:
    """Return OpenSim's numbers of a model file at the default pose and at random ones; moment arms at the first `arms`.

    progress: called with the number of poses done and that of all. `OsimError` where opensim is missing or refuses the
    file.
    """
    try:
        opensim: Any = importlib.import_module("opensim")
    except (ImportError, OSError) as error:
        raise OsimError(f"the opensim package is not there ({error}): pip install opensim") from None
    opensim.Logger.setLevelString("off")
    try:
        return _Computer(opensim, Path(path)).compute(poses, arms, seed, motions, progress)
    except RuntimeError as error:
        raise OsimError(f"OpenSim cannot use '{path}': {' '.join(str(error).split())[:300]}") from None


class _Computer:
    def __init__(self, opensim: Any, path: Path) -> None:
        self.opensim, self.path = opensim, path
        self.notes: list[str] = []
        self.model = opensim.Model(str(path))
        self.model.set_assembly_accuracy(1e-12)
        self.state = self.model.initSystem()
        every = self.model.getCoordinateSet()
        self.coordinates = {every.get(i).getName(): every.get(i) for i in range(every.getSize())}
        self.independent = [
            name for name, found in self.coordinates.items() if not found.isConstrained(self.state)
        ]
        forces = self.model.getForceSet()
        self.paths: dict[str, Any] = {}
        for i in range(forces.getSize()):
            force = forces.get(i)
            for kind in ("Muscle", "Ligament", "PathSpring", "PathActuator"):
                cast = getattr(opensim, kind).safeDownCast(force)
                if cast is not None:
                    self.paths[force.getName()] = cast
                    break
        muscles = self.model.getMuscles()
        self.muscles = {muscles.get(i).getName(): muscles.get(i) for i in range(muscles.getSize())}
        bodies = self.model.getBodySet()
        self.bodies = {bodies.get(i).getName(): bodies.get(i) for i in range(bodies.getSize())}
        self._places = coordinate_places(self.state, self.coordinates)
        self._movable = {name: self.coordinates[name] for name in self.independent}
        every_path = {name: path_of(force) for name, force in self.paths.items()}
        self._curved = {  # whose lengths may jump
            name: path
            for name, path in every_path.items()
            if hasattr(path, "getWrapSet") and path.getWrapSet().getSize()
        }

    def compute(
        self,
        poses: int,
        arms: int,
        seed: int,
        motions: bool,
        progress: Callable[[int, int], object] | None,
    ) -> Reference:
        rng = np.random.default_rng(seed)
        found = []
        for k in range(poses + 1):
            if k > 0:
                self._draw(rng)
            found.append(self._pose(k <= arms))
            if progress is not None:
                progress(k + 1, poses + 1)
        return Reference(
            model=self.path.name,
            sha256=sha256_of(self.path),
            opensim=str(self.opensim.GetVersion()),
            independent=self.independent,
            activations=list(ACTIVATIONS),
            poses=found,
            passive=self._motion(None, PASSIVE) if motions else None,
            driven=self._motion(EXCITATION, DRIVEN) if motions and self.muscles else None,
            notes=self.notes,
        )

    def _draw(self, rng: np.random.Generator) -> None:
        """Move the model to a random pose within the ranges of its coordinates.

        OpenSim's assembly of constraints stops far from a solution where it starts far away. So the values are drawn
        nearer to the default ones until it succeeds; a note says so if it never does.
        """
        drawn = {}
        for name in self.independent:
            coordinate = self.coordinates[name]
            widest = WIDEST.get(int(coordinate.getMotionType()), math.pi)
            low, high = max(coordinate.getRangeMin(), -widest), min(coordinate.getRangeMax(), widest)
            drawn[name] = rng.uniform(low, high) if low < high else coordinate.getDefaultValue()
        for halving in range(HALVINGS):
            for name, value in drawn.items():
                start = self.coordinates[name].getDefaultValue()
                self.coordinates[name].setValue(
                    self.state, float(start + (value - start) * 0.5**halving), False
                )
            self.model.assemble(self.state)
            self.model.realizePosition(self.state)
            errors = self.state.getQErr()
            if max((abs(errors.get(i)) for i in range(errors.size())), default=0.0) <= ASSEMBLED:
                return
            self.state = self.model.initSystem()  # OpenSim's solver does not recover by itself
        note = "OpenSim's assembly did not satisfy the constraints at some poses"
        if note not in self.notes:
            self.notes.append(note)

    def _pose(self, with_arms: bool) -> PoseNumbers:
        model, state = self.model, self.state
        for name in self.independent:
            self.coordinates[name].setSpeedValue(state, 0.0)
        model.realizePosition(state)
        bodies = {}
        for name, body in self.bodies.items():
            place = body.getTransformInGround(state)
            position, turn = place.p(), place.R().asMat33()
            bodies[name] = [position.get(i) for i in range(3)] + [
                turn.get(i, j) for i in range(3) for j in range(3)
            ]
        values = {name: float(c.getValue(state)) for name, c in self.coordinates.items()}
        mass, speeds = self._mass()
        lengths = {name: float(path_of(found).getLength(state)) for name, found in self.paths.items()}
        arms: dict[str, dict[str, float]] = {}
        if with_arms:
            for name, found in self.paths.items():
                path = path_of(found)
                arms[name] = {
                    c: float(path.computeMomentArm(state, self.coordinates[c])) for c in self.independent
                }
        tensions = {name: self._tensions(muscle) for name, muscle in self.muscles.items()}
        wraps = {
            name: found
            for name, force in self.paths.items()
            if (found := contacts(self.opensim, path_of(force), state))
        }
        between = {name: segments(self.opensim, path_of(self.paths[name]), state) for name in wraps}
        slopes = length_slopes(model, state, self._curved, self._movable) if with_arms else {}
        return PoseNumbers(
            values, bodies, mass, lengths, arms, tensions, wraps, slopes, segments=between, speeds=speeds
        )

    def _tensions(self, muscle: Any) -> list[float | None]:
        """Return the tension of a muscle at equilibrium, at rest, at each of the activations."""
        found: list[float | None] = []
        for activation in ACTIVATIONS:
            try:
                muscle.setActivation(self.state, activation)
                muscle.computeEquilibrium(self.state)
                self.model.realizeDynamics(self.state)
                found.append(float(muscle.getTendonForce(self.state)))
            except RuntimeError:
                found.append(None)
        return found

    def _mass(self) -> tuple[list[list[float]] | None, list[list[float]] | None]:
        """Return NᵀMN about the rates of the independent coordinates, and each one's speed u from all rates.

        The latter is None where speeds and rates are the same. Column i of N is P eᵢ / Pᵢᵢ, with the projector P on the
        rates that satisfy Simbody's constraints.
        """
        model, state, opensim = self.model, self.state, self.opensim
        matter = model.getMatterSubsystem()
        mass = opensim.Matrix()
        matter.calcM(state, mass)
        size = mass.nrow()
        m = np.array([[mass.get(i, j) for j in range(size)] for i in range(size)]).reshape(size, size)
        if len(self.coordinates) != size or not self.independent:
            return None, None
        speeds = np.linalg.inv(self._rates(size))  # u from the coordinates' rates
        names = list(self.coordinates)
        chosen = [names.index(name) for name in self.independent]
        constraints = opensim.Matrix()
        matter.calcG(state, constraints)
        rows = constraints.nrow()
        g = np.array([[constraints.get(i, j) for j in range(size)] for i in range(rows)]).reshape(rows, size)
        of_rates = g @ speeds
        projector = np.eye(size) - np.linalg.pinv(of_rates, rcond=RANK) @ of_rates
        own = np.diag(projector)[chosen]
        by_coordinate = speeds[self._speed_places()]
        same = np.abs(by_coordinate - np.eye(size)).max() < SAME
        kept = None if same else by_coordinate.tolist()
        if own.min() < MOVES:
            return None, kept
        n = speeds @ (projector[:, chosen] / own)
        return (n.T @ m @ n).tolist(), kept

    def _speed_places(self) -> list[int]:
        """Return the place in u of the speed of each coordinate."""
        state, found = self.state, []
        for coordinate in self.coordinates.values():
            state.setU(self.opensim.Vector(state.getNU(), 0.0))
            locked = coordinate.getLocked(state)
            coordinate.setLocked(state, False)
            coordinate.setSpeedValue(state, 1.0)
            speeds = state.getU()
            found.append(int(np.argmax([speeds.get(i) for i in range(speeds.size())])))
            coordinate.setLocked(state, locked)
        state.setU(self.opensim.Vector(state.getNU(), 0.0))
        self.model.realizeVelocity(state)
        return found

    def _rates(self, size: int) -> Array:
        """Return the rates of the coordinates for each unit velocity u, (coordinates, u)."""
        state = self.state
        found = np.zeros((len(self.coordinates), size))
        for k in range(size):
            u = self.opensim.Vector(size, 0.0)
            u.set(k, 1.0)
            state.setU(u)
            self.model.realizeVelocity(state)
            rates = state.getQDot()
            found[:, k] = [rates.get(place) for place in self._places]
        state.setU(self.opensim.Vector(size, 0.0))
        self.model.realizeVelocity(state)
        return found

    def _motion(self, excitation: float | None, duration: float) -> MotionNumbers | None:
        """Return a motion, or None, with a note, where OpenSim fails."""
        try:
            return opensim_motion(self.opensim, self.path, excitation, duration, seed=1)
        except RuntimeError as error:
            kind = "passive" if excitation is None else "driven"
            self.notes.append(f"the {kind} motion: OpenSim says {' '.join(str(error).split())[:200]}")
            return None
