"""Couplings, moving points, conditional points and ligaments of a model, as text and as values for JSON."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mujoco

from mjwrap.cli.inspect.declared import condition
from mjwrap.mjcf import MuscleDeclaration, name_of, read_moving_axes
from mjwrap.mjcf.couplings import read_couplings
from mjwrap.mjcf.joint_ranges import joint_range
from mjwrap.muscles import Ligament
from mjwrap.text import counted

SHOWN = 12  # lines of each kind that are printed; JSON has all
OBJ = mujoco.mjtObj
Parts = dict[str, list[dict[str, Any]]]


def parts_of(model: mujoco.MjModel, muscles: Sequence[MuscleDeclaration]) -> Parts:
    """Return couplings, moving and conditional points and ligaments by kind; ranges and lengths in rad or m."""
    return {
        "couplings": _couplings(model),
        "moving_points": _moving(model),
        "conditional_points": _conditional(model, muscles),
        "ligaments": [
            {"ligament": muscle.name, "pcsa_force": law.pcsa_force, "resting_length": law.resting_length}
            for muscle in muscles
            if isinstance(law := muscle.parameters, Ligament)
        ],
    }


def parts_text(parts: Parts) -> str:
    """Return the parts as lines, "" if there are none."""
    lines = []
    for kind, found in parts.items():
        if found:
            lines.append(f"{counted(len(found), kind.replace('_', ' ').removesuffix('s'))}:")
            lines += [f"  {_TEXTS[kind](part)}" for part in found[:SHOWN]]
        if len(found) > SHOWN:
            lines.append(f"  and {len(found) - SHOWN} more: --json lists all")
    return "\n".join(lines)


def _joint(model: mujoco.MjModel, joint: int) -> dict[str, Any]:
    """Return the name of a joint and its range, None without one."""
    return {"joint": name_of(model, OBJ.mjOBJ_JOINT, joint), "range": joint_range(model, joint)}


def _couplings(model: mujoco.MjModel) -> list[dict[str, Any]]:
    return [
        {
            "joint": name_of(model, OBJ.mjOBJ_JOINT, each.joint),
            "follows": [
                _joint(model, leader) | {"weight": float(weight)}
                for leader, weight in zip(each.leaders, each.weights, strict=True)
            ],
            "pieces": len(each.equalities),
        }
        for each in read_couplings(model)
    ]


def _moving(model: mujoco.MjModel) -> list[dict[str, Any]]:
    found: dict[int, list[dict[str, Any]]] = {}
    for axis in read_moving_axes(model):
        part = {"axis": "xyz"[axis.axis]} | _joint(model, axis.joint) | {"pieces": len(axis.origins)}
        found.setdefault(axis.site, []).append(part)
    return [{"site": name_of(model, OBJ.mjOBJ_SITE, site), "axes": axes} for site, axes in found.items()]


def _conditional(model: mujoco.MjModel, muscles: Sequence[MuscleDeclaration]) -> list[dict[str, Any]]:
    found = []
    for muscle in muscles:
        for routes in muscle.pieces:
            for site in dict.fromkeys(site for route in routes for site in route.sites):
                ranges = [
                    {"joint": name_of(model, OBJ.mjOBJ_JOINT, each.joint), "range": (each.low, each.high)}
                    for each in condition(routes, site)
                ]
                if ranges:
                    name = name_of(model, OBJ.mjOBJ_SITE, site)
                    found.append({"site": name, "muscle": muscle.name, "where": ranges})
    return found


def _span(joint: dict[str, Any]) -> str:
    if joint["range"] is None:
        return f"{joint['joint']} (without a range)"
    return "{} ({:.4g} to {:.4g})".format(joint["joint"], *joint["range"])


def _coupling_text(part: dict[str, Any]) -> str:
    leaders = [
        ("" if each["weight"] == 1.0 else f"{each['weight']:g} × ") + _span(each) for each in part["follows"]
    ]
    followed = f"follows {' + '.join(leaders)}" if leaders else "is held"
    return f"{part['joint']} {followed}, {counted(part['pieces'], 'piece')}"


def _moving_text(part: dict[str, Any]) -> str:
    axes = [f"{a['axis']} with {_span(a)}, {counted(a['pieces'], 'piece')}" for a in part["axes"]]
    return f"{part['site']}: {'; '.join(axes)}"


def _conditional_text(part: dict[str, Any]) -> str:
    return f"{part['site']} of {part['muscle']}: only in {' and '.join(map(_span, part['where']))}"


def _ligament_text(part: dict[str, Any]) -> str:
    force, length = part["pcsa_force"], part["resting_length"]
    return f"{part['ligament']}: {force:.4g} N, {1e3 * length:.4g} mm at rest"


_TEXTS = {
    "couplings": _coupling_text,
    "moving_points": _moving_text,
    "conditional_points": _conditional_text,
    "ligaments": _ligament_text,
}
