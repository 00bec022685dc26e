"""The wording of messages and tables."""

import difflib
from collections.abc import Collection, Iterable, Sequence


def counted(number: float, noun: str) -> str:
    """Return a number with a noun in singular or plural, such as "1 pose" and "2 poses"."""
    return f"{number:.0f} {noun}{'s' * (number != 1)}"


def counted_paths(total: int, cables: int, tendons: int = 0) -> str:
    """Return the numbers of muscles, cables and bare tendons in words; total: of all of them."""
    parts = {"muscle": total - cables - tendons, "cable": cables}
    words = [counted(number, noun) for noun, number in parts.items() if number]
    if tendons:
        words.append(f"{counted(tendons, 'tendon')} without an actuator")
    return " and ".join(words) or counted(0, "muscle")


def noun(kinds: Iterable[str], several: bool = False) -> str:
    """Return the word for things of these kinds, such as "muscle or cable" or, for several, "muscles and cables"."""
    known = set(kinds)
    found = [kind for kind in ("muscle", "cable", "tendon") if kind in known] or ["muscle"]
    return " and ".join(f"{kind}s" for kind in found) if several else " or ".join(found)


def few(names: Sequence[str], most: int = 6) -> str:
    """Return names for a message, the first of many and the number of the others."""
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")


def nearest(name: str, known: Iterable[str]) -> str:
    """Return " (did you mean ...?)" with at most three known names like a wrong one, the best first, or an empty text.

    Capitals do not count.
    """
    by_lower: dict[str, list[str]] = {}
    for each in known:
        by_lower.setdefault(each.lower(), []).append(each)
    close = [
        each for key in difflib.get_close_matches(name.lower(), by_lower, n=3) for each in by_lower[key]
    ][:3]
    return f" (did you mean {' or '.join(repr(each) for each in close)}?)" if close else ""


def aligned(rows: Iterable[Sequence[str]], left: Collection[int] = (0,)) -> list[str]:
    """Return rows of cells as lines of text with aligned columns, two spaces apart; the heads are a row, too.

    left: columns aligned at the left; the others are aligned at the right. Cells are not wrapped or cut, and no line
    ends in spaces.
    """
    cells = [list(row) for row in rows]
    wide = [max(map(len, column)) for column in zip(*cells, strict=True)]
    return [
        "  ".join(
            cell.ljust(width) if i in left else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(row, wide, strict=True))
        ).rstrip()
        for row in cells
    ]
