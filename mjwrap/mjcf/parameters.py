"""Read the parameters of a declared muscle: numerics, recognised by their names, become a law's dataclass."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import mujoco
import numpy as np

from mjwrap.errors import ModelError
from mjwrap.mjcf.actuators import curves_reason, is_muscle, keeps_state, mujoco_law, tendon_reason
from mjwrap.mjcf.names import listed, name_of
from mjwrap.mjcf.wrapping_geoms import SIZES
from mjwrap.muscles import laws
from mjwrap.muscles.activation import FORMS, ActivationDynamics
from mjwrap.muscles.laws import (
    PASSIVE_LAWS,
    REFUSED,
    SEVERAL,
    TENDONS,
    ActuatorForce,
    FiberLaw,
    Law,
    MuJoCoMuscle,
)
from mjwrap.text import counted

OBJ = mujoco.mjtObj
TIMES, SMOOTHING = "activation_time_constants", "activation_smoothing"
LAW, TENDON, DYNAMICS = "law", "tendon_model", "activation_dynamics"  # words in the names of texts
# For each law: the numerics that it needs, and optional ones.
LAWS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    name: (law.needs, law.takes + (TIMES, SMOOTHING) * law.activated) for name, law in laws.LAWS.items()
}
FIBER_LAWS: dict[str, type[FiberLaw]] = {
    name: law for name, law in laws.LAWS.items() if issubclass(law, FiberLaw)
}
NUMERICS = tuple(dict.fromkeys(key for needed, other in LAWS.values() for key in (*needed, *other)))
TEXTS = (LAW, TENDON, DYNAMICS)

Given = dict[str, list[float]]


def read_numerics(model: mujoco.MjModel, ids: list[int]) -> Given:
    """Return the values of numerics by the parameter that their names contain."""
    given: Given = {}
    for i in ids:
        name = name_of(model, OBJ.mjOBJ_NUMERIC, i)
        fits = [key for key in NUMERICS if key in name]
        if len(fits) != 1:
            raise ModelError(
                f"numeric '{name}' must contain exactly one of these in its name: {listed(NUMERICS)}; or, directly "
                f"after a geom whose surface it declares: {listed(SIZES)}"
            )
        if fits[0] in given:
            raise ModelError(f"{fits[0]} is given twice, the second time by numeric '{name}'")
        first = int(model.numeric_adr[i])
        values = [float(x) for x in model.numeric_data[first : first + int(model.numeric_size[i])]]
        counts = SEVERAL.get(fits[0], (2 if fits[0] == TIMES else 1,))
        if counts and len(values) not in counts:
            wanted = " or ".join([*map(str, counts[:-1]), counted(counts[-1], "value")])
            raise ModelError(f"numeric '{name}' must have {wanted}, not {len(values)}")
        given[fits[0]] = values
    return given


def read_texts(model: mujoco.MjModel, ids: list[int]) -> dict[str, str]:
    """Return the contents of texts by the word in their names."""
    given: dict[str, str] = {}
    for i in ids:
        name = name_of(model, OBJ.mjOBJ_TEXT, i)
        key = max(
            TEXTS, key=lambda key: name.rfind(key)
        )  # the last one in the name: a muscle may be called claw
        if key not in name:
            raise ModelError(f"text '{name}' must contain one of these in its name: {listed(TEXTS)}")
        if key in given:
            raise ModelError(f"{key} is given twice, the second time by text '{name}'")
        first = int(model.text_adr[i])
        raw = bytes(model.text_data[first : first + int(model.text_size[i])])
        given[key] = raw.split(b"\0", 1)[0].decode(errors="replace").strip()
    return given


def law_arguments(given: Mapping[str, Sequence[float]]) -> dict[str, Any]:
    """Return the arguments of a law's dataclass from the numbers of its parameters."""
    return {
        key: tuple(values) if key in SEVERAL else values[0]
        for key, values in given.items()
        if key not in (TIMES, SMOOTHING)
    }


def choose_law(given: Given) -> str:
    """Return the law whose parameters are given, for a tuple that names no law; without parameters MuJoCo's."""
    for enough in (all, any):
        for law, (needed, _) in LAWS.items():
            if needed and enough(key in given for key in needed):
                return law
    return "mujoco"


