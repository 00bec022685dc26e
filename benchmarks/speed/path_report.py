"""The output of bench_paths.py about a scene, a machine and an earlier run."""

from __future__ import annotations

import json
import os
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from path_targets import Rows

import mjwrap as mw
from mjwrap.text import aligned


def machine() -> dict[str, str]:
    """What the figures depend on."""
    found = {"machine": platform.machine(), "cores": str(os.cpu_count()), "python": platform.python_version()}
    found["mjwrap"] = mw.__version__
    for package in ("numba", "numpy", "mujoco", "opensim"):
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "not installed"
    return found


def print_scene(name: str, rows: Rows, missing: dict[str, str]) -> None:
    """Print one scene's table."""
    print(f"\n{name}")
    table = [["", "median", "p95", "whole", "times mjwrap (range)", "failures", "length", "steps", ""]]
    for solver, row in rows.items():
        times = [f"{row[name]:.3f}" for name in ("median", "p95", "whole")]
        ratio = f"{row['ratio']:.3g} ({row['ratio_low']:.3g} to {row['ratio_high']:.3g})"
        failures = f"{row['failures']} of {row['poses']}"
        steps = f"{row['iterations']:.2f}" if "iterations" in row else ""
        shorter = f"shorter at {row['shorter']}" if row["shorter"] else ""
        table.append([solver, *times, ratio, failures, f"{row['length_difference']:.0e}", steps, shorter])
    for line in aligned(table, (0, 8)):
        print(f"  {line}")
    for solver, reason in missing.items():
        print(f"  {solver}: no: {reason}")


def compare(old: dict[str, Any], new: dict[str, Any]) -> None:
    """Print the medians of two saved runs side by side."""
    changed = {k: (old["machine"].get(k), v) for k, v in new["machine"].items() if old["machine"].get(k) != v}
    print("\nagainst the old run" + (f" (other: {changed})" if changed else ""))
    table = [["", "", "old", "new", "new/old"]]
    for scene, rows in new["scenes"].items():
        for solver, row in rows.items():
            before = old["scenes"].get(scene, {}).get(solver)
            if before is not None:
                ratio = f"{row['median'] / before['median']:.2f}"
                table.append([scene, solver, f"{before['median']:.3f}", f"{row['median']:.3f}", ratio])
    for line in aligned(table, (0, 1)):
        print(f"  {line}")


def read_old(path: Path) -> dict[str, Any]:
    """Read an earlier run's file; ValueError with the reason where that fails."""
    try:
        old = json.loads(path.read_text(encoding="utf-8"))
        if not isinstance(old["scenes"], dict) or not isinstance(old["machine"], dict):
            raise KeyError("scenes")
    except OSError as error:
        raise ValueError(f"cannot read {path}: {error.strerror}") from None
    except (ValueError, KeyError, TypeError):
        raise ValueError(f"{path} is not a file that --json of this benchmark wrote") from None
    return old
