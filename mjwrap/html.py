"""Small tables and drawings in HTML, as notebooks show them; all text is escaped."""

from __future__ import annotations

import html
import math
from collections.abc import Iterable, Sequence

WIDTH, HEIGHT = 320, 200  # of a drawing [pixels]
EDGE = 12  # [pixels]
Point = Sequence[float]


def table(head: Sequence[str], rows: Iterable[Sequence[object]], caption: str = "") -> str:
    """Return a table; the caption stands above it."""
    title = (
        f"<caption style='text-align:left;white-space:nowrap'>{escaped(caption)}</caption>" if caption else ""
    )
    heads = "".join(f"<th>{escaped(cell)}</th>" for cell in head)
    body = "".join(f"<tr>{''.join(f'<td>{escaped(cell)}</td>' for cell in row)}</tr>" for row in rows)
    return f"<table>{title}<thead><tr>{heads}</tr></thead><tbody>{body}</tbody></table>"


def facts(entries: Iterable[tuple[str, object]], caption: str = "") -> str:
    """Return a table of names and values, without a head."""
    title = (
        f"<caption style='text-align:left;white-space:nowrap'>{escaped(caption)}</caption>" if caption else ""
    )
    body = "".join(f"<tr><th>{escaped(name)}</th><td>{escaped(value)}</td></tr>" for name, value in entries)
    return f"<table>{title}<tbody>{body}</tbody></table>"


def drawing(
    lines: Sequence[Sequence[Point]], marks: Sequence[Point] = (), outlines: Sequence[Sequence[Point]] = ()
) -> str:
    """Return an SVG of lines, marks on them, and thin outlines behind, from points (x, y) of one scale, y upwards.

    A point that is not finite separates a line into two.
    """
    every = [p for line in (*lines, *outlines, list(marks)) for p in line if _finite(p)]
    if not every:
        return ""
    low = [min(p[k] for p in every) for k in (0, 1)]
    wide = [max(p[k] for p in every) - low[k] for k in (0, 1)]
    scale = min((size - 2 * EDGE) / max(w, 1e-300) for size, w in zip((WIDTH, HEIGHT), wide, strict=True))
    shift = [(size - scale * w) / 2 for size, w in zip((WIDTH, HEIGHT), wide, strict=True)]

    def at(p: Point) -> str:
        x, y = shift[0] + scale * (p[0] - low[0]), HEIGHT - shift[1] - scale * (p[1] - low[1])
        return f"{x:.1f},{y:.1f}"

    def path(line: Sequence[Point], style: str) -> str:
        steps, pen = [], "M"
        for p in line:
            if not _finite(p):
                pen = "M"
                continue
            steps.append(pen + at(p))
            pen = "L"
        return f"<path d='{' '.join(steps)}' fill='none' {style}/>"

    parts = [path(line, "stroke='#8893a5' stroke-width='0.7'") for line in outlines]
    parts += [path(line, "stroke='#c0392b' stroke-width='2'") for line in lines]
    for p in marks:
        x, _, y = at(p).partition(",")
        parts.append(f"<circle cx='{x}' cy='{y}' r='3' fill='#2c3e50'/>")
    return f"<svg xmlns='http://www.w3.org/2000/svg' width='{WIDTH}' height='{HEIGHT}'>{''.join(parts)}</svg>"


def escaped(value: object) -> str:
    """Return text for HTML; a name may contain any characters."""
    return html.escape(str(value))


def _finite(p: Point) -> bool:
    return math.isfinite(p[0]) and math.isfinite(p[1])
