#!/usr/bin/env python3
"""Compare the wrapped paths of imported OpenSim models with OpenSim's `Scholz2015GeometryPath` at random poses.

    python3 benchmarks/osim/scholz_lengths.py MODEL.osim ... [--poses 50] [--seed 0] [--geometry FOLDER]

Needs the opensim package. Every model is imported, written, and loaded again. At each pose every path that touches a
surface is built once more in OpenSim: its points and the surfaces that it touches, fixed in the world, each with the
middle of mjwrap's contact chord as hint. Surfaces that the path does not touch are left out: mjwrap's certificate says
that it does not run through them. Printed: pairs of path and pose, the share within 1e-9 m, and the others one by one.
"""

from __future__ import annotations

import argparse
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import opensim  # pyright: ignore[reportMissingImports]
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import mjwrap as mw
from mjwrap.kernels import layout
from mjwrap.kernels.coupling import muscle_paths

Array = NDArray[np.float64]
CLOSE = 1e-9  # [m]


@dataclass(frozen=True)
class Stop:
    """A stop of a path in the world: a point, or a surface with its pose and a hint in its frame."""

    pos: Array
    surface: Any = None
    turn: Array | None = None
    hint: Array | None = None


def shape(stop: Stop, body: Any) -> Any:
    """Return the contact geometry of a stop's surface."""
    origin = opensim.Vec3(*stop.pos)
    angles = Rotation.from_matrix(stop.turn).as_euler("XYZ")
    turn, surface = opensim.Vec3(*angles), stop.surface
    if isinstance(surface, mw.Cylinder):
        return opensim.ContactCylinder(surface.radius, origin, turn, body)
    if isinstance(surface, mw.Sphere):
        frame = opensim.PhysicalOffsetFrame(body, opensim.Transform())
        frame.set_translation(origin)
        return opensim.ContactSphere(surface.radius, origin, body)
    if isinstance(surface, mw.Ellipsoid):
        return opensim.ContactEllipsoid(opensim.Vec3(*surface.radii), origin, turn, body)
    if isinstance(surface, mw.Torus):
        return opensim.ContactTorus(surface.major_radius, surface.minor_radius, origin, turn, body)
    raise NotImplementedError(f"OpenSim's path has no {type(surface).__name__}")


def scholz_length(stops: list[Stop]) -> float:
    """Return the length of OpenSim's path over the stops [m]; `RuntimeError` where it throws."""
    model = opensim.Model()
    ground = model.getGround()
    path = opensim.Scholz2015GeometryPath()
    path.setName("path")
    for k, stop in enumerate(stops):
        if stop.surface is None:
            path.appendPathPoint(ground, opensim.Vec3(*stop.pos))
            continue
        geometry = shape(stop, ground)
        geometry.setName(f"surface{k}")
        model.addContactGeometry(geometry)
        hint = np.zeros(3) if stop.hint is None else stop.hint
        path.appendObstacle(geometry, opensim.Vec3(*hint))
    model.addComponent(path)
    state = model.initSystem()
    model.realizePosition(state)
    return float(path.getLength(state))


class Paths:
    """The stops of the routes of a model's muscles at the last evaluated pose."""

    def __init__(self, muscles: mw.MuscleSystem) -> None:
        self.muscles = muscles
        self.surfaces = [
            node.surface for m in muscles.declarations for route in m.routes for node in route.nodes
        ]

    def touching(self) -> list[tuple[str, float, list[Stop]]]:
        """Return name, length and stops of every route that touches a surface and is converged."""
        plan, state = self.muscles._plan, self.muscles._last
        node, poses = state.paths.node, state.scratch
        found = []
        for c, route in enumerate(plan.routes):
            info = state.paths.info[c]
            if info[layout.I_STATUS] != layout.CONVERGED or not route[muscle_paths.R_SURFACES]:
                continue
            rows = node[route[muscle_paths.R_LO] : route[muscle_paths.R_HI]]
            touched = rows[:, layout.S_MODE] == layout.TOUCHED
            if not (touched & (rows[:, layout.KIND] != layout.VIA)).any():
                continue
            stops = [Stop(self._site(poses, route[muscle_paths.R_FROM]))]
            for k, row in enumerate(rows):
                place = row[layout.POS : layout.POS + 3].copy()
                if row[layout.KIND] == layout.VIA:
                    stops.append(Stop(place))
                elif touched[k]:
                    turn = row[layout.ROT : layout.ROT + 9].reshape(3, 3).copy()
                    first = stops[0].pos
                    ends = [row[w : w + 3] + first for w in (layout.W_P, layout.W_Q)]
                    middle = turn.T @ (0.5 * (ends[0] + ends[1]) - place)
                    stops.append(Stop(place, self.surfaces[route[muscle_paths.R_LO] + k], turn, middle))
            stops.append(Stop(self._site(poses, route[muscle_paths.R_TO])))
            name = self.muscles.names[int(route[muscle_paths.R_MUSCLE])]
            found.append((name, float(info[layout.I_LENGTH]), stops))
        return found

    def _site(self, poses: mujoco.MjData, site: int) -> Array:
        return poses.site_xpos[site].copy()


def compare(path: Path, poses: int, seed: int, geometry: list[str]) -> tuple[int, list[str]]:
    """Return the number of pairs of one model, and a line for each that differs by more than `CLOSE`."""
    with tempfile.TemporaryDirectory() as folder:
        written = Path(folder) / "model.xml"
        mw.import_osim(path, meshes=geometry).save(written)
        model = mujoco.MjModel.from_xml_path(str(written))
    data, muscles = mujoco.MjData(model), mw.MuscleSystem(model)
    names = muscles.coordinates
    rng = np.random.default_rng(seed)
    count, lines = 0, []
    paths = Paths(muscles)
    for k in range(poses):
        mujoco.mj_resetData(model, data)
        mw.osim.set_coordinates(model, data, {name: draw(model, name, rng) for name in names})
        mujoco.mj_forward(model, data)
        muscles.reset(data)
        muscles.forward(data)
        for name, length, stops in paths.touching():
            count += 1
            try:
                theirs = scholz_length(stops)
            except RuntimeError as error:
                lines.append(f"  {name}, pose {k}: OpenSim: {' '.join(str(error).split())[:100]}")
                continue
            if not abs(theirs - length) <= CLOSE:
                lines.append(
                    f"  {name}, pose {k}: {length:.9f} m, OpenSim {theirs:.9f} m ({length - theirs:+.2e})"
                )
    return count, lines


def draw(model: mujoco.MjModel, name: str, rng: np.random.Generator) -> float:
    """Return a random value of a coordinate in its range [rad or m]."""
    joint = model.joint(name)
    low, high = (float(x) for x in joint.range)
    widest = np.pi if int(joint.type[0]) == mujoco.mjtJoint.mjJNT_HINGE else 1.0
    if low >= high:
        low, high = -0.2 * widest, 0.2 * widest
    return float(rng.uniform(max(low, -widest), min(high, widest)))


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("models", nargs="+", type=Path)
    parser.add_argument("--poses", type=int, default=50)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--geometry", action="append", default=[])
    options = parser.parse_args()
    opensim.Logger.setLevelString("off")
    for path in options.models:
        count, lines = compare(path, options.poses, options.seed, options.geometry)
        share = 100.0 * (1.0 - len(lines) / count) if count else float("nan")
        print(
            f"{path.name}: {count} pairs that touch, {count - len(lines)} within {CLOSE:g} m ({share:.2f} %)",
            flush=True,
        )
        print("\n".join(lines), end="\n" if lines else "", flush=True)


if __name__ == "__main__":
    main()
