"""The report of an import: what became of every element of an .osim file."""

from __future__ import annotations

from dataclasses import dataclass, field

EXACT, APPROXIMATED, LEFT_OUT = "exact", "approximated", "left out"


@dataclass(frozen=True)
class Entry:
    """What became of one element: `outcome` is exact, approximated or left out; `text` says how, or why not.

    size: the largest effect of an approximation, with its unit in `unit`; NaN where it was not measured.
    """

    kind: str  # the class in the file
    name: str
    outcome: str
    text: str = ""
    size: float = float("nan")
    unit: str = ""


@dataclass
class Report:
    """The entries of an import, in the order of the file."""

    model: str
    version: int
    entries: list[Entry] = field(default_factory=list)

    def add(
        self, kind: str, name: str, outcome: str, text: str = "", size: float = float("nan"), unit: str = ""
    ) -> None:
        """Add an entry; see `Entry`."""
        self.entries.append(Entry(kind, name, outcome, text, size, unit))

    def counted(self) -> dict[tuple[str, str], int]:
        """Return how many elements of each kind have each outcome."""
        counts: dict[tuple[str, str], int] = {}
        for entry in self.entries:
            key = entry.kind, entry.outcome
            counts[key] = counts.get(key, 0) + 1
        return counts
