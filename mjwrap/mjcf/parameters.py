"""Parameters of a declared muscle: numerics, found by what their names contain, become a law's dataclass."""

from __future__ import annotations

import mujoco
import numpy as np

from mjwrap.errors import ModelError
from mjwrap.mjcf.actuators import curves_reason, is_muscle, mujoco_law
from mjwrap.mjcf.names import listed, name_of
from mjwrap.mjcf.surfaces import SIZES
from mjwrap.muscles import DeGrooteFregly2016, Law, PathActuator

OBJ = mujoco.mjtObj
TIMES = "activation_time_constants"
DEFAULT_TIMES = (0.01, 0.04)  # [s], as MuJoCo's muscles
# Per law: the parameters that it needs and those that it can do without.
LAWS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "degroote_fregly_2016": (
        ("max_isometric_force", "optimal_fiber_length", "tendon_slack_length"),
        ("pennation_angle", "max_contraction_velocity", "fiber_damping", TIMES),
    ),
    "mujoco": ((), ()),
    "path_actuator": (("optimal_force",), ()),
}
NUMERICS = tuple(key for needed, other in LAWS.values() for key in (*needed, *other))

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
        wanted = 2 if fits[0] == TIMES else 1
        if len(values) != wanted:
            raise ModelError(
                f"numeric '{name}' must have {wanted} value{'s' * (wanted > 1)}, not {len(values)}"
            )
        given[fits[0]] = values
    return given


def read_text(model: mujoco.MjModel, index: int) -> str:
    """Return the contents of a text."""
    first = int(model.text_adr[index])
    raw = bytes(model.text_data[first : first + int(model.text_size[index])])
    return raw.split(b"\0", 1)[0].decode(errors="replace").strip()


def choose_law(given: Given) -> str:
    """Return the law whose parameters are given, for a tuple that names none: MuJoCo's where there are none."""
    for law, (needed, _) in LAWS.items():
        if any(key in given for key in needed):
            return law
    return "mujoco"


def build_law(model: mujoco.MjModel, law: str, actuator: int, given: Given) -> Law:
    """Return a law's dataclass from the numerics of a tuple, or from its muscle actuator for MuJoCo's own."""
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
    if law == "path_actuator":
        return PathActuator(given["optimal_force"][0])
    if law == "degroote_fregly_2016":
        return DeGrooteFregly2016(**{key: value[0] for key, value in given.items() if key != TIMES})
    if actuator < 0 or not is_muscle(model, actuator):
        raise ModelError(
            f"law 'mujoco' needs a muscle actuator in the tuple; laws that do not: {_without('mujoco')}"
        )
    reason = curves_reason(model, actuator)
    if reason is not None:
        raise ModelError(f"law 'mujoco' cannot be used with its actuator: {reason}")
    return mujoco_law(model, actuator)


def _without(law: str) -> str:
    return listed(f"{other} (needs {listed(needed)})" for other, (needed, _) in LAWS.items() if other != law)


def activation_times(given: Given, actuator: int) -> tuple[float, float]:
    """Return activation and deactivation time constants [s]; only a muscle without actuator can be given its own."""
    if TIMES not in given:
        return DEFAULT_TIMES
    if actuator >= 0:
        raise ModelError(
            f"{TIMES} are for muscles without an actuator; this one has its actuator's own dynamics"
        )
    up, down = given[TIMES]
    if not (np.isfinite([up, down]).all() and up > 0.0 and down > 0.0):
        raise ModelError(f"{TIMES} must be finite and positive [s], not {up} and {down}")
    return up, down
