"""What a caller chooses for each muscle or coordinate: one number, an array, or numbers by name."""

from __future__ import annotations

import fnmatch
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjwrap import validation
from mjwrap.errors import StateError
from mjwrap.mjcf.names import listed
from mjwrap.text import nearest

Array = NDArray[np.float64]


def positive_by_name(
    given: ArrayLike | Mapping[str, float],
    names: Sequence[str],
    what: str,
    noun: str,
    unbounded: bool = False,
) -> Array:
    """Return a positive number for each name (n,); `StateError` if they are not positive or name what is not there.

    given: one number; (n,) numbers; or a dict of numbers by name or pattern (`*`, `?`), 1 for names that it lacks, a
    later entry overriding earlier ones. what, noun: for messages, "reserves" and "coordinate".
    """
    if isinstance(given, Mapping):
        found = np.ones(len(names))
        for key, value in given.items():
            places = _matching(key, names, what, noun)
            found[places] = validation.positive(value, f"{what}[{key!r}]", StateError, unbounded=unbounded)
        return found
    values = validation.numbers(given, what, StateError)
    if values.shape not in ((), (len(names),)):
        raise StateError(
            f"{what} must be one number, ({len(names)},) numbers, or a dict by {noun}, not {values.shape}"
        )
    found = np.array(np.broadcast_to(values, len(names)))
    good = (found > 0.0) & (np.isfinite(found) | unbounded)
    if not good.all():
        bad = int(np.argmin(good))
        raise StateError(f"{what} of {noun} '{names[bad]}' must be positive, not {found[bad]:g}")
    return found


def _matching(key: object, names: Sequence[str], what: str, noun: str) -> list[int]:
    """Return the places of a name, or of all that match a pattern."""
    validation.instance(key, str, f"a key of {what}", StateError, f"the name of a {noun}, or a pattern")
    assert isinstance(key, str)
    fit = [i for i, name in enumerate(names) if name == key]
    fit = fit or [i for i, name in enumerate(names) if fnmatch.fnmatchcase(name, key)]
    if not fit:
        raise StateError(f"{what}: no {noun} '{key}'{nearest(key, names)}; {noun}s: {listed(names)}")
    return fit


def activation_bounds(given: object, time: Array, names: Sequence[str]) -> tuple[Array, Array]:
    """Return the least and largest activations (T, n) from a pair of numbers, or of arrays (n,) or (T, n)."""
    good = isinstance(given, Sequence | np.ndarray) and not isinstance(given, str | bytes) and len(given) == 2
    validation.require(good, "bounds", "a pair: least and largest activation", given, StateError)
    shape = len(time), len(names)
    pair = []
    for value, which in zip(given, ("least", "largest"), strict=True):  # pyright: ignore[reportArgumentType]
        values = validation.numbers(value, f"bounds: the {which} activation", StateError)
        if values.shape not in ((), shape[1:], shape):
            raise StateError(
                f"bounds: the {which} activation must be one number, {shape[1:]} or {shape}, not {values.shape}"
            )
        whole = np.array(np.broadcast_to(values, shape))
        bad = np.argwhere(~((whole >= 0.0) & (whole <= 1.0)))
        if len(bad):
            t, m = bad[0]
            raise StateError(
                f"bounds: the {which} activation of muscle '{names[m]}' at time {time[t]:g} s must be within "
                f"0 and 1, not {whole[t, m]:g}"
            )
        pair.append(whole)
    low, high = pair
    bad = np.argwhere(low > high)
    if len(bad):
        t, m = bad[0]
        raise StateError(
            f"bounds: the least activation {low[t, m]:g} of muscle '{names[m]}' at time {time[t]:g} s is above "
            f"the largest, {high[t, m]:g}"
        )
    return low, high
