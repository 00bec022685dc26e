"""Compare an imported model's numbers with OpenSim's, and give the reason for each large difference."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.errors import StateError
from mjwrap.osim.verifying.driven import driven_cause
from mjwrap.osim.verifying.imported import ImportedModel, ImportedNumbers, SimulatedMotion
from mjwrap.osim.verifying.reasons import LARGE, UNEXPLAINED, Geodesic, arm_reason, length_reason
from mjwrap.osim.verifying.reference import MotionNumbers, PoseNumbers, Reference

Array = NDArray[np.float64]
RELATIVE = 1e-2  # a difference of a tension, as a share of the larger one, that needs a reason
TURN = 1e-2  # [rad] a rotation that needs a reason
LOSS = 1e-3  # [J] change of a passive motion's energy that disproves the motion
SMALLEST = 1e-12  # of the mass matrix's diagonal, as a share of its largest element, to divide by


@dataclass(frozen=True)
class Difference:
    """A difference that needs a reason: of `what` ("length", ...) in element `name` at pose number `pose`, None for a
    motion."""

    what: str
    name: str
    pose: int | None
    opensim: float
    mjwrap: float
    unit: str
    reason: str


@dataclass
class Quantity:
    """All comparisons of one quantity: how many, the largest and the median difference, and how many within `tight`."""

    what: str
    unit: str
    tight: float
    differences: list[float] = field(default_factory=list)
    worst: str = ""

    def add(self, difference: float, where: str) -> None:
        """Add a difference and where it was seen."""
        size = abs(difference)
        if not self.differences or not size <= max(self.differences):
            self.worst = where
        self.differences.append(size)

    @property
    def count(self) -> int:
        return len(self.differences)

    @property
    def largest(self) -> float:
        return max(self.differences, default=0.0)

    @property
    def median(self) -> float:
        return float(np.median(self.differences)) if self.differences else 0.0

    @property
    def share(self) -> float:
        """The share of differences up to `tight`."""
        return sum(d <= self.tight for d in self.differences) / max(self.count, 1)


@dataclass
class Verification:
    """The result: quantities, differences with their reasons, and what could not be compared."""

    reference: Reference
    quantities: list[Quantity]
    differences: list[Difference]
    missing: list[str]

    @property
    def unexplained(self) -> list[Difference]:
        """The large differences without a reason."""
        return [d for d in self.differences if d.reason.startswith(UNEXPLAINED)]


def verify(
    model: mujoco.MjModel,
    reference: Reference,
    progress: Callable[[int, int], object] | None = None,
    geodesic: Geodesic | None = None,
) -> Verification:
    """Compare an imported model, compiled, with OpenSim's numbers of the same file.

    progress: called with the number of poses done and that of all. geodesic: returns the length of another program's
    geodesic over the stops of a route, or None; it judges between paths that differ.
    """
    imported = ImportedModel(model)
    every = {
        "coordinate": Quantity("coordinates that are set, or follow", "rad, m", 1e-9),
        "position": Quantity("position of bodies", "m", 1e-9),
        "rotation": Quantity("rotation of bodies", "rad", 1e-9),
        "mass": Quantity("reduced mass matrix, share of its diagonal", "", 1e-9),
        "straight": Quantity("length of paths without contact", "m", 1e-12),
        "wrapped": Quantity("length of paths with contact", "m", 1e-9),
        "arm": Quantity("moment arms of paths without contact", "m", 5e-7),
        "wrapped arm": Quantity("moment arms of paths with contact", "m", 5e-7),
        "law": Quantity("tension at OpenSim's length, share of the maximum force", "", 1e-7),
        "tension": Quantity("tension at mjwrap's length, share of the maximum force", "", 1e-7),
    }
    found = Verification(reference, [], [], [*reference.notes])
    known = set(imported.muscles.names)
    lost = [name for name in (reference.poses[0].lengths if reference.poses else ()) if name not in known]
    if lost:
        found.missing.append(f"paths that the imported model does not have: {', '.join(lost)}")
    for k, pose in enumerate(reference.poses):
        try:
            ours = imported.at(pose, reference.independent, reference.activations)
        except StateError as error:
            found.missing.append(f"pose {k}: {error}")
            continue
        elsewhere = _compare_bodies(every, found, pose, ours, k)
        _compare_paths(every, found, imported, pose, ours, k, geodesic, elsewhere)
        if progress is not None:
            progress(k + 1, len(reference.poses))
    for name, motion in (("passive motion", reference.passive), ("driven motion", reference.driven)):
        if motion is not None:
            _compare_motion(every, found, imported, name, motion)
    found.missing += _not_compared(reference, imported)
    found.quantities = [quantity for quantity in every.values() if quantity.count]
    return found


def _not_compared(reference: Reference, imported: ImportedModel) -> list[str]:
    """Return sentences on what was not compared, and why."""
    lost = []
    if not reference.poses:
        return ["nothing: the numbers have no pose"]
    first = reference.poses[0]
    known = {imported.model.body(i).name for i in range(imported.model.nbody)}
    if missing := [name for name in first.bodies if name not in known]:
        lost.append(f"bodies that the imported model does not have: {', '.join(missing)}")
    if first.mass is None and first.coordinates:
        lost.append(
            "the reduced mass matrix: OpenSim has other speeds than coordinates, or a coordinate cannot move"
        )
    unknown = [name for name in reference.independent if not imported.knows(name)]
    if unknown and first.mass is not None:
        lost.append(f"the reduced mass matrix: the imported model does not have {', '.join(unknown)}")
    if unknown and first.moment_arms:
        lost.append(f"moment arms about {', '.join(unknown)}: the imported model does not have them")
    return lost


def _compare_bodies(
    every: dict[str, Quantity], found: Verification, pose: PoseNumbers, ours: ImportedNumbers, k: int
) -> str:
    """Compare coordinates, bodies and mass; return why paths differ, too, if bodies do, else ""."""
    apart, moved = 0.0, 0.0
    for name, value in pose.coordinates.items():
        if name in ours.coordinates:
            gap = ours.coordinates[name] - value
            apart = max(apart, abs(gap))
            every["coordinate"].add(gap, f"{name}, pose {k}")
    elsewhere = ""
    if apart > LARGE:
        elsewhere = f"{UNEXPLAINED}: coordinates differ by up to {apart:.2g} rad or m"
    why = elsewhere or f"{UNEXPLAINED}: the same coordinates"
    for name, place in pose.bodies.items():
        if name not in ours.bodies:
            continue
        theirs, mine = np.array(place), ours.bodies[name]
        shift = float(np.abs(mine[:3] - theirs[:3]).max())
        moved = max(moved, shift)
        every["position"].add(shift, f"{name}, pose {k}")
        turn = mine[3:].reshape(3, 3) @ theirs[3:].reshape(3, 3).T
        skew = 0.5 * np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
        angle = float(np.arctan2(np.linalg.norm(skew), 0.5 * (np.trace(turn) - 1.0)))
        every["rotation"].add(angle, f"{name}, pose {k}")
        if not shift <= LARGE:
            found.differences.append(Difference("position", name, k, 0.0, shift, "m", why))
        if not angle <= TURN:
            found.differences.append(Difference("rotation", name, k, 0.0, angle, "rad", why))
    if pose.mass is not None and ours.mass is not None:
        theirs = np.array(pose.mass)
        diagonal = np.maximum(np.diag(theirs), SMALLEST * np.diag(theirs).max())  # 0 for a body without mass
        scale = np.sqrt(np.outer(diagonal, diagonal))
        share = float((np.abs(ours.mass - theirs) / scale).max())
        every["mass"].add(share, f"pose {k}")
        if not share <= RELATIVE:
            found.differences.append(Difference("mass", "reduced mass matrix", k, 0.0, share, "", why))
    if moved > LARGE and not elsewhere:
        return f"{UNEXPLAINED}: bodies are up to {1e3 * moved:.2g} mm apart"
    return elsewhere


def _compare_paths(
    every: dict[str, Quantity],
    found: Verification,
    imported: ImportedModel,
    pose: PoseNumbers,
    ours: ImportedNumbers,
    k: int,
    geodesic: Geodesic | None,
    elsewhere: str,
) -> None:
    for name, theirs in pose.lengths.items():
        mine = ours.lengths.get(name)
        if mine is None:
            continue
        touches = ours.touched[name] > 0 or name in pose.wraps
        every["wrapped" if touches else "straight"].add(mine - theirs, f"{name}, pose {k}")
        reason = ""
        if not abs(mine - theirs) <= LARGE:
            reason = elsewhere or length_reason(name, pose, ours, mine - theirs, geodesic)
            found.differences.append(Difference("length", name, k, theirs, mine, "m", reason))
        for coordinate, arm in pose.moment_arms.get(name, {}).items():
            if coordinate not in ours.moment_arms[name]:
                continue
            own = ours.moment_arms[name][coordinate]
            every["wrapped arm" if touches else "arm"].add(own - arm, f"{name} about {coordinate}, pose {k}")
            if not abs(own - arm) <= LARGE:
                why = elsewhere or arm_reason(name, coordinate, arm, own, pose)
                reason = reason or length_reason(name, pose, ours, mine - theirs, geodesic)
                about = f"{name} about {coordinate}"
                found.differences.append(Difference("moment arm", about, k, arm, own, "m", why or reason))
    for name, law in ours.laws.items():
        strongest = float(getattr(imported.muscles[name].parameters, "max_isometric_force", 0.0))
        if strongest <= 0.0:
            continue
        for i, tension in enumerate(pose.tensions[name]):
            if tension is None:
                continue
            where = f"{name} at activation {found.reference.activations[i]:g}, pose {k}"
            every["law"].add((law[i] - tension) / strongest, where)
            if name in ours.tensions:
                every["tension"].add((ours.tensions[name][i] - tension) / strongest, where)
            gap = abs(law[i] - tension)
            if not gap <= RELATIVE * max(abs(tension), 1e-3 * strongest):
                found.differences.append(
                    Difference(
                        "tension", where, k, tension, float(law[i]), "N", f"{UNEXPLAINED}: same length"
                    )
                )


def _compare_motion(
    every: dict[str, Quantity], found: Verification, imported: ImportedModel, name: str, motion: MotionNumbers
) -> None:
    try:
        ours = imported.motion(motion)
    except StateError as error:
        found.missing.append(f"the {name}: {error}")
        return
    quantity = every[name] = Quantity(f"coordinates in the {name}, {motion.time[-1]:g} s", "rad, m", 1e-4)
    couplings = every[f"{name}, couplings"] = Quantity(f"coupled joints in the {name}", "rad, m", 5e-6)
    for joint, error in ours.coupling_errors.items():
        couplings.add(error, joint)
    gaps = {n: values - np.array(motion.coordinates[n]) for n, values in ours.coordinates.items()}
    large = [n for n, gap in gaps.items() if not np.abs(gap).max(initial=0.0) <= LARGE]
    why = _motion_reason(imported, motion, ours, [gaps[n] for n in large]) if large else ""
    for coordinate, gap in gaps.items():
        k = int(np.argmax(np.abs(gap)))
        quantity.add(float(gap[k]), coordinate)
        if coordinate in large:
            theirs = motion.coordinates[coordinate][k]
            place = f"{coordinate}, {motion.time[k]:g} s"
            found.differences.append(
                Difference(name, place, None, theirs, theirs + float(gap[k]), "rad, m", why)
            )


def _motion_reason(
    imported: ImportedModel, motion: MotionNumbers, ours: SimulatedMotion, gaps: list[Array]
) -> str:
    """Return why coordinates differ along a motion, from OpenSim's energy or from its muscles."""
    lost = abs(motion.energy[-1] - motion.energy[0]) if motion.energy else 0.0
    if lost > LOSS and abs(ours.energy_change) < 0.01 * lost:
        return f"OpenSim's motion changes its energy by {lost:.2g} J, mjwrap's by {abs(ours.energy_change):.1g} J"
    begin = min(int(np.argmax(~(np.abs(gap) <= LARGE))) for gap in gaps)
    until = next((s.frame for s in motion.samples if s.frame >= begin), begin)
    cause = driven_cause(imported, motion, motion.time[until]) if motion.samples else ""
    return cause or f"{UNEXPLAINED}: motion"
