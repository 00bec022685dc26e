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
    print(
        f"  {'':16}{'median':>10}{'p95':>10}{'whole':>10}{'times mjwrap (range)':>25}{'failures':>16}{'length':>8}"
        f"{'steps':>7}"
    )
    for solver, row in rows.items():
        ratio = f"{row['ratio']:.3g} ({row['ratio_low']:.3g} to {row['ratio_high']:.3g})"
        failures = f"{row['failures']} of {row['poses']}"
        steps = f"{row['iterations']:7.2f}" if "iterations" in row else ""
        shorter = f"  shorter at {row['shorter']}" if row["shorter"] else ""
        print(
            f"  {solver:16}{row['median']:10.3f}{row['p95']:10.3f}{row['whole']:10.3f}{ratio:>25}{failures:>16}"
            f"{row['length_difference']:8.0e}{steps}{shorter}"
        )
    for solver, reason in missing.items():
        print(f"  {solver:16}  no: {reason}")


def compare(old: dict[str, Any], new: dict[str, Any]) -> None:
    """Print the medians of two saved runs side by side."""
    changed = {k: (old["machine"].get(k), v) for k, v in new["machine"].items() if old["machine"].get(k) != v}
    print("\nagainst the old run" + (f" (other: {changed})" if changed else ""))
    print(f"  {'':16}{'':20}{'old':>9}{'new':>9}{'new/old':>9}")
    for scene, rows in new["scenes"].items():
        for solver, row in rows.items():
            before = old["scenes"].get(scene, {}).get(solver)
            if before is not None:
                print(
                    f"  {scene:16}{solver:20}{before['median']:9.3f}{row['median']:9.3f}"
                    f"{row['median'] / before['median']:9.2f}"
                )


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
