"""Length ranges of native muscles, found along mjwrap's paths and written into an MjSpec."""

from __future__ import annotations

from typing import Any

import mujoco

from mjwrap import validation
from mjwrap.calibration.ranges import LengthRange, length_ranges
from mjwrap.errors import ModelError
from mjwrap.mjcf.side_rules import check_side_rule
from mjwrap.system import MuscleSystem

_PLACEHOLDER = (
    1.0,
    2.0,
)  # until the ranges are known: the compiler and MuJoCo's muscle need an increasing one


def set_length_ranges(
    spec: mujoco.MjSpec, *, side_rule: int | None = None, **options: Any
) -> dict[str, LengthRange]:
    """Write length ranges along mjwrap's paths into the muscle actuators of an MjSpec that have none.

    MuJoCo's compiler finds missing ranges by a simulation along its own tendons. It does not converge if a tendon
    jumps, and the model cannot be loaded. With the ranges written here the compiler need not look for them.

    Args:
        spec: the model; `lengthrange` of its actuators is changed.
        side_rule: as for `MuscleSystem`.
        options: arguments of `length_ranges`, such as `ranges`, `base` or `seed`.

    Returns:
        The range of the path of each actuator that had none, by name; `lengthrange` is this times the actuator's gear.

    Raises:
        ModelError: mjwrap cannot take over a muscle without a range, it has no path at any pose, or its length does
            not change.
    """
    validation.of_type(spec, "MjSpec", "spec", ModelError)
    check_side_rule(side_rule)
    missing = [
        element
        for element in spec.actuators
        if element.dyntype == mujoco.mjtDyn.mjDYN_MUSCLE
        and not element.lengthrange[0] < element.lengthrange[1]
    ]
    before = [tuple(element.lengthrange) for element in missing]
    mode = spec.compiler.LRopt.mode
    try:
        spec.compiler.LRopt.mode = int(mujoco.mjtLRMode.mjLRMODE_NONE)
        for element in missing:
            element.lengthrange = _PLACEHOLDER
        muscles = MuscleSystem(spec.compile(), side_rule=side_rule)
        names = [element.name for element in missing]
        for name in names:
            if name not in muscles.names:
                raise ModelError(f"muscle '{name}': {muscles.native.get(name, 'it cannot be taken over')}")
        found = length_ranges(muscles, names=names, **options)
        for name, each in found.items():
            if not each.shortest < each.longest:
                raise ModelError(
                    f"muscle {name!r}: its length does not change ({each.shortest:g} m to {each.longest:g} m)"
                )
        for element in missing:
            ends = found[element.name].shortest, found[element.name].longest
            element.lengthrange = sorted(
                element.gear[0] * end for end in ends
            )  # of the actuator, not of the tendon
    except BaseException:
        for element, values in zip(missing, before, strict=True):
            element.lengthrange = values
        raise
    finally:
        spec.compiler.LRopt.mode = mode
    return found
