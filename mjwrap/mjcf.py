"""Declarations of muscles in an MjModel: what pulls, along which sites and geoms, by which law.

Two forms are read (docs/declaring.md): every muscle actuator on a spatial tendon, as it stands; and `<custom>` tuples
whose name contains "mjwrap", which add what MuJoCo's schema cannot say. Nothing here changes the model.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass, field

import mujoco
import numpy as np

from mjwrap.errors import ModelError
from mjwrap.kernels import layout
from mjwrap.muscles import DeGrooteFregly2016, Law, MuJoCoMuscle, PathActuator

SURFACES = {
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): layout.CYLINDER,
    int(mujoco.mjtGeom.mjGEOM_SPHERE): layout.SPHERE,
}
LAWS = ("degroote_fregly_2016", "mujoco", "path_actuator")
_HILL = (
    "max_isometric_force",
    "optimal_fiber_length",
    "tendon_slack_length",
    "pennation_angle",
    "max_contraction_velocity",
    "fiber_damping",
)
_NUMERICS = (*_HILL, "optimal_force", "activation_time_constants")


@dataclass(frozen=True)
class Node:
    """One stop of a route: a via site or a wrapping geom with, perhaps, the site that hints at its side."""

    site: int = -1
    geom: int = -1
    hint_site: int = -1


@dataclass(frozen=True)
class Route:
    """An unbroken stretch of string: origin site, nodes, insertion site; weight: its share in the muscle's length."""

    origin: int
    nodes: tuple[Node, ...]
    insertion: int
    weight: float = 1.0


@dataclass(frozen=True)
class MuscleDeclaration:
    """One muscle of a model: ids are MuJoCo's.

    name; routes: one, or several joined by pulleys; parameters: the law's dataclass; actuator, tendon: id or -1;
    activation_times: activation and deactivation time constants [s] where mjwrap integrates the activation itself.
    """

    name: str
    routes: tuple[Route, ...]
    parameters: Law
    actuator: int = -1
    tendon: int = -1
    activation_times: tuple[float, float] = (0.01, 0.04)

    @property
    def law(self) -> str:
        """Name of the muscle law."""
        return self.parameters.law

    @property
    def origin_site(self) -> int:
        """Site id of the origin."""
        return self.routes[0].origin

    @property
    def insertion_site(self) -> int:
        """Site id of the insertion."""
        return self.routes[-1].insertion

    @property
    def via_sites(self) -> list[int]:
        """Site ids of the via points, in order."""
        return [node.site for route in self.routes for node in route.nodes if node.site >= 0]

    @property
    def geoms(self) -> list[int]:
        """Geom ids of the wrapping surfaces, in order."""
        return [node.geom for route in self.routes for node in route.nodes if node.geom >= 0]


@dataclass(frozen=True)
class Declarations:
    """All muscles of a model, and the native muscle actuators that cannot be taken over, each with the reason."""

    muscles: list[MuscleDeclaration]
    native: dict[str, str] = field(default_factory=dict)


def read_model(path: str | os.PathLike[str]) -> mujoco.MjModel:
    """Load an MJCF or MJB file; `ModelError` with MuJoCo's reason where that fails."""
    name = os.fspath(path)
    if not os.path.isfile(name):
        raise ModelError(f"no such model file: {name}")
    try:
        if name.endswith(".mjb"):
            return mujoco.MjModel.from_binary_path(name)
        return mujoco.MjModel.from_xml_path(name)
    except (ValueError, mujoco.FatalError) as error:
        reason = " ".join(str(error).split())
        raise ModelError(f"{name} is not a model that MuJoCo can load: {reason}") from None


def names(model: mujoco.MjModel, kind: mujoco.mjtObj, count: int) -> list[str]:
    """Return the names of all objects of a kind; unnamed ones are written as #id."""
    return [mujoco.mj_id2name(model, kind, i) or f"#{i}" for i in range(count)]


