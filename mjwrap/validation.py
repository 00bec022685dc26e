"""Validate what a caller gives: a wrong type or value is an error that names the argument and what it must be."""

from __future__ import annotations

import math
import os
from collections.abc import Collection, Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjwrap.errors import MjwrapError


def is_positive(value: object) -> bool:
    """Return whether a value is a finite number above zero."""
    return _number(value) > 0.0 and math.isfinite(_number(value))


def positive(
    value: Any, name: str, error: type[MjwrapError], unit: str = "", unbounded: bool = False
) -> float:
    """Return `value` as a float; raise `error` unless it is positive and, if not `unbounded`, finite.

    name: beginning of the message, which names the value; unit: for the message, such as "m".
    """
    number = _number(value)
    if not (number > 0.0 and (unbounded or math.isfinite(number))):
        wanted = "positive" if unbounded else "finite and positive"
        raise error(f"{name} must be {wanted}{f' [{unit}]' * bool(unit)}, not {value!r}")
    return number


def not_negative(value: Any, name: str, error: type[MjwrapError], unit: str = "") -> float:
    """Return `value` as a float; raise `error` unless it is finite and zero or more. Arguments as for `positive`."""
    number = _number(value)
    if not 0.0 <= number < math.inf:
        raise error(f"{name} must be finite and >= 0{f' [{unit}]' * bool(unit)}, not {value!r}")
    return number


def is_finite(value: object) -> bool:
    """Return whether a value is a finite number; text is none, even "1"."""
    return math.isfinite(_number(value))


def is_number(value: object) -> bool:
    """Return whether a value is a number, of whatever size; text is none, even "1"."""
    return not math.isnan(_number(value)) or isinstance(value, float | np.floating)


def _number(value: Any) -> float:
    """Return a value as a float, NaN if it is not a number; text is never a number, even "1"."""
    try:
        return math.nan if isinstance(value, str | bytes) else float(value)
    except (TypeError, ValueError):
        return math.nan


def described(value: object) -> str:
    """Return a value for a message: a number or a short text as it is, anything else by its type."""
    if value is None or isinstance(value, bool | int | float | str | bytes | os.PathLike):
        shown = repr(value)
        return shown if len(shown) <= 60 else f"{shown[:57]}..."
    if isinstance(value, type):
        return f"the class {value.__name__}"
    shape = getattr(value, "shape", None)
    if isinstance(shape, tuple):
        return f"an array of shape {shape}"
    name = type(value).__name__
    return f"{'an' if name[0] in 'AEIOU' or name.startswith('Mj') else 'a'} {name}"


def require(good: object, name: str, wanted: str, value: object, error: type[MjwrapError]) -> None:
    """Raise `error` unless `good`: "NAME must be WANTED, not VALUE"."""
    if not good:
        raise error(f"{name} must be {wanted}, not {described(value)}")


def instance(value: object, kind: Any, name: str, error: type[MjwrapError], wanted: str) -> None:
    """Raise `error` unless a value is an instance of a class, or of one of several."""
    require(isinstance(value, kind), name, wanted, value, error)


def optional(value: object, kind: Any, name: str, error: type[MjwrapError], wanted: str) -> None:
    """Raise `error` unless a value is None or an instance of a class, or of one of several."""
    require(value is None or isinstance(value, kind), name, f"{wanted}, or None", value, error)


def flag(value: object, name: str, error: type[MjwrapError]) -> None:
    """Raise `error` unless a value is true or false; 0 and 1 count, and NumPy's own truth values."""
    good = isinstance(value, bool | int | np.bool_) and value in (0, 1)
    require(good, name, "True or False", value, error)


def choice(value: object, known: Iterable[str], name: str, error: type[MjwrapError]) -> None:
    """Raise `error`, which lists them, unless a value is one of the known names."""
    names = list(known)
    good = isinstance(value, str) and value in names
    require(good, name, f"one of {', '.join(names)}", value, error)


