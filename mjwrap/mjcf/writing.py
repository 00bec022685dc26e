"""Write muscle laws into an MjSpec, as tuples, numerics and texts, which `tuples.py` reads."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import mujoco

from mjwrap import validation
from mjwrap.errors import ModelError
from mjwrap.mjcf.names import listed
from mjwrap.mjcf.parameters import (
    DYNAMICS,
    FIBER_LAWS,
    LAW,
    NUMERICS,
    SMOOTHING,
    TENDON,
    TEXTS,
    TIMES,
)
from mjwrap.mjcf.tuple_names import declares_muscle
from mjwrap.mjcf.wrapping_geoms import SIZES
from mjwrap.muscles.activation import ActivationDynamics
from mjwrap.muscles.laws import SEVERAL, FiberLaw

OBJ = mujoco.mjtObj


def set_laws(
    spec: mujoco.MjSpec, laws: Mapping[str, FiberLaw], dynamics: ActivationDynamics | None = None
) -> None:
    """Give Hill-type laws to muscles of an MjSpec.

    The spec is changed in place, and compiles in MuJoCo without mjwrap. A muscle that a tuple declares keeps its route
    and gets the new law; a native muscle gets a tuple. If the law has an elastic tendon, or `dynamics` are given,
    mjwrap integrates the states. The actuator then becomes `dyntype="user" actdim="2"`, keeps its control and
    control range, and does not pull without mjwrap. Keyframes get a fibre length of 0. A native muscle keeps its
    time constants unless `dynamics` replace them; MuJoCo's smoothing between them and a force range of the actuator
    are not kept.

    Args:
        spec: the model.
        laws: laws by the name of the muscle's actuator, or of its tuple if it has no actuator.
        dynamics: activation dynamics of all these muscles; None to keep those of the actuators.

    Raises:
        ModelError: no muscle has the name, an actuator pulls no tendon or pushes, or a law has no fibre. The spec is
            not changed then.
    """
    validation.of_type(spec, "MjSpec", "spec", ModelError)
    validation.instance(laws, Mapping, "laws", ModelError, "a dict of laws by the name of the muscle")
    validation.optional(dynamics, ActivationDynamics, "dynamics", ModelError, "an ActivationDynamics")
    actuators = {actuator.name: actuator for actuator in spec.actuators}
    tuples = {entry.name: entry for entry in spec.tuples if declares_muscle(entry.name)}
    by_actuator = {_actuator_of(entry): entry for entry in tuples.values()}
    free = {name.replace("mjwrap_", ""): e for name, e in tuples.items() if not _actuator_of(e)}
    unknown = [name for name in laws if name not in actuators and name not in free]
    if unknown:
        raise ModelError(
            f"no muscle {listed(unknown)}; actuators: {listed(actuators)}; tuples: {listed(free)}"
        )
    for name, law in laws.items():
        _check(name, law, actuators.get(name), by_actuator.get(name))
    holders = [
        a
        for name, law in laws.items()
        if (law.states == 2 or dynamics is not None) and (a := actuators.get(name))
    ]
    _insert_fiber_lengths(spec, holders)
    for name, law in laws.items():
        chosen = dynamics
        actuator = actuators.get(name)
        if actuator is not None and (law.states == 2 or dynamics is not None):
            chosen = dynamics or _native_dynamics(actuator)
            _hold_states(actuator)
        entry = by_actuator.get(name) if actuator is not None else free[name]
        if entry is None:
            entry = spec.add_tuple(name=_fresh(f"mjwrap_{name}", tuples))
            _set_elements(entry, [(OBJ.mjOBJ_ACTUATOR, name, 0.0)])
        _write(spec, entry, name, law, chosen)


def _check(name: str, law: object, actuator: Any, entry: Any) -> None:
    """Raise `ModelError` if a muscle cannot have a law."""
    if not isinstance(law, FiberLaw):
        kinds = " or ".join(each.__name__ for each in FIBER_LAWS.values())
        raise ModelError(f"muscle '{name}': its law must be {kinds}, not {type(law).__name__}")
    mixed = [key for key in (*NUMERICS, *SIZES) if key in name]
    if mixed:
        raise ModelError(
            f"muscle '{name}': its name contains '{mixed[0]}', which is the name of a parameter in numerics"
        )
    if actuator is None:
        return
    stops = entry is not None and any(kind == OBJ.mjOBJ_SITE for kind, _, _ in _elements(entry))
    if actuator.trntype != mujoco.mjtTrn.mjTRN_TENDON and not stops:
        raise ModelError(f"muscle '{name}': its actuator pulls no tendon, and no tuple lists sites for it")
    if actuator.gear[0] <= 0.0:
        raise ModelError(f"muscle '{name}': the gear of its actuator is not positive, so it pushes")


def _insert_fiber_lengths(spec: mujoco.MjSpec, holders: list[Any]) -> None:
    """Insert a fibre length of 0 after the activation of actuators in every keyframe that has activations."""
    keys = [key for key in spec.keys if len(key.act)]
    if not keys or not holders:
        return
    model = spec.copy().compile()
    new = {actuator.name for actuator in holders}
    for key in keys:
        found: list[float] = []
        before = [float(a) for a in key.act]
        for i in range(model.nactuator):
            first, count = int(model.actuator_actadr[i]), int(model.actuator_actnum[i])
            kept = before[first : first + count] if count else []
            if model.actuator(i).name in new and count < 2:
                kept = [*kept, 0.0] if kept else [0.0, 0.0]
            found += kept
        key.act = found


def _elements(entry: Any) -> list[tuple[mujoco.mjtObj, str, float]]:
    kinds, names, marks = list(entry.objtype), list(entry.objname), list(entry.objprm)
    return [(OBJ(int(k)), str(n), float(p)) for k, n, p in zip(kinds, names, marks, strict=True)]


def _set_elements(entry: Any, elements: list[tuple[mujoco.mjtObj, str, float]]) -> None:
    entry.objtype = [int(kind) for kind, _, _ in elements]
    entry.objname = [name for _, name, _ in elements]
    entry.objprm = [prm for _, _, prm in elements]


def _actuator_of(entry: Any) -> str:
    return next((name for kind, name, _ in _elements(entry) if kind == OBJ.mjOBJ_ACTUATOR), "")


def _fresh(name: str, taken: Mapping[str, Any]) -> str:
    """Return the name, with a number if the name is taken."""
    found, k = name, 2
    while found in taken:
        found, k = f"{name}_{k}", k + 1
    return found


def _native_dynamics(actuator: Any) -> ActivationDynamics | None:
    """Return the time constants of MuJoCo's muscle dynamics; None if the actuator has other dynamics."""
    if actuator.dyntype != mujoco.mjtDyn.mjDYN_MUSCLE:
        return None
    return ActivationDynamics("zajac", float(actuator.dynprm[0]), float(actuator.dynprm[1]))


