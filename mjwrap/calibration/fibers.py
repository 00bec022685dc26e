"""Optimal fibre length and tendon slack length from the lengths that a muscle takes.

With a rigid tendon and constant fibre height, musculotendon length l and normalised fibre length x are related by
l = l_s + l_o √(x² − sin²α₀). Two lengths at two wanted x give l_o and l_s.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from mjwrap import validation
from mjwrap.errors import ModelError
from mjwrap.muscles.laws import DeGrooteFregly2016, MuJoCoMuscle

MUJOCO_RANGE = (0.75, 1.05)  # of normalised fibre lengths: MuJoCo's default
WIDE_RANGE = (0.5, 1.5)  # where the active force-length curve is well above zero
LEAST_SLACK = 0.05  # smallest tendon slack length, as a share of the shortest length


@dataclass(frozen=True)
class FiberFit:
    """The fibre and tendon of a muscle between its shortest and its longest length.

    Attributes:
        optimal_fiber_length: [m].
        tendon_slack_length: [m].
        pennation_angle: at optimal fibre length [rad].
        fiber_range: normalised fibre lengths at the shortest and the longest musculotendon length, with a rigid tendon.
        wanted: the fibre range that was requested.
        implied_slack_length: the slack length that the requested range needs [m]; negative if impossible.
    """

    optimal_fiber_length: float
    tendon_slack_length: float
    pennation_angle: float
    fiber_range: tuple[float, float]
    wanted: tuple[float, float]
    implied_slack_length: float

    @property
    def exact(self) -> bool:
        """Whether the fibre has the requested range; otherwise this needs a tendon that is too short or negative."""
        return self.tendon_slack_length == self.implied_slack_length

    @property
    def sentence(self) -> str:
        """The result in words."""
        low, high = self.wanted
        if self.exact:
            return f"fibre from {low:.4g} to {high:.4g} optimal lengths, as requested"
        return (
            f"fibre from {low:.4g} to {high:.4g} optimal lengths would need a tendon slack length of "
            f"{1e3 * self.implied_slack_length:.4g} mm; with {1e3 * self.tendon_slack_length:.4g} mm it goes from "
            f"{self.fiber_range[0]:.4g} to {self.fiber_range[1]:.4g}"
        )


def fit_fiber_and_slack(
    shortest: float,
    longest: float,
    *,
    fiber_range: tuple[float, float] = MUJOCO_RANGE,
    pennation_angle: float = 0.0,
    least_slack: float = LEAST_SLACK,
) -> FiberFit:
    """Return the fibre and tendon with which the fibre covers `fiber_range` between two musculotendon lengths.

    If the tendon would be shorter than `least_slack` times the shortest length, or negative, it gets that length. The
    fibre range is then widened by the same amount below and above, and `FiberFit.exact` is false.

    Args:
        shortest: shortest musculotendon length [m].
        longest: longest musculotendon length [m].
        fiber_range: normalised fibre lengths at these two lengths, with a rigid tendon.
        pennation_angle: at optimal fibre length [rad].
        least_slack: least tendon slack length, as a share of the shortest length.

    Returns:
        The fibre and tendon.

    Raises:
        ModelError: lengths or range do not increase, or the fibre would be shorter than its height l_o sin α₀.
    """
    for name, value in (("shortest", shortest), ("longest", longest)):
        validation.require(validation.is_number(value), name, "a length [m]", value, ModelError)
    if not (math.isfinite(longest) and 0.0 < shortest < longest):
        raise ModelError(
            f"lengths must be finite, positive and increasing [m], not {shortest:g} and {longest:g}: does the muscle "
            "have a path, and does a joint that moves it have a range?"
        )
    validation.between(
        pennation_angle, 0.0, 0.5 * math.pi, "pennation_angle", ModelError, "in [0, pi/2) [rad]"
    )
    share = "a fraction of the shortest length, in [0, 1)"
    validation.between(least_slack, 0.0, 1.0, "least_slack", ModelError, share)
    low, high = validation.several(fiber_range, 2, "fiber_range", ModelError)
    height = math.sin(pennation_angle)
    if not (math.isfinite(high) and height < low < high):
        raise ModelError(
            f"fiber_range must increase from above the fibre's height, {height:.4g} optimal lengths, not {low:g} to "
            f"{high:g}"
        )
    along = math.sqrt(low * low - height * height), math.sqrt(high * high - height * height)
    optimal = (longest - shortest) / (along[1] - along[0])
    implied = shortest - optimal * along[0]
    slack, reached = implied, (low, high)
    if implied < least_slack * shortest:
        slack = least_slack * shortest
        optimal = _widened(shortest - slack, longest - slack, low + high, height)
        reached = (
            math.hypot((shortest - slack) / optimal, height),
            math.hypot((longest - slack) / optimal, height),
        )
    return FiberFit(optimal, slack, float(pennation_angle), reached, (low, high), implied)


def _widened(short: float, long: float, total: float, height: float) -> float:
    """Return the optimal length at which the fibre's two normalised lengths have the sum `total`.

    short, long [m]: along the tendon. u = 1/l_o² solves √(short² u + height²) + √(long² u + height²) = total.
    """
    difference = (long * long - short * short) / total
    mean = 0.5 * (short * short + long * long)
    constant = 0.25 * total * total - height * height
    u = 2.0 * constant / (mean + math.sqrt(mean * mean - difference * difference * constant))
    return 1.0 / math.sqrt(u)


@dataclass(frozen=True)
class HillFit:
    """A Hill-type muscle that replaces a muscle of MuJoCo.

    Attributes:
        muscle: the law with its parameters.
        fiber: the fibre and tendon.
        notes: properties that could not be kept, in words.
    """

    muscle: DeGrooteFregly2016
    fiber: FiberFit
    notes: tuple[str, ...] = ()


def hill_from_mujoco(
    law: MuJoCoMuscle,
    *,
    pennation_angle: float = 0.0,
    fiber_damping: float | None = None,
    tendon: str = "rigid",
    least_slack: float = LEAST_SLACK,
) -> HillFit:
    """Return a Hill-type muscle that replaces a muscle of MuJoCo, with the tendon's lengths and without gear.

    The maximum isometric force is `force`, or scale/acc0 if that is negative, times gear, divided by the cosine of the
    pennation angle, so that the tension at optimal length is MuJoCo's. The fibre covers range[0] to range[1] over the
    actuator's length range. The maximum contraction velocity is the same in metres per second. The curves differ.

    Args:
        law: the muscle to convert.
        pennation_angle: at optimal fibre length [rad].
        fiber_damping: as in `DeGrooteFregly2016`.
        tendon: "rigid" or "elastic".
        least_slack: least tendon slack length, as in `fit_fiber_and_slack`; replaces a negative one.

    Returns:
        The muscle, its fibre, and notes about properties that could not be kept.

    Raises:
        ModelError: a parameter is not possible.
    """
    validation.instance(law, MuJoCoMuscle, "law", ModelError, "a MuJoCoMuscle")
    if law.prm[2] < 0.0 and not law.acc0 > 0.0:
        raise ModelError(f"force must be scale/acc0, but acc0 is {law.acc0!r}")
    short, long = law.length_range
    optimal = (long - short) / (law.prm[1] - law.prm[0]) / law.gear
    fiber = fit_fiber_and_slack(
        short / law.gear,
        long / law.gear,
        fiber_range=(law.prm[0], law.prm[1]),
        pennation_angle=pennation_angle,
        least_slack=least_slack,
    )
    peak = mujoco_peak_force(law)
    notes = () if fiber.exact else (fiber.sentence,)
    least = -law.force_range[0] * law.gear
    if least < peak:
        notes += (
            f"the actuator's force range limits its tension to {least:.4g} N; the Hill-type muscle's is not",
        )
    if law.passive is not None:
        notes += ("its passive force has parameters of its own; the Hill-type muscle's is that of its law",)
    muscle = DeGrooteFregly2016(
        max_isometric_force=peak / math.cos(fiber.pennation_angle),
        optimal_fiber_length=fiber.optimal_fiber_length,
        tendon_slack_length=fiber.tendon_slack_length,
        pennation_angle=fiber.pennation_angle,
        max_contraction_velocity=law.prm[6] * optimal / fiber.optimal_fiber_length,
        fiber_damping=fiber_damping,
        tendon=tendon,
    )
    return HillFit(muscle, fiber, notes)


def mujoco_peak_force(law: MuJoCoMuscle) -> float:
    """Return the peak tension [N] of MuJoCo's muscle at optimal length: gear × force, or gear × scale/acc0."""
    force, scale = law.prm[2], law.prm[3]
    return law.gear * (force if force >= 0.0 else scale / max(law.acc0, 1e-15))
