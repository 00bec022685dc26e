"""Write and read the private marks of mjwrap in arrays of MuJoCo.

MuJoCo has no place for data of another program, and a model can be copied, pickled, saved as XML or MJB, or attached to
another one. So mjwrap stores what it must know afterwards in entries that MuJoCo keeps and does not use:

- `actuator_gainprm[i, 9]` and `actuator_biasprm[i, 9]`: the lowest and highest force that actuator i had before it was
  disabled (∓mjMAXVAL: no limits). Written by `model/takeover.py` into a model and by `plugin/spec/actuators.py` into a
  spec; read by both, `plugin/blocks/image.py` and `plugin/callbacks/sync.py`.
- `actuator_forcerange[i]`: actuator i is disabled; 0 to 0 where a `MuscleSystem` runs, and `DISABLED_RANGE` with the
  engine plugin, which shows tensions as forces and takes the moment away. Same modules.
- `actuator_dynprm[i, 9]`, 1: gain and bias of actuator i were a muscle's. Used by `plugin/spec/tendons.py`.
- `wrap_prm[tendon_adr[t]]`, if `tendon_num[t]` is 0: the number of stops that tendon t had. Same module.
- `tendon_width[t]` below 1e-7 m: hidden; the original width is 2²⁶ times that. Written by `plugin/spec/tendons.py`,
  read by it and by `plugin/callbacks/drawing.py`.
- the name of a plugin's instance, ending in "mjwrap": its configuration names the muscles. Written by
  `plugin/spec/instance.py`, read by `plugin/spec/configuration.py`; a body refers to it, so that `attach` keeps it.
- the first character of that configuration, "!" instead of a name's: the instance drives nothing. Written by
  `plugin/uninstalling.py` into a model, read by `plugin/registering.py`.

MuJoCo 3.11 to 4.0 does not use these entries: a row of gainprm, biasprm or dynprm has 10 numbers (mjNGAIN, mjNBIAS,
mjNDYN). Of the actuators that mjwrap takes over, fixed ones use 1, affine ones 3 and muscles 9 numbers of gain and
bias; a muscle's dynamics use 3 of dynprm. `wrap_prm` of a site is not read. A width is only drawn.
`tests/test_marks.py` checks this with the installed MuJoCo.
"""

from __future__ import annotations

from typing import NamedTuple

import mujoco

COLUMN = 9  # the last column of gainprm, biasprm and dynprm
PLUGIN_INSTANCE = "mjwrap"  # name of the plugin's instance, after the prefix of an attached model
SIDE_RULE_PLACE = 3  # place of the side rule among the texts of an instance's configuration
IDLE = ord("!")  # first character of the configuration of an idle instance: quoted names do not contain it
# force range [N] of an actuator whose muscle the engine plugin runs: it limits nothing, and no model has it by chance
DISABLED_RANGE = (-mujoco.mjMAXVAL, 0.5 * mujoco.mjMAXVAL)
EARLIER_RANGE = (0.0, 1e-12)  # the same in models that were saved when the plugin showed no forces
HIDDEN_FACTOR = (
    2.0**-26
)  # factor on a tendon's width: a power of two, so that the original width is restored exactly
HIDDEN_BELOW = 1e-7  # [m] (to_xml writes no width below 1e-12 m, and the compiler does not accept 0)
_CURVES = int(mujoco.mjtGain.mjGAIN_MUSCLE), int(mujoco.mjtBias.mjBIAS_MUSCLE)
_NO_CURVES = int(mujoco.mjtGain.mjGAIN_FIXED), int(mujoco.mjtBias.mjBIAS_NONE)


# ---------------------------------------------------------------------- the force limits of disabled actuators


class ForceLimits(NamedTuple):
    """Force limits of an actuator [N]; without limits, low and high are MuJoCo's largest number, ∓mjMAXVAL."""

    limited: bool
    low: float
    high: float


def _limits(limited: bool, low: float, high: float) -> ForceLimits:
    if not limited:
        low, high = -mujoco.mjMAXVAL, mujoco.mjMAXVAL
    return ForceLimits(limited, float(low), float(high))


def force_limits(model: mujoco.MjModel, actuator: int) -> ForceLimits:
    """Return the force limits that an actuator has now."""
    return _limits(bool(model.actuator_forcelimited[actuator]), *model.actuator_forcerange[actuator])


