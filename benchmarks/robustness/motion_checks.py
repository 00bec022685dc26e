"""Laws that a motion of a path has to obey, one function per law; each returns the faults that it found."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from motions import Motion
from numpy.typing import NDArray

import mjwrap as mw
from mjwrap.verification.certificate import Case, findings, grouped, laid_out
from mjwrap.verification.polish import Touch, polish
from mjwrap.verification.shapes import Array

SAME = 1e-9  # relative: lengths of one path found in two ways
SUSPECTS = 6  # intervals of a sweep that are looked at closely
FINER = 24  # steps in such an interval, twice over
NARROWEST = 1e-7  # to which a jump is narrowed down, in the period's share
RATES = 25  # poses at which the speed is compared with differences of length
RATE_STEPS = (4e-3, 1e-3, 2.5e-4)  # of those differences, in tau; extrapolated to order four
RATE_ERROR = (
    1e-7  # relative to the fastest speed of the motion: order four of the step, at places ten times sharper
)
JUDGED = 15  # every so manieth pose of a sweep is judged by the certificate


@dataclass
class Followed:
    """A motion solved pose after pose: times, solutions, lengths, speeds per unit of tau."""

    motion: Motion
    tau: Array
    sols: list[mw.PathSolution]
    length: Array
    speed: Array

    @property
    def good(self) -> NDArray[np.bool_]:
        """Whether each pose has a path."""
        return np.array([sol.converged for sol in self.sols])

    def case(self, k: int) -> Case:
        """Return one pose's claim."""
        return Case.of(*self.motion.scene(self.tau[k]), self.sols[k])


@dataclass
class Report:
    """What one motion shows: counts of poses and events, and the faults with the times at which they happen."""

    counts: dict[str, float] = field(default_factory=dict)
    faults: list[dict[str, Any]] = field(default_factory=list)

    def count(self, name: str, by: float = 1) -> None:
        """Count something."""
        self.counts[name] = self.counts.get(name, 0) + by

    def fault(self, what: str, tau: float, detail: str) -> None:
        """Count a fault and keep where it is."""
        self.count(what)
        self.faults.append({"what": what, "tau": float(tau), "detail": detail})


def follow(motion: Motion, tau: Array, start: mw.PathSolution | None = None) -> Followed:
    """Solve poses one after the other, each from the one before."""
    sols, lengths, speeds = [], [], []
    sol = start
    for now in tau:
        scene = motion.scene(now)
        sol = mw.solve_path(*scene, start=sol)
        sols.append(sol)
        lengths.append(sol.length)
        speeds.append(sol.speed(*motion.velocities(now)))
    return Followed(motion, np.asarray(tau), sols, np.array(lengths), np.array(speeds))


def goes_on(motion: Motion, sol: mw.PathSolution, before: float, after: float, reach: float) -> bool:
    """Return whether a path continues to the next pose: polished there by other means, it is a true path again.

    reach: by how much its length can have changed [m].
    """
    case = Case.of(*motion.scene(before), sol)
    touches, _, _ = laid_out(0, case)
    grouped([case], touches)
    rough = [Touch(t.index, t.P, t.tangents[0], t.s) for t in touches]
    scene = motion.scene(after)
    if rough:
        found = polish(*scene, [rough])[0]
    else:
        straight = float(np.linalg.norm(scene[1] - scene[0]))
        found = Case(*scene, [[] for _ in scene[2]], straight)
    if found is None or findings([found])[0]:
        return False
    alike = [len(x) for x in found.contacts] == [len(x) for x in case.contacts]
    return alike and abs(found.length - sol.length) <= reach


# --------------------------------------------------------------------------------------------- laws


