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
import contextlib
import tempfile
from pathlib import Path

import mujoco
import numpy as np
import opensim  # pyright: ignore[reportMissingImports]

import mjwrap as mw
from mjwrap.osim.verifying.scholz import scholz_length
from mjwrap.osim.verifying.stops import TouchingRoutes

CLOSE = 1e-9  # [m]
SHARES = 1.0, 0.5, 0.25, 0.1, 0.0  # of the way to a random pose that the constraints of a model may not allow


def compare(path: Path, poses: int, seed: int, geometry: list[str]) -> tuple[int, list[str]]:
    """Return the number of pairs of one model, and a line for each that differs by more than `CLOSE`."""
    with tempfile.TemporaryDirectory() as folder:
        written = Path(folder) / "model.xml"
        mw.import_osim(path, meshes=geometry).save(written)
        model = mujoco.MjModel.from_xml_path(str(written))
    data, muscles = mujoco.MjData(model), mw.MuscleSystem(model)
    if not muscles.n:
        return 0, []
    names = muscles.coordinates
    rng = np.random.default_rng(seed)
    count, lines = 0, []
    paths = TouchingRoutes(muscles)
    for k in range(poses):
        mujoco.mj_resetData(model, data)
        place(model, data, {name: draw(model, name, rng) for name in names})
        mujoco.mj_forward(model, data)
        muscles.reset(data)
        muscles.forward(data)
        for route in paths.now(data):
            name, length = route.muscle, route.length
            count += 1
            try:
                theirs = scholz_length(opensim, route)
            except RuntimeError as error:
                lines.append(f"  {name}, pose {k}: OpenSim: {' '.join(str(error).split())[:100]}")
                continue
            if theirs is None:
                lines.append(f"  {name}, pose {k}: OpenSim has no such path, or a length that is no number")
            elif not abs(theirs - length) <= CLOSE:
                lines.append(
                    f"  {name}, pose {k}: {length:.9f} m, OpenSim {theirs:.9f} m ({length - theirs:+.2e})"
                )
    return count, lines


def place(model: mujoco.MjModel, data: mujoco.MjData, values: dict[str, float]) -> None:
    """Set coordinates, or such nearer to the default pose as satisfy the model's constraints."""
    default = mw.osim.coordinates(model, data)
    for share in SHARES:
        nearer = {name: default[name] + share * (value - default[name]) for name, value in values.items()}
        with contextlib.suppress(mw.StateError):
            mw.osim.set_coordinates(model, data, nearer)
            return


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