def between(value: Any, low: float, high: float, name: str, error: type[MjwrapError], wanted: str) -> float:
    """Return `value` as a float; raise `error` unless low <= value < high."""
    number = _number(value)
    require(low <= number < high, name, wanted, value, error)
    return number


def finite(value: Any, name: str, error: type[MjwrapError]) -> float:
    """Return `value` as a float; raise `error` unless it is a finite number."""
    number = _number(value)
    require(is_finite(value), name, "a finite number", value, error)
    return number


def whole(value: Any, least: int, name: str, error: type[MjwrapError]) -> int:
    """Return `value` as an int; raise `error` unless it is a whole number of at least `least`."""
    number = _number(value)
    good = math.isfinite(number) and number == int(number) and number >= least
    require(good, name, f"a whole number, at least {least}", value, error)
    return int(number)


def numbers(value: Any, name: str, error: type[MjwrapError]) -> NDArray[np.float64]:
    """Return `value` as an array of any shape; raise `error` unless it consists of numbers."""
    if not isinstance(value, str | bytes):
        try:
            return np.asarray(value, dtype=np.float64)
        except (TypeError, ValueError):
            pass
    require(False, name, "an array of numbers", value, error)
    raise AssertionError


def several(value: Any, count: int, name: str, error: type[MjwrapError]) -> tuple[float, ...]:
    """Return `value` as a tuple of floats; raise `error` unless it is `count` numbers."""
    found = numbers(value, name, error)
    require(found.shape == (count,), name, f"{count} numbers", value, error)
    return tuple(found.tolist())


def sequence(value: Any, name: str, error: type[MjwrapError], wanted: str) -> None:
    """Raise `error` unless a value is a list, a tuple, an array or another collection, but not text or a dict."""
    good = (
        isinstance(value, Collection)
        and not isinstance(value, Mapping)
        and not isinstance(value, str | bytes)
    )
    require(good, name, wanted, value, error)


# What to do with another of MuJoCo's objects, or with a file, in place of the one that is wanted.
_REMEDIES = {
    ("MjModel", "MjSpec"): "compile it: spec.compile()",
    ("MjModel", "file"): "load it: mujoco.MjModel.from_xml_path(path), or mw.load(path)",
    ("MjModel", "MjData"): "give the model of this data",
    ("MjModel", "MuscleSystem"): "give its model: muscles.model",
    ("MjSpec", "MjModel"): "a compiled model cannot be changed; open its file: mujoco.MjSpec.from_file(path)",
    ("MjSpec", "file"): "open it: mujoco.MjSpec.from_file(path), or mw.load(path)",
    ("MjData", "MjModel"): "make the data of a model: mujoco.MjData(model)",
    ("MuscleSystem", "MjModel"): "make one: mw.MuscleSystem(model)",
    ("MuscleSystem", "MjSpec"): "make one: mw.MuscleSystem(spec.compile())",
    ("MuscleSystem", "file"): "load it: mw.MuscleSystem(mujoco.MjModel.from_xml_path(path))",
}
_ARTICLES = {
    "MjModel": "an MjModel",
    "MjSpec": "an MjSpec",
    "MjData": "an MjData",
    "MuscleSystem": "a MuscleSystem",
}


def of_type(value: object, wanted: str, name: str, error: type[MjwrapError]) -> None:
    """Raise `error` unless a value is an MjModel, MjSpec, MjData or MuscleSystem; with what to do with what was given.

    wanted: the name of the class. Types are told by name, so that MuJoCo is not needed for it.
    """
    kinds = {each.__name__ for each in type(value).__mro__}
    if wanted in kinds:
        return
    given = "file" if isinstance(value, str | os.PathLike) else next((k for k in _ARTICLES if k in kinds), "")
    remedy = _REMEDIES.get((wanted, given), "")
    shown = _ARTICLES.get(given) or described(value)
    raise error(f"{name}: expected {_ARTICLES[wanted]}, not {shown}{'; ' * bool(remedy)}{remedy}")
