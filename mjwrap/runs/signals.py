"""Signals over time for excitations, controls and prescribed motion: patterns such as "sine:0.3,1", and tables."""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from mjwrap.errors import SignalError
from mjwrap.files import SUFFIXES, Table
from mjwrap.text import nearest

_ELSEWHERE = {  # what tables in OpenSim's names that were given for something else are for
    "/jointset/": "; the motion of joints is prescribed (--prescribe), or a table of states",
    "/forceset/": "; these are muscles: give the table as excitation (--excitation)",
}

Array = NDArray[np.float64]
TURN = 2.0 * math.pi


class Signal(Protocol):
    """A value that changes with time."""

    def value(self, t: float) -> float:
        """Return the value at time t [s]."""
        ...


class SmoothSignal(Signal, Protocol):
    """A signal without jumps, which a joint can follow."""

    def rate(self, t: float) -> float:
        """Return the derivative at time t [1/s]."""
        ...


@dataclass(frozen=True)
class Constant:
    """The same value at all times."""

    level: float

    def value(self, t: float) -> float:
        return self.level

    def rate(self, t: float) -> float:
        return 0.0


@dataclass(frozen=True)
class Step:
    """Zero before `start` [s], `level` from then on."""

    level: float
    start: float

    def value(self, t: float) -> float:
        return self.level if t >= self.start else 0.0


@dataclass(frozen=True)
class Sine:
    """offset + amplitude sin(2π (frequency t + phase)), frequency in Hz, phase in turns."""

    amplitude: float
    frequency: float
    offset: float = 0.0
    phase: float = 0.0

    def value(self, t: float) -> float:
        return self.offset + self.amplitude * math.sin(TURN * (self.frequency * t + self.phase))

    def rate(self, t: float) -> float:
        omega = TURN * self.frequency
        return self.amplitude * omega * math.cos(TURN * (self.frequency * t + self.phase))


@dataclass(frozen=True)
class Pulse:
    """Smooth pulses of height `peak`, one per `period` [s] and half as long; the first begins after `phase` turns."""

    peak: float
    period: float
    phase: float

    def value(self, t: float) -> float:
        turns = t / self.period - self.phase
        wave = math.sin(TURN * turns)
        return self.peak * wave * wave if turns > 0.0 and wave > 0.0 else 0.0


@dataclass(frozen=True)
class Wander:
    """Random levels between 0 and 1, a new one every `hold` [s], joined smoothly; the same `seed`, the same signal."""

    seed: tuple[int, ...]
    hold: float = 0.25

    def value(self, t: float) -> float:
        place = max(t, 0.0) / self.hold
        k = int(place)
        blend = 0.5 - 0.5 * math.cos(math.pi * (place - k))
        return (1.0 - blend) * self._level(k) + blend * self._level(k + 1)

    def _level(self, k: int) -> float:
        digits = ",".join(map(str, (*self.seed, k)))
        # splitmix64 of a checksum: random enough here, and much faster than a new generator for every k
        z = (zlib.crc32(digits.encode()) * 0x9E3779B97F4A7C15 + 0x9E3779B97F4A7C15) % 2**64
        z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) % 2**64
        z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) % 2**64
        return float((z ^ (z >> 31)) >> 11) / 2**53


@dataclass(frozen=True)
class Samples:
    """Values at given times, interpolated linearly; constant before the first and after the last time."""

    times: Array
    values: Array

    def value(self, t: float) -> float:
        return float(np.interp(t, self.times, self.values))


Maker = Callable[[str, int, int], Signal]

# name: form, fewest numbers, most numbers
PATTERNS = {
    "constant": ("constant:LEVEL", 1, 1),
    "step": ("step:LEVEL@TIME", 2, 2),
    "sine": ("sine:AMPLITUDE,HZ[,OFFSET[,PHASE]]", 2, 4),
    "cosine": ("cosine:AMPLITUDE,HZ[,OFFSET[,PHASE]]", 2, 4),
    "pulses": ("pulses[:PEAK[,PERIOD]]", 0, 2),
    "random": ("random[:SEED[,HOLD]]", 0, 2),
}


def pattern_forms() -> str:
    """Return the forms of all patterns, for help and errors."""
    return ", ".join(form for form, _, _ in PATTERNS.values())


