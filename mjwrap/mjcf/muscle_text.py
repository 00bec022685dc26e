"""Write the declaration of a muscle as MJCF text: tendon, actuator, numerics, texts and tuple of a route.

Text is written, not an MjSpec, because MjSpec.to_xml rounds numbers to six digits; here they have all their digits.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from xml.sax.saxutils import quoteattr

import mujoco

from mjwrap import validation
from mjwrap.errors import ModelError
from mjwrap.mjcf.names import listed, name_of
from mjwrap.mjcf.parameters import (
    DYNAMICS,
    FIBER_LAWS,
    LAW,
    LAWS,
    NUMERICS,
    SMOOTHING,
    TENDON,
    TIMES,
    choose_law,
    law_arguments,
)
from mjwrap.mjcf.route_text import FINITE, Stop, read_route
from mjwrap.mjcf.wrapping_geoms import SIZES
from mjwrap.muscles import laws
from mjwrap.muscles.activation import FORMS
from mjwrap.muscles.laws import PASSIVE_LAWS, REFUSED, TENDONS, MuJoCoMuscle
from mjwrap.text import nearest

OBJ = mujoco.mjtObj
NATIVE = ("lengthrange", "force", "range", "scale", "lmin", "lmax", "vmax", "fpmax", "fvmax", "timeconst")


@dataclass(frozen=True)
class _Muscle:
    """What is written: see `muscle_xml`."""

    name: str
    stops: Sequence[Stop]
    law: str
    numbers: Mapping[str, Sequence[float]]
    words: Mapping[str, str] = field(default_factory=dict)
    actuator: str | None = None
    driven: bool = True


def muscle_xml(
    model: mujoco.MjModel,
    name: str,
    route: str,
    *,
    law: str | None = None,
    parameters: Mapping[str, float | str | Sequence[float]] | None = None,
    actuator: str | None = None,
    driven: bool = True,
) -> str:
    """Return MJCF text that declares a muscle along a route of a model, to paste before its `</mujoco>`.

    Args:
        model: the compiled model, in which the names are looked up.
        name: name of the muscle.
        route: stops in order, separated by commas. The first and the last are sites; other sites are via points. A geom
            may have a hint, GEOM:SITE, near which the path touches it, or a side, GEOM:side=SITE, on which the path
            passes it at every pose; GEOM@SHAPE=SIZE/SIZE gives it another shape, with sizes [m] as in
            docs/declaring.md; GEOM@finite wraps a cylinder geom as long as it is drawn. Where a site and a geom have
            the same name, write site/NAME or geom/NAME.
        law: "degroote_fregly_2016", "millard_2012", "thelen_2003", "mujoco", "path_actuator", "ligament" or
            "path_spring"; None for the one whose parameters are given.
        parameters: of the law, by the names of docs/declaring.md, such as max_isometric_force, and "tendon_model" and
            "activation_dynamics". For the law "mujoco", attributes of `<muscle>`, lengthrange among them.
        actuator: an actuator of the model that drives the muscle; None for a new one, with a tendon of its own.
        driven: whether the muscle has an actuator; without one its excitation is set in Python. Ligaments and springs
            have none.

    Returns:
        The text; numbers have all their digits.

    Raises:
        ModelError: a name does not exist or is taken, or the route, the law or a parameter is not possible.
    """
    validation.of_type(model, "MjModel", "model", ModelError)
    for argument, text in (("name", name), ("route", route)):
        validation.instance(text, str, argument, ModelError, "text")
    for argument, optional in (("law", law), ("actuator", actuator)):
        validation.optional(optional, str, argument, ModelError, "text")
    validation.optional(parameters, Mapping, "parameters", ModelError, "a dict of values by name")
    validation.flag(driven, "driven", ModelError)
    stops = read_route(model, route)
    numbers, words = _read_parameters(name, parameters or {})
    chosen = law or (choose_law({key: list(value) for key, value in numbers.items()}) if numbers else "")
    if chosen == "mujoco" and law is None:
        chosen = "mujoco" if any(key in NATIVE for key in numbers) else ""
    _check_law(name, chosen, numbers, words, driven, actuator)
    _check_names(model, name, actuator, driven)
    return _text(_Muscle(name, stops, chosen, numbers, words, actuator, driven))


def insert_xml(xml: str, fragment: str) -> str:
    """Return the text of an MJCF file with a fragment before its last `</mujoco>`; all else stays as it is.

    Raises `ModelError` if the text has no such end.
    """
    for argument, text in (("xml", xml), ("fragment", fragment)):
        validation.instance(text, str, argument, ModelError, "text")
    place = xml.rfind("</mujoco>")
    if place < 0:
        raise ModelError("the text has no </mujoco>, before which a muscle could be inserted")
    return f"{xml[:place].rstrip()}\n{fragment}{xml[place:]}"


def _read_parameters(
    name: str, given: Mapping[str, float | str | Sequence[float]]
) -> tuple[dict[str, list[float]], dict[str, str]]:
    numbers: dict[str, list[float]] = {}
    words: dict[str, str] = {}
    for key, value in given.items():
        if key in (TENDON, DYNAMICS):
            words[key] = str(value)
        elif key in NUMERICS or key in NATIVE:
            try:
                several = value.split(",") if isinstance(value, str) else value
                numbers[key] = [float(x) for x in (several if isinstance(several, Sequence) else [several])]
            except (TypeError, ValueError):
                raise ModelError(f"muscle '{name}': {key} must be a number, not {value!r}") from None
        else:
            known = (*NUMERICS, TENDON, DYNAMICS)
            raise ModelError(
                f"muscle '{name}': no parameter '{key}'{nearest(key, (*known, *NATIVE))}; parameters: "
                f"{listed(known)}; for the law mujoco: {listed(NATIVE)}"
            )
    return numbers, words


def _check_law(
    name: str,
    law: str,
    numbers: Mapping[str, Sequence[float]],
    words: Mapping[str, str],
    driven: bool,
    actuator: str | None,
) -> None:
    if not law:
        needed = "; ".join(f"{each}: {listed(need)}" for each, (need, _) in LAWS.items() if need)
        raise ModelError(
            f"muscle '{name}' needs a law and its parameters: {needed}; {MuJoCoMuscle.law}: lengthrange"
        )
    if law in REFUSED:
        raise ModelError(f"muscle '{name}': law '{law}' is not supported: {REFUSED[law]}")
    if law not in LAWS:
        raise ModelError(f"law '{law}' does not exist; laws: {listed(LAWS)}")
    own = law == MuJoCoMuscle.law
    needed, other = (("lengthrange",), NATIVE) if own and not actuator else LAWS[law]
    missing = [key for key in needed if key not in numbers]
    if missing:
        hint = "; mjwrap plot or inspect tell the lengths" if own else ""
        raise ModelError(f"muscle '{name}': law '{law}' needs {listed(missing)}{hint}")
    unused = [key for key in numbers if key not in (*needed, *other)]
    if unused:
        raise ModelError(
            f"muscle '{name}': law '{law}' has no parameter {listed(unused)}; it has: {listed((*needed, *other))}"
        )
    if own and not driven:
        raise ModelError(f"muscle '{name}': law '{law}' needs an actuator")
    if words.get(TENDON, TENDONS[0]) not in TENDONS or (TENDON in words and law not in FIBER_LAWS):
        raise ModelError(
            f"muscle '{name}': {TENDON} must be one of {listed(TENDONS)}, for the laws {listed(FIBER_LAWS)}"
        )
    if words.get(DYNAMICS, next(iter(FORMS))) not in FORMS:
        raise ModelError(f"muscle '{name}': {DYNAMICS} must be one of {listed(FORMS)}")
    if laws.LAWS[law] in PASSIVE_LAWS and driven:
        raise ModelError(f"muscle '{name}': law '{law}' is passive and needs no actuator: say driven=False")
    if law in FIBER_LAWS:  # a ModelError says what is wrong with a value
        FIBER_LAWS[law](**law_arguments(numbers), tendon=words.get(TENDON, TENDONS[0]))
    elif not own:
        laws.LAWS[law](**law_arguments(numbers))


def _check_names(model: mujoco.MjModel, name: str, actuator: str | None, driven: bool) -> None:
    mixed = [key for key in (*NUMERICS, *SIZES) if key in name]
    if not name or mixed or name.split() != [name]:
        why = "is empty" if not name else "contains a space, which tuples of MuJoCo cannot hold"
        why = f"contains '{mixed[0]}', which is the name of a parameter" if mixed else why
        raise ModelError(f"muscle '{name}': its name {why}")
    kinds = (
        ("actuator", OBJ.mjOBJ_ACTUATOR, name),
        ("tendon", OBJ.mjOBJ_TENDON, f"{name}_tendon"),
        ("tuple", OBJ.mjOBJ_TUPLE, f"mjwrap_{name}"),
    )
    for what, kind, wanted in kinds:
        if (actuator or not driven) and what != "tuple":
            continue
        if mujoco.mj_name2id(model, kind, wanted) >= 0:
            instead = ": give its name as the actuator of the muscle" if what == "actuator" else ""
            raise ModelError(f"muscle '{name}': the model has the {what} '{wanted}' already{instead}")
    if actuator and mujoco.mj_name2id(model, OBJ.mjOBJ_ACTUATOR, actuator) < 0:
        known = (name_of(model, OBJ.mjOBJ_ACTUATOR, i) for i in range(model.nactuator))
        raise ModelError(f"muscle '{name}': no actuator '{actuator}'; actuators: {listed(known)}")
    for i in range(model.ntuple if actuator else 0):
        first, count = int(model.tuple_adr[i]), int(model.tuple_size[i])
        has = any(
            int(model.tuple_objtype[j]) == int(OBJ.mjOBJ_ACTUATOR)
            and name_of(model, OBJ.mjOBJ_ACTUATOR, int(model.tuple_objid[j])) == actuator
            for j in range(first, first + count)
        )
        if has and "mjwrap" in name_of(model, OBJ.mjOBJ_TUPLE, i):
            raise ModelError(
                f"muscle '{name}': actuator '{actuator}' drives a muscle already, that of tuple "
                f"'{name_of(model, OBJ.mjOBJ_TUPLE, i)}'"
            )


def _text(muscle: _Muscle) -> str:
    """Return the elements of a muscle as text, each section closed."""
    name, lines = muscle.name, list[str]()
    elastic = muscle.words.get(TENDON) == TENDONS[1]
    own_states = elastic or any(
        key in muscle.words or key in muscle.numbers for key in (DYNAMICS, TIMES, SMOOTHING)
    )
    if muscle.driven and not muscle.actuator:
        sites = [_element("site", site=site) for site in _distinct_sites(muscle)]
        lines += [
            "<tendon>",
            f"  <!-- carries the actuator of {_comment(name)}; mjwrap's route is in the tuple -->",
        ]
        lines += [
            f"  <spatial name={quoteattr(f'{name}_tendon')}>",
            *(f"    {site}" for site in sites),
            "  </spatial>",
        ]
        lines += ["</tendon>", "<actuator>", f"  {_actuator(muscle, own_states)}", "</actuator>"]
    elements: list[str] = []
    custom: list[str] = []
    driver = (muscle.actuator or name) if muscle.driven else None
    if driver:
        elements.append(_element("element", objtype="actuator", objname=driver))
    for k, stop in enumerate(muscle.stops):
        marked = {"prm": "1"} if stop.shape == FINITE else {}
        elements.append(_element("element", objtype=stop.kind, objname=stop.name, **marked))
        if stop.sizes:
            numeric = f"mjwrap_{name}_{k}_{stop.shape}_size"
            custom.append(_element("numeric", name=numeric, data=_digits(stop.sizes)))
            elements.append(_element("element", objtype="numeric", objname=numeric))
        if stop.hint:
            elements.append(
                _element("element", objtype="site", objname=stop.hint, prm="2" if stop.side else "1")
            )
    for key, values in muscle.numbers.items():
        if key in NUMERICS:
            custom.append(_element("numeric", name=f"mjwrap_{name}_{key}", data=_digits(values)))
            elements.append(_element("element", objtype="numeric", objname=f"mjwrap_{name}_{key}"))
    for key, value in {LAW: muscle.law, **muscle.words}.items():
        custom.append(_element("text", name=f"mjwrap_{name}_{key}", data=value))
        elements.append(_element("element", objtype="text", objname=f"mjwrap_{name}_{key}"))
    lines += ["<custom>", *(f"  {line}" for line in custom)]
    lines += [
        f"  <tuple name={quoteattr(f'mjwrap_{name}')}>",
        *(f"    {line}" for line in elements),
        "  </tuple>",
    ]
    lines += ["</custom>"]
    return "".join(f"  {line}\n" for line in lines)


def _distinct_sites(muscle: _Muscle) -> list[str]:
    """Return the sites of a route for a tendon of MuJoCo, which must not have one twice in a row."""
    sites = [name for name, _ in itertools.groupby(stop.name for stop in muscle.stops if stop.kind == "site")]
    if len(sites) < 2:
        raise ModelError(
            f"muscle '{muscle.name}': its route has one site only, '{sites[0]}', over which no tendon for a new "
            f"actuator can be put"
        )
    return sites


def _actuator(muscle: _Muscle, own_states: bool) -> str:
    common = {
        "name": muscle.name,
        "tendon": f"{muscle.name}_tendon",
        "ctrllimited": "true",
        "ctrlrange": "0 1",
    }
    # all types are written, because a default of <muscle> holds for <general>, too
    plain = {"gaintype": "fixed", "gainprm": "0", "biastype": "none"}
    if own_states:  # mjwrap integrates activation and fibre length
        return _element("general", **common, **plain, dyntype="user", actdim="2")
    if muscle.law == MuJoCoMuscle.law:
        given = {key: _digits(values) for key, values in muscle.numbers.items() if key in NATIVE}
        return _element("muscle", **common, **given)
    if muscle.law not in FIBER_LAWS:  # the activation is the control
        return _element("general", **common, **plain, dyntype="none")
    return _element("muscle", **common, lengthrange="0.5 1")  # unused: the law's curves are mjwrap's


def _element(tag: str, **attributes: str) -> str:
    return f"<{tag} {' '.join(f'{key}={quoteattr(value)}' for key, value in attributes.items())}/>"


def _digits(values: Sequence[float]) -> str:
    return " ".join(f"{value!r}" for value in values)


def _comment(text: str) -> str:
    return text.replace("--", "-")
