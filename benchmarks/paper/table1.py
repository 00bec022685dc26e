"""Rerun Table I of Muñoz-Pepi et al. 2023 with the paper's methods and with mjwrap's own solver.

Prints iterations, function evaluations and time beside the paper's, the length error against the closed form, l̇
against differences of l, the two-cylinder scene, and the fold of Fig. 8. Exit code 1 where any pose failed, 2 for a bad
argument.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import os
import platform
import sys
import tempfile
from importlib.metadata import version
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import paper_scenes as paper
from table1_extras import Fold, TwoRow, fold, two_cylinders
from table1_runs import Rates, Row, paper_row, production_row, rates

import mjwrap as mw
from mjwrap.files.atomic import PartFile
from mjwrap.text import aligned

COUNTS = """\
n_f counts every evaluation of the residual over the whole path at one set of unknowns, those of finite differences,
line searches and first guesses included; mjwrap's evaluates the analytic Jacobian along with it and counts both as
one. Times are this machine's: NumPy for the paper's methods (finite differences in one batch; one run), the median of
repeated compiled calls of mjwrap.solve_sweep for the 251 poses. The paper's are MATLAB's on its authors' machine."""


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        self.exit(2, f"table1.py: {message}\n")


def _count(text: str) -> int:
    try:
        value = int(text)
    except ValueError:
        value = 0
    if value < 1:
        raise argparse.ArgumentTypeError(f"must be a whole number of at least 1, not {text!r}")
    return value


def _writable(text: str) -> Path:
    path = Path(text)
    if path.is_dir():
        raise argparse.ArgumentTypeError(f"{text!r} is a folder, not a file")
    try:
        with tempfile.TemporaryFile(dir=path.resolve().parent):
            pass
        if path.exists():
            with path.open("ab"):
                pass
    except OSError as reason:
        raise argparse.ArgumentTypeError(f"cannot write {text!r}: {reason.strerror}") from None
    return path


def _plot_file(text: str) -> Path:
    path = _writable(text)
    if path.suffix not in (".png", ".svg", ".pdf"):
        raise argparse.ArgumentTypeError(f"must end in .png, .svg or .pdf, not {text!r}")
    return path


def _print_rows(case: int, rows: list[Row]) -> None:
    amplitude = paper.AMPLITUDE[case] / paper.CM
    print(f"\nCase {case}: c_y = {amplitude:g} sin 2πt cm, 251 poses, {rows[-1].touched} of them touched")
    heads = ("", "n_i", "paper", "i_a", "paper", "n_f", "paper", "time [s]", "paper", "failed", "max ‖f‖")
    table = [[*heads, "length error [cm]"]]
    for row in rows:
        n_i, i_a, n_f, seconds = (f"{x:,}" for x in row.paper) if row.paper else ("–",) * 4
        counts = [f"{row.n_i:,}", n_i, f"{row.i_a:.1f}", i_a, f"{row.n_f:,}", n_f]
        errors = [f"{row.failures}", f"{row.tangency_error:.1e}", f"{row.length_error_cm:.1e}"]
        table.append([row.label, *counts, f"{row.seconds:.3g}", seconds, *errors])
    print("\n".join(aligned(table)))


def _print_rates(found: list[Rates]) -> None:
    print(
        "\nl̇ (17) against central differences of l: largest error [cm/s] by step, and the order seen from step to step"
    )
    for r in found:
        errors = "  ".join(
            f"{h * 1e3:g} ms {e / paper.CM:.1e}" for h, e in zip(r.steps, r.errors, strict=True)
        )
        orders = ", ".join(f"{order:.2f}" for order in r.orders)
        print(f"Case {r.case}, {r.label}: {errors}; order {orders}")
        print(
            f"    extrapolated: {r.extrapolated:.1e} of the largest |l̇|, {r.largest_rate / paper.CM:.3g} cm/s; "
            f"{r.poses} poses, {r.failures} failed"
        )
        if r.across:
            errors = "  ".join(f"{e / paper.CM:.1e}" for e in r.across_errors)
            print(
                f"    left out: {r.across} poses with a lift-off or touchdown (l̇ has a corner) in the widest stencil; "
                f"their errors: {errors}"
            )


def _print_two(rows: list[TwoRow]) -> None:
    n_i, i_a, n_f, seconds = paper.TWO_PAPER
    print(f"\nTwo cylinders: {paper.TWO_WHY}")
    table = [["", "n_i", "i_a", "n_f", "time [s]", "failed", "max ‖f‖", "against newton"]]
    for row in rows:
        counts = [
            f"{row.n_i:,}",
            f"{row.n_i / 251:.1f}",
            f"{row.n_f:,}",
            f"{row.seconds:.3g}",
            f"{row.failures}",
        ]
        table.append([row.label, *counts, f"{row.tangency_error:.1e}", f"{row.length_difference:.1e}"])
    table.append(
        ["paper, BR", f"{n_i:,}", f"{i_a}", f"{n_f:,}", f"{seconds}", "", "", "own radii, end points"]
    )
    print("\n".join(aligned(table)))
    patterns = {tuple(row.touched) for row in rows}
    touched = " or ".join(f"{first} and {second}" for first, second in sorted(patterns))
    print(f"touched: the first and the second cylinder at {touched} poses, over all methods")


