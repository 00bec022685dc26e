"""Tables of excitations and motions that do not cover the whole run."""

from __future__ import annotations

import os
from collections.abc import Iterable

from mjwrap.files import read_table


def uncovered(entries: Iterable[str], duration: float, timestep: float) -> str:
    """Return, as a sentence, which tables begin after or end before a run of `duration` [s]; empty if none.

    entries: as for `Excitation` and `PrescribedMotion`; those that are not files are patterns, which never end.
    """
    early, late = [], []
    for entry in dict.fromkeys(entry for entry in entries if os.path.isfile(entry)):
        time = read_table(entry).time
        if time[-1] < duration - 1.5 * timestep:
            early.append(f"'{entry}' at {time[-1]:g} s")
        if time[0] > 1.5 * timestep:
            late.append(f"'{entry}' at {time[0]:g} s")
    told = []
    if early:
        held = f"table ends before the run ({duration:g} s), its last values are held from then on"
        told.append(f"{held}: {', '.join(early)}")
    if late:
        told.append(
            f"table begins later than the run, its first values are held until then: {', '.join(late)}"
        )
    return "; ".join(told)