def limit_marks(model: mujoco.MjModel, actuator: int) -> tuple[float, float]:
    """Return the two marks of an actuator: lowest and highest force before it was disabled, 0 and 0 if it is not."""
    return float(model.actuator_gainprm[actuator, COLUMN]), float(model.actuator_biasprm[actuator, COLUMN])


def is_disabled(model: mujoco.MjModel, actuator: int) -> bool:
    """Return whether an actuator's force is limited to 0."""
    return bool(model.actuator_forcelimited[actuator]) and not model.actuator_forcerange[actuator].any()


def disabled_actuators(model: mujoco.MjModel) -> dict[int, ForceLimits]:
    """Return the disabled actuators of a model with their original limits."""
    marks = {i: limit_marks(model, i) for i in range(len(model.actuator_gainprm)) if is_disabled(model, i)}
    return {
        i: ForceLimits(high < mujoco.mjMAXVAL, low, high) for i, (low, high) in marks.items() if low < high
    }


def disable_force(model: mujoco.MjModel, actuator: int, limits: ForceLimits) -> None:
    """Limit an actuator's force to 0, and store its original limits as marks."""
    model.actuator_gainprm[actuator, COLUMN], model.actuator_biasprm[actuator, COLUMN] = limits[1:]
    model.actuator_forcelimited[actuator], model.actuator_forcerange[actuator] = 1, 0.0


def enable_force(model: mujoco.MjModel, actuator: int, limits: ForceLimits) -> None:
    """Restore the limits of a disabled actuator, and remove the marks."""
    model.actuator_gainprm[actuator, COLUMN] = model.actuator_biasprm[actuator, COLUMN] = 0.0
    model.actuator_forcelimited[actuator] = limits.limited
    model.actuator_forcerange[actuator] = limits[1:] if limits.limited else 0.0


def disable_element(element: mujoco.MjsActuator, limits: ForceLimits) -> None:
    """Disable an actuator of an MjSpec, as `disable_force` does in a model."""
    element.gainprm[COLUMN], element.biasprm[COLUMN] = limits[1:]
    element.forcelimited, element.forcerange = 1, DISABLED_RANGE


def enable_element(element: mujoco.MjsActuator) -> None:
    """Enable an actuator of an MjSpec, as `enable_force` does in a model; does nothing if it is not disabled."""
    if tuple(element.forcerange) not in (DISABLED_RANGE, EARLIER_RANGE):
        return
    low, high = float(element.gainprm[COLUMN]), float(element.biasprm[COLUMN])
    limited = high < mujoco.mjMAXVAL
    element.gainprm[COLUMN] = element.biasprm[COLUMN] = 0.0
    element.forcelimited, element.forcerange = limited, (low, high) if limited else (0.0, 0.0)


def zero_disabled_ranges(model: mujoco.MjModel) -> None:
    """Set the force ranges of actuators that were disabled in an MjSpec to 0 to 0, as in a model."""
    for actuator in range(len(model.actuator_forcerange)):
        if has_disabled_range(model, actuator):
            model.actuator_forcerange[actuator] = 0.0


def has_disabled_range(model: mujoco.MjModel, actuator: int) -> bool:
    """Return whether an actuator was disabled in an MjSpec."""
    return tuple(model.actuator_forcerange[actuator]) in (DISABLED_RANGE, EARLIER_RANGE)


# ------------------------------------------------------------------------------------ the curves of muscle actuators


def has_curves(model: mujoco.MjModel, actuator: int) -> bool:
    """Return whether gain and bias of an actuator are a muscle's, and its mark is free."""
    return _kinds(model, actuator) == _CURVES and model.actuator_dynprm[actuator, COLUMN] == 0.0


def lacks_curves(model: mujoco.MjModel, actuator: int) -> bool:
    """Return whether an actuator's curves were removed by `remove_curves`."""
    return _kinds(model, actuator) == _NO_CURVES and model.actuator_dynprm[actuator, COLUMN] == 1.0


def _kinds(model: mujoco.MjModel, actuator: int) -> tuple[int, int]:
    return int(model.actuator_gaintype[actuator]), int(model.actuator_biastype[actuator])


def remove_curves(model: mujoco.MjModel, actuator: int) -> None:
    """Make gain and bias of a muscle actuator constant, so that MuJoCo need not compute its curves, and mark it."""
    model.actuator_gaintype[actuator], model.actuator_biastype[actuator] = _NO_CURVES
    model.actuator_dynprm[actuator, COLUMN] = 1.0