def parse_pattern(text: str, seed: int = 0) -> Maker:
    """Return a function (name, index, count) -> `Signal` for a pattern such as "sine:0.3,1,0.5".

    index and count make `pulses` pass through all muscles in turn; the name makes `random` different for each. seed:
    used by `random` without a seed of its own. Raises `SignalError`, which lists the forms, for a wrong pattern.
    """
    kind, _, rest = text.partition(":")
    if kind not in PATTERNS:
        raise SignalError(f"'{text}' is not a pattern{_meant(text)}; patterns: {pattern_forms()}")
    form, fewest, most = PATTERNS[kind]
    parts = rest.replace("@", ",").split(",") if rest else []
    try:
        numbers = [float(part) for part in parts]
    except ValueError:
        raise SignalError(f"'{text}': {rest!r} does not fit {form}") from None
    if not fewest <= len(numbers) <= most or (kind == "step") != ("@" in rest):
        raise SignalError(f"'{text}' does not fit {form}")
    if not all(math.isfinite(x) for x in numbers):
        raise SignalError(f"'{text}': every number must be finite")
    return _maker(text, kind, numbers, seed)


def _maker(text: str, kind: str, numbers: list[float], seed: int) -> Maker:
    if kind == "constant":
        return lambda name, index, count: Constant(numbers[0])
    if kind == "step":
        return lambda name, index, count: Step(numbers[0], numbers[1])
    if kind in ("sine", "cosine"):
        amplitude, frequency, offset, phase = (*numbers, 0.0, 0.0)[:4]
        late = phase + (0.25 if kind == "cosine" else 0.0)
        return lambda name, index, count: Sine(amplitude, frequency, offset, late)
    if kind == "pulses":
        peak, period = (*numbers, *(0.3, 1.0)[len(numbers) :])
        if not period > 0.0:
            raise SignalError(f"'{text}': the period must be positive [s]")
        return lambda name, index, count: Pulse(peak, period, index / max(count, 1))
    chosen, hold = (*numbers, *(float(seed), 0.25)[len(numbers) :])
    if chosen != int(chosen) or chosen < 0:
        raise SignalError(f"'{text}': the seed must be a whole number, 0 or more")
    if not hold > 0.0:
        raise SignalError(f"'{text}': the time between new levels must be positive [s]")
    return lambda name, index, count: Wander((int(chosen), zlib.crc32(name.encode())), hold)


def _meant(text: str) -> str:
    """Return what to write in place of text that is not a pattern, if it is a number, a table or nearly a pattern."""
    try:
        return f"; for a level that stays write constant:{float(text):g}"
    except ValueError:
        if text.lower().endswith(SUFFIXES):
            return (
                "; a table drives the muscles of its columns: write its name alone, without NAME= before it"
            )
        return nearest(text.partition(":")[0], PATTERNS)


def match_columns(table: Table, known: Sequence[str], what: str) -> dict[str, str]:
    """Return, for each column of a table, the name among `known` that it drives.

    A column has this name; or "ctrl:NAME", as in tables of `mjwrap run`, whose columns of other kinds are ignored; or a
    name as in OpenSim: "/forceset/NAME", "NAME.excitation" or "/jointset/JOINT/NAME/value". Raises `SignalError`, which
    lists the known names, for any other column.
    """
    own = [column for column in table.names if column.startswith("ctrl:")]
    found = {column: _known(column, known) for column in own or table.names}
    unknown = [column for column, name in found.items() if name not in known]
    if unknown:
        s = "s" * (len(unknown) != 1)
        other = next((told for mark, told in _ELSEWHERE.items() if unknown[0].startswith(mark)), "")
        raise SignalError(
            f"{table.source}: no {what} for column{s} {', '.join(repr(n) for n in unknown)}; "
            f"there are: {', '.join(known) or 'none'}{other}"
        )
    for column, name in found.items():
        others = [other for other in found if other != column and found[other] == name]
        if others:
            raise SignalError(
                f"{table.source}: columns '{column}' and '{others[0]}' are both {what} '{name}'"
            )
    return found


def _known(column: str, known: Sequence[str]) -> str:
    """Return the known name in a column's name; if there is none, the column's name."""
    short = column.removesuffix(".excitation").removesuffix("/excitation").removesuffix("/value")
    readings = (column, column.removeprefix("ctrl:"), short, short.rpartition("/")[2])
    return next((name for name in readings if name in known), column)
