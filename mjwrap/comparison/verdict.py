"""The outcome of the comparison at each pose, and a summary for each muscle."""

from __future__ import annotations

import enum
from collections import Counter
from dataclasses import dataclass, field

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.comparison.judge_geodesic import SAME_TURN, Fault
from mjwrap.comparison.paired_evaluation import MusclePair, PathRecord
from mjwrap.mjcf import name_of
from mjwrap.paths import Status
from mjwrap.poses.joint_sweeps import PoseSequence

Array = NDArray[np.float64]
AGREE = (
    3e-9  # largest difference of two true geodesics on the same branch, relative to the muscle (`relative`)
)
INSIDE_TOLERANCE = 3e-6  # the same if a string is held inside: MuJoCo finds its corner to 1e-6 rad


class Outcome(enum.IntEnum):
    """The outcome of the comparison of one muscle at one pose."""

    AGREE = 0  # both are the same true geodesic
    OTHER_BRANCH = 1  # both are true geodesics, but go round the surface in different ways
    MUJOCO_NOT_GEODESIC = 2  # mjwrap's path is a true geodesic, MuJoCo's is not
    NO_PATH = 3  # mjwrap found no path, and MuJoCo's is not a geodesic either
    MJWRAP_FAILED = 4  # mjwrap found no path, but MuJoCo's is a true geodesic
    MJWRAP_WRONG = 5  # mjwrap's path is not a true geodesic
    UNEXPLAINED = 6  # both are judged to be the same true geodesic, but their numbers differ
    WRONG_SIDE = (
        7  # from a cold start mjwrap passes a cylinder not on the side that its hint means, MuJoCo does
    )
    KINK = 8  # a kink, at which the path has no derivative, or a tie, at which no way round is the shortest


MJWRAP_AT_FAULT = (Outcome.MJWRAP_FAILED, Outcome.MJWRAP_WRONG, Outcome.UNEXPLAINED, Outcome.WRONG_SIDE)


def outcomes(pair: MusclePair, motion: PoseSequence) -> NDArray[np.int64]:
    """Return the `Outcome` (T,) of a muscle in both programs along a motion.

    At a tie of equally long ways round a sphere each program takes one of them, and at a kink each has one of the
    derivatives to either side; neither is at fault.
    """
    native, mine = pair.native, pair.mjwrap
    assert mine is not None
    count = len(native.length)
    same = (np.abs(native.turns - mine.turns) < SAME_TURN).all(axis=1)
    held = (native.touched & [span.inside for span in pair.spans]).any(axis=1)
    gaps, allowed = relative(pair, motion), np.where(held, INSIDE_TOLERANCE, AGREE)
    near, as_long = gaps.max(axis=0) <= allowed, gaps[0] <= allowed
    found = np.full(count, Outcome.UNEXPLAINED, dtype=np.int64)
    for here, outcome in (  # the last outcome that applies is used
        (same & as_long & pair.kink, Outcome.KINK),
        (same & as_long & pair.tie, Outcome.OTHER_BRANCH),
        (near & same, Outcome.AGREE),
        (~same, Outcome.OTHER_BRANCH),
        (~same & (not motion.continuous) & (native.hinted & ~mine.hinted).any(axis=1), Outcome.WRONG_SIDE),
        (native.fault != 0, Outcome.MUJOCO_NOT_GEODESIC),
        (mine.fault != 0, Outcome.MJWRAP_WRONG),
        ((pair.status != 0) & (native.fault == 0), Outcome.MJWRAP_FAILED),
        ((pair.status == Status.NOT_MINIMAL) & (native.fault == 0) & pair.tie, Outcome.KINK),
        ((pair.status != 0) & (native.fault != 0), Outcome.NO_PATH),
    ):
        found[here] = outcome
    return found


def differences(native: PathRecord, mine: PathRecord) -> Array:
    """Return (3, T): differences in length [m], velocity [m/s], largest moment arm [m/rad]."""
    arm = np.abs(mine.jacobian - native.jacobian).max(axis=1, initial=0.0)
    return np.array([np.abs(mine.length - native.length), np.abs(mine.velocity - native.velocity), arm])


