"""Muscle parameters: length ranges, fibres and tendons that fit them, and implausible parameters."""

from mjwrap.calibration.fibers import (
    MUJOCO_RANGE,
    WIDE_RANGE,
    FiberFit,
    HillFit,
    fit_fiber_and_slack,
    hill_from_mujoco,
)
from mjwrap.calibration.length_range_fields import set_length_ranges
from mjwrap.calibration.plausibility import implausible
from mjwrap.calibration.ranges import LengthRange, length_ranges
from mjwrap.calibration.report import Finding, Implausible, ParameterLimits, ParameterReport

__all__ = [
    "MUJOCO_RANGE",
    "WIDE_RANGE",
    "FiberFit",
    "Finding",
    "HillFit",
    "Implausible",
    "LengthRange",
    "ParameterLimits",
    "ParameterReport",
    "fit_fiber_and_slack",
    "hill_from_mujoco",
    "implausible",
    "length_ranges",
    "set_length_ranges",
]
