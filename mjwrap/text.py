"""The wording of messages and tables."""

from collections.abc import Collection, Iterable, Sequence


def counted(number: float, noun: str) -> str:
    """Return a number with a noun in singular or plural, such as "1 pose" and "2 poses"."""
    return f"{number:.0f} {noun}{'s' * (number != 1)}"


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
