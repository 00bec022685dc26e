"""The report of an import and its verification as text."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from mjwrap.osim.report import APPROXIMATED, EXACT, LEFT_OUT, Entry, Report
from mjwrap.osim.verifying.differences import Verification
from mjwrap.text import counted

SHOWN = 12  # lines of a list that are printed; pages and JSON have all


def tell_entries(report: Report) -> str:
    """Return how many elements are exact, and a line for each that is approximated or left out."""
    kinds: dict[str, int] = {}
    for entry in report.entries:
        if entry.outcome == EXACT:
            kinds[entry.kind] = kinds.get(entry.kind, 0) + 1
    lines = [f"exact:     {', '.join(f'{count} {kind}' for kind, count in kinds.items()) or 'nothing'}"]
    for outcome in (APPROXIMATED, LEFT_OUT):
        chosen = [entry for entry in report.entries if entry.outcome == outcome]
        if chosen:
            lines.append(f"{outcome} ({len(chosen)}):")
            lines += shortened([f"  {entry_text(entry)}" for entry in chosen])
    return "\n".join(lines)


def entry_text(entry: Entry) -> str:
    """Return an entry as a line."""
    size = f" ({entry.size:.3g} {entry.unit})".replace(" )", ")") if math.isfinite(entry.size) else ""
    return f"{entry.kind} '{entry.name}': {entry.text}{size}"


def tell_verification(found: Verification) -> str:
    """Return the table of quantities, and the large differences by their reason."""
    rows = [("compared with OpenSim " + found.reference.opensim, "number", "median", "largest", "where", "")]
    rows += [
        (q.what, str(q.count), f"{q.median:.1e}", f"{q.largest:.1e} {q.unit}".rstrip(), q.worst,
         f"{100.0 * q.share:.4g} % within {q.tight:g}")
        for q in found.quantities
    ]  # fmt: skip
    lines = list(columns(rows))
    reasons: dict[str, list[str]] = {}
    for d in found.differences:
        reasons.setdefault(d.reason, []).append(
            f"{d.what} of {d.name}{'' if d.pose is None else f', pose {d.pose}'}: {d.mjwrap:.6g} {d.unit}, "
            f"OpenSim {d.opensim:.6g} {d.unit}"
        )
    if found.differences:
        count = counted(len(found.differences), "difference")
        lines.append(f"{count} above 1 mm or 1 %, {len(found.unexplained)} not explained:")
        for reason, cases in sorted(reasons.items(), key=lambda item: -len(item[1])):
            lines.append(f"  {reason} ({len(cases)}); for example {cases[0]}")
    lines += [f"not compared: {text}" for text in found.missing]
    return "\n".join(lines)


def columns(rows: Sequence[Sequence[str]]) -> Iterable[str]:
    """Yield the rows of a table with aligned columns."""
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    for row in rows:
        yield "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()


def shortened(lines: list[str]) -> list[str]:
    """Return the first lines, and how many more there are."""
    more = len(lines) - SHOWN
    return lines if more <= 0 else [*lines[:SHOWN], f"  and {more} more: --report and --json list all"]
