"""The slow, obvious twin of a wrapped tendon: tangents and arcs in closed form, on the side of the side site."""

import math

import mujoco
import numpy as np
from mjcf_reading import Vector


def cylinder_length(a: Vector, b: Vector, radius: float, side: Vector) -> float:
    """Length [m] from a to b round a cylinder about z, both in its frame, on the side of `side`."""
    step = b[:2] - a[:2]
    nearest = a[:2] + np.clip(-a[:2] @ step / (step @ step), 0, 1) * step
    if np.hypot(*nearest) >= radius and nearest @ side[:2] >= 0:
        return float(np.linalg.norm(b - a))
    reach_a, reach_b = np.hypot(*a[:2]), np.hypot(*b[:2])
    found = []
    for turn in (1, -1):
        angle_p = math.atan2(a[1], a[0]) + turn * math.acos(radius / reach_a)
        angle_q = math.atan2(b[1], b[0]) - turn * math.acos(radius / reach_b)
        arc = turn * (angle_q - angle_p) % (2 * math.pi)
        middle = angle_p + turn * arc / 2
        if math.cos(middle) * side[0] + math.sin(middle) * side[1] > 0:
            plane = math.sqrt(reach_a**2 - radius**2) + radius * arc + math.sqrt(reach_b**2 - radius**2)
            found.append(math.hypot(plane, a[2] - b[2]))
    return min(found)


def sphere_length(a: Vector, b: Vector, radius: float) -> float:
    """Length [m] from a to b round a sphere about the origin that their chord enters."""
    reach_a, reach_b = np.linalg.norm(a), np.linalg.norm(b)
    arc = math.acos(a @ b / (reach_a * reach_b)) - math.acos(radius / reach_a) - math.acos(radius / reach_b)
    return math.sqrt(reach_a**2 - radius**2) + radius * arc + math.sqrt(reach_b**2 - radius**2)


def closed_form_length(model: mujoco.MjModel, data: mujoco.MjData, tendon: int) -> float:
    length, last, geom, side_site = 0.0, np.full(3, np.nan), -1, -1
    start = model.tendon_adr[tendon]
    for row in range(start, start + model.tendon_num[tendon]):
        obj = model.wrap_objid[row]
        if model.wrap_type[row] != mujoco.mjtWrap.mjWRAP_SITE:
            geom, side_site = obj, int(model.wrap_prm[row])
            continue
        point = data.site_xpos[obj].copy()
        if row > start and geom < 0:
            length += float(np.linalg.norm(point - last))
        elif geom >= 0:
            centre, rotation = data.geom_xpos[geom], data.geom_xmat[geom].reshape(3, 3)
            a, b, side = ((p - centre) @ rotation for p in (last, point, data.site_xpos[side_site]))
            radius = float(model.geom_size[geom, 0])
            if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_CYLINDER:
                length += cylinder_length(a, b, radius, side)
            else:
                length += sphere_length(a, b, radius)
            geom = -1
        last = point
    return length