def name_of(model: mujoco.MjModel, kind: mujoco.mjtObj, index: int) -> str:
    """Return an object's name, or #id where it has none."""
    return mujoco.mj_id2name(model, kind, index) or f"#{index}"


def _site(model: mujoco.MjModel, index: int) -> str:
    return name_of(model, mujoco.mjtObj.mjOBJ_SITE, index)


def _list_sites(model: mujoco.MjModel) -> str:
    return f"sites: {', '.join(names(model, mujoco.mjtObj.mjOBJ_SITE, model.nsite)) or 'none'}"


def _check_geom(model: mujoco.MjModel, muscle: str, geom: int) -> None:
    kind = int(model.geom_type[geom])
    geom_name = name_of(model, mujoco.mjtObj.mjOBJ_GEOM, geom)
    if kind not in SURFACES:
        kinds = mujoco.mjtGeom(kind).name.removeprefix("mjGEOM_").lower()
        fit = [i for i in range(model.ngeom) if int(model.geom_type[i]) in SURFACES]
        there = ", ".join(name_of(model, mujoco.mjtObj.mjOBJ_GEOM, i) for i in fit) or "none"
        raise ModelError(
            f"muscle '{muscle}': geom '{geom_name}' is a {kinds}; a wrapping surface must be a cylinder or a sphere "
            f"(geoms of those kinds: {there})"
        )
    radius = float(model.geom_size[geom, 0])
    if not (np.isfinite(radius) and radius > 0.0):
        raise ModelError(f"muscle '{muscle}': geom '{geom_name}' has radius {radius}; it must be positive [m]")


def _hint_inside(model: mujoco.MjModel, data: mujoco.MjData, geom: int, site: int) -> bool:
    """Return whether a side site lies inside its geom: MuJoCo's sign for a string that runs inside."""
    local = data.geom_xmat[geom].reshape(3, 3).T @ (data.site_xpos[site] - data.geom_xpos[geom])
    if int(model.geom_type[geom]) == int(mujoco.mjtGeom.mjGEOM_CYLINDER):
        local = local[:2]
    return bool(np.linalg.norm(local) < model.geom_size[geom, 0])


