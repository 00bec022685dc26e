"""Find implausible muscle parameters: from the parameters alone, over the joints' ranges, and at rest."""

from __future__ import annotations

import copy
import math
from collections.abc import Iterator, Mapping
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjwrap import validation
from mjwrap.calibration.fibers import mujoco_peak_force
from mjwrap.calibration.ranges import LengthRange, length_ranges
from mjwrap.calibration.report import Finding, Implausible, ParameterLimits, ParameterReport
from mjwrap.errors import ModelError, StateError
from mjwrap.kernels.musculotendon import tension as laws
from mjwrap.mjcf import is_muscle, name_of
from mjwrap.mjcf.actuators import mujoco_law
from mjwrap.muscles.laws import FiberLaw, Law, MuJoCoMuscle, parameter_row
from mjwrap.system import MuscleSystem, is_cable, twin_of
from mjwrap.text import counted

Found = Iterator[tuple[Implausible, float, float, str]]


class Unit(NamedTuple):
    """A muscle of any law as a fibre with a rigid tendon: F_max [N], lengths [m], sin α₀, declared length range [m].

    If the law has no fibre, its length is NaN.
    """

    peak: float
    optimal: float
    slack: float
    height: float
    declared: tuple[float, float] | None

    def fiber(self, length: float) -> float:
        """Return the normalised fibre length at a musculotendon length; negative if this is below the tendon's."""
        along = (length - self.slack) / self.optimal
        return along if along <= 0.0 else math.hypot(along, self.height)


def as_unit(law: Law) -> Unit:
    """Return the parameters of a law; a law without fibre and tendon has only a force."""
    if isinstance(law, MuJoCoMuscle):
        short, long = (x / law.gear for x in law.length_range)
        optimal = (long - short) / (law.prm[1] - law.prm[0])
        return Unit(mujoco_peak_force(law), optimal, short - law.prm[0] * optimal, 0.0, (short, long))
    if not isinstance(law, FiberLaw):
        return Unit(law.strength, math.nan, math.nan, 0.0, None)
    peak, optimal, slack = (
        float(getattr(law, name))
        for name in ("max_isometric_force", "optimal_fiber_length", "tendon_slack_length")
    )
    return Unit(peak, optimal, slack, math.sin(getattr(law, "pennation_angle", 0.0)), None)


def implausible(
    muscles: MuscleSystem,
    *,
    ranges: Mapping[str, LengthRange] | None = None,
    rest: ArrayLike | None = None,
    limits: ParameterLimits | None = None,
) -> ParameterReport:
    """Find implausible parameters of all muscles, including those that stay with MuJoCo.

    Fibres are computed with a rigid tendon, whatever the law's tendon is. Neither the model nor `muscles` is changed.

    Args:
        muscles: the muscles.
        ranges: from `length_ranges`, which is called if None. Muscles missing there are judged by their parameters
            alone.
        rest: (nq,) pose at which no muscle should pull much without activation; qpos0 if None.
        limits: the limits of plausible values.

    Returns:
        All findings, and remarks on muscles that could not be judged.

    Raises:
        StateError: the rest pose is not possible.
    """
    validation.optional(limits, ParameterLimits, "limits", ModelError, "ParameterLimits")
    validation.optional(ranges, Mapping, "ranges", ModelError, "what length_ranges returns, by muscle")
    limits = limits or ParameterLimits()
    ranges = length_ranges(muscles) if ranges is None else ranges
    passive = _passive_tension(muscles, rest)
    findings: list[Finding] = []
    remarks: dict[str, tuple[str, ...]] = {}
    for i, muscle in enumerate(muscles.declarations):
        if is_cable(muscle):
            continue  # MuJoCo computes its force
        unit, known = as_unit(muscle.parameters), ranges.get(muscle.name)
        found = list(_alone(unit, limits))
        if known is not None and np.isfinite([known.shortest, known.longest]).all():
            found += _over_range(unit, known, limits)
        share = passive[i] / unit.peak if unit.peak > 0.0 else 0.0  # NaN without a path
        if share > limits.passive:
            words = f"pulls with {share:.3g} F_max at rest without activation"
            found.append((Implausible.PASSIVE_AT_REST, share, limits.passive, words))
        findings += [Finding(muscle.name, *parts) for parts in found]
        told = _remarks(known)
        if math.isnan(passive[i]):
            told += ("no path at the rest pose, so its passive force there is not judged",)
        if told:
            remarks[muscle.name] = told
    for name, law, reason in _native_laws(muscles):
        told = f"stays with MuJoCo, so it is not judged along a geodesic path: {reason}"
        if isinstance(law, str):
            told = f"{told}; its parameters are not valid: {law}"
        else:
            findings += [Finding(name, *parts) for parts in _alone(as_unit(law), limits)]
        remarks[name] = (told,)
    return ParameterReport(tuple(findings), remarks, dict(ranges))


