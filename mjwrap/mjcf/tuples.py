"""Read a muscle from a `<custom>` tuple whose name contains "mjwrap": route, parameters, law and actuator."""

from __future__ import annotations

from dataclasses import dataclass, field

import mujoco

from mjwrap.errors import ModelError
from mjwrap.mjcf.active_ranges import WORD as ACTIVE_RANGE
from mjwrap.mjcf.active_ranges import read_active_range
from mjwrap.mjcf.actuators import is_fixed, is_muscle, pulled_tendon, unfit_reason
from mjwrap.mjcf.declarations import MuscleDeclaration, Route
from mjwrap.mjcf.names import listed, name_of
from mjwrap.mjcf.parameters import (
    DYNAMICS,
    LAW,
    NUMERICS,
    TENDON,
    TEXTS,
    activation_dynamics,
    build_law,
    choose_law,
    read_numerics,
    read_texts,
)
from mjwrap.mjcf.routes import Stop, build_routes, tendon_stops
from mjwrap.mjcf.side_rules import AUTHORS
from mjwrap.mjcf.tuple_names import COUPLING
from mjwrap.mjcf.wrapping_geoms import size_keys
from mjwrap.surfaces.rows import side_fault

OBJ = mujoco.mjtObj
MARKS = {
    OBJ.mjOBJ_SITE: (
        "site",
        2,
        "0 makes it a stop of the path, 1 the hint and 2 the side of the geom before",
    ),
    OBJ.mjOBJ_GEOM: ("geom", 1, "0 wraps an infinite cylinder, 1 a cylinder as long as it is drawn"),
}


@dataclass
class _Elements:
    """The elements of a tuple, by their meaning."""

    actuators: list[int] = field(default_factory=list)
    tendons: list[int] = field(default_factory=list)
    stops: list[Stop] = field(default_factory=list)
    numerics: list[int] = field(default_factory=list)
    texts: list[int] = field(default_factory=list)


def read_tuple(
    model: mujoco.MjModel,
    rest: mujoco.MjData,
    index: int,
    by_mujoco: tuple[bool, bool] = (False, False),
    side_rule: int = AUTHORS,
) -> MuscleDeclaration:
    """Return the muscle that a tuple declares; `ModelError`, which names the tuple or muscle and the element, if wrong.

    rest: kinematics of the reference pose. by_mujoco: whether MuJoCo computes the force under the law "mujoco": of its
    muscles, and of other actuators on spatial tendons. side_rule: of the side sites of a tendon whose route the tuple
    takes; the hints that the tuple itself lists are the author's, and nothing changes their meaning.
    """
    tuple_name = name_of(model, OBJ.mjOBJ_TUPLE, index)
    try:
        found = _collect(model, index)
    except ModelError as error:
        raise ModelError(f"tuple '{tuple_name}': {error}") from None
    actuator = found.actuators[0] if found.actuators else -1
    tendon = found.tendons[0] if found.tendons else -1
    if tendon < 0 <= actuator:
        tendon = pulled_tendon(model, actuator)
    if actuator >= 0:
        name = name_of(model, OBJ.mjOBJ_ACTUATOR, actuator)
    elif tendon >= 0:
        name = name_of(model, OBJ.mjOBJ_TENDON, tendon)
    else:
        name = tuple_name.replace("mjwrap_", "")
    stops = found.stops
    if not stops:
        if tendon < 0:
            raise ModelError(f"tuple '{tuple_name}': it has neither sites nor a tendon with sites")
        stops = tendon_stops(model, rest, tendon, side_rule)
    routes = build_routes(model, name, stops)
    _check_sides(model, rest, name, routes)
    try:
        given = read_numerics(model, found.numerics)
        texts = read_texts(model, found.texts)
        law = texts.get(LAW) or choose_law(given)
        native = law == "mujoco" and by_mujoco[actuator < 0 or not is_muscle(model, actuator)]
        unfit = unfit_reason(model, actuator) if actuator >= 0 and not native else None
        if unfit is not None:
            raise ModelError(f"its actuator cannot be taken over: {unfit}")
        parameters = build_law(model, law, actuator, given, texts.get(TENDON), native)
        dynamics = activation_dynamics(model, actuator, given, texts.get(DYNAMICS))
    except ModelError as error:
        raise ModelError(f"muscle '{name}' (tuple '{tuple_name}'): {error}") from None
    return MuscleDeclaration(name, routes, parameters, actuator, tendon, dynamics)


