"""Read the route of a muscle from text: sites and geoms by name, with hints and shapes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco

from mjwrap.errors import ModelError
from mjwrap.mjcf.names import listed, names
from mjwrap.mjcf.wrapping_geoms import SIZES
from mjwrap.text import nearest

OBJ = mujoco.mjtObj
SHAPES = {key.removesuffix("_size"): sizes for key, sizes in SIZES.items()}
FINITE = "finite"
SIDE = "side="  # before the site of a hint: it holds at every pose
ROUTE_FORMS = (
    "SITE, GEOM, GEOM:HINT, GEOM@finite, GEOM@SHAPE=SIZE/SIZE or GEOM@SHAPE=SIZE/SIZE:HINT, separated by commas; "
    "side=HINT instead of HINT holds the side at every pose; "
    f"shapes: {', '.join(SHAPES)}"
)


@dataclass(frozen=True)
class Stop:
    """A stop of a route: the name of a site or geom, and of a geom its hint, shape and sizes [m].

    side: the hint is a side that holds at every pose.
    """

    kind: str  # "site" or "geom"
    name: str
    hint: str = ""
    shape: str = ""
    sizes: tuple[float, ...] = ()
    side: bool = False


def read_route(model: mujoco.MjModel, route: str) -> list[Stop]:
    words = [word.strip() for word in route.split(",")]
    if len(words) < 2 or not all(words):
        raise ModelError(f"route '{route}': write at least two stops: {ROUTE_FORMS}")
    stops = [_read_stop(model, word) for word in words]
    spaced = [n for stop in stops for n in (stop.name, stop.hint) if n and n.split() != [n]]
    if spaced:
        raise ModelError(
            f"'{spaced[0]}' contains a space, which tuples of MuJoCo cannot hold: give it another name"
        )
    for stop, what in ((stops[0], "first"), (stops[-1], "last")):
        if stop.kind != "site":
            raise ModelError(f"route '{route}': the {what} stop must be a site, not geom '{stop.name}'")
    return stops


def _read_stop(model: mujoco.MjModel, word: str) -> Stop:
    sites = [n for n in names(model, OBJ.mjOBJ_SITE, model.nsite) if not n.startswith("#")]
    geoms = [n for n in names(model, OBJ.mjOBJ_GEOM, model.ngeom) if not n.startswith("#")]
    kind, mark, bare = word.partition("/")
    if mark and kind in ("site", "geom") and word not in (*sites, *geoms):
        word = bare
    else:
        kind = ""
    if word in sites and word in geoms and not kind:
        raise ModelError(f"'{word}' is a site and a geom: write site/{word} or geom/{word}")
    if kind != "geom" and word in sites:
        return Stop("site", word)
    name, hint, shape, sizes = word, "", "", ()
    if name not in geoms:
        name, _, hint = word.rpartition(":") if ":" in word else (word, "", "")
        name, mark, rest = name.partition("@")
        if mark:
            shape, sizes = _read_shape(word, rest)
    if name not in geoms or kind == "site":
        wanted = {"site": sites, "geom": geoms}.get(kind, [*sites, *geoms])
        what = kind or "site or geom"
        raise ModelError(f"'{word}': the model has no {what} '{name}'{_near(name, wanted, 'there are')}")
    side = hint not in sites and hint.startswith(SIDE)
    hint = hint.removeprefix(SIDE) if side else hint
    if (hint or side) and hint not in sites:
        raise ModelError(
            f"'{word}': the {'side' if side else 'hint'} '{hint}' is not a site{_near(hint, sites, 'sites')}"
        )
    return Stop("geom", name, hint, shape, sizes, side)


def _read_shape(word: str, text: str) -> tuple[str, tuple[float, ...]]:
    if text == FINITE:
        return FINITE, ()
    shape, _, given = text.partition("=")
    if shape not in SHAPES:
        raise ModelError(f"'{word}': no shape '{shape}'; shapes: {listed(SHAPES)}, or {FINITE}")
    wanted = SHAPES[shape]
    try:
        sizes = tuple(float(size) for size in given.split("/"))
    except ValueError:
        sizes = ()
    if not wanted.least <= len(sizes) <= wanted.most:
        raise ModelError(f"'{word}': write {shape}={'/'.join(wanted.meaning.split())} [m]")
    wanted.build(*sizes)  # a GeometryError says what is wrong with the sizes
    return shape, sizes


def _near(name: str, known: Sequence[str], what: str) -> str:
    """Return names like a wrong one for a message, else all of them."""
    return nearest(name, known) or f"; {what}: {listed(known)}"
