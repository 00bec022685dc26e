"""Read the muscles of instances of the plugin, from a model in Python or from a model at an address."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import NamedTuple

import mujoco

from mjwrap.errors import ModelError
from mjwrap.mjcf import MuscleDeclaration, marks, read_declarations
from mjwrap.model.arrays import Plan, build_plan
from mjwrap.model.takeover import Takeover
from mjwrap.plugin.mujoco_c.copies import copy_of
from mjwrap.plugin.spec.configuration import TRANSMISSION, Configuration, configuration_at
from mjwrap.plugin.spec.tendons import left_out_tendons, restore_tendons

_COPY = threading.Lock()  # locked while the copy of a model is read
_here = threading.local()  # .reading: this thread reads the copy of a model


class Copy(NamedTuple):
    """A copy of a model as before `install`, its muscles, their arrays, and the tendons that the model leaves out."""

    model: mujoco.MjModel
    plan: Plan
    muscles: list[MuscleDeclaration]
    left_out: set[int]


def read_muscles(
    model: mujoco.MjModel, names: list[str], mode: str, side_rule: int
) -> tuple[Plan, list[MuscleDeclaration]]:
    """Return the named muscles of a model and their arrays; `ModelError` if one is missing.

    Undoes the changes of `install` in `model`, except for the disabled actuators.
    """
    marks.zero_disabled_ranges(model)
    restore_tendons(model)
    with Takeover(model).original_limits():
        found = read_declarations(model, transmission=mode == TRANSMISSION, side_rule=side_rule).muscles
    declared = {muscle.name: muscle for muscle in found}
    missing = [name for name in names if name not in declared]
    if missing:
        raise ModelError(
            f"the model no longer has the muscle '{missing[0]}', which install gave to the engine plugin; muscles: "
            f"{', '.join(declared) or 'none'}; call install again"
        )
    muscles = [declared[name] for name in names]
    return build_plan(model, muscles), muscles


@contextmanager
def copy_read(address: int, configuration: Configuration) -> Iterator[Copy]:
    """Yield a copy of the model at an address, its muscles and their arrays; it is valid inside the with block."""
    with _COPY:
        yield _read_copy(address, configuration)


def is_reading() -> bool:
    """Return whether this thread is reading the copy of a model, for which MuJoCo makes an mjData of its own."""
    return getattr(_here, "reading", False)


def read_instances(address: int, instances: list[int]) -> tuple[Plan, list[MuscleDeclaration]]:
    """Return the muscles of instances of the model at an address, in their order, and the arrays of all of them."""
    with _COPY:
        copies = [_read_copy(address, configuration_at(address, instance)) for instance in instances]
        muscles = [muscle for copy in copies for muscle in copy.muscles]
        return build_plan(copies[-1].model, muscles), muscles


def _read_copy(address: int, configuration: Configuration) -> Copy:
    _here.reading = True
    try:
        model = copy_of(address)
        names, _, mode, side_rule = configuration
        left_out = left_out_tendons(model)
        return Copy(model, *read_muscles(model, names, mode, side_rule), left_out)
    finally:
        _here.reading = False