def relative(pair: MusclePair, motion: PoseSequence) -> Array:
    """Return (3, T): differences in length, velocity and largest moment arm, relative to the muscle's size.

    A velocity is relative to that of a muscle whose moment arms are all as large as the muscle, and along slides 1.
    """
    native, mine = pair.native, pair.mjwrap
    assert mine is not None
    fastest = np.abs(motion.qvel) @ pair.arms
    arm = (np.abs(mine.jacobian - native.jacobian) / pair.arms).max(axis=1, initial=0.0)
    velocity = np.abs(mine.velocity - native.velocity) / np.where(fastest > 0.0, fastest, pair.size)
    return np.array([np.abs(mine.length - native.length) / pair.size, velocity, arm])


@dataclass
class Extreme:
    """The largest difference of one quantity: its motion, place, joint positions, and both programs' numbers."""

    difference: float = 0.0
    motion: str = ""
    at: float = 0.0
    joints: dict[str, float] = field(default_factory=dict)
    native: float = 0.0
    mjwrap: float = 0.0
    dof: str = ""


@dataclass
class Curves:
    """One sweep of one muscle for a plot: at, and length and slope of both programs, (T,) each.

    turning: whether `at` is an angle.
    """

    motion: str
    at: Array
    native_length: Array
    native_slope: Array
    length: Array | None
    slope: Array | None
    failed: NDArray[np.bool_]
    base: int = 0
    turning: bool = True