def _check_sides(model: mujoco.MjModel, rest: mujoco.MjData, muscle: str, routes: tuple[Route, ...]) -> None:
    """Raise a `ModelError` for a side that says no half: a site on the axis of its geom, or in its middle."""
    for node in (node for route in routes for node in route.nodes):
        if not node.side or node.surface is None:
            continue
        turned = rest.geom_xmat[node.geom].reshape(3, 3)
        fault = side_fault(
            node.surface, turned.T @ (rest.site_xpos[node.hint_site] - rest.geom_xpos[node.geom])
        )
        if fault:
            raise ModelError(
                f"muscle '{muscle}': site '{name_of(model, OBJ.mjOBJ_SITE, node.hint_site)}', the side (prm=2) of geom "
                f"'{name_of(model, OBJ.mjOBJ_GEOM, node.geom)}', lies {fault} of the geom and so says no side; move it "
                "to where the muscle passes"
            )


def _collect(model: mujoco.MjModel, index: int) -> _Elements:
    found = _Elements()
    first = int(model.tuple_adr[index])
    end = first + int(model.tuple_size[index])
    after_site, ranged = False, -1  # whether a range may follow; the numeric of the last range
    for j in range(first, end):
        kind, item, prm = (
            OBJ(int(model.tuple_objtype[j])),
            int(model.tuple_objid[j]),
            float(model.tuple_objprm[j]),
        )
        if j == ranged:
            continue
        if kind == OBJ.mjOBJ_JOINT:
            if not after_site:
                name = name_of(model, kind, item)
                raise ModelError(
                    f"joint '{name}' must directly follow a site of the path, whose {ACTIVE_RANGE} it has"
                )
            site = found.stops[-1]
            ranged = j + 1
            each = read_active_range(model, item, ranged if ranged < end else -1)
            found.stops[-1] = site._replace(ranges=(*site.ranges, each))
            continue
        after_site = kind == OBJ.mjOBJ_SITE and prm == 0.0
        if kind == OBJ.mjOBJ_ACTUATOR:
            found.actuators.append(item)
        elif kind == OBJ.mjOBJ_TENDON:
            found.tendons.append(item)
        elif kind == OBJ.mjOBJ_SITE:
            mark = _mark(model, kind, item, prm)
            found.stops.append(Stop("hint" if mark else "site", item, side=mark == 2))
        elif kind == OBJ.mjOBJ_GEOM:
            found.stops.append(Stop("geom", item, finite=_mark(model, kind, item, prm) == 1))
        elif kind == OBJ.mjOBJ_NUMERIC and size_keys(name_of(model, kind, item)):
            _check_size_name(name_of(model, kind, item))
            found.stops.append(Stop("sizes", item))
        elif kind == OBJ.mjOBJ_NUMERIC:
            found.numerics.append(item)
        elif kind == OBJ.mjOBJ_TEXT:
            found.texts.append(item)
        else:
            what = kind.name.removeprefix("mjOBJ_").lower()
            pieces = kind == OBJ.mjOBJ_EQUALITY
            hint = f"; the pieces of a coupling are in a tuple '{COUPLING}JOINT'" if pieces else ""
            raise ModelError(
                f"{what} '{name_of(model, kind, item)}' cannot be used; use actuator, tendon, site, geom, numeric, "
                f"or a text whose name contains one of: {listed(TEXTS)}{hint}"
            )
    _at_most_one(model, OBJ.mjOBJ_ACTUATOR, found.actuators)
    _at_most_one(model, OBJ.mjOBJ_TENDON, found.tendons)
    if found.tendons and is_fixed(model, found.tendons[0]):
        name = name_of(model, OBJ.mjOBJ_TENDON, found.tendons[0])
        raise ModelError(f"tendon '{name}' is fixed: it has joints, not a path")
    return found


def _mark(model: mujoco.MjModel, kind: mujoco.mjtObj, item: int, prm: float) -> int:
    """Return the prm of a site or geom, one of those that have a meaning."""
    what, most, meaning = MARKS[kind]
    if prm not in range(most + 1):
        raise ModelError(f"{what} '{name_of(model, kind, item)}' has prm={prm:g}; {meaning}")
    return int(prm)


def _check_size_name(name: str) -> None:
    keys = [*size_keys(name), *(key for key in NUMERICS if key in name)]
    if len(keys) > 1:
        raise ModelError(f"numeric '{name}' must contain only one of these in its name: {listed(keys)}")


def _at_most_one(model: mujoco.MjModel, kind: mujoco.mjtObj, items: list[int]) -> None:
    if len(items) > 1:
        what = kind.name.removeprefix("mjOBJ_").lower()
        there = listed(name_of(model, kind, item) for item in items)
        raise ModelError(f"a muscle can have only one {what}, not {len(items)}: {there}")