def build_law(
    model: mujoco.MjModel, law: str, actuator: int, given: Given, tendon: str | None, native: bool = False
) -> Law:
    """Return a law's dataclass from the numerics of a tuple, or from its muscle actuator for MuJoCo's own.

    tendon: "rigid" or "elastic", None if the tuple does not say; only for laws with a tendon. native: under MuJoCo's
    own law the force is that which MuJoCo computes for the actuator, of any kind.
    """
    if law in REFUSED:
        raise ModelError(f"law '{law}' is not supported: {REFUSED[law]}")
    if law not in LAWS:
        raise ModelError(f"law '{law}' does not exist; laws: {listed(LAWS)}")
    needed, other = LAWS[law]
    missing = [key for key in needed if key not in given]
    if missing:
        raise ModelError(f"law '{law}' needs numeric {listed(missing)}; given: {listed(given)}")
    unused = [key for key in given if key not in (*needed, *other)]
    if unused:
        raise ModelError(
            f"law '{law}' has no parameter {listed(unused)}; it has: {listed((*needed, *other))}"
        )
    values = law_arguments(given)
    if law in FIBER_LAWS:
        found = FIBER_LAWS[law](**values) if tendon is None else FIBER_LAWS[law](**values, tendon=tendon)
        if found.states == 2 and actuator >= 0 and not keeps_state(model, actuator):
            raise ModelError(
                "an elastic tendon needs the fibre length as a state, which its actuator does not have: write it as "
                "<general dyntype='user' actdim='2' .../>, or let mjwrap.set_laws(spec, ...) do that"
            )
        return found
    if tendon is not None:
        raise ModelError(
            f"law '{law}' has no tendon; {TENDON} ({listed(TENDONS)}) is only for the laws {listed(FIBER_LAWS)}"
        )
    if laws.LAWS[law] in PASSIVE_LAWS and actuator >= 0:
        raise ModelError(f"law '{law}' is passive, so that its tuple must have no actuator")
    if law != MuJoCoMuscle.law:  # its parameters are those of the actuator
        return laws.LAWS[law](**values)
    if native and actuator >= 0:
        astray = tendon_reason(model, actuator)
        if astray is not None:
            raise ModelError(f"law 'mujoco' cannot be used with its actuator: {astray}")
        return ActuatorForce()
    if actuator < 0 or not is_muscle(model, actuator):
        raise ModelError(
            f"law 'mujoco' needs a muscle actuator in the tuple; laws without an actuator: {_without('mujoco')}; "
            f"other actuators of MuJoCo's pull along it in mode 'transmission'"
        )
    reason = curves_reason(model, actuator)
    if reason is not None:
        raise ModelError(f"law 'mujoco' cannot be used with its actuator: {reason}")
    return mujoco_law(model, actuator)


def _without(law: str) -> str:
    return listed(f"{other} (needs {listed(needed)})" for other, (needed, _) in LAWS.items() if other != law)


def activation_dynamics(
    model: mujoco.MjModel, actuator: int, given: Given, dynamics: str | None
) -> ActivationDynamics:
    """Return the activation dynamics if mjwrap integrates the activation; otherwise none may be given."""
    own = actuator < 0 or keeps_state(model, actuator)
    said = [key for key in (TIMES, SMOOTHING) if key in given] + [DYNAMICS] * (dynamics is not None)
    if said and not own:
        raise ModelError(
            f"{listed(said)} is only for muscles whose activation mjwrap integrates: those without an actuator, or "
            f"with an actuator of dyntype='user' actdim='2'; this muscle has the dynamics of its actuator"
        )
    if dynamics is not None and dynamics not in FORMS:
        raise ModelError(f"{DYNAMICS} '{dynamics}' do not exist; there are: {listed(FORMS)}")
    up, down = given.get(TIMES, (None, None))
    if (
        up is not None
        and down is not None
        and not (np.isfinite([up, down]).all() and up > 0.0 and down > 0.0)
    ):
        raise ModelError(f"{TIMES} must be finite and positive [s], not {up} and {down}")
    smoothing = given[SMOOTHING][0] if SMOOTHING in given else 10.0
    return ActivationDynamics(dynamics or "zajac", up, down, smoothing)