def _hold_states(actuator: Any) -> None:
    actuator.dyntype, actuator.actdim = mujoco.mjtDyn.mjDYN_USER, 2
    actuator.gaintype, actuator.biastype = mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias.mjBIAS_NONE
    actuator.actlimited = mujoco.mjtLimited.mjLIMITED_FALSE
    for prm in (actuator.dynprm, actuator.gainprm, actuator.biasprm):
        prm[:] = 0.0


def _is_parameter(kind: mujoco.mjtObj, name: str, keep: tuple[str, ...]) -> bool:
    """Return whether an element belongs to the law of a muscle, and not to its route or to what is kept."""
    if kind not in (OBJ.mjOBJ_NUMERIC, OBJ.mjOBJ_TEXT) or any(key in name for key in keep):
        return False
    return any(key in name for key in (NUMERICS if kind == OBJ.mjOBJ_NUMERIC else TEXTS))


def _write(
    spec: mujoco.MjSpec, entry: Any, muscle: str, law: FiberLaw, dynamics: ActivationDynamics | None
) -> None:
    """Replace a tuple's parameters by those of a law."""
    given = {key: getattr(law, key, None) for key in (*law.needs, *law.takes)}
    numerics = {
        key: [float(x) for x in (value if key in SEVERAL else [value])]
        for key, value in given.items()
        if value is not None
    }
    texts = {LAW: law.law, TENDON: law.tendon}
    if dynamics is not None:
        up, down, smoothing = dynamics.row()
        numerics |= {TIMES: [up, down], SMOOTHING: [smoothing]}
        texts[DYNAMICS] = dynamics.dynamics
    keep = (TIMES, SMOOTHING, DYNAMICS) if dynamics is None else ()
    elements = [e for e in _elements(entry) if not _is_parameter(e[0], e[1], keep)]
    # existing elements are changed in place: MuJoCo 4 deletes a tuple together with an element of it
    known_numerics, known_texts = {n.name: n for n in spec.numerics}, {t.name: t for t in spec.texts}
    for key, values in numerics.items():
        name = f"mjwrap_{muscle}_{key}"
        if name in known_numerics:
            known_numerics[name].data, known_numerics[name].size = values, len(values)
        else:
            spec.add_numeric(name=name, data=values, size=len(values))
        elements.append((OBJ.mjOBJ_NUMERIC, name, 0.0))
    for key, words in texts.items():
        name = f"mjwrap_{muscle}_{key}"
        if name in known_texts:
            known_texts[name].data = words
        else:
            spec.add_text(name=name, data=words)
        elements.append((OBJ.mjOBJ_TEXT, name, 0.0))
    _set_elements(entry, elements)
