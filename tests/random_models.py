"""Random MJCF models whose muscles run over rows of surfaces and via points on bodies of every kind.

Elements of a row stand 0.1 m apart along x at the reference pose and are passed above and below in turn. Each is fixed
to some body: the world, a mocap body, or one that moves by free, ball, hinge or slide joints; every body frame, centre
of mass and geom is rotated at random, so nothing is aligned with anything.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from mjcf_reading import Vector

SPACING = 0.1  # [m]
RADIUS = 0.03  # [m]
# Of a surface's centre from the straight line, away from the side on which it is passed [m]. A string whose chord runs
# close to a sphere's centre turns fast with small motions, which spoils difference quotients: spheres stand off.
OFFSET = {"cylinder": 0.012, "sphere": 0.02, "ellipsoid": 0.018, "torus": 0.012, "hole": 0.006}
SIMPLE = ("cylinder", "sphere")
ALL = (*SIMPLE, "ellipsoid", "capsule", "cone", "elliptic_cylinder", "torus", "hole")
RING, TUBE = 0.06, 0.025  # of the torus through whose hole a string runs [m]
# type and size of the geom, and the numeric that gives it another shape
SHAPES = {
    "cylinder": ("cylinder", f"{RADIUS} 0.05", ""),
    "sphere": ("sphere", f"{RADIUS}", ""),
    "ellipsoid": ("ellipsoid", "0.03 0.034 0.045", ""),
    "capsule": ("capsule", "0.03 0.04", ""),
    "cone": ("sphere", "0.001", '<numeric name="mjwrap_cone_size" data="0.033 0.027 0.05"/>'),
    "elliptic_cylinder": (
        "box",
        "0.01 0.01 0.01",
        '<numeric name="mjwrap_elliptic_cylinder_size" data="0.03 0.034"/>',
    ),
    "torus": ("sphere", "0.001", '<numeric name="mjwrap_a_torus_size" data="0.018 0.014"/>'),
    "hole": ("sphere", "0.001", f'<numeric name="mjwrap_b_torus_size" data="{RING} {TUBE}"/>'),
}


def _text(values: Vector | list[float]) -> str:
    return " ".join(repr(float(value)) for value in values)


def _random_quat(rng: np.random.Generator) -> Vector:
    quat = rng.normal(size=4)
    return quat / np.linalg.norm(quat)


def _rotate(quat: Vector, vector: Vector) -> Vector:
    out = np.zeros(3)
    mujoco.mju_rotVecQuat(out, vector, quat)
    return out


def _relative(pos: Vector, quat: Vector, pos_b: Vector, quat_b: Vector) -> tuple[Vector, Vector]:
    """Pose of frame (pos, quat) as seen in frame (pos_b, quat_b)."""
    back, turned = np.zeros(4), np.zeros(4)
    mujoco.mju_negQuat(back, quat_b)
    mujoco.mju_mulQuat(turned, back, quat)
    return _rotate(back, pos - pos_b), turned


@dataclass
class _Body:
    name: str
    pos: Vector
    quat: Vector
    joints: str  # "world", "mocap" or joint types, comma-separated
    parent: _Body | None
    children: list[_Body]
    content: list[str]

    def xml(self, rng: np.random.Generator) -> str:
        if self.joints == "world":
            return "\n".join([*self.content, *(child.xml(rng) for child in self.children)])
        assert self.parent is not None
        pos, quat = _relative(self.pos, self.quat, self.parent.pos, self.parent.quat)
        lines = [f'<body name="{self.name}" pos="{_text(pos)}" quat="{_text(quat)}"' + self._mocap() + ">"]
        lines.append(
            f'<inertial pos="{_text(rng.uniform(-0.03, 0.03, 3))}" mass="{rng.uniform(0.5, 2)!r}"'
            f' quat="{_text(_random_quat(rng))}" diaginertia="0.002 0.0025 0.003"/>'
        )
        for kind in self.joints.split(","):
            if kind in ("free", "ball"):
                lines.append(f'<joint type="{kind}"/>')
            elif kind != "mocap":
                axis, anchor = rng.normal(size=3), rng.uniform(-0.02, 0.02, 3)
                lines.append(f'<joint type="{kind}" axis="{_text(axis)}" pos="{_text(anchor)}"/>')
        return "\n".join([*lines, *self.content, *(child.xml(rng) for child in self.children), "</body>"])

    def _mocap(self) -> str:
        return ' mocap="true"' if self.joints == "mocap" else ""


def _bodies(rng: np.random.Generator, count: int) -> list[_Body]:
    """World, one mocap body, one free body, and `count` others in a random tree."""
    world = _Body("world", np.zeros(3), np.array([1.0, 0, 0, 0]), "world", None, [], [])
    bodies = [world]
    for k in range(count + 2):
        place = np.array([rng.uniform(0, SPACING * (count + 1)), 0, 0]) + rng.uniform(-0.03, 0.03, 3)
        kind = (
            ("mocap", "free")[k]
            if k < 2
            else str(rng.choice(["ball", "hinge", "slide", "hinge,slide", "slide,ball"]))
        )
        movable = [body for body in bodies if body.joints != "mocap"]
        parent = world if k < 2 else movable[rng.integers(len(movable))]
        body = _Body(f"body{k}", place, _random_quat(rng), kind, parent, [], [])
        parent.children.append(body)
        bodies.append(body)
    return bodies


def _place(rng: np.random.Generator, body: _Body, k: int, kind: str, last: bool) -> None:
    """Fix element k of the row to a body; k = 0 is the origin."""
    side = 1.0 if k % 2 else -1.0
    if kind == "site":
        at = np.array([SPACING * k, 0.0, 0.01 if last else rng.uniform(-0.005, 0.005)])
        pos, _ = _relative(at, body.quat, body.pos, body.quat)
        body.content.append(f'<site name="e{k}" pos="{_text(pos)}"/>')
        return
    tilt = np.zeros(4)
    mujoco.mju_euler2Quat(tilt, np.array([*rng.uniform(-0.15, 0.15, 2), rng.uniform(-3, 3)]), "XYZ")
    at = np.array([SPACING * k, -side * OFFSET.get(kind, 0.012), rng.uniform(-0.003, 0.003)])
    touch = at + np.array([0.0, side * 1.3 * RADIUS, 0.0])
    if kind == "hole":  # the ring's axis lies along the string, which touches the tube from within
        across = np.array([0.0, side, 0.0])
        touch, at = at + TUBE * across, at + RING * across
        turned = np.zeros(4)
        mujoco.mju_mulQuat(turned, np.array([0.5**0.5, 0.0, 0.5**0.5, 0.0]), tilt)
        tilt = turned
    pos, quat = _relative(at, tilt, body.pos, body.quat)
    shape, size, _ = SHAPES[kind]
    body.content.append(
        f'<geom name="e{k}" type="{shape}" size="{size}" pos="{_text(pos)}" quat="{_text(quat)}"'
        ' contype="0" conaffinity="0" mass="0"/>'
    )
    hint, _ = _relative(touch, body.quat, body.pos, body.quat)
    body.content.append(f'<site name="hint{k}" pos="{_text(hint)}"/>')


def random_model(seed: int, surfaces: tuple[str, ...] = SIMPLE) -> mujoco.MjModel:
    """The compiled `random_xml`."""
    return mujoco.MjModel.from_xml_string(random_xml(seed, surfaces))


def random_xml(seed: int, surfaces: tuple[str, ...] = SIMPLE) -> str:
    """A model with three muscles over 3 to 7 elements each, one of them with via points; no gravity, no contacts."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(4, 8))
    kinds = ["site", *rng.choice(surfaces, count).tolist(), "site"]
    if count > 4:
        kinds[count // 2] = "site"  # a via point between rows
    bodies = _bodies(rng, 5)
    row = rng.choice(len(bodies), len(kinds))
    for k, kind in enumerate(kinds):
        _place(rng, bodies[row[k]], k, kind, k == len(kinds) - 1)
    ends = [bodies[row[k]] for k in range(len(kinds))]
    for name, k in (
        ("first", 2),
        ("second", 4),
    ):  # other origins and insertions, so that muscles share surfaces
        at = np.array([SPACING * k, 0.005, -0.01])
        pos, _ = _relative(at, ends[k].quat, ends[k].pos, ends[k].quat)
        if kinds[k] != "site":
            at[1] = (1.0 if k % 2 else -1.0) * 1.6 * RADIUS  # above the surface that stands there
            body = bodies[rng.integers(len(bodies))]
            pos, _ = _relative(at, body.quat, body.pos, body.quat)
            body.content.append(f'<site name="{name}" pos="{_text(pos)}"/>')
        else:
            ends[k].content.append(f'<site name="{name}" pos="{_text(pos)}"/>')
    last = len(kinds) - 1
    routes = {
        "whole": [f"e{k}" for k in range(last + 1)],
        "front": [*(f"e{k}" for k in range(4)), "second"],
        "back": ["first", *(f"e{k}" for k in range(3, last + 1))],
    }
    tuples = sorted({SHAPES[kind][2] for kind in kinds if kind != "site"} - {""})
    for m, (name, route) in enumerate(routes.items()):
        tuples.append(f'<numeric name="mjwrap_{name}_optimal_force" data="{40 + 30 * m}"/>')
        tuples.append(f'<tuple name="mjwrap_{name}">')
        for stop in route:
            kind = kinds[int(stop[1:])] if stop.startswith("e") else "site"
            if kind == "site":
                tuples.append(f'<element objtype="site" objname="{stop}"/>')
            else:
                tuples.append(f'<element objtype="geom" objname="{stop}"/>')
                if SHAPES[kind][2]:
                    tuples.append(
                        f'<element objtype="numeric" objname="{SHAPES[kind][2].split(chr(34))[1]}"/>'
                    )
                tuples.append(f'<element objtype="site" objname="hint{stop[1:]}" prm="1"/>')
        tuples.append(f'<element objtype="numeric" objname="mjwrap_{name}_optimal_force"/></tuple>')
    body = bodies[0].xml(rng)
    newline = "\n"
    return (
        f'<mujoco model="random{seed}"><compiler angle="radian"/><option gravity="0 0 0" timestep="0.001"/>'
        f"<worldbody>{newline}{body}{newline}</worldbody><custom>{newline.join(tuples)}</custom></mujoco>"
    )


def random_state(
    model: mujoco.MjModel, data: mujoco.MjData, rng: np.random.Generator, size: float = 0.02
) -> None:
    """Move every degree of freedom and every mocap body by about `size` [m, rad] from the reference pose."""
    mujoco.mj_resetData(model, data)
    mujoco.mj_integratePos(model, data.qpos, rng.uniform(-size, size, model.nv), 1.0)
    data.qvel[:] = rng.uniform(-1, 1, model.nv)
    for i in range(model.nmocap):
        data.mocap_pos[i] += rng.uniform(-0.5, 0.5, 3) * size
        mujoco.mju_quatIntegrate(data.mocap_quat[i], rng.uniform(-1, 1, 3) * size, 1.0)
