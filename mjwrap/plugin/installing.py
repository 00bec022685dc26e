"""Add the plugin to a model: `install` for an MjSpec, `load` for a file."""

from __future__ import annotations

import os
import warnings

import mujoco

from mjwrap import validation
from mjwrap.errors import ModelError
from mjwrap.mjcf import (
    MuscleDeclaration,
    is_binary,
    marks,
    read_declarations,
    read_model,
    read_spec,
    with_remedy,
)
from mjwrap.mjcf.file_inertias import restore_inertias
from mjwrap.mjcf.marks import PLUGIN_INSTANCE, own_instances
from mjwrap.mjcf.missing_names import with_candidates
from mjwrap.mjcf.named_models import quiet_prefixes
from mjwrap.mjcf.side_rules import check_side_rule, running_side_rule
from mjwrap.model.moment_columns import check_moment_columns
from mjwrap.model.piece_table import piece_table
from mjwrap.model.takeover import Takeover
from mjwrap.plugin.announcing import renumber
from mjwrap.plugin.blocks.image import pulled_bodies, state_size
from mjwrap.plugin.blocks.instance_muscles import read_muscles
from mjwrap.plugin.mujoco_c.visualisation import drawing
from mjwrap.plugin.registering import register, take_error
from mjwrap.plugin.spec.actuators import disable_actuators, enable_actuator
from mjwrap.plugin.spec.configuration import (
    MODES,
    TRANSMISSION,
    WRENCH,
    configuration_at,
    configuration_of,
    configuration_texts,
    spec_instances,
)
from mjwrap.plugin.spec.force_sensors import hidden_forces, hidden_forces_message
from mjwrap.plugin.spec.instance import add_instance, prevent_sleep
from mjwrap.plugin.spec.tendons import hide_tendons, left_out_tendons, remove_unneeded_tendons, show_tendon
from mjwrap.plugin.spec.undo import undone_on_error

_BOTH_OFF = int(mujoco.mjtDisableBit.mjDSBL_SPRING) | int(mujoco.mjtDisableBit.mjDSBL_DAMPER)


def install(
    spec: mujoco.MjSpec, mode: str = "wrench", *, keep_tendons: bool = False, side_rule: int | None = None
) -> mujoco.MjModel:
    """Add the engine plugin to an MjSpec, and compile a model whose `mj_step` runs the muscles.

    It also switches the pieces of joints' couplings; a model that has these needs no muscle.

    The spec itself is changed, so that it can be compiled again, attached and saved: it gets an instance of the
    plugin, actuators without force, and invisible tendons, because the plugin draws the muscles. If an error is
    raised, the spec is unchanged.

    Args:
        spec: the model.
        mode: "wrench" adds the muscles' forces to xfrc_applied. "transmission" gives length, velocity and moment along
            mjwrap's paths to every actuator on a spatial tendon whose force MuJoCo computes; muscles with other laws
            act by wrenches.
        keep_tendons: let MuJoCo also compute tendons that only declare the route of a muscle; by default the returned
            model leaves them out.
        side_rule: whose rule picks, at the reference pose, the way round a cylinder that the side site of a tendon
            means: 3 for MuJoCo 3's, 4 for MuJoCo 4's. None: the rule of an earlier install of this spec, else that of
            the running MuJoCo. The model keeps it, also when it is saved and opened with another MuJoCo.

    Returns:
        The compiled model.

    Raises:
        ModelError: the muscles cannot be read, MuJoCo cannot store the moment of a path, or there is no such mode or
            rule.
        VersionError: the layout of the installed MuJoCo could not be verified.
    """
    validation.of_type(spec, "MjSpec", "spec", ModelError)
    _check_options(mode, keep_tendons, side_rule)
    register()
    with undone_on_error(spec):
        return _installed(spec, mode, keep_tendons, side_rule)


def _installed(spec: mujoco.MjSpec, mode: str, keep_tendons: bool, side_rule: int | None) -> mujoco.MjModel:
    rule = _remove_earlier(spec, mode, side_rule)
    model = _compile(spec)
    if int(model.opt.disableflags) & _BOTH_OFF == _BOTH_OFF:
        raise ModelError(
            "MuJoCo does not call the plugin while springs and dampers are both disabled; enable one of them"
        )
    marks.zero_disabled_ranges(model)
    coupled = len(piece_table(model).equality) > 0
    with Takeover(model).original_limits():
        attached = [configuration_of(element) for element in spec_instances(spec)]
        taken = {name: (each.mode, each.side_rule) for each in attached for name in each.muscles}
        declared = _declared(model, (mode, rule), taken)
        muscles = [muscle for muscle in declared if muscle.name not in taken]
        if not muscles and not taken and not coupled:
            raise ModelError(
                f"the model declares no muscle for mjwrap{_reasons(model, mode) or _hint(spec, mode)}"
            )
        disable_actuators(spec, model, muscles)
    names = [muscle.name for muscle in muscles]
    plan, muscles = read_muscles(model, names, mode, rule)
    check_moment_columns(model, plan, muscles)
    if drawing():
        hide_tendons(spec, muscles)
    prevent_sleep(spec, model, pulled_bodies(model, plan))
    add_instance(spec, configuration_texts(names, state_size(plan), mode, rule))
    model = _compile(spec)
    if not keep_tendons:
        remove_unneeded_tendons(model, declared)
    hidden = hidden_forces(model, muscles, left_out_tendons(model))
    if hidden:
        warnings.warn(hidden_forces_message(hidden), stacklevel=4)
    return model