def _alone(unit: Unit, limits: ParameterLimits) -> Found:
    """Find implausible values in the parameters alone."""
    low, high = limits.force
    if not unit.peak >= low:
        yield Implausible.NO_FORCE, unit.peak, low, f"maximum isometric force {unit.peak:.3g} N"
    if unit.peak > high:
        yield Implausible.HUGE_FORCE, unit.peak, high, f"maximum isometric force {unit.peak:.3g} N"
    if math.isnan(unit.optimal):
        return
    ratio = unit.slack / unit.optimal
    short, long = limits.tendon
    words = f"tendon slack length {1e3 * unit.slack:.4g} mm, {ratio:.3g} optimal fibre lengths"
    if unit.slack < 0.0:
        yield Implausible.NEGATIVE_TENDON, unit.slack, 0.0, words
    elif ratio < short:
        yield Implausible.SHORT_TENDON, ratio, short, words
    elif ratio > long:
        yield Implausible.LONG_TENDON, ratio, long, words


def _over_range(unit: Unit, known: LengthRange, limits: ParameterLimits) -> Found:
    """Find implausible values over the joints' ranges."""
    if math.isnan(unit.optimal):
        return
    shortest, longest = known.shortest, known.longest
    if longest <= unit.slack:
        words = (
            f"its longest length, {longest:.4f} m, is less than its tendon slack length, {unit.slack:.4f} m"
        )
        yield Implausible.SLACK, longest, unit.slack, words
    else:
        low, high = unit.fiber(shortest), unit.fiber(longest)
        least, most = limits.fiber
        if low < least:
            words = f"fibre {low:.3g} optimal lengths at the shortest length, {shortest:.4f} m"
            if low <= 0.0:
                words = f"shorter than its tendon by {-low:.3g} optimal fibre lengths at its shortest, {shortest:.4f} m"
            yield Implausible.SHORT_FIBER, low, least, words
        if high > most:
            words = f"fibre {high:.3g} optimal lengths at the longest length, {longest:.4f} m"
            yield Implausible.LONG_FIBER, high, most, words
    if unit.declared is not None:
        short, long = unit.declared
        excess = max(short - shortest, longest - long) / (long - short)
        if excess > limits.excess:
            words = f"its path is {shortest:.4f} to {longest:.4f} m long, its length range {short:.4f} to {long:.4f} m"
            yield Implausible.LENGTH_RANGE, excess, limits.excess, words


def _remarks(known: LengthRange | None) -> tuple[str, ...]:
    """Return remarks on a length range."""
    if known is None:
        return ()
    told = []
    failed = sum(known.without_path.values())
    if failed:
        why = ", ".join(f"{name} {count}" for name, count in known.without_path.items())
        told.append(f"no path at {failed} of {counted(known.poses, 'pose')} ({why})")
    if known.held:
        told.append(f"not moved, because they have no range: {', '.join(known.held)}")
    return tuple(told)


def _passive_tension(muscles: MuscleSystem, rest: ArrayLike | None) -> NDArray[np.float64]:
    """Return the tension (n,) [N] at rest, without activation and motion, with a rigid tendon; NaN without a path."""
    model = copy.copy(muscles.model)
    data = mujoco.MjData(model)
    if rest is not None:
        given = validation.numbers(rest, "rest", StateError)
        if given.shape != (model.nq,):
            raise StateError(f"the rest pose must have shape ({model.nq},), not {given.shape}")
        data.qpos[:] = given
    own = twin_of(muscles, model)
    own.forward(data)
    tension = np.full(own.n, np.nan)
    for i in np.flatnonzero(own.status == 0):
        law = own.declarations[i].parameters
        params = np.array([parameter_row(law)])
        tension[i] = laws.tension(law.code, params, 0, 0.0, own.length[i], 0.0)
    return tension


def _native_laws(muscles: MuscleSystem) -> Iterator[tuple[str, MuJoCoMuscle | str, str]]:
    """Yield name, law (or why it is not valid) and reason of every muscle actuator that stays with MuJoCo."""
    model = muscles.model
    for actuator in range(model.nactuator):
        name = name_of(model, mujoco.mjtObj.mjOBJ_ACTUATOR, actuator)
        if name in muscles.native and is_muscle(model, actuator):
            law: MuJoCoMuscle | str
            try:
                law = mujoco_law(model, actuator)
            except ModelError as error:
                law = str(error)
            yield name, law, muscles.native[name]
