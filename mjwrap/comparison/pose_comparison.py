"""Compare both programs over all poses: choose the motions, and collect the results."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.comparison.jumps import Jump, find_jumps
from mjwrap.comparison.motion import pristine
from mjwrap.comparison.paired_evaluation import NO_TENDON, PLACEHOLDER, Batch, Comparer
from mjwrap.comparison.verdict import MuscleSummary, Outcome
from mjwrap.errors import ModelError
from mjwrap.poses.joint_sweeps import PoseMaker
from mjwrap.system import CableSystem, kinds
from mjwrap.text import counted_paths, noun

Array = NDArray[np.float64]


@dataclass
class PoseComparison:
    """The results of a comparison over all poses.

    Attributes:
        muscles: a summary for each muscle, by name.
        jumps: the jumps of both programs.
        left_out: muscles that were left out, with the reason.
        poses: number of poses.
        side_rule: the rule of mjwrap's paths.
        kinds: "muscle", "cable" or "tendon" (without an actuator) by name.
    """

    muscles: dict[str, MuscleSummary] = field(default_factory=dict)
    jumps: list[Jump] = field(default_factory=list)
    left_out: dict[str, str] = field(default_factory=dict)
    poses: int = 0
    side_rule: int = 3
    kinds: dict[str, str] = field(default_factory=dict)

    def noun(self, several: bool = False) -> str:
        """Return the word for what was compared, such as "cable", or "muscles and cables" for several."""
        return noun((self.kinds.get(name, "muscle") for name in self.muscles), several)

    def counted(self, names: Collection[str]) -> str:
        """Return the number of names with their kinds, such as "2 muscles and 1 cable"."""
        found = [self.kinds.get(name, "muscle") for name in names]
        return counted_paths(len(found), found.count("cable"), found.count("tendon"))

    def total(self, outcome: Outcome) -> int:
        """Return the number of poses, over all muscles, with an outcome."""
        return sum(summary.counts[outcome.name] for summary in self.muscles.values())

    @property
    def unlike(self) -> list[str]:
        """Muscles that MuJoCo pulls along another route, or not at all, so that motions must differ."""
        return [name for name, reason in self.left_out.items() if reason in (PLACEHOLDER, NO_TENDON)]

    @property
    def at_fault(self) -> int:
        """Number of poses at which mjwrap is wrong, or has no path where MuJoCo's is a true geodesic."""
        return sum(summary.at_fault for summary in self.muscles.values())


def compare_poses(
    model: mujoco.MjModel,
    *,
    names: Sequence[str] | None = None,
    samples: int = 101,
    bases: int = 1,
    seed: int = 0,
    base: Array | None = None,
    each: Callable[[Batch], object] | None = None,
    side_rule: int | None = None,
    tendons: bool = False,
    progress: Callable[[str, int, int], object] | None = None,
) -> PoseComparison:
    """Compare both programs along sweeps of every joint around the base pose, and at random poses.

    Args:
        model: the model; it is not changed.
        names: of muscles; None for all.
        samples: number of poses of a sweep, and of random poses.
        bases: number of further poses around which joints are swept: the middle of all ranges first, then random ones.
        seed: of the random poses.
        base: (nq,) base pose; qpos0 if None.
        each: called with every evaluated batch.
        side_rule: of mjwrap's paths, as for `MuscleSystem`; MuJoCo's tendons have that of the running MuJoCo.
        tendons: compare spatial tendons without an actuator, too.
        progress: called with (name, done, all) before each motion.

    Returns:
        A summary for each muscle, and the jumps of both programs.

    Raises:
        ModelError: a name is not that of a muscle.
    """
    model = pristine(model)
    muscles = CableSystem(model, side_rule=side_rule, tendons=tendons)
    known = [*muscles.names, *muscles.native]
    unknown = [name for name in names or () if name not in known]
    if unknown:
        raise ModelError(
            f"no muscle {', '.join(repr(n) for n in unknown)}; muscles: {', '.join(known) or 'none'}"
        )
    comparer = Comparer(muscles, list(names or known))
    found = PoseComparison(left_out=comparer.left_out, side_rule=muscles.side_rule, kinds=kinds(muscles))
    start = np.array(model.qpos0 if base is None else base, dtype=np.float64)
    makers = [PoseMaker(model, start, seed)]
    joints = makers[0].joints()
    if len(joints) > 1 and bases > 0:
        middle = makers[0].middle()
        others = makers[0].random(bases).qpos[1:]
        makers += [PoseMaker(model, pose, seed + i, i) for i, pose in enumerate((middle, *others), 1)]
    plan = [(maker, joint, axis) for maker in makers for joint in joints for axis in maker.axes(joint)]

    def take(batch: Batch) -> None:
        found.poses += len(batch.motion.at)
        for pair in batch.pairs:
            summary = found.muscles.setdefault(
                pair.name, MuscleSummary(pair.name, muscles.native.get(pair.name, ""), pair.size)
            )
            summary.add(model, batch.motion, pair)
        if each is not None:
            each(batch)

    for done, (maker, joint, axis) in enumerate(plan):
        motion = maker.sweep(joint, samples, axis)
        if progress is not None:
            progress(motion.name, done, len(plan) + 1)
        batch = comparer.evaluate(motion, maker.base)
        take(batch)
        found.jumps += find_jumps(comparer, maker, batch, joint, axis)
    if progress is not None:
        progress("random poses", len(plan), len(plan) + 1)
    take(comparer.evaluate(makers[0].random(samples)))
    return found
