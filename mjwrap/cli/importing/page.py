"""The report of an import as one HTML page; the template report.html.j2 holds the HTML and escapes every name."""

from __future__ import annotations

import math
from pathlib import Path

import mujoco

import mjwrap
from mjwrap.cli.common.pages import report_template
from mjwrap.files.atomic import PartFile
from mjwrap.osim.report import APPROXIMATED, EXACT, LEFT_OUT, Entry, Report
from mjwrap.osim.verifying.differences import UNEXPLAINED, Verification

_OUTCOMES = (EXACT, APPROXIMATED, LEFT_OUT)


def write_page(
    output: PartFile, model: str, command: str, report: Report, found: Verification | None
) -> None:
    """Write the page; command: the command line that makes it again."""
    counts = report.counted()
    kinds = list(dict.fromkeys(kind for kind, _ in counts))
    page = report_template("mjwrap.cli.importing").render(
        model=Path(model).name,
        command=command,
        versions=f"MuJoCo {mujoco.__version__}, mjwrap {mjwrap.__version__}",
        version=report.version,
        outcomes=_OUTCOMES,
        totals=[(o, sum(n for (_, outcome), n in counts.items() if outcome == o)) for o in _OUTCOMES],
        kinds=[(kind, [counts.get((kind, o), 0) for o in _OUTCOMES]) for kind in kinds],
        sections=[(o, [_entry(e) for e in report.entries if e.outcome == o]) for o in (LEFT_OUT, APPROXIMATED, EXACT)],
        verification=_verification(found) if found is not None else None,
    )  # fmt: skip
    output.write_text(page)


def _entry(entry: Entry) -> list[str]:
    size = f"{entry.size:.3g} {entry.unit}".rstrip() if math.isfinite(entry.size) else ""
    return [entry.kind, entry.name, entry.text, size]


def _verification(found: Verification) -> dict[str, object]:
    """Return the values of the part about OpenSim."""
    differences = sorted(
        found.differences, key=lambda d: (not d.reason.startswith(UNEXPLAINED), d.reason, d.name, d.pose or 0)
    )
    return {
        "opensim": found.reference.opensim,
        "poses": len(found.reference.poses),
        "quantities": [
            [q.what, str(q.count), f"{q.median:.1e}", f"{q.largest:.1e} {q.unit}".rstrip(), q.worst,
             f"{100.0 * q.share:.4g} % within {q.tight:g}"]
            for q in found.quantities
        ],
        "differences": [
            [d.what, d.name, "" if d.pose is None else str(d.pose), f"{d.opensim:.6g}", f"{d.mjwrap:.6g}",
             f"{d.mjwrap - d.opensim:+.3g} {d.unit}", d.reason]
            for d in differences
        ],
        "unexplained": len(found.unexplained),
        "missing": found.missing,
    }  # fmt: skip
