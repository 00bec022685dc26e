"""Save figures drawn with matplotlib, and test that it is installed."""

from __future__ import annotations

from typing import Any

from mjwrap.cli.common.errors import UserError
from mjwrap.files.atomic import PartFile


def need_matplotlib() -> None:
    """Raise `UserError` if matplotlib is not installed: called before the run."""
    try:
        import matplotlib
    except ImportError:
        raise UserError("--plot needs matplotlib: pip install 'mjwrap[demo]'") from None
    matplotlib.use("Agg")


def save_figure(figure: Any, output: PartFile) -> None:
    """Write a figure to its file and close the figure."""
    import matplotlib.pyplot as plt

    with output.writing():
        figure.savefig(output.part, dpi=110)
    plt.close(figure)
    output.publish()