class _Reader:
    """Reads one model; holds what every step of the reading needs."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self.model = model
        self.rest = mujoco.MjData(model)
        mujoco.mj_kinematics(model, self.rest)

    def build_routes(self, muscle: str, stops: Iterable[tuple[str, int, float]]) -> tuple[Route, ...]:
        """Return the routes of a list of (kind, id, parameter): "site", "geom", "hint" or "pulley"."""
        routes: list[Route] = []
        origin, nodes, weight = -1, list[Node](), 1.0

        def close() -> None:
            nonlocal origin, nodes
            if origin < 0 and not nodes:
                return
            if origin < 0 or not nodes or nodes[-1].site < 0:
                count = (origin >= 0) + sum(node.site >= 0 for node in nodes)
                raise ModelError(
                    f"muscle '{muscle}': its path has {count} site{'s' * (count != 1)} and must begin and end with "
                    f"one; {_list_sites(self.model)}"
                )
            routes.append(Route(origin, tuple(nodes[:-1]), nodes[-1].site, weight))
            origin, nodes = -1, []

        for kind, index, parameter in stops:
            if kind == "pulley":
                close()
                if not parameter > 0.0:
                    raise ModelError(f"muscle '{muscle}': pulley divisor {parameter} must be positive")
                weight = 1.0 / parameter
            elif kind == "geom":
                _check_geom(self.model, muscle, index)
                nodes.append(Node(geom=index))
            elif kind == "hint":
                if not nodes or nodes[-1].geom < 0 or nodes[-1].hint_site >= 0:
                    raise ModelError(
                        f"muscle '{muscle}': site '{_site(self.model, index)}' is marked as a hint (prm=1) but does not "
                        f"follow a geom"
                    )
                nodes[-1] = Node(geom=nodes[-1].geom, hint_site=index)
            elif origin < 0:
                if nodes:
                    close()
                origin = index
            else:
                nodes.append(Node(site=index))
        close()
        if not routes:
            raise ModelError(f"muscle '{muscle}': its path has no sites; {_list_sites(self.model)}")
        return tuple(routes)

    def tendon_stops(self, tendon: int) -> list[tuple[str, int, float]]:
        """Return the stops of a spatial tendon."""
        model = self.model
        stops: list[tuple[str, int, float]] = []
        first = int(model.tendon_adr[tendon])
        for w in range(first, first + int(model.tendon_num[tendon])):
            kind, index, parameter = int(model.wrap_type[w]), int(model.wrap_objid[w]), float(model.wrap_prm[w])
            if kind == int(mujoco.mjtWrap.mjWRAP_SITE):
                stops.append(("site", index, 0.0))
            elif kind == int(mujoco.mjtWrap.mjWRAP_PULLEY):
                stops.append(("pulley", -1, parameter))
            elif kind in (int(mujoco.mjtWrap.mjWRAP_SPHERE), int(mujoco.mjtWrap.mjWRAP_CYLINDER)):
                stops.append(("geom", index, 0.0))
                if parameter >= 0.0:
                    stops.append(("hint", round(parameter), 0.0))
        return stops

    def native_reason(self, actuator: int) -> str | None:
        """Return why a muscle actuator must stay native, or None."""
        model = self.model
        if int(model.actuator_trntype[actuator]) != int(mujoco.mjtTrn.mjTRN_TENDON):
            return "it does not pull a tendon"
        tendon = int(model.actuator_trnid[actuator, 0])
        if int(model.wrap_type[model.tendon_adr[tendon]]) == int(mujoco.mjtWrap.mjWRAP_JOINT):
            return "its tendon is fixed, not spatial"
        if model.actuator_actearly[actuator]:
            return "its activation acts early (actearly)"
        if int(model.actuator_actnum[actuator]) > 1:
            return "it has more than one activation state"
        bias = int(model.actuator_biastype[actuator])
        muscle_bias = bias == int(mujoco.mjtBias.mjBIAS_MUSCLE)
        if bias != int(mujoco.mjtBias.mjBIAS_NONE) and not muscle_bias:
            return "its bias is not a muscle's"
        gain_prm, bias_prm = model.actuator_gainprm[actuator, :9], model.actuator_biasprm[actuator, :9]
        if muscle_bias and not np.array_equal(gain_prm, bias_prm):
            return "its gain and bias have different parameters"
        for kind, geom, site in self._hinted(tendon):
            if kind and _hint_inside(model, self.rest, geom, site):
                name = name_of(model, mujoco.mjtObj.mjOBJ_GEOM, geom)
                return f"its tendon runs inside geom '{name}' (side site '{_site(model, site)}' is inside)"
        return None

    def _hinted(self, tendon: int) -> list[tuple[bool, int, int]]:
        stops = self.tendon_stops(tendon)
        pairs = zip(stops, stops[1:], strict=False)
        return [(True, geom[1], hint[1]) for geom, hint in pairs if geom[0] == "geom" and hint[0] == "hint"]

    def mujoco_law(self, muscle: str, actuator: int) -> MuJoCoMuscle:
        """Return the native curves of a muscle actuator."""
        model = self.model
        prm = [float(p) for p in model.actuator_gainprm[actuator, :9]]
        if int(model.actuator_biastype[actuator]) == int(mujoco.mjtBias.mjBIAS_NONE):
            prm[7] = 0.0
        limited = bool(model.actuator_forcelimited[actuator])
        low, high = (float(x) for x in model.actuator_forcerange[actuator])
        low, high = (low, high) if limited else (-np.inf, np.inf)
        length_range = (float(model.actuator_lengthrange[actuator, 0]), float(model.actuator_lengthrange[actuator, 1]))
        acc0, gear = float(model.actuator_acc0[actuator]), float(model.actuator_gear[actuator, 0])
        try:
            return MuJoCoMuscle(tuple(prm), length_range, acc0, gear, (low, high))
        except ModelError as error:
            raise ModelError(f"muscle '{muscle}': {error}") from None


def _numerics(model: mujoco.MjModel, muscle: str, ids: list[int]) -> dict[str, list[float]]:
    """Return the parameters of a tuple's numerics by what their names contain."""
    found: dict[str, list[float]] = {}
    for i in ids:
        name = name_of(model, mujoco.mjtObj.mjOBJ_NUMERIC, i)
        fits = [key for key in _NUMERICS if key in name]
        if len(fits) != 1:
            raise ModelError(
                f"muscle '{muscle}': numeric '{name}' must contain one of these in its name: {', '.join(_NUMERICS)}"
            )
        if fits[0] in found:
            raise ModelError(f"muscle '{muscle}': {fits[0]} is given twice, the second time by numeric '{name}'")
        first = int(model.numeric_adr[i])
        values = [float(x) for x in model.numeric_data[first : first + int(model.numeric_size[i])]]
        wanted = 2 if fits[0] == "activation_time_constants" else 1
        if len(values) != wanted:
            raise ModelError(f"muscle '{muscle}': numeric '{name}' must have {wanted} value(s), not {len(values)}")
        found[fits[0]] = values
    return found