@dataclass
class MuscleSummary:
    """The results of all poses for one muscle.

    native_only: why it stays with MuJoCo, or empty; counts: poses by `Outcome` name; faults: MuJoCo's faults by (fault,
    geom); measures: their largest measures; own_faults, statuses: mjwrap's faults and failures by message; agreement
    (3,): the largest differences at poses where both are the same true geodesic; length, velocity, moment_arm: the
    largest differences of all poses; longer_branch [m]: mjwrap minus MuJoCo where they are on different branches, of
    the largest size; size: of the muscle [m]; ties, cold_branches: how many poses on different branches are ties of
    equally long ways round a sphere, and how many are cold starts.
    """

    name: str
    native_only: str = ""
    size: float = 1.0
    poses: int = 0
    ties: int = 0
    cold_branches: int = 0
    counts: Counter[str] = field(default_factory=Counter)
    faults: Counter[tuple[Fault, str]] = field(default_factory=Counter)
    measures: dict[tuple[Fault, str], float] = field(default_factory=dict)
    own_faults: Counter[str] = field(default_factory=Counter)
    statuses: Counter[str] = field(default_factory=Counter)
    agreement: Array = field(default_factory=lambda: np.zeros(3))
    length: Extreme = field(default_factory=Extreme)
    velocity: Extreme = field(default_factory=Extreme)
    moment_arm: Extreme = field(default_factory=Extreme)
    longer_branch: float = (
        0.0  # mjwrap minus MuJoCo where they are on other branches, of the largest size [m]
    )
    curves: Curves | None = None
    bad_poses: list[tuple[str, str, float, dict[str, float]]] = field(default_factory=list)

    def add(self, model: mujoco.MjModel, motion: PoseSequence, pair: MusclePair) -> None:
        """Add the results of one motion."""
        native, mine = pair.native, pair.mjwrap
        self.poses += len(motion.at)
        for k in np.flatnonzero(native.fault):
            geom = _geom(model, pair, int(native.span[k]))
            key = Fault(int(native.fault[k])), geom
            self.faults[key] += 1
            self.measures[key] = max(self.measures.get(key, 0.0), float(native.measure[k]))
        if mine is None:
            self._keep_curves(motion, pair, 0.0)
            return
        found = outcomes(pair, motion)
        self.counts.update(Outcome(int(o)).name for o in found)
        self.statuses.update(Status(int(s)).message for s in pair.status[pair.status != 0])
        wrong = found == Outcome.MJWRAP_WRONG
        self.own_faults.update(
            Fault(int(f)).words.format(m) for f, m in zip(mine.fault[wrong], mine.measure[wrong], strict=True)
        )
        for k in np.flatnonzero(np.isin(found, MJWRAP_AT_FAULT)):
            place = (
                Outcome(int(found[k])).name,
                motion.name,
                float(motion.at[k]),
                _joints(model, motion.qpos[k]),
            )
            self.bad_poses.append(place)
        gaps = differences(native, mine)
        same = np.isin(found, (Outcome.AGREE, Outcome.UNEXPLAINED))
        if same.any():
            self.agreement = np.maximum(self.agreement, gaps[:, same].max(axis=1))
        other = found == Outcome.OTHER_BRANCH
        self.ties += int((other & pair.tie).sum())
        self.cold_branches += int((other & ~pair.tie).sum()) * (not motion.continuous)
        if other.any():
            longer = (mine.length - native.length)[other]
            most = float(longer[np.argmax(np.abs(longer))])
            self.longer_branch = most if abs(most) > abs(self.longer_branch) else self.longer_branch
        gaps = np.where(pair.status == 0, gaps, 0.0)
        self._keep_extremes(model, motion, pair, gaps)
        self._keep_curves(motion, pair, float(gaps[0].max(initial=0.0)))

    def _keep_extremes(
        self, model: mujoco.MjModel, motion: PoseSequence, pair: MusclePair, gaps: Array
    ) -> None:
        native, mine = pair.native, pair.mjwrap
        assert mine is not None
        for row, name in enumerate(("length", "velocity", "moment_arm")):
            k = int(np.argmax(gaps[row]))
            if gaps[row, k] <= getattr(self, name).difference:
                continue
            ours, theirs, dof = mine.length[k], native.length[k], ""
            if name == "velocity":
                ours, theirs = mine.velocity[k], native.velocity[k]
            elif name == "moment_arm":
                d = int(np.argmax(np.abs(mine.jacobian[k] - native.jacobian[k])))
                ours, theirs = mine.jacobian[k, d], native.jacobian[k, d]
                dof = name_of(model, mujoco.mjtObj.mjOBJ_JOINT, int(model.dof_jntid[d]))
            where = motion.name, float(motion.at[k]), _joints(model, motion.qpos[k])
            setattr(self, name, Extreme(float(gaps[row, k]), *where, float(theirs), float(ours), dof))

    def _keep_curves(self, motion: PoseSequence, pair: MusclePair, gap: float) -> None:
        """Keep the sweep with the largest difference or, without differences, the largest change of length."""
        if not motion.continuous:
            return
        change = float(np.ptp(pair.native.length))
        score = (gap if gap > AGREE * pair.size else 0.0, change)
        if self.curves is not None and score <= self._score:
            return
        self._score = score
        mine = pair.mjwrap
        self.curves = Curves(
            motion.name, motion.at, pair.native.length, slope(pair.native, motion),
            None if mine is None else mine.length, None if mine is None else slope(mine, motion), pair.status != 0,
            motion.base, motion.turning,
        )  # fmt: skip

    _score: tuple[float, float] = (0.0, 0.0)

    @property
    def at_fault(self) -> int:
        """Number of poses at which mjwrap is wrong, or has no path although MuJoCo's is a true geodesic."""
        return sum(self.counts[outcome.name] for outcome in MJWRAP_AT_FAULT)


def slope(record: PathRecord, motion: PoseSequence) -> Array:
    """Return dl/d(at) (T,) along a sweep [m/rad or 1]."""
    return np.einsum("tj,tj->t", record.jacobian, motion.tangent)


def _geom(model: mujoco.MjModel, pair: MusclePair, span: int) -> str:
    if span < 0:
        return ""
    return name_of(model, mujoco.mjtObj.mjOBJ_GEOM, pair.spans[span].geom)


def _joints(model: mujoco.MjModel, qpos: Array) -> dict[str, float]:
    """Return the positions of all hinges and slides by name."""
    single = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
    return {
        name_of(model, mujoco.mjtObj.mjOBJ_JOINT, j): float(qpos[model.jnt_qposadr[j]])
        for j in range(model.njnt)
        if int(model.jnt_type[j]) in single
    }
