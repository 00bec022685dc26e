"""Figures drawn with matplotlib: whether it is installed, and saving them."""

from __future__ import annotations

from typing import Any

from mjwrap.cli.common.errors import UserError
from mjwrap.files.atomic import PartFile


def need_matplotlib() -> None:
    """Raise `UserError` before a run whose plot could not be drawn."""
    try:
        import matplotlib
    except ImportError:
        raise UserError("--plot needs matplotlib: pip install 'mjwrap[demo]'") from None
    matplotlib.use("Agg")


def save_figure(figure: Any, output: PartFile) -> None:
    """Write a figure, give the file its name, and close the figure."""
    import matplotlib.pyplot as plt

    with output.writing():
        figure.savefig(output.part, dpi=110)
    plt.close(figure)
    output.publish()