def _text(model: mujoco.MjModel, index: int) -> str:
    first = int(model.text_adr[index])
    raw = bytes(model.text_data[first : first + int(model.text_size[index])])
    return raw.split(b"\0", 1)[0].decode()


def _choose_law(reader: _Reader, muscle: str, actuator: int, law: str | None, given: dict[str, list[float]]) -> Law:
    """Return the law of a tuple: the one it names, else the one whose parameters it gives, else MuJoCo's."""
    if law is None:
        if "optimal_fiber_length" in given or "max_isometric_force" in given:
            law = "degroote_fregly_2016"
        else:
            law = "path_actuator" if "optimal_force" in given else "mujoco"
    try:
        if law == "path_actuator":
            if "optimal_force" not in given:
                raise ModelError("path_actuator: numeric optimal_force [N] is missing")
            return PathActuator(given["optimal_force"][0])
        if law == "degroote_fregly_2016":
            missing = [key for key in _HILL[:3] if key not in given]
            if missing:
                raise ModelError(f"degroote_fregly_2016: numeric {', '.join(missing)} is missing")
            return DeGrooteFregly2016(**{key: given[key][0] for key in _HILL if key in given})
        if law == "mujoco":
            muscle_gain = actuator >= 0 and int(reader.model.actuator_gaintype[actuator]) == int(
                mujoco.mjtGain.mjGAIN_MUSCLE
            )
            if not muscle_gain:
                raise ModelError("law 'mujoco' needs a muscle actuator in the tuple, or numerics for another law")
            return reader.mujoco_law(muscle, actuator)
    except ModelError as error:
        raise ModelError(f"muscle '{muscle}': {error}") from None
    raise ModelError(f"muscle '{muscle}': law '{law}' is none of: {', '.join(LAWS)}")


