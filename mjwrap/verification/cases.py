"""Scenes as plain numbers: robustness.py and motion.py save and replay them."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

import mjwrap as mw
from mjwrap.verification.certificate import Case, findings
from mjwrap.verification.multistart import shortest
from mjwrap.verification.shapes import Array


def plain(value: Any) -> Any:
    """Convert arrays, tuples and NumPy numbers to lists and Python numbers, with all digits."""
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | list | tuple):
        return [plain(item) for item in value]
    return value.item() if isinstance(value, np.generic) else value


def describe(origin: Array, insertion: Array, obstacles: Sequence[mw.Obstacle]) -> dict[str, Any]:
    """Return a scene as plain numbers."""
    rows = [
        {
            "surface": type(o.surface).__name__,
            "sizes": {f.name: getattr(o.surface, f.name) for f in dataclasses.fields(o.surface)},
            "pos": o.pos,
            "quat": o.quat,
            "hint": o.hint,
        }
        for o in obstacles
    ]
    return plain({"origin": origin, "insertion": insertion, "obstacles": rows})


def restore(scene: dict[str, Any]) -> tuple[Array, Array, list[mw.Obstacle]]:
    """Return origin, insertion and obstacles of a described scene."""
    obstacles = []
    for row in scene["obstacles"]:
        sizes = {k: tuple(v) if isinstance(v, list) else v for k, v in row["sizes"].items()}
        surface = getattr(mw, row["surface"])(**sizes)
        hint = None if row["hint"] is None else tuple(row["hint"])
        obstacles.append(mw.Obstacle(surface, tuple(row["pos"]), tuple(row["quat"]), hint))
    return np.array(scene["origin"]), np.array(scene["insertion"]), obstacles


def replay(file: Path, index: int | None) -> None:
    """Solve saved cases again and print the results."""
    cases = json.loads(file.read_text(encoding="utf-8"))
    for number in range(len(cases)) if index is None else [index]:
        case = cases[number]
        origin, insertion, obstacles = restore(case["scene"])
        print(f"case {number}: {case['class']}, hints {case['hints']}: {case['reason']}")
        sol = mw.solve_path(origin, insertion, obstacles)
        print(f"  {sol!r}, {sol.evaluations} evaluations")
        for obstacle, contact in zip(obstacles, sol.contacts, strict=True):
            hint = "" if obstacle.hint is None else f", hint {np.round(obstacle.hint, 5).tolist()}"
            second = "" if contact.second is None else f" and {contact.second.arc_length:.6g}"
            print(f"    {obstacle.surface}{hint}: arc {contact.arc_length:.6g}{second} m")
        found = Case.of(origin, insertion, obstacles, sol)
        reason = findings([found])[0]
        print(f"  judge: {reason or 'no fault found'}")
        free = [dataclasses.replace(obstacle, hint=None) for obstacle in obstacles]
        best = shortest(origin, insertion, free, np.random.default_rng(0), None if reason else found)
        if best is not None:
            arcs = [[float(f"{s:.4g}") for _, _, s in contacts] for contacts in best.contacts]
            print(f"  another search, without hints: {best.length!r} m, arcs {arcs}")
        if case.get("best") is not None:
            print(f"  when it was saved: a path of {case['best']['length']!r} m ({case['best']['how']})")