def restore_curves(model: mujoco.MjModel, actuator: int) -> None:
    """Restore the muscle's gain and bias, and remove the mark."""
    model.actuator_gaintype[actuator], model.actuator_biastype[actuator] = _CURVES
    model.actuator_dynprm[actuator, COLUMN] = 0.0


# ----------------------------------------------------------------------------------------- the stops of spatial tendons


def lacks_stops(model: mujoco.MjModel, tendon: int) -> bool:
    """Return whether a tendon has no stops: MuJoCo computes neither length nor Jacobian of it."""
    return int(model.tendon_num[tendon]) == 0


def remove_stops(model: mujoco.MjModel, tendon: int) -> None:
    """Remove the stops of a tendon whose first stop is a site, and store their number as a mark."""
    model.wrap_prm[model.tendon_adr[tendon]] = model.tendon_num[tendon]
    model.tendon_num[tendon] = 0


def restore_stops(model: mujoco.MjModel, tendon: int) -> None:
    """Restore the stops of a tendon, and remove the mark."""
    first = int(model.tendon_adr[tendon])
    model.tendon_num[tendon] = int(model.wrap_prm[first])
    model.wrap_prm[first] = 0.0


# ---------------------------------------------------------------------------------------------- hidden tendons


def hide_tendon(element: mujoco.MjsTendon) -> None:
    """Make a tendon of an MjSpec too thin to be seen."""
    if element.width >= HIDDEN_BELOW:
        element.width *= HIDDEN_FACTOR


def show_all_tendons(model: mujoco.MjModel) -> None:
    """Give the hidden tendons of a model their widths back."""
    model.tendon_width[model.tendon_width < HIDDEN_BELOW] /= HIDDEN_FACTOR


def show_tendon(element: mujoco.MjsTendon) -> None:
    """Restore the width of a tendon of an MjSpec that `hide_tendon` has changed."""
    if element.width < HIDDEN_BELOW:
        element.width /= HIDDEN_FACTOR


# ------------------------------------------------------------------------------------------ instances of the plugin


def is_own_instance(name: str) -> bool:
    """Return whether the name of a plugin's instance, without a prefix, is that of mjwrap's instances."""
    return name.endswith(PLUGIN_INSTANCE)


def set_idle(model: mujoco.MjModel, instance: int) -> None:
    """Have an instance drive nothing from now on, in mjData that are made from now on."""
    first = model.plugin_attradr[instance]
    if model.plugin_attr[first] != 0:  # one without muscles drives none
        model.plugin_attr[first] = IDLE


def stored_side_rule(model: mujoco.MjModel) -> int:
    """Return the side rule (`mjcf/side_rules.py`) that `install` stored in a model; 0 without one.

    Of several instances that drive muscles, or did, the model's own counts; those of attached models count if they
    agree.
    """
    rules: dict[str, int] = {}
    for i in own_instances(model):
        if not model.plugin_attr[model.plugin_attradr[i]]:
            continue
        texts = bytes(model.plugin_attr[model.plugin_attradr[i] :]).split(b"\0")
        rule = read_side_rule(texts[SIDE_RULE_PLACE] if len(texts) > SIDE_RULE_PLACE else b"")
        rules[mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_PLUGIN, i)] = rule
    return rules.get(PLUGIN_INSTANCE, min(rules.values(), default=0) if len(set(rules.values())) == 1 else 0)


def read_side_rule(text: bytes) -> int:
    """Return the side rule in a configuration; a model from before it was stored has that of MuJoCo 3."""
    return 4 if text == b"4" else 3


def driving_instances(model: mujoco.MjModel) -> list[int]:
    """Return the ids of mjwrap's instances in a model that drive muscles."""
    firsts = {i: int(model.plugin_attr[model.plugin_attradr[i]]) for i in own_instances(model)}
    return [i for i, first in firsts.items() if first not in (0, IDLE)]


def own_instances(model: mujoco.MjModel) -> list[int]:
    """Return the ids of mjwrap's instances in a model, whether they drive muscles or not."""
    names = (mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_PLUGIN, i) or "" for i in range(model.nplugin))
    return [i for i, name in enumerate(names) if is_own_instance(name)]
