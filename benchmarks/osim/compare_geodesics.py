"""Lengths of imported paths beside OpenSim's own geodesics and its classic paths. Needs the package opensim.

    python benchmarks/osim/compare_geodesics.py MODEL.osim ... [--poses 30]

For every path and random pose: mjwrap's length over the surfaces in the order in which the import wrote them, that of
a `Scholz2015GeometryPath` over the surfaces that mjwrap touches (hint: middle of mjwrap's contact chord; over one
sphere the closed form), and that of the file's own path. Coordinates are drawn as the import draws them; constraints
are met.
"""

import argparse
import math
from pathlib import Path

import mujoco
import numpy as np
import opensim

import mjwrap as mw
from mjwrap.mjcf import read_declarations
from mjwrap.mjcf.declarations import MuscleDeclaration
from mjwrap.osim.kinematics import body_poses
from mjwrap.osim.reading.model import read_osim
from mjwrap.osim.writing.sampled_poses import sampled_poses

CLOSE = 1e-9  # [m]


def body_xyz(rotation: np.ndarray) -> tuple[float, float, float]:
    """Return the body-fixed x-y-z angles of a rotation matrix [rad]."""
    y = math.asin(max(-1.0, min(1.0, rotation[0, 2])))
    return math.atan2(-rotation[1, 2], rotation[2, 2]), y, math.atan2(-rotation[0, 1], rotation[0, 0])


def contact_geometry(surface: mw.Sphere, place: np.ndarray, rotation: np.ndarray, ground: object) -> object:
    """Return OpenSim's contact geometry of a surface at a pose in ground."""
    origin, turn = opensim.Vec3(*map(float, place)), opensim.Vec3(*body_xyz(rotation))
    if isinstance(surface, mw.Cylinder):
        return opensim.ContactCylinder(surface.radius, origin, turn, ground)
    if isinstance(surface, mw.Sphere):
        return opensim.ContactSphere(surface.radius, origin, ground)
    if isinstance(surface, mw.Ellipsoid):
        return opensim.ContactEllipsoid(opensim.Vec3(*surface.radii), origin, turn, ground)
    return opensim.ContactTorus(surface.major_radius, surface.minor_radius, origin, turn, ground)


def scholz_length(points: list[tuple[str, object]]) -> float:
    """Return the length of OpenSim's geodesic path; NaN where it throws. points: via points, obstacles with hints."""
    model = opensim.Model()
    ground = model.getGround()
    path = opensim.Scholz2015GeometryPath()
    path.setName("path")
    for k, (kind, what) in enumerate(points):
        if kind == "point":
            path.appendPathPoint(ground, opensim.Vec3(*map(float, what)))
        else:
            surface, place, rotation, hint = what
            shape = contact_geometry(surface, place, rotation, ground)
            shape.setName(f"surface{k}")
            model.addContactGeometry(shape)
            path.appendObstacle(shape, opensim.Vec3(*map(float, hint)))
    model.addComponent(path)
    try:
        state = model.initSystem()
        model.realizePosition(state)
        return path.getLength(state)
    except RuntimeError:
        return float("nan")


def reference_length(points: list[tuple[str, object]]) -> float:
    """Return the length of the path span by span: in closed form over one sphere, else by OpenSim's geodesics."""
    total, span = 0.0, points[:1]
    for stop in points[1:]:
        span.append(stop)
        if stop[0] != "point":
            continue
        surfaces = [what for kind, what in span if kind == "surface"]
        first, last = span[0][1], stop[1]
        if not surfaces:
            total += float(np.linalg.norm(last - first))
        elif len(surfaces) == 1 and isinstance(surfaces[0][0], mw.Sphere):
            radius, a, b = surfaces[0][0].radius, first - surfaces[0][1], last - surfaces[0][1]
            far_a, far_b = np.linalg.norm(a), np.linalg.norm(b)
            turn = np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b)
            turn -= np.arccos(radius / far_a) + np.arccos(radius / far_b)
            total += float(np.sqrt(far_a**2 - radius**2) + np.sqrt(far_b**2 - radius**2) + radius * turn)
        else:
            total += scholz_length(span)
        span = [stop]
    return total


