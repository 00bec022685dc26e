"""A comparison as one HTML page: what it found in short, a table of all muscles, and a section for each that differs.

The page stands alone: its pictures are inside, and it loads nothing.
"""

from __future__ import annotations

import html
import io
import re
from collections.abc import Iterable, Sequence
from typing import Any

import matplotlib.pyplot as plt
import mujoco

import mjwrap
from mjwrap.cli.compare.plot import COLOURS, draw_motion, draw_sweep
from mjwrap.cli.compare.text import TITLES, millimetres, starred, where
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

_STYLE = """
:root { color-scheme: light dark; --line: #8884; --soft: #8881; }
body { font: 15px/1.45 system-ui, sans-serif; margin: 2rem auto; max-width: 84rem; padding: 0 1rem; }
h1 { font-size: 1.5rem; margin-bottom: .2rem; } h2 { margin-top: 2.2rem; font-size: 1.2rem; }
code { font-size: .9em; overflow-wrap: anywhere; }
table { border-collapse: collapse; font-size: .86rem; font-variant-numeric: tabular-nums; }
th, td { padding: .22rem .55rem; text-align: right; border-bottom: 1px solid var(--line); vertical-align: top; }
th { vertical-align: bottom; } td { white-space: nowrap; }
td.text, th.text { text-align: left; } details td.text { white-space: normal; }
.scroll { overflow-x: auto; } .facts { display: flex; flex-wrap: wrap; gap: .8rem; margin: 1rem 0; }
.fact { background: var(--soft); border-radius: .5rem; padding: .5rem .9rem; }
.fact b { font-size: 1.35rem; display: block; }
.bar { display: flex; width: 9rem; height: .8rem; border-radius: .2rem; overflow: hidden; }
.bar span { min-width: .3rem; }
.spot { display: inline-block; width: .8rem; height: .8rem; margin-right: .4rem; }
ul.key { list-style: none; padding: 0; margin: .5rem 0; display: flex; flex-wrap: wrap; gap: .2rem 1.4rem; }
details { border: 1px solid var(--line); border-radius: .5rem; margin: .5rem 0; padding: .3rem .9rem; }
summary { cursor: pointer; padding: .25rem 0; } .dim { opacity: .7; }
figure { margin: .6rem 0; background: #fff; border-radius: .4rem; padding: .4rem; }
svg { max-width: 100%; height: auto; }
"""
_RIGHT = {
    "both": "both",
    "mjwrap": "mjwrap",
    "mjwrap in motion": "both; in motion mjwrap",
    "MuJoCo": "MuJoCo",
    "neither": "no path exists",
    "-": "stays native",
}


def write_page(
    output: PartFile,
    model: str,
    command: str,
    found: PoseComparison,
    verdicts: dict[str, Verdict],
    motion: MotionDifference | None,
    tables: Sequence[TableDifference] = (),
) -> None:
    """Write the page and give the file its name; command: the line that makes it again."""
    versions = f"MuJoCo {mujoco.__version__}, mjwrap {mjwrap.__version__}"
    parts = [
        f"<h1>{_text(model)}: MuJoCo's tendons and mjwrap's paths</h1>",
        f"<p class='dim'>{versions}. Made by <code>{_text(command)}</code></p>",
        _facts(found, verdicts),
        "<h2>All muscles</h2>",
        _key(found),
        _muscles(found, verdicts),
    ]
    if tables:
        parts += ["<h2>Beside the given tables</h2>", _tables(tables)]
    if motion is not None and motion.difference.size:
        parts += ["<h2>Motion of both with the same controls</h2>", _motion(motion)]
    parts += ["<h2>Muscle by muscle</h2>", _details(found, verdicts), _left_out(found)]
    page = (
        "<!doctype html><html lang='en'><head><meta charset='utf-8'><meta name='viewport' content='width=device-width'>"
        f"<title>{_text(model)}: comparison</title><style>{_STYLE}</style></head><body>{''.join(parts)}</body></html>\n"
    )
    with output.writing():
        output.part.write_text(page, encoding="utf-8")
    output.publish()


def _text(words: object) -> str:
    return html.escape(str(words), quote=True)


