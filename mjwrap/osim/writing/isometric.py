"""The isometric tension of muscles whose curves the file lists, to tell how far the law written instead is from it."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from mjwrap.errors import MjwrapError
from mjwrap.mjcf.parameters import FIBER_LAWS, law_arguments
from mjwrap.muscles.bench import simulate_muscle
from mjwrap.osim.description.forces import Muscle
from mjwrap.osim.writing.laws import WrittenLaw

ACTIVATIONS = (0.05, 1.0)
LARGEST = 300.0  # exponent of a force; a fibre of 39 optimal lengths has it
HALVINGS = 60  # of the interval of the tendon's length
ACTIVE, PASSIVE, TENDON = (f"{what}_force_length_curve" for what in ("active", "passive", "tendon"))


def tension(muscle: Muscle, length: float, activation: float) -> float | None:
    """Return the tension at rest [shares of max_isometric_force] by the file's curves; None where it lacks one.

    length: of the path [m]. The fibre keeps its thickness; a compliant tendon takes its part of the length.
    """
    given, curves = muscle.parameters, muscle.splines
    if ACTIVE not in curves or PASSIVE not in curves or (TENDON not in curves and not muscle.rigid_tendon):
        return None
    exponential = muscle.kind.startswith("Schutte1993")
    optimal, slack = given["optimal_fiber_length"], given["tendon_slack_length"]
    thickness = optimal * float(np.sin(given["pennation_angle_at_optimal"]))

    def of_fiber(along: float) -> float:
        fiber = float(np.hypot(max(along, 0.0), thickness))
        if fiber == 0.0:
            return 0.0
        share = fiber / optimal
        # OpenSim's Schutte muscle has this exponential, whatever curve the file lists
        passive = math.exp(min(8.0 * share - 12.0, LARGEST)) if exponential else curves[PASSIVE](share).item()
        force = activation * curves[ACTIVE](share).item() + passive
        return force * max(along, 0.0) / fiber

    if muscle.rigid_tendon or slack == 0.0:
        return of_fiber(length - slack)
    low, high = slack, max(length, slack)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if curves[TENDON](middle / slack - 1.0).item() < of_fiber(length - middle):
            low = middle
        else:
            high = middle
    return float(curves[TENDON](low / slack - 1.0).item())


def largest_difference(muscle: Muscle, law: WrittenLaw, lengths: Iterable[float]) -> float | None:
    """Return the largest difference of tension at rest [shares of max_isometric_force] from the file's; or None."""
    written = FIBER_LAWS[law.name](**law_arguments(law.numbers), tendon=law.words["tendon_model"])
    strongest = muscle.parameters["max_isometric_force"]
    worst = 0.0
    for length in lengths:
        for activation in ACTIVATIONS:
            theirs = tension(muscle, length, activation)
            if theirs is None:
                return None
            try:
                found = simulate_muscle(written, [0.0], length, activation=activation)  # type: ignore[arg-type]
            except MjwrapError:
                return None
            worst = max(worst, abs(float(found.tension[0]) / strongest - theirs))
    return worst
