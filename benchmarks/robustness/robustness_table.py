"""The counts of robustness.py, and its table."""

from __future__ import annotations

import collections
import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mjwrap.text import aligned

REFUSALS = ("OUT_OF_RANGE", "NO_GEODESIC")  # no path of that kind exists, says the solver
PEERS = """\
CableSpan (C++, measured on the same machine): of cold starts on mixed scenes 8 to 10 % do not converge, and nothing
says so; folded paths, a longest path over a sphere (0.33915 m for a minimum of 0.30562 m) and a path of 28,792 m round
a cylinder of 0.036 m count as converged; end points inside a surface throw."""


@dataclass
class Tally:
    """What happened in the scenes of one class with one kind of hints."""

    scenes: int = 0
    status: collections.Counter[str] = field(default_factory=collections.Counter)
    exceptions: int = 0
    not_finite: int = 0
    refuted: int = 0
    folded: int = 0
    penetrating: int = 0
    compared: int = 0
    searched: int = 0
    shaken: int = 0
    longer: int = 0
    refused_wrongly: int = 0
    evaluations: list[int] = field(default_factory=list)
    microseconds: list[float] = field(default_factory=list)

    def add(self, other: Tally) -> None:
        """Add the counts of another tally of the same class."""
        for name, value in vars(other).items():
            setattr(self, name, getattr(self, name) + value)

    @property
    def lost(self) -> int:
        """Scenes that ended without a path, those left out in which the solver says that there is none."""
        found = self.status["CONVERGED"] + sum(self.status[name] for name in REFUSALS)
        return self.scenes - found

    @property
    def wrong(self) -> int:
        """Claims that are not true."""
        return self.refuted + self.exceptions + self.not_finite

    def numbers(self) -> dict[str, Any]:
        """Return what is printed and saved."""
        return {
            "scenes": self.scenes,
            **{
                name: getattr(self, name)
                for name in ("exceptions", "not_finite", "refuted", "folded", "penetrating")
            },
            "status": dict(self.status),
            "not_converged": self.lost,
            "refused": sum(self.status[name] for name in REFUSALS),
            **{
                name: getattr(self, name)
                for name in ("refused_wrongly", "longer", "compared", "searched", "shaken")
            },
            "evaluations_median": float(np.median(self.evaluations)) if self.evaluations else math.nan,
            "evaluations_most": max(self.evaluations, default=0),
            "us_median": float(np.median(self.microseconds)) if self.microseconds else math.nan,
            "us_p95": float(np.percentile(self.microseconds, 95)) if self.microseconds else math.nan,
        }


COLUMNS = (
    "class",
    "hints",
    "scenes",
    "not converged",
    "no path exists",
    "refuted",
    "folded",
    "penetrating",
    "raised",
    "NaN",
    "longer",
    "evaluations",
    "µs",
)
WORDS = (0, 1)  # columns that hold no numbers


def row_of(name: str, hints: str, numbers: dict[str, Any]) -> list[str]:
    """Return the cells of one line of the table."""
    lost, scenes = numbers["not_converged"], numbers["scenes"]
    share = f"{lost} ({100 * lost / scenes:.2g} %)" if lost else "0"
    refused = str(numbers["refused"])
    if numbers["refused_wrongly"]:
        refused += f" ({numbers['refused_wrongly']} do)"
    longer = f"{numbers['longer']} of {numbers['compared']}" if hints == "none" else "-"
    return [
        name,
        hints,
        str(scenes),
        share,
        refused,
        *(str(numbers[key]) for key in ("refuted", "folded", "penetrating", "exceptions", "not_finite")),
        longer,
        f"{numbers['evaluations_median']:.0f}, {numbers['evaluations_most']}",
        f"{numbers['us_median']:.0f}, {numbers['us_p95']:.0f}",
    ]


def table(results: dict[str, dict[str, dict]], markdown: bool) -> str:
    """Return the table of all classes as text, or as Markdown."""
    rows = [row_of(name, kind, numbers) for name, kinds in results.items() for kind, numbers in kinds.items()]
    if markdown:
        rule = ["---" if i in WORDS else "---:" for i in range(len(COLUMNS))]
        return "\n".join("| " + " | ".join(cells) + " |" for cells in (COLUMNS, rule, *rows))
    return "\n".join(aligned([COLUMNS, *rows], WORDS))


NOTES = """\
not converged: no path and no reason why there is none; no path exists: OUT_OF_RANGE or NO_GEODESIC (in brackets: a path
is known all the same); longer: without hints, than the shortest of all other paths known for the scene, by more than
1e-6; evaluations (median, most): of all residuals at once; µs (median, 95 %): solve_path with its checks in Python."""