def _facts(found: PoseComparison, verdicts: dict[str, Verdict]) -> str:
    """Return the figures that say most, each in its box."""
    both = [s for s in found.muscles.values() if not s.native_only]
    equal = sum(s.counts[Outcome.AGREE.name] == s.poses for s in both)
    jumps = {p: [j for j in found.jumps if j.program == p] for p in ("MuJoCo", "mjwrap")}
    entries = [
        (f"{len(both)}", f"muscles compared at {found.poses} poses each"),
        (f"{equal}", "equal at every pose"),
        (f"{len(both) - equal}", "differ somewhere"),
        (f"{len(found.muscles) - len(both)}", "stay with MuJoCo's own tendon"),
        (_count(jumps["MuJoCo"]), f"jumps of MuJoCo's tendons along the sweeps{starred(jumps['MuJoCo'])}"),
        (_count(jumps["mjwrap"]), f"jumps of mjwrap's paths along the sweeps{starred(jumps['mjwrap'])}"),
        (f"{found.at_fault}", "poses at which mjwrap is at fault"),
    ]
    return (
        "<div class='facts'>"
        + "".join(f"<div class='fact'><b>{n}</b>{_text(what)}</div>" for n, what in entries)
        + "</div>"
    )


def _count(jumps: list[Jump]) -> str:
    """Return how many jumps there are, of how many muscles, and the largest."""
    if not jumps:
        return "0"
    return f"{len(jumps)} <small>of {counted(len({j.muscle for j in jumps}), 'muscle')}, {_largest(jumps)}</small>"


def _largest(jumps: Sequence[Jump]) -> str:
    """Say how large the largest of these jumps is: in length, or in moment arm where no length jumps."""
    length = max(abs(j.length) for j in jumps)
    arm = max(abs(j.slope) for j in jumps)
    return f"to {1e3 * length:.3g} mm" if length else f"arm only, to {1e3 * arm:.3g} mm"


def _table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table; a head that begins with < stands over text, at the left. The cells are HTML."""
    kinds = [" class='text'" if head.startswith("<") else "" for head in heads]
    top = "".join(
        f"<th{kind}>{_text(head.lstrip('<'))}</th>" for kind, head in zip(kinds, heads, strict=True)
    )
    body = "".join(
        f"<tr>{''.join(f'<td{kind}>{cell}</td>' for kind, cell in zip(kinds, row, strict=True))}</tr>"
        for row in rows
    )
    return f"<div class='scroll'><table><tr>{top}</tr>{body}</table></div>"


def _muscles(found: PoseComparison, verdicts: dict[str, Verdict]) -> str:
    """Return the table of all muscles: who is right, shares of outcomes, the largest differences, jumps."""

    def row(name: str, s: MuscleSummary) -> list[str]:
        cells = [f"<a href='#{_anchor(name)}'>{_text(name)}</a>", _RIGHT[verdicts[name].right]]
        gaps = [f"{x.difference:.1e}" for x in (s.length, s.velocity, s.moment_arm)]
        cells += ["", "", "", ""] if s.native_only else [_bar(s), *gaps]
        for program in ("MuJoCo", "mjwrap"):
            mine = [j for j in found.jumps if j.program == program and j.muscle == name]
            cells.append(f"{len(mine)}, {_largest(mine)}" if mine else "")
        return cells

    heads = (
        "<muscle", "<right", "<outcomes", "largest difference: length [m]", "velocity [m/s]", "moment arm [m/rad]",
        "jumps of MuJoCo", "jumps of mjwrap",
    )  # fmt: skip
    return _table(heads, [row(name, s) for name, s in found.muscles.items()])


def _tables(tables: Sequence[TableDifference]) -> str:
    """Return the table of differences from another program's tables."""
    heads = (
        "<muscle",
        "<program",
        "<quantity",
        "rows",
        "mean [mm]",
        "rms without the mean [mm]",
        "largest [mm]",
        "at [s]",
    )
    rows = [
        [_text(d.muscle), d.program, _text(f"moment arm, {d.about}" if d.about else "length"), f"{d.rows}"]
        + [millimetres(x, 4) for x in (d.mean, d.spread, d.largest)]
        + [f"{d.time:g}"]
        for d in sorted(tables, key=lambda d: -d.spread)
    ]
    return f"<p>Program minus table.</p>{_table(heads, rows)}"


def _bar(s: MuscleSummary) -> str:
    """Return the shares of a muscle's outcomes as a bar."""
    pieces, told = [], []
    for outcome in Outcome:
        count = s.counts[outcome.name]
        if count:
            pieces.append(
                f"<span style='background:{COLOURS[outcome]};width:{100.0 * count / s.poses:.3f}%'></span>"
            )
            told.append(f"{TITLES[outcome]}: {count} of {s.poses}")
    return f"<div class='bar' title='{_text('; '.join(told))}'>{''.join(pieces)}</div>"


