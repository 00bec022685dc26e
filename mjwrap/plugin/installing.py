"""Putting the plugin into a model: `install` for an MjSpec, `load` for a file."""

from __future__ import annotations

import os
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.errors import ModelError
from mjwrap.mjcf import read_declarations, read_model
from mjwrap.model.takeover import Takeover
from mjwrap.muscles.laws import ActuatorForce
from mjwrap.plugin import register as reg
from mjwrap.plugin.blocks.image import loaded_bodies, state_size
from mjwrap.plugin.blocks.transmission_part import check_room
from mjwrap.plugin.mujoco_c.visualisation import drawing
from mjwrap.plugin.spec.placeholders import drop_placeholders, hide_placeholders, show_placeholder
from mjwrap.plugin.spec.resting import rest_actuators
from mjwrap.plugin.spec.undo import undone_on_error

_BOTH_OFF = int(mujoco.mjtDisableBit.mjDSBL_SPRING) | int(mujoco.mjtDisableBit.mjDSBL_DAMPER)


def install(spec: mujoco.MjSpec, mode: str = "wrench", *, keep_tendons: bool = False) -> mujoco.MjModel:
    """Give the muscles of an MjSpec to the engine plugin, and compile a model whose `mj_step` runs them.

    The spec itself is changed (an instance of the plugin, actuators without force, tendons too thin to be seen), so
    that it can be compiled again, attached and saved. The plugin draws the muscles. If an error is raised, the spec
    is as it was.

    Args:
        spec: the model.
        mode: "wrench" adds the muscles' forces to xfrc_applied. "transmission" gives length, velocity and moment along
            mjwrap's paths to every actuator on a spatial tendon whose force MuJoCo itself computes; muscles of other
            laws act by wrenches.
        keep_tendons: keep tendons that are only there for the route of a muscle, so that MuJoCo computes them;
            otherwise the returned model leaves out those that nothing else needs.

    Returns:
        The compiled model.

    Raises:
        ModelError: the muscles cannot be read, or a moment has no room for all bodies of its path.
        VersionError: this MuJoCo is unknown.
    """
    if not isinstance(spec, mujoco.MjSpec):
        raise ModelError(f"expected an MjSpec (mujoco.MjSpec.from_file), not {type(spec).__name__}")
    if mode not in (reg.WRENCH, reg.TRANSMISSION):
        raise ModelError(f"mode '{mode}' does not exist; modes: {reg.WRENCH}, {reg.TRANSMISSION}")
    reg.register()
    with undone_on_error(spec):
        return _installed(spec, mode, keep_tendons)


def _installed(spec: mujoco.MjSpec, mode: str, keep_tendons: bool) -> mujoco.MjModel:
    for element in [p for p in spec.plugins if p.plugin_name == reg.NAME and p.name == reg.INSTANCE]:
        for name in _claim(element).muscles:  # installed before: read the muscles anew
            _wake(spec.actuator(name))
            show_placeholder(spec, name)
        element.config = reg.configuration([], 1, mode)
    model = _compile(spec)
    if int(model.opt.disableflags) & _BOTH_OFF == _BOTH_OFF:
        raise ModelError(
            "MuJoCo calls no passive plugins while springs and dampers are both disabled; enable one of them"
        )
    reg.hush_to_silence(model)
    with Takeover(model).suspended():
        claims = [_claim(p) for p in spec.plugins if p.plugin_name == reg.NAME]
        taken = {name: claim.mode for claim in claims for name in claim.muscles}
        declared = [
            muscle
            for kind in dict.fromkeys([mode, *taken.values()])
            for muscle in read_declarations(model, transmission=kind == reg.TRANSMISSION).muscles
            if taken.get(muscle.name, mode) == kind
        ]
        muscles = [muscle for muscle in declared if muscle.name not in taken]
        if not muscles and not taken:
            also = (
                ", and no actuator on a spatial tendon"
                if mode == reg.TRANSMISSION
                else (
                    "; other actuators on spatial tendons are driven with mode='transmission'"
                    if spec.tendons
                    else ""
                )
            )
            raise ModelError(f"the model declares no muscle that mjwrap could drive{also}")
        actuators = {element.id: element for element in spec.actuators}
        for muscle in muscles:
            if muscle.actuator >= 0 and not isinstance(muscle.parameters, ActuatorForce):
                _silence(model, muscle.actuator, actuators[muscle.actuator])
    names = [muscle.name for muscle in muscles]
    plan, muscles = reg.read_plan(model, names, mode)
    check_room(model, plan, muscles)
    if drawing():
        hide_placeholders(spec, muscles)
    _keep_awake(spec, model, loaded_bodies(plan))
    _add_instance(spec, reg.configuration(names, state_size(plan), mode))
    model = _compile(spec)
    if not keep_tendons:
        drop_placeholders(model, declared)
        rest_actuators(model, reg.HUSHED)
    return model


