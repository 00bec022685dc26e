"""Names that a model refers to and does not have: MuJoCo's error, with the names that resemble the missing one."""

from __future__ import annotations

import re

import mujoco

from mjwrap.mjcf.names import listed
from mjwrap.text import nearest

_MISSING = re.compile(r"(?P<kind>[\w ]*?)\s*'(?P<name>[^']*)' (?:not found )?in \w+ \d+")
_LISTED = 12  # names to list where none resembles the missing one


def with_candidates(reason: str, spec: mujoco.MjSpec | None) -> str:
    """Return MuJoCo's reason against a model; for a name that does not exist, also what resembles it.

    spec: the model, not compiled; None if it could not be read.
    """
    found = _MISSING.search(reason)
    if spec is None or found is None or not ("not found" in reason or "unrecognized" in reason):
        return reason
    name, names = found["name"], _names(spec)
    wanted = _kind(found["kind"], name, spec, names)
    others = [kind for kind, there in names.items() if name in there and kind not in wanted]
    if others:
        return f"{reason}; '{name}' is a {others[0]}, not a {' or '.join(wanted)}"
    known = [each for kind in wanted for each in names[kind]]
    what = " or ".join(wanted)
    if close := nearest(name, known):
        return f"{reason}; there is no {what} '{name}'{close}"
    rest = len(known) - _LISTED
    more = f" and {rest} more" if rest > 0 else ""
    return f"{reason}; there is no {what} '{name}'; there are: {listed(known[:_LISTED])}{more}"


def _names(spec: mujoco.MjSpec) -> dict[str, list[str]]:
    """Return the names of all elements that others can refer to, by kind."""
    kinds = {
        "site": spec.sites, "geom": spec.geoms, "tendon": spec.tendons, "joint": spec.joints, "body": spec.bodies,
        "actuator": spec.actuators, "numeric": spec.numerics, "text": spec.texts, "sensor": spec.sensors,
    }  # fmt: skip
    return {kind: [element.name for element in elements if element.name] for kind, elements in kinds.items()}


def _kind(told: str, name: str, spec: mujoco.MjSpec, names: dict[str, list[str]]) -> list[str]:
    """Return the kinds of element that a missing name may have: as MuJoCo says, or as the tuple that lists it says."""
    for kind in names:
        if told.endswith(kind):
            return [kind]
    if "transmission target" in told:
        return ["tendon", "joint", "site", "body"]
    for entry in spec.tuples:
        for objtype, objname in zip(entry.objtype, entry.objname, strict=True):
            kind = mujoco.mjtObj(int(objtype)).name.removeprefix("mjOBJ_").lower()
            if objname == name and kind in names and name not in names[kind]:
                return [kind]
    return list(names)