def _read_tuple(reader: _Reader, index: int) -> MuscleDeclaration:
    model = reader.model
    kinds = mujoco.mjtObj
    tuple_name = name_of(model, kinds.mjOBJ_TUPLE, index)
    actuators, tendons, numerics = list[int](), list[int](), list[int]()
    stops: list[tuple[str, int, float]] = []
    law: str | None = None
    first = int(model.tuple_adr[index])
    for j in range(first, first + int(model.tuple_size[index])):
        kind, item, prm = int(model.tuple_objtype[j]), int(model.tuple_objid[j]), float(model.tuple_objprm[j])
        if kind == int(kinds.mjOBJ_ACTUATOR):
            actuators.append(item)
        elif kind == int(kinds.mjOBJ_TENDON):
            tendons.append(item)
        elif kind == int(kinds.mjOBJ_SITE):
            stops.append(("hint" if prm == 1.0 else "site", item, 0.0))
        elif kind == int(kinds.mjOBJ_GEOM):
            stops.append(("geom", item, 0.0))
        elif kind == int(kinds.mjOBJ_NUMERIC):
            numerics.append(item)
        elif kind == int(kinds.mjOBJ_TEXT) and "law" in name_of(model, kinds.mjOBJ_TEXT, item):
            law = _text(model, item)
        else:
            raise ModelError(
                f"tuple '{tuple_name}': element of type {mujoco.mjtObj(kind).name} cannot be used; use actuator, tendon, "
                f"site, geom, numeric, or a text whose name contains 'law'"
            )
    if len(actuators) > 1 or len(tendons) > 1:
        raise ModelError(f"tuple '{tuple_name}': at most one actuator and one tendon make a muscle")
    actuator = actuators[0] if actuators else -1
    tendon = tendons[0] if tendons else -1
    if tendon < 0 <= actuator and int(model.actuator_trntype[actuator]) == int(mujoco.mjtTrn.mjTRN_TENDON):
        tendon = int(model.actuator_trnid[actuator, 0])
    if actuator >= 0:
        name = name_of(model, kinds.mjOBJ_ACTUATOR, actuator)
    elif tendon >= 0:
        name = name_of(model, kinds.mjOBJ_TENDON, tendon)
    else:
        name = tuple_name.replace("mjwrap_", "")
    if not stops:
        if tendon < 0:
            raise ModelError(f"tuple '{tuple_name}': it has neither sites of its own nor a tendon to take them from")
        stops = reader.tendon_stops(tendon)
    if actuator >= 0 and (model.actuator_actearly[actuator] or int(model.actuator_actnum[actuator]) > 1):
        raise ModelError(f"muscle '{name}': actuators with actearly or several activation states are not supported")
    given = _numerics(model, name, numerics)
    times = given.get("activation_time_constants", [0.01, 0.04])
    if not all(np.isfinite(t) and t > 0.0 for t in times):
        raise ModelError(f"muscle '{name}': activation_time_constants must be finite and positive [s], not {times}")
    return MuscleDeclaration(
        name=name,
        routes=reader.build_routes(name, stops),
        parameters=_choose_law(reader, name, actuator, law, given),
        actuator=actuator,
        tendon=tendon,
        activation_times=(times[0], times[1]),
    )


def read_declarations(model: mujoco.MjModel) -> Declarations:
    """Read every muscle that a model declares, in the order of its actuators, then of tuples without an actuator.

    Raises `ModelError` for a declaration that cannot be understood; native muscle actuators that mjwrap cannot take
    over are left to MuJoCo and named in `native`.
    """
    reader = _Reader(model)
    by_actuator: dict[int, MuscleDeclaration] = {}
    free: list[MuscleDeclaration] = []
    for index in range(model.ntuple):
        if "mjwrap" not in name_of(model, mujoco.mjtObj.mjOBJ_TUPLE, index):
            continue
        muscle = _read_tuple(reader, index)
        if muscle.actuator < 0:
            free.append(muscle)
        elif muscle.actuator in by_actuator:
            raise ModelError(f"muscle '{muscle.name}': two mjwrap tuples name its actuator")
        else:
            by_actuator[muscle.actuator] = muscle
    muscles: list[MuscleDeclaration] = []
    native: dict[str, str] = {}
    for actuator in range(model.nu):
        if actuator in by_actuator:
            muscles.append(by_actuator[actuator])
            continue
        if int(model.actuator_gaintype[actuator]) != int(mujoco.mjtGain.mjGAIN_MUSCLE):
            continue
        name = name_of(model, mujoco.mjtObj.mjOBJ_ACTUATOR, actuator)
        reason = reader.native_reason(actuator)
        if reason is not None:
            native[name] = reason
            continue
        tendon = int(model.actuator_trnid[actuator, 0])
        routes = reader.build_routes(name, reader.tendon_stops(tendon))
        muscles.append(
            MuscleDeclaration(name, routes, reader.mujoco_law(name, actuator), actuator=actuator, tendon=tendon)
        )
    return Declarations(muscles + free, native)