def no_jumps(run: Followed, report: Report) -> int:
    """Look closely where the length does not follow its speed, or the speed jumps; return how often the string slipped.

    A smooth stretch shows less of both with the square of the step, lift-off and touchdown with the step; a jump
    stays. It is a fault
    if the path before it goes on behind it, otherwise the string had to slip: its path ceased to be a minimum.
    """
    slips = 0
    h = np.diff(run.tau)
    both = run.good[:-1] & run.good[1:]
    for k in np.flatnonzero(run.good[:-1] & ~run.good[1:]):
        reach = run.motion.travel([run.tau[k]]) * h[k]
        if goes_on(run.motion, run.sols[k], run.tau[k], run.tau[k + 1], reach):
            report.fault("lost", run.tau[k], f"{run.sols[k + 1].status.name} though the path goes on")
        else:
            slips += 1
    with np.errstate(invalid="ignore"):
        defect = np.where(both, np.abs(np.diff(run.length) - 0.5 * h * (run.speed[1:] + run.speed[:-1])), 0.0)
        kink = np.where(both, np.abs(np.diff(run.speed)), 0.0)
    scale = float(np.abs(run.speed[run.good]).max(initial=1e-6))
    suspects = [*np.argsort(defect)[-SUSPECTS:], *np.argsort(kink)[-SUSPECTS:]]
    for k in sorted({int(k) for k in suspects}):
        if defect[k] > 1e-9 or kink[k] > 1e-3 * scale:
            slips += _looked_at(run, k, float(defect[k]), float(kink[k]), scale, report)
    return slips


def _looked_at(run: Followed, k: int, defect: float, kink: float, scale: float, report: Report) -> int:
    """Refine one interval until its jump, if it has one, stands in a narrow gap; return 1 for a slip."""
    start, a, b = run.sols[k], float(run.tau[k]), float(run.tau[k + 1])
    while True:
        fine = follow(run.motion, np.linspace(a, b, FINER + 1)[1:], start)
        sols, tau = [start, *fine.sols], np.concatenate([[a], fine.tau])
        length = np.array([sol.length for sol in sols])
        speed = np.concatenate([[start.speed(*run.motion.velocities(a))], fine.speed])
        if not all(sol.converged for sol in sols):
            bad = next(i for i, sol in enumerate(sols) if not sol.converged)
            before, after = float(tau[bad - 1]), float(tau[bad])
            what, size = sols[bad].status.name, 0.0
            at = bad - 1
        else:
            gaps = np.abs(np.diff(length) - 0.5 * np.diff(tau) * (speed[1:] + speed[:-1]))
            steps = np.abs(np.diff(speed))
            if gaps.max() > 0.5 * defect and gaps.max() > 1e-10:
                at, what, size = int(gaps.argmax()), "length", float(gaps.max())
            elif steps.max() > 0.5 * kink and steps.max() > 1e-3 * scale:
                at, what, size = int(steps.argmax()), "speed", float(steps.max())
            else:
                return 0
            before, after = float(tau[at]), float(tau[at + 1])
        if after - before < NARROWEST:
            break
        a, b, start = before, after, sols[at]
    reach = max(run.motion.travel([before]) * (after - before), 1e-12)
    if goes_on(run.motion, sols[at], before, after, reach):
        report.fault("jumps", before, f"{what} by {size:.2e} though the path goes on")
        return 0
    return 1


def _rate_at(run: Followed, k: int, step: float) -> float | None:
    """Return the rate of length at one pose from differences over `step`; None where a contact comes or goes nearby."""
    now = float(run.tau[k])
    times = [now + share * step for share in (-1.0, -0.5, 0.5, 1.0)]
    around = [mw.solve_path(*run.motion.scene(time), start=run.sols[k]) for time in times]
    if not all(sol.converged and touched(sol) == touched(run.sols[k]) for sol in around):
        return None
    far, near, near2, far2 = (sol.length for sol in around)
    if max(abs(far - run.length[k]), abs(far2 - run.length[k])) > run.motion.travel([now]) * step:
        return None  # the string slips there
    return (4.0 * (near2 - near) / step - (far2 - far) / (2.0 * step)) / 3.0


