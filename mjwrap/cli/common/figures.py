"""Save figures drawn with matplotlib, and test that it is installed."""

from __future__ import annotations

from typing import Any

from mjwrap.cli.common.errors import UserError
from mjwrap.files.atomic import PartFile


def need_matplotlib(option: str = "--plot") -> None:
    """Raise `UserError` if matplotlib is not installed: called before the run. option: what needs it."""
    try:
        import matplotlib
    except ImportError:
        raise UserError(
            f"{option} needs matplotlib: pip install 'mjwrap[demo]', or pip install matplotlib"
        ) from None
    matplotlib.use("Agg")
    # names of models are text, whatever they contain: no formulas between dollars, no TeX
    matplotlib.rcParams.update({"text.parse_math": False, "text.usetex": False})


def legend_label(name: str) -> str:
    """Return a model's name as matplotlib shows it in a legend, which leaves out labels that begin with "_"."""
    return f" {name}" if name.startswith("_") else name


def save_figure(figure: Any, output: PartFile) -> None:
    """Write a figure to its file and close the figure."""
    import matplotlib.pyplot as plt

    with output.writing():
        figure.savefig(output.part, dpi=110)
    plt.close(figure)
    output.publish()