def _print_folds(folds: list[Fold]) -> None:
    print("\nFig. 8: case 1 with NR λ=0.08 on one residual or the other")
    for f in folds:
        off = np.abs(f.rate - f.difference)[1:-1].max()
        print(
            f"{f.label:30}  failed {f.failures}  max residual {f.residual_error:.1e}  ‖f‖ {f.tangency_errors[0]:.3g} "
            f"… {f.tangency_errors[1]:.3g}  length {f.length.min():.3f} … {f.length.max():.3f} cm  "
            f"largest |l̇ − Δl/Δt| {off:.3g} cm/s, largest |l̇| {np.abs(f.rate).max():.3g}"
        )
        if f.from_first_guess:
            count, h, error = f.from_first_guess
            print(
                f"    h from the paper's own first guess: after {count:,} iterations ‖h‖ = {h:.1e}, ‖f‖ = {error:.4f}, "
                "P running off along\n    the axis; so the folded path starts here from a guess that runs back from P"
            )


def _plot(path: Path, rows: dict[int, list[Row]], folds: list[Fold]) -> None:
    import matplotlib

    matplotlib.use("agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 3, figsize=(16, 4.8), layout="constrained")
    own, theirs = rows[1], [row.paper[2] if row.paper else np.nan for row in rows[1]]
    y = np.arange(len(own))
    axes[0].barh(y - 0.2, [row.n_f for row in own], 0.4, label="here")
    axes[0].barh(y + 0.2, theirs, 0.4, label="paper")
    axes[0].set_yticks(y, [row.label for row in own])
    axes[0].invert_yaxis()
    axes[0].set(
        xscale="log", xlim=(100, None), xlabel="function evaluations for 251 poses", title="Case 1, Table I"
    )
    axes[0].legend(loc="lower right")
    for axis, f in zip(axes[1:], folds, strict=True):
        axis.plot(paper.TIMES, f.difference, label="differences of l")
        axis.plot(paper.TIMES, f.rate, "--", label=r"$\dot l$ (17)")
        low, high = f.tangency_errors
        norm = f"‖f‖ = {low:.3g}" if high - low < 1e-6 and low > 1e-6 else f"‖f‖ ≤ {high:.0e}"
        axis.set(xlabel="time [s]", ylabel="lengthening speed [cm/s]", title=f"{f.label}, {norm}")
        axis.margins(y=0.2)
        axis.legend(loc="upper center", ncols=2)
    _replace(path, lambda file: figure.savefig(file, dpi=120, format=path.suffix[1:]))
    plt.close(figure)


def _replace(path: Path, write: Any) -> None:
    """Write a file, so that nothing half-written is left."""
    output = PartFile(path, path.suffix.lower())
    try:
        with output.writing():
            write(output.part)
        output.publish()
    finally:
        output.discard()


def _machine() -> dict[str, Any]:
    packages = ("numpy", "scipy", "numba")
    return {
        "python": platform.python_version(),
        "processor": platform.processor() or platform.machine(),
        "cpus": os.cpu_count(),
        "mjwrap": mw.__version__,
        **{name: version(name) for name in packages},
    }


def _json(
    rows: dict[int, list[Row]], found: list[Rates], two: list[TwoRow], folds: list[Fold]
) -> dict[str, Any]:
    def plain(value: Any) -> Any:
        if isinstance(value, np.ndarray):
            return value.tolist()
        if dataclasses.is_dataclass(value) and not isinstance(value, type):
            return {f.name: plain(getattr(value, f.name)) for f in dataclasses.fields(value)}
        return value

    return {
        "machine": _machine(),
        "counts": COUNTS,
        "table": [{**plain(row), "i_a": row.i_a} for case in rows.values() for row in case],
        "rates": [plain(r) for r in found],
        "two_cylinders": {
            "scene": paper.TWO_WHY,
            "paper": paper.TWO_PAPER,
            "rows": [plain(row) for row in two],
        },
        "fold": [plain(f) for f in folds],
    }


def main(arguments: list[str] | None = None) -> int:
    """Run everything, print it, and return the exit code."""
    parser = _Parser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=_writable, metavar="FILE", help="write the same numbers there")
    parser.add_argument(
        "--plot", type=_plot_file, metavar="FILE", help="draw Table I and the fold (.png, .svg, .pdf)"
    )
    parser.add_argument(
        "--repeats", type=_count, default=51, help="compiled calls to take the median of (51)"
    )
    parser.add_argument(
        "--start",
        choices=("last", "restart"),
        default="last",
        help="the paper's methods start from the last solution, or from its (u, v) and the first guess's (u', v', l)",
    )
    options = parser.parse_args(arguments)
    if options.plot:
        try:
            import matplotlib  # noqa: F401
        except ImportError:
            parser.error("--plot needs matplotlib: pip install 'mjwrap[demo]'")
    print(COUNTS)
    rows: dict[int, list[Row]] = {}
    for case in paper.AMPLITUDE:
        rows[case] = [paper_row(case, row, options.start == "restart") for row in paper.TABLE]
        rows[case].append(production_row(case, options.repeats))
        _print_rows(case, rows[case])
    found = [rates(case, method) for case in paper.AMPLITUDE for method in ("broyden", "newton")]
    _print_rates(found)
    two, _ = two_cylinders(options.repeats)
    _print_two(two)
    folds = [fold("tangency"), fold("normals_binormals")]
    _print_folds(folds)
    try:
        if options.json:
            text = json.dumps(_json(rows, found, two, folds), indent=1, ensure_ascii=False, allow_nan=False)
            _replace(options.json, lambda file: file.write_text(text + "\n", encoding="utf-8"))
            print(f"\nwrote {options.json}")
        if options.plot:
            _plot(options.plot, rows, folds)
            print(f"\nwrote {options.plot}")
    except OSError as reason:
        print(f"table1.py: {reason}", file=sys.stderr)
        return 1
    failures = sum(row.failures for case in rows.values() for row in case) + sum(row.failures for row in two)
    failures += sum(f.failures for f in folds) + sum(r.failures for r in found)
    if failures:
        print(f"{failures} poses failed", file=sys.stderr)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
