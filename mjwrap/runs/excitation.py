"""Excitation of muscles and actuators by signals, given as patterns or tables."""

from __future__ import annotations

import fnmatch
import os
from collections.abc import Iterable, Sequence
from typing import Any

from mjwrap.errors import SignalError
from mjwrap.files import SUFFIXES, read_table
from mjwrap.runs.signals import Samples, Signal, match_columns, parse_pattern, pattern_forms
from mjwrap.system import MuscleSystem
from mjwrap.text import nearest


def control_names(model: Any) -> list[str]:
    """Return a name for every entry of ctrl: its actuator's, with a number if the actuator has several controls."""
    found: list[str] = []
    for i in range(model.nactuator):
        name, count = model.actuator(i).name or f"#{i}", int(model.actuator_ctrlnum[i])
        found += [name] if count == 1 else [f"{name}[{k}]" for k in range(count)]
    return found


class Excitation:
    """Signals for the muscles and other actuators of a model.

    Actuators that no entry names keep their control.

    Args:
        muscles: the muscles.
        entries: patterns and tables; a later entry overrides earlier ones. A pattern ("sine:0.3,1,0.4") is for all
            muscles; NAME=PATTERN for the muscles and actuators whose names match NAME (`*` and `?` match any
            characters); the name of a table (.csv, .sto, .mot, .npz) for the muscles and actuators that its columns
            name (`match_columns`).
        seed: seed of the pattern `random`.

    Raises:
        SignalError: an entry is not valid, or matches no muscle or actuator.
    """

    def __init__(self, muscles: MuscleSystem, entries: Sequence[str], seed: int = 0) -> None:
        model: Any = muscles.model
        self._muscles = muscles
        self._seed = seed
        controls = control_names(model)
        self._places: dict[str, tuple[bool, int]] = {name: (True, i) for i, name in enumerate(controls)}
        driven = {int(model.actuator_ctrladr[m.actuator]) for m in muscles.declarations if m.actuator >= 0}
        pulling = [n for i, n in enumerate(controls) if i in driven or n in muscles.native]
        for i, muscle in enumerate(muscles.declarations):
            if muscle.actuator < 0:
                self._places[muscle.name] = (False, i)
                pulling.append(muscle.name)
        self.muscle_names: list[str] = pulling
        self.signals: dict[str, Signal] = {}
        for entry in entries:
            self._read(entry)

    @property
    def names(self) -> list[str]:
        """Names of everything that can be driven: actuators, then muscles without an actuator."""
        return list(self._places)

    def _read(self, entry: str) -> None:
        name, equals, pattern = entry.rpartition("=")  # the name may contain "=", too
        if equals and not os.path.isfile(entry):
            found = [name] if name in self._places else fnmatch.filter(self.names, name)
            if not found:
                known = ", ".join(self.names) or "none"
                raise SignalError(
                    f"'{entry}': no muscle or actuator '{name}'{nearest(name, self.names)}; there are: {known}"
                )
            self._fill(found, pattern)
        elif entry.lower().endswith(SUFFIXES) or os.path.isfile(entry):
            table = read_table(entry)
            for column, driven in match_columns(table, self.names, "muscle or actuator").items():
                self.signals[driven] = Samples(table.time, table[column])
        elif os.sep in entry:
            raise SignalError(f"'{entry}' is neither a file nor a pattern; patterns: {pattern_forms()}")
        else:
            self._fill(self.muscle_names, entry)

    def _fill(self, names: Iterable[str], pattern: str) -> None:
        make = parse_pattern(pattern, self._seed)
        for name in names:
            turn = self.muscle_names.index(name) if name in self.muscle_names else 0
            self.signals[name] = make(name, turn, len(self.muscle_names))

    def write(self, data: Any, *, own: bool = True) -> None:
        """Write the signals' values at `data.time` to `data.ctrl`, and (own) to `muscles.excitation`."""
        t = float(data.time)
        for name, signal in self.signals.items():
            is_actuator, index = self._places[name]
            if is_actuator:
                data.ctrl[index] = signal.value(t)
            elif own:
                self._muscles.excitation[index] = signal.value(t)
