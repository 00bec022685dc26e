"""Find tuples, numerics and texts that look like parts of a muscle's declaration, but that nothing reads."""

from __future__ import annotations

import difflib
from collections.abc import Iterator

import mujoco

from mjwrap.checking.mistakes.finding import Mistake, PossibleMistake, quoted
from mjwrap.mjcf import name_of
from mjwrap.mjcf.parameters import LAWS, NUMERICS, TEXTS
from mjwrap.mjcf.wrapping_geoms import SIZES, size_keys

OBJ = mujoco.mjtObj
SIMILAR = 0.8  # least likeness of a misspelt word, as difflib measures it
_USABLE = {
    int(kind)
    for kind in (
        OBJ.mjOBJ_ACTUATOR, OBJ.mjOBJ_TENDON, OBJ.mjOBJ_SITE, OBJ.mjOBJ_GEOM, OBJ.mjOBJ_NUMERIC, OBJ.mjOBJ_TEXT,
        OBJ.mjOBJ_JOINT,
    )
}  # fmt: skip
Elements = list[tuple[int, int]]  # type and id of each


def is_read(model: mujoco.MjModel, index: int) -> bool:
    """Return whether mjwrap reads a tuple."""
    return "mjwrap" in name_of(model, OBJ.mjOBJ_TUPLE, index)


def tuple_elements(model: mujoco.MjModel, index: int) -> Elements:
    """Return the elements of a tuple."""
    first = int(model.tuple_adr[index])
    places = range(first, first + int(model.tuple_size[index]))
    return [(int(model.tuple_objtype[j]), int(model.tuple_objid[j])) for j in places]


def listed_numerics(model: mujoco.MjModel) -> set[int]:
    """Return the numerics that are elements of some tuple."""
    return {
        item
        for index in range(model.ntuple)
        for kind, item in tuple_elements(model, index)
        if kind == int(OBJ.mjOBJ_NUMERIC)
    }


def unread_elements(model: mujoco.MjModel) -> Iterator[PossibleMistake]:
    """Yield a finding for every tuple, numeric and text that seems to be meant for mjwrap."""
    for index in range(model.ntuple):
        if not is_read(model, index) and _looks_declared(model, index):
            name = name_of(model, OBJ.mjOBJ_TUPLE, index)
            yield PossibleMistake(
                Mistake.UNREAD_TUPLE,
                quoted(model, "tuple", index),
                "looks like the declaration of a muscle, but nothing reads it: its name does not contain 'mjwrap'",
                f"call it 'mjwrap_{name}', in small letters",
            )
    listed = listed_numerics(model)
    for index in range(model.nnumeric):
        key = _meant(name_of(model, OBJ.mjOBJ_NUMERIC, index)) if index not in listed else ""
        if key:
            where = "directly after its geom" if key in SIZES else "at the end"
            yield PossibleMistake(
                Mistake.UNREAD_NUMERIC,
                quoted(model, "numeric", index),
                f"is in no tuple, so nothing reads it ({key}?)",
                f"list it in the tuple of its muscle, {where}, with '{key}' in its name",
            )
    texts = {
        item
        for index in range(model.ntuple)
        for kind, item in tuple_elements(model, index)
        if kind == int(OBJ.mjOBJ_TEXT)
    }
    for index in range(model.ntext):
        if index not in texts and _is_our_text(model, index):
            yield PossibleMistake(
                Mistake.UNREAD_TEXT,
                quoted(model, "text", index),
                "is in no tuple, so nothing reads it",
                f"list it in the tuple of its muscle, with one of these in its name: {', '.join(TEXTS)}",
            )


def _looks_declared(model: mujoco.MjModel, index: int) -> bool:
    """Return whether a tuple has what a declaration has: a route with a geom, a parameter, or a name like "mjwrap"."""
    elements = tuple_elements(model, index)
    if not elements or any(kind not in _USABLE for kind, _ in elements):
        return False
    name = name_of(model, OBJ.mjOBJ_TUPLE, index).lower()
    windows = (name[i : i + n] for n in (6, 7) for i in range(max(len(name) - n + 1, 1)))
    if any(_likeness(part, "mjwrap") >= SIMILAR for part in windows):
        return True
    numerics = [
        name_of(model, OBJ.mjOBJ_NUMERIC, item) for kind, item in elements if kind == int(OBJ.mjOBJ_NUMERIC)
    ]
    if any(key in numeric for numeric in numerics for key in (*NUMERICS, *SIZES)):
        return True
    route = [kind for kind, _ in elements if kind in (int(OBJ.mjOBJ_SITE), int(OBJ.mjOBJ_GEOM))]
    return int(OBJ.mjOBJ_GEOM) in route[1:-1] and route[0] == route[-1] == int(OBJ.mjOBJ_SITE)


def _meant(name: str) -> str:
    """Return the parameter or shape that the name of a numeric contains or nearly contains, else ""."""
    exact = [*size_keys(name), *(key for key in NUMERICS if key in name)]
    if exact:
        return exact[0]
    words = name.lower().split("_")
    best, found = SIMILAR, ""
    for key in (*NUMERICS, *SIZES):
        count = key.count("_") + 1
        parts = (
            "_".join(words[i : i + n])
            for n in (count - 1, count, count + 1)
            for i in range(len(words) - n + 1)
            if n > 0
        )
        for part in parts:
            if _likeness(part, key) >= best:
                best, found = _likeness(part, key), key
    return found or ("a parameter or size" if "mjwrap" in name.lower() else "")


def _is_our_text(model: mujoco.MjModel, index: int) -> bool:
    first, count = int(model.text_adr[index]), int(model.text_size[index])
    words = bytes(model.text_data[first : first + count]).split(b"\0", 1)[0].decode(errors="replace").strip()
    return "mjwrap" in name_of(model, OBJ.mjOBJ_TEXT, index).lower() or words in LAWS


def _likeness(one: str, other: str) -> float:
    return difflib.SequenceMatcher(None, one, other).ratio()
