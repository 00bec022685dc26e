"""Validate numbers that a caller gives."""

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


def _number(value: Any) -> float:
    """Return a value as a float, NaN if it is not a number; text is never a number, even "1"."""
    try:
        return math.nan if isinstance(value, str | bytes) else float(value)
    except (TypeError, ValueError):
        return math.nan
