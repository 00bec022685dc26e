"""Newton-Euler equations of a tree of bodies, body by body in the world, written from the laws alone."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

Array = np.ndarray
FREE, BALL, SLIDE, HINGE = range(4)


@dataclass
class Body:
    """Orientation and origin of a body, its angular velocity and acceleration, and the acceleration of its origin."""

    turn: Array
    origin: Array
    spin: Array
    spin_rate: Array
    rate: Array

    def at(self, local: Array) -> Array:
        """Return where a point of the body is."""
        return self.origin + self.turn @ local

    def acceleration(self, point: Array) -> Array:
        """Return the acceleration of the point of the body that is at a place in the world."""
        arm = point - self.origin
        return self.rate + np.cross(self.spin_rate, arm) + np.cross(self.spin, np.cross(self.spin, arm))


def moved_bodies(model: mujoco.MjModel, qpos: Array, qvel: Array, qacc: Array) -> list[Body]:
    """Return all bodies of a model, the world first."""
    found = [Body(np.eye(3), *np.zeros((4, 3)))]
    for b in range(1, model.nbody):
        parent = found[model.body_parentid[b]]
        home = parent.at(model.body_pos[b])
        body = Body(
            parent.turn @ matrix(model.body_quat[b]),
            home,
            parent.spin,
            parent.spin_rate,
            parent.acceleration(home),
        )
        for j in range(model.body_jntadr[b], model.body_jntadr[b] + model.body_jntnum[b]):
            body = _moved(model, j, body, qpos, qvel, qacc)
        found.append(body)
    return found


def _moved(model: mujoco.MjModel, j: int, body: Body, qpos: Array, qvel: Array, qacc: Array) -> Body:
    kind, q, v = int(model.jnt_type[j]), int(model.jnt_qposadr[j]), int(model.jnt_dofadr[j])
    if kind == FREE:
        turn = matrix(qpos[q + 3 : q + 7])
        return Body(
            turn, qpos[q : q + 3], turn @ qvel[v + 3 : v + 6], turn @ qacc[v + 3 : v + 6], qacc[v : v + 3]
        )
    axis = body.turn @ model.jnt_axis[j]
    if kind == SLIDE:
        place = body.origin + axis * (qpos[q] - model.qpos0[q])
        rate = body.acceleration(place) + 2 * np.cross(body.spin, axis * qvel[v]) + axis * qacc[v]
        return Body(body.turn, place, body.spin, body.spin_rate, rate)
    anchor = body.at(model.jnt_pos[j])
    if kind == HINGE:
        turn, spin, spin_rate = (
            body.turn @ about(model.jnt_axis[j], qpos[q] - model.qpos0[q]),
            axis * qvel[v],
            axis * qacc[v],
        )
    else:
        turn = body.turn @ matrix(qpos[q : q + 4])
        spin, spin_rate = turn @ qvel[v : v + 3], turn @ qacc[v : v + 3]
    spin_rate = body.spin_rate + spin_rate + np.cross(body.spin, spin)
    turned = Body(turn, anchor, body.spin + spin, spin_rate, body.acceleration(anchor))
    origin = turned.at(-model.jnt_pos[j])
    return Body(turn, origin, turned.spin, spin_rate, turned.acceleration(origin))


def rates_of_momentum(model: mujoco.MjModel, bodies: list[Body]) -> list[tuple[Array, Array, Array]]:
    """Return for every body m a, the rate of its angular momentum about its centre of mass, and that centre."""
    found = []
    for b, body in enumerate(bodies):
        centre = body.at(model.body_ipos[b])
        axes = body.turn @ matrix(model.body_iquat[b])
        inertia = axes @ np.diag(model.body_inertia[b]) @ axes.T
        turning = inertia @ body.spin_rate + np.cross(body.spin, inertia @ body.spin)
        found.append((model.body_mass[b] * body.acceleration(centre), turning, centre))
    return found


def about(axis: Array, angle: float) -> Array:
    """Return Rodrigues' rotation matrix."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def matrix(quat: Array) -> Array:
    """Return the rotation matrix of a unit quaternion, real part first."""
    half = np.linalg.norm(quat[1:])
    return about(quat[1:] / half, 2 * np.arctan2(half, quat[0])) if half > 0.0 else np.eye(3)
