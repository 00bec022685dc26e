"""A comparison as one HTML page: a summary, a table of all muscles, and a section for each muscle.

The page contains its pictures and loads no other file. The template report.html.j2 holds the HTML and escapes every
name; this module computes the values that are filled in.
"""

from __future__ import annotations

import io
import re
from collections.abc import Iterable, Sequence
from typing import Any

import matplotlib.pyplot as plt
import mujoco

import mjwrap
from mjwrap.cli.common.pages import report_template
from mjwrap.cli.compare.plot import COLOURS, draw_motion, draw_sweep
from mjwrap.cli.compare.text import TITLES, millimetres, starred, unlike_routes, where
from mjwrap.comparison import (
    AGREE,
    Jump,
    MotionDifference,
    MuscleSummary,
    Outcome,
    PoseComparison,
    TableDifference,
    Verdict,
)
from mjwrap.files.atomic import PartFile
from mjwrap.text import counted

_RIGHT = {
    "both": "both",
    "mjwrap": "mjwrap",
    "mjwrap in motion": "both; mjwrap in motion",
    "MuJoCo": "MuJoCo",
    "neither": "no path exists",
    "-": "stays with MuJoCo",
}
_PROGRAMS = ("MuJoCo", "mjwrap")


def write_page(
    output: PartFile,
    model: str,
    command: str,
    found: PoseComparison,
    verdicts: dict[str, Verdict],
    motion: MotionDifference | None,
    tables: Sequence[TableDifference] = (),
) -> None:
    """Write the page; command: the command line that makes it again."""
    page = report_template("mjwrap.cli.compare").render(
        model=model,
        command=command,
        versions=f"MuJoCo {mujoco.__version__}, mjwrap {mjwrap.__version__} (side rule {found.side_rule})",
        facts=_facts(found),
        outcomes=[
            {"title": TITLES[o], "colour": COLOURS[o], "poses": found.total(o)}
            for o in Outcome
            if found.total(o)
        ],
        agree=f"{AGREE:g}",
        muscles=[_muscle(s, found, verdicts[name]) for name, s in found.muscles.items()],
        tables=_tables(tables),
        motion=_motion(motion, found.unlike) if motion is not None and motion.difference.size else None,
        left_out=found.left_out,
        counted=counted,
        noun=found.noun(),
        nouns=found.noun(several=True),
    )
    output.write_text(page)


def _facts(found: PoseComparison) -> list[dict[str, object]]:
    """Return the most important numbers, each with what it counts."""
    both = [s for s in found.muscles.values() if not s.native_only]
    equal = sum(s.counts[Outcome.AGREE.name] == s.poses for s in both)
    facts: list[tuple[int, str]] = [
        (len(both), f"{found.noun(several=True)} compared at {found.poses} poses each"),
        (equal, "equal at every pose"),
        (len(both) - equal, "differ at some pose"),
        (len(found.muscles) - len(both), "stay with MuJoCo's own tendon"),
    ]
    for program, paths in (("MuJoCo", "tendons"), ("mjwrap", "paths")):
        jumps = [j for j in found.jumps if j.program == program]
        what = f"jumps of {program}'s {paths} along the sweeps"
        if jumps:
            muscles = found.counted({j.muscle for j in jumps})
            what += f", in {muscles}{starred(jumps)}; the largest is {_largest(jumps)}"
        facts.append((len(jumps), what))
    facts.append((found.at_fault, "poses at which mjwrap is wrong"))
    return [{"number": number, "what": what} for number, what in facts]


def _largest(jumps: Sequence[Jump]) -> str:
    """Return the size of the largest jump as text: in length, or in moment arm if no length jumps."""
    length = max(abs(j.length) for j in jumps)
    arm = max(abs(j.slope) for j in jumps)
    return f"{1e3 * length:.3g} mm" if length else f"{1e3 * arm:.3g} mm of the moment arm"