def load(
    path: str | os.PathLike[str], mode: str | None = None, *, keep_tendons: bool = False
) -> mujoco.MjModel:
    """Load an MJCF file with its muscles in the engine plugin (`install`), or an MJB file of a model that has it.

    Args:
        path: the file.
        mode: as in `install`; "wrench" if None. An MJB file has its own mode.
        keep_tendons: as in `install`; for MJCF files.

    Returns:
        The compiled model.

    Raises:
        ModelError: as in `install`, or the file cannot be loaded, or an MJB file has another mode.
        VersionError: this MuJoCo is unknown.
    """
    reg.register()
    model = read_model(path)
    if Path(path).suffix != ".mjb":
        spec = mujoco.MjSpec.from_file(os.fspath(path))
        return install(spec, mode or reg.WRENCH, keep_tendons=keep_tendons)
    names = [mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_PLUGIN, i) or "" for i in range(model.nplugin)]
    mine = [i for i, name in enumerate(names) if name.endswith(reg.INSTANCE)]
    modes = {reg.claim_of(model._address, i).mode for i in mine}
    if mine and mode is not None and modes != {mode}:
        raise ModelError(
            f"{path} was saved with mode '{', '.join(sorted(modes))}', and an MJB file cannot be changed; leave out "
            f"mode '{mode}', or load its XML"
        )
    if not mine:
        raise ModelError(
            f"{path} has no plugin of mjwrap, and an MJB file cannot be changed; load its XML instead"
        )
    return model


def _claim(element: mujoco.MjsPlugin) -> reg.Claim:
    return reg.read_claim(element.name, dict(element.config))


def _compile(spec: mujoco.MjSpec) -> mujoco.MjModel:
    reg.take_error()
    try:
        return spec.compile()
    except (ValueError, mujoco.FatalError) as error:
        reason = reg.take_error()
        raise ModelError(str(reason) if reason else f"the model does not compile: {error}") from reason


def _silence(model: mujoco.MjModel, actuator: int, element: mujoco.MjsActuator) -> None:
    """Clamp an actuator's force, with the marks that `Takeover` reads; the model shows the limits as written."""
    limited = bool(model.actuator_forcelimited[actuator])
    low, high = (float(x) for x in model.actuator_forcerange[actuator])
    if not limited:
        low, high = -mujoco.mjMAXVAL, mujoco.mjMAXVAL
    element.gainprm[-1], element.biasprm[-1] = low, high
    element.forcelimited, element.forcerange = 1, reg.HUSHED


def _wake(element: mujoco.MjsActuator | None) -> None:
    """Give an actuator that `_silence` has clamped the limits back that it had."""
    if element is None or not np.array_equal(element.forcerange, reg.HUSHED):
        return
    low, high = float(element.gainprm[-1]), float(element.biasprm[-1])
    limited = high < mujoco.mjMAXVAL
    element.gainprm[-1] = element.biasprm[-1] = 0.0
    element.forcelimited, element.forcerange = limited, (low, high) if limited else (0.0, 0.0)


def _keep_awake(spec: mujoco.MjSpec, model: mujoco.MjModel, bodies: NDArray[np.int64]) -> None:
    """Let no tree sleep that a muscle pulls, unless its sleep policy is given: as MuJoCo does for its own actuators."""
    trees = {int(tree) for tree in model.body_treeid[bodies] if tree >= 0}
    for element in spec.bodies[1:]:
        tree, above = (int(model.body_treeid[b]) for b in (element.id, element.parent.id))
        if tree in trees and tree != above and element.sleep == mujoco.mjtSleepPolicy.mjSLEEP_AUTO:
            element.sleep = mujoco.mjtSleepPolicy.mjSLEEP_NEVER


def _add_instance(spec: mujoco.MjSpec, config: dict[str, str]) -> None:
    """Add the instance, or give the one that is there its new configuration.

    MuJoCo's `attach` keeps only instances that an element names, so a body does: the first one without a plugin.
    """
    for element in spec.plugins:
        if element.plugin_name == reg.NAME and element.name == reg.INSTANCE:
            element.config = config
            return
    spec.activate_plugin(reg.NAME)
    spec.add_plugin(name=reg.INSTANCE, plugin_name=reg.NAME, active=True).config = config
    for body in spec.bodies[1:]:
        if not body.plugin.active:
            body.plugin.name, body.plugin.plugin_name, body.plugin.active = reg.INSTANCE, reg.NAME, True
            return
