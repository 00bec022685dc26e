"""Numbers that a caller gives: whether they can be used, and the error to raise where they cannot."""

from __future__ import annotations

import math
from typing import Any

from mjwrap.errors import MjwrapError


def is_positive(value: object) -> bool:
    """Return whether a value is a finite number above zero."""
    return _number(value) > 0.0 and math.isfinite(_number(value))


def positive(
    value: Any, name: str, error: type[MjwrapError], unit: str = "", unbounded: bool = False
) -> float:
    """Return `value` as a float; raise `error` unless it is positive and, if not `unbounded`, finite.

    name: of the value, as the message begins; unit: in the message, such as "m".
    """
    number = _number(value)
    if not (number > 0.0 and (unbounded or math.isfinite(number))):
        wanted = "positive" if unbounded else "finite and positive"
        raise error(f"{name} must be {wanted}{f' [{unit}]' * bool(unit)}, not {value!r}")
    return number


def not_negative(value: Any, name: str, error: type[MjwrapError], unit: str = "") -> float:
    """Return `value` as a float; raise `error` unless it is finite and zero or more. Arguments as of `positive`."""
    number = _number(value)
    if not 0.0 <= number < math.inf:
        raise error(f"{name} must be finite and >= 0{f' [{unit}]' * bool(unit)}, not {value!r}")
    return number


def _number(value: Any) -> float:
    """Return a value as a float, NaN where it is no number: text is none, whatever it says."""
    try:
        return math.nan if isinstance(value, str | bytes) else float(value)
    except (TypeError, ValueError):
        return math.nan