def _details(found: PoseComparison, verdicts: dict[str, Verdict]) -> str:
    """Return a section for every muscle, open where the two differ."""
    parts = []
    for name, s in found.muscles.items():
        jumps = [jump for jump in found.jumps if jump.muscle == name]
        differs = not s.native_only and s.counts[Outcome.AGREE.name] < s.poses
        body = [f"<p>{_text(verdicts[name].why)}</p>"]
        if (differs or jumps) and s.curves is not None:
            body.append(_sweep(s, found))
        if jumps:
            body.append(_jumps(jumps))
        if differs:
            body.append(_extremes(s))
        right = _RIGHT[verdicts[name].right]
        told = counted(len(jumps), "jump") if jumps else ""
        head = f"<b>{_text(name)}</b> <span class='dim'>{_text(right)}{', ' + told if told else ''}</span>"
        opened = " open" if differs or jumps else ""
        parts.append(
            f"<details id='{_anchor(name)}'{opened}><summary>{head}</summary>{''.join(body)}</details>"
        )
    return "".join(parts)


def _anchor(name: str) -> str:
    return "m-" + re.sub(r"[^A-Za-z0-9_-]", lambda m: f"-{ord(m.group()):x}-", name)


def _sweep(s: MuscleSummary, found: PoseComparison) -> str:
    figure, pair = plt.subplots(1, 2, figsize=(10.0, 2.5), layout="constrained")
    draw_sweep(pair, s, found)
    return _drawn(figure)


def _motion(motion: MotionDifference) -> str:
    dof, gap, when = motion.worst()
    last, final = motion.final()
    told = (
        f"Over {motion.time[-1]:g} s mjwrap differs most from MuJoCo by {gap:+.3g} ({dof}, at {when:g} s), at "
        f"the end {final:+.3g} ({last}) [rad, m]. {motion.stopped}"
    )
    lost = f"<p>No path, so that the last good force was held:</p><pre>{_text(motion.paths)}</pre>"
    figure, pair = plt.subplots(1, 2, figsize=(10.0, 2.8), layout="constrained")
    draw_motion(pair, motion)
    return f"<p>{_text(told)}</p>{lost if motion.paths else ''}{_drawn(figure)}"


def _drawn(figure: Any) -> str:
    """Return a figure as SVG, its ids made its own, and close it."""
    text = io.StringIO()
    with plt.rc_context({"svg.fonttype": "none", "svg.hashsalt": "mjwrap"}):
        figure.savefig(text, format="svg", metadata={"Date": None})
    plt.close(figure)
    drawing = text.getvalue()
    drawing = drawing[drawing.index("<svg") :]
    return f"<figure>{drawing}</figure>"


def _jumps(jumps: Sequence[Jump]) -> str:
    return _table(
        ("<jump of", "<at", "length [mm]", "moment arm [mm]", "<before", "<after"),
        [
            [_text(j.program), _text(j.where), millimetres(j.length), millimetres(-j.slope),
             _text(j.before), _text(j.after)]
            for j in sorted(jumps, key=lambda j: (j.program, -abs(j.length)))
        ],
    )  # fmt: skip


def _extremes(s: MuscleSummary) -> str:
    rows = []
    for what, unit, extreme in (
        ("length", "m", s.length),
        ("velocity", "m/s", s.velocity),
        ("moment arm", "m/rad", s.moment_arm),
    ):
        about = f" about {extreme.dof}" if extreme.dof else ""
        sign = -1.0 if extreme.dof else 1.0  # a moment arm is −∂l/∂q
        figures = [f"{sign * x:.9g}" for x in (extreme.native, extreme.mjwrap)]
        rows.append([f"{what}{_text(about)} [{unit}]", *figures, _text(where(extreme))])
    return _table(("<largest difference in", "MuJoCo", "mjwrap", "<at"), rows)


def _left_out(found: PoseComparison) -> str:
    if not found.left_out:
        return ""
    items = "".join(f"<li>{_text(name)}: {_text(why)}</li>" for name, why in found.left_out.items())
    return f"<h2>Not compared</h2><ul>{items}</ul>"


def _key(found: PoseComparison) -> str:
    """Return what the colours mean, of the outcomes that were seen."""
    spots = "".join(
        f"<li><span class='spot' style='background:{COLOURS[o]}'></span>{TITLES[o]}: {found.total(o)}</li>"
        for o in Outcome
        if found.total(o)
    )
    return (
        f"<ul class='key'>{spots}</ul><p class='dim'>Poses of all muscles by outcome. In the bars a few poses are as "
        "wide as it takes to see them. Two true geodesics count as equal where length, velocity and moment arm agree "
        f"to {AGREE:g}; every path is judged by its own geometry.</p>"
    )