def _remove_earlier(spec: mujoco.MjSpec, mode: str, side_rule: int | None) -> int:
    """Undo an earlier install for the spec's own muscles, so that they are read again; return the side rule to use."""
    rule = side_rule or running_side_rule()
    for element in spec_instances(spec):
        if element.name != PLUGIN_INSTANCE:
            continue  # the instance of an attached model
        earlier = configuration_of(element)
        for name in earlier.muscles:
            enable_actuator(spec, name)
            show_tendon(spec, name)
        rule = side_rule or earlier.side_rule
        element.config = configuration_texts([], 1, mode, rule)
    return rule


def _declared(
    model: mujoco.MjModel, new: tuple[str, int], taken: dict[str, tuple[str, int]]
) -> list[MuscleDeclaration]:
    """Return the muscles of a model, each read for its mode and side rule: those of an attached model, or new ones.

    taken: mode and side rule of the muscles of attached models, by name.
    """
    return [
        muscle
        for kind in dict.fromkeys([new, *taken.values()])
        for muscle in read_declarations(
            model, transmission=kind[0] == TRANSMISSION, side_rule=kind[1]
        ).muscles
        if taken.get(muscle.name, new) == kind
    ]


def _reasons(model: mujoco.MjModel, mode: str) -> str:
    """Return, for the error of a model without a muscle for mjwrap, why its native muscles are left to MuJoCo."""
    native = read_declarations(model, transmission=mode == TRANSMISSION).native
    return "".join(f"\n  {name}: {reason}" for name, reason in native.items())


def _hint(spec: mujoco.MjSpec, mode: str) -> str:
    """Return a hint for the error of a model that declares no muscle."""
    if mode == TRANSMISSION:
        return ", and no actuator on a spatial tendon"
    return "; other actuators on spatial tendons are driven with mode='transmission'" if spec.tendons else ""


def load(
    path: str | os.PathLike[str],
    mode: str | None = None,
    *,
    keep_tendons: bool = False,
    side_rule: int | None = None,
) -> mujoco.MjModel:
    """Load an MJCF file and `install` the engine plugin, or load an MJB file of a model that has the plugin.

    Args:
        path: the file; or "mjwrap:NAME", a model that comes with mjwrap, or "myo_sim:NAME", one of the myo-sim package.
        mode: as in `install`; "wrench" if None. An MJB file has its own mode.
        keep_tendons: as in `install`; only for MJCF files.
        side_rule: as in `install`; an MJB file has its own rule.

    Returns:
        The compiled model.

    Raises:
        ModelError: as in `install`, or the file cannot be loaded, or an MJB file has another mode or rule.
        VersionError: the layout of the installed MuJoCo could not be verified.
    """
    _check_options(WRENCH if mode is None else mode, keep_tendons, side_rule)
    register()
    with quiet_prefixes(path):
        model = read_model(path)
        renumber(model)
        if not is_binary(path):
            return install(read_spec(path), mode or WRENCH, keep_tendons=keep_tendons, side_rule=side_rule)
    instances = own_instances(model)
    saved = [configuration_at(model._address, i) for i in instances]
    modes, rules = {each.mode for each in saved}, {each.side_rule for each in saved}
    if instances and mode is not None and modes != {mode}:
        raise ModelError(
            f"{path} was saved with mode '{', '.join(sorted(modes))}', and an MJB file cannot be changed; leave out "
            f"mode '{mode}', or load its XML"
        )
    if instances and side_rule is not None and rules != {side_rule}:
        raise ModelError(
            f"{path} was saved with side_rule {', '.join(str(rule) for rule in sorted(rules))}, and an MJB file cannot "
            f"be changed; leave out side_rule {side_rule}, or load its XML"
        )
    if not instances:
        raise ModelError(
            f"{path} does not contain mjwrap's plugin, and an MJB file cannot be changed; load its XML instead"
        )
    return model


def _check_options(mode: str, keep_tendons: bool, side_rule: int | None) -> None:
    if not isinstance(mode, str) or mode not in MODES:
        shown = validation.described(mode)
        raise ModelError(f"mode {shown} does not exist; modes: {', '.join(MODES)}")
    validation.flag(keep_tendons, "keep_tendons", ModelError)
    check_side_rule(side_rule)


def _compile(spec: mujoco.MjSpec) -> mujoco.MjModel:
    take_error()
    try:
        model = spec.compile()
    except (ValueError, mujoco.FatalError) as error:
        reason = take_error()
        told = (
            str(reason)
            if reason
            else with_candidates(
                with_remedy(f"the model does not compile: {' '.join(str(error).split())}"), spec
            )
        )
        raise ModelError(told) from reason
    restore_inertias(model)
    return model