class World:
    """Sites and geoms of an imported model at a pose of its bodies."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self.model = model

    def place(self, bodies: dict, kind: str, index: int) -> tuple[np.ndarray, np.ndarray]:
        """Return position and rotation in ground of a site or geom."""
        model = self.model
        body = int(getattr(model, f"{kind}_bodyid")[index])
        pose = bodies["ground" if body == 0 else model.body(body).name]
        turn = np.zeros(9)
        mujoco.mju_quat2Mat(turn, getattr(model, f"{kind}_quat")[index])
        local = getattr(model, f"{kind}_pos")[index]
        return pose.position + pose.rotation @ local, pose.rotation @ turn.reshape(3, 3)


def solved(
    world: World, bodies: dict, muscle: MuscleDeclaration
) -> tuple[mw.PathSolution, list[tuple[str, object]]]:
    """Return mjwrap's path, and what it touches for OpenSim."""
    route = muscle.routes[0]
    first, last = (world.place(bodies, "site", site)[0] for site in (route.origin, route.insertion))
    stops: list[mw.Obstacle | mw.ViaPoint] = []
    frames = []
    for node in route.nodes:
        if node.surface is None:
            place, rotation = world.place(bodies, "site", node.site)
            stops.append(mw.ViaPoint(tuple(place)))
        else:
            place, rotation = world.place(bodies, "geom", node.geom)
            quat = np.zeros(4)
            mujoco.mju_mat2Quat(quat, rotation.ravel())
            side = None
            if node.hint_site >= 0:
                at = world.place(bodies, "site", node.hint_site)[0]
                side = tuple(rotation.T @ (at - place))
            stops.append(mw.Obstacle(node.surface, tuple(place), tuple(quat), side=side))
        frames.append((place, rotation))
    solution = mw.solve_path(first, last, stops)
    points: list[tuple[str, object]] = [("point", first)]
    for node, contact, (place, rotation) in zip(route.nodes, solution.contacts, frames, strict=True):
        if node.surface is None:
            points.append(("point", place))
        elif contact.active:
            middle = rotation.T @ (0.5 * (contact.P + contact.Q) - place)
            points.append(("surface", (node.surface, place, rotation, middle)))
    return solution, [*points, ("point", last)]


def compare(file: Path, count: int) -> None:
    """Print the comparison for one model."""
    imported = mw.import_osim(file)
    model = mujoco.MjModel.from_xml_string(imported.xml, imported.assets)
    muscles = [m for m in read_declarations(model).muscles if m.surfaces]
    world, description = World(model), read_osim(file)
    classic = opensim.Model(str(file))
    state = classic.initSystem()
    pairs = touching = close = unsolved = within = 0
    compared, rest = [], []
    for sample in sampled_poses(description, count, seed=11):
        bodies = body_poses(description, sample.values)
        for name, value in sample.values.items():
            coordinate = classic.getCoordinateSet().get(name)
            coordinate.setLocked(state, False)
            coordinate.setValue(state, value, False)
        classic.realizePosition(state)
        for muscle in muscles:
            solution, points = solved(world, bodies, muscle)
            path = opensim.Muscle.safeDownCast(classic.getForceSet().get(muscle.name)).getGeometryPath()
            pairs += 1
            if not solution.converged:
                unsolved += 1
                rest.append((float("nan"), muscle.name, solution.status.name))
                continue
            difference = abs(solution.length - path.getLength(state))
            within += difference < 1e-3
            compared.append((difference, muscle.name))
            if any(kind == "surface" for kind, _ in points):
                touching += 1
                length = reference_length(points)
                if abs(length - solution.length) < CLOSE:
                    close += 1
                else:
                    rest.append((length - solution.length, muscle.name, "reference"))
    print(
        f"{file.stem}: {len(muscles)} paths over surfaces, {pairs} pairs of path and pose, {unsolved} not converged"
    )
    print(
        f"  touching {touching}, within {CLOSE:g} m of the reference {close} ({close / max(touching, 1):.1%})"
    )
    print(
        f"  within 1 mm of the classic path {within / max(pairs - unsolved, 1):.1%}, worst {max(compared, default=0)}"
    )
    for entry in rest[:20]:
        print("   ", *entry)


def main() -> None:
    """Compare every model given."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("models", nargs="+", type=Path)
    parser.add_argument("--poses", type=int, default=30)
    options = parser.parse_args()
    opensim.Logger.setLevelString("Off")
    for file in options.models:
        compare(file, options.poses)


if __name__ == "__main__":
    main()