def rates_agree(run: Followed, rng: np.random.Generator, report: Report) -> None:
    """Compare the speed with differences of length, where the same surfaces are touched on both sides.

    Over smaller steps where they disagree: a contact may cross the seam of a capsule, where curvature jumps.
    """
    scale = float(np.abs(run.speed[run.good]).max(initial=1e-6))
    worst = 0.0
    for k in rng.choice(len(run.tau), RATES, replace=False):
        if not run.good[k]:
            continue
        errors = []
        for step in RATE_STEPS:
            rate = _rate_at(run, k, step)
            if rate is None:
                continue
            errors.append(abs(rate - float(run.speed[k])) / scale)
            if errors[-1] <= RATE_ERROR:
                break
        if not errors:
            continue
        report.count("rates")
        worst = max(worst, min(errors))
        if min(errors) > RATE_ERROR:
            report.fault("wrong speed", float(run.tau[k]), f"off by {min(errors):.1e} of the fastest")
    report.counts["worst rate"] = max(report.counts.get("worst rate", 0.0), worst)


def touched(sol: mw.PathSolution) -> list[int]:
    """Return how often each obstacle is touched."""
    return [0 if not c.active else 1 if c.second is None else 2 for c in sol.contacts]


def agrees(
    run: Followed, places: Iterable[int], sols: Sequence[mw.PathSolution], what: str, report: Report
) -> None:
    """Count the poses of another way through the motion at which the length differs."""
    worst, where = 0.0, 0
    differ = 0
    for k, sol in zip(places, sols, strict=True):
        if not run.good[k]:
            continue
        off = abs(sol.length - run.length[k]) if sol.converged else np.inf
        if off > SAME * run.length[k]:
            differ += 1
            if off > worst:
                worst, where = float(off), k
    if differ:
        report.fault(what, run.tau[where], f"{differ} poses, by up to {worst:.2e} m")


def steps_do_not_matter(run: Followed, report: Report, slips: int) -> None:
    """Solve the motion backwards and in coarse steps; where no string slipped every pose is the same."""
    if slips:
        return
    last = len(run.tau) - 1
    back = follow(run.motion, run.tau[::-1], run.sols[last])
    agrees(run, range(last, -1, -1), back.sols, "back differs", report)
    for stride in (10, 50):
        places = list(range(0, last + 1, stride))
        coarse = follow(run.motion, run.tau[places[1:]], run.sols[0])
        agrees(run, places[1:], coarse.sols, f"every {stride}th differs", report)


def large_jumps(run: Followed, rng: np.random.Generator, report: Report, count: int = 60) -> None:
    """Solve poses in random order, each from the last: every claim is judged, other lengths are counted."""
    places = rng.permutation(len(run.tau))[:count]
    sol, cases, other = run.sols[0], [], 0
    for k in places:
        scene = run.motion.scene(float(run.tau[k]))
        sol = mw.solve_path(*scene, start=sol)
        report.count("large jumps")
        if not sol.converged:
            report.count("large jumps lost", float(run.good[k]))
            continue
        cases.append((k, Case.of(*scene, sol)))
        other += bool(run.good[k]) and abs(sol.length - run.length[k]) > SAME * run.length[k]
    report.count("large jumps to another branch", float(other))
    for (k, _), reason in zip(cases, findings([case for _, case in cases]), strict=True):
        if reason:
            report.fault("refuted", float(run.tau[k]), f"after a large jump: {reason}")


def judged(run: Followed, report: Report) -> None:
    """Judge a share of the poses by the certificate."""
    places = [k for k in range(0, len(run.tau), JUDGED) if run.good[k]]
    for k, reason in zip(places, findings([run.case(k) for k in places]), strict=True):
        report.count("judged")
        if reason:
            report.fault("refuted", run.tau[k], reason)


def sweep_agrees(run: Followed, report: Report) -> None:
    """Compare with the compiled loop over the whole motion; it extrapolates, so the last digits may differ."""
    origin, insertion, pos, quat = run.motion.poses(run.tau)
    sweep = mw.solve_sweep(origin, insertion, run.motion.obstacles, pos, quat)
    both = run.good & (sweep.status == mw.Status.CONVERGED)
    report.count("sweep lost", int((run.good & ~both).sum()))
    off = np.abs(sweep.length - run.length)[both]
    if off.max(initial=0.0) > SAME * run.length.max():
        where = run.tau[both][off.argmax()]
        report.fault(
            "sweep differs",
            where,
            f"{(off > SAME * run.length.max()).sum()} poses, by up to {off.max():.2e} m",
        )
    if not np.isfinite(sweep.length).all():
        report.fault("not finite", 0.0, "sweep")