def _muscle(s: MuscleSummary, found: PoseComparison, verdict: Verdict) -> dict[str, object]:
    """Return the values of one muscle: for its row in the table of all muscles, and for its section."""
    jumps = [jump for jump in found.jumps if jump.muscle == s.name]
    by_program = [[jump for jump in jumps if jump.program == program] for program in _PROGRAMS]
    differs = not s.native_only and s.counts[Outcome.AGREE.name] < s.poses
    drawn = (differs or jumps) and s.curves is not None
    return {
        "name": s.name,
        "anchor": "m-" + re.sub(r"[^A-Za-z0-9_-]", lambda m: f"-{ord(m.group()):x}-", s.name),
        "right": _RIGHT[verdict.right],
        "why": verdict.why,
        "compared": not s.native_only,
        "shares": _shares(s),
        "gaps": [x.difference for x in (s.length, s.velocity, s.moment_arm)],
        "jump_counts": [f"{len(mine)}; largest {_largest(mine)}" if mine else "" for mine in by_program],
        "open": differs or bool(jumps),
        "drawing": _sweep(s, found) if drawn else "",
        "jumps": _jumps(jumps),
        "extremes": _extremes(s) if differs else [],
    }


def _shares(s: MuscleSummary) -> list[dict[str, object]]:
    """Return the share of each outcome in a muscle's poses."""
    return [
        {
            "colour": COLOURS[outcome],
            "percent": 100.0 * count / s.poses,
            "told": f"{TITLES[outcome]}: {count} of {s.poses}",
        }
        for outcome in Outcome
        if (count := s.counts[outcome.name])
    ]


def _jumps(jumps: Iterable[Jump]) -> list[list[str]]:
    return [
        [j.program, j.where, millimetres(j.length), millimetres(-j.slope), j.before, j.after]
        for j in sorted(jumps, key=lambda j: (j.program, -abs(j.length)))
    ]


def _extremes(s: MuscleSummary) -> list[list[str]]:
    rows = []
    for what, unit, extreme in (
        ("length", "m", s.length),
        ("velocity", "m/s", s.velocity),
        ("moment arm", "m/rad", s.moment_arm),
    ):
        about = f" about {extreme.dof}" if extreme.dof else ""
        sign = -1.0 if extreme.dof else 1.0  # a moment arm is −∂l/∂q
        figures = [f"{sign * x:.9g}" for x in (extreme.native, extreme.mjwrap)]
        rows.append([f"{what}{about} [{unit}]", *figures, where(extreme)])
    return rows


def _tables(tables: Sequence[TableDifference]) -> list[list[str]]:
    """Return the rows of the differences from another program's tables, largest first."""
    return [
        [d.muscle, d.program, f"moment arm, {d.about}" if d.about else "length", f"{d.rows}"]
        + [millimetres(x, 4) for x in (d.mean, d.spread, d.largest)]
        + [f"{d.time:g}"]
        for d in sorted(tables, key=lambda d: -d.spread)
    ]


def _motion(motion: MotionDifference, unlike: Sequence[str]) -> dict[str, str]:
    dof, gap, when = motion.worst()
    last, final = motion.final()
    told = (
        f"Over {motion.time[-1]:g} s the largest difference of mjwrap from MuJoCo is {gap:+.3g} {motion.unit(dof)} "
        f"({dof}, at {when:g} s); at the end it is {final:+.3g} {motion.unit(last)} ({last}). {motion.stopped}"
    )
    if unlike:
        told = f"{unlike_routes(unlike)}. {told}"
    figure, pair = plt.subplots(1, 2, figsize=(10.0, 2.8), layout="constrained")
    draw_motion(pair, motion)
    return {"told": told, "paths": motion.paths, "drawing": _svg(figure)}


def _sweep(s: MuscleSummary, found: PoseComparison) -> str:
    figure, pair = plt.subplots(1, 2, figsize=(10.0, 2.5), layout="constrained")
    draw_sweep(pair, s, found)
    return _svg(figure)


def _svg(figure: Any) -> str:
    """Return a figure as SVG with ids that no other figure uses, and close it."""
    text = io.StringIO()
    with plt.rc_context({"svg.fonttype": "none", "svg.hashsalt": "mjwrap"}):
        figure.savefig(text, format="svg", metadata={"Date": None})
    plt.close(figure)
    drawing = text.getvalue()
    return drawing[drawing.index("<svg") :]
