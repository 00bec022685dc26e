"""Freeze poses, lengths and parameters of OpenSim models, and values of its splines, for tests without OpenSim.

    python benchmarks/osim/freeze_poses.py FOLDER OWN OUTPUT [--compare]

FOLDER holds the public models, OWN the small models of the tests; OUTPUT is the folder of the JSON files. It needs the
package `opensim`. For each model and a few seeded values of its coordinates, it stores the pose of every body, the
places of all markers and wrap objects, and the length of every path without wrap objects; then the parameters of some
muscles, and OWN/own_version_3.osim as OpenSim writes it again in its newest version.
With --compare it prints how far mjwrap is from OpenSim at 50 random poses of each model, and freezes nothing.
"""

from __future__ import annotations

import json
import multiprocessing
import re
import sys
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import opensim

POSES, COMPARED = 2, 50
WIDEST = 3.0  # [rad or m] coordinates are drawn from their range, within this distance of zero
MUSCLES = 3  # of each class and model whose parameters are stored
CURVES = ("FiberForceLengthCurve", "TendonForceLengthCurve", "ActiveForceLengthCurve", "ForceVelocityCurve")
# OpenSim rounds orientations of old files to six digits when it converts them; these are the numbers of the files.
EXACT_ORIENTATIONS = {
    "BushingForceModel_30000.osim": {
        "/jointset/sliderjoint/ground_offset": (0.0, 0.0, 1.5707963267949),
        "/jointset/sliderjoint/ball_offset": (0.0, 0.0, 1.5707963267949),
    }
}


def main() -> None:
    folder, own, output = (Path(argument) for argument in sys.argv[1:4])
    paths = sorted(folder.glob("*.osim")) + sorted(own.glob("own_*.osim"))
    if "--compare" in sys.argv:
        compare(paths)
        return
    write(output / "poses.json", {path.name: alone(poses_of, path, POSES) for path in paths})
    write(
        output / "muscle_parameters.json",
        {path.name: found for path in paths if (found := alone(muscles_of, path))},
    )
    write(output / "splines.json", splines())
    alone(write_again, own / "own_version_3.osim", output / "upgraded_version_3.osim")


def alone(function: Callable[..., Any], *arguments: Any) -> Any:
    """Return what a function returns in a process of its own: OpenSim keeps one model's <defaults> for the next."""
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        return pool.submit(function, *arguments).result()


def write(path: Path, records: Any) -> None:
    about = {
        "made by": "benchmarks/osim/freeze_poses.py",
        "OpenSim": opensim.GetVersion(),
        "records": records,
    }
    path.write_text(json.dumps(about, separators=(",", ":")).replace('{"values"', '\n{"values"') + "\n")


def write_again(source: Path, target: Path) -> None:
    """Write a model in OpenSim's newest version, without its comments."""
    loaded(source)[0].printToXML(str(target))
    text = re.sub(r"<!--.*?-->", "", target.read_text(), flags=re.DOTALL)
    target.write_text("\n".join(line for line in text.splitlines() if line.strip()) + "\n")


def loaded(path: Path) -> tuple[Any, Any]:
    """Return a model and its state."""
    opensim.Logger.setLevelString("Off")
    model = opensim.Model(str(path))
    for frame, angles in EXACT_ORIENTATIONS.get(path.name, {}).items():
        found = opensim.PhysicalOffsetFrame.safeDownCast(model.updComponent(frame))
        found.set_orientation(opensim.Vec3(*angles))
    return model, model.initSystem()


def poses_of(path: Path, count: int) -> list[dict[str, Any]]:
    """Return what is stored of a model at each of some poses."""
    model, state = loaded(path)
    coordinates = {c.getName(): c for c in model.getCoordinateSet()}
    couplers = couplers_of(model)
    rng = np.random.default_rng(1)
    records = []
    for _ in range(count):
        values = {}
        for name, coordinate in coordinates.items():
            low, high = max(coordinate.getRangeMin(), -WIDEST), min(coordinate.getRangeMax(), WIDEST)
            locked = coordinate.getDefaultLocked() or high <= low
            values[name] = coordinate.getDefaultValue() if locked else float(rng.uniform(low, high))
        for _ in couplers:  # a chain of couplers settles in as many rounds as it has links
            for name, (leader, function, scale) in couplers.items():
                values[name] = scale * function.calcValue(opensim.Vector(1, values[leader]))
        for name, coordinate in coordinates.items():
            coordinate.setLocked(state, False)
            coordinate.setValue(state, values[name], False)
        model.realizePosition(state)
        records.append({"values": values, **places_of(model, state)})
    return records


def couplers_of(model: Any) -> dict[str, tuple[str, Any, float]]:
    found = {}
    for constraint in model.getConstraintSet():
        coupler = opensim.CoordinateCouplerConstraint.safeDownCast(constraint)
        if coupler is not None and coupler.get_isEnforced():
            leader = coupler.getIndependentCoordinateNames().get(0)
            scale = opensim.PropertyHelper.getValueDouble(coupler.getPropertyByName("scale_factor"))
            found[coupler.getDependentCoordinateName()] = (leader, coupler.getFunction(), scale)
    return found


def places_of(model: Any, state: Any) -> dict[str, dict[str, Any]]:
    """Return poses of bodies and wrap objects as position and rows of the rotation, markers, and lengths."""
    wraps = {}
    for kind in ("WrapCylinder", "WrapEllipsoid", "WrapSphere", "WrapTorus"):
        for component in model.getComponentsList():
            if component.getConcreteClassName() == kind:
                wrap = getattr(opensim, kind).safeDownCast(component)
                whole = wrap.getFrame().getTransformInGround(state).compose(wrap.getTransform())
                wraps[wrap.getName()] = flat(whole)
    lengths = {}
    for force in model.getForceSet():
        path = f"/forceset/{force.getName()}/path"
        if model.hasComponent(path):
            found = opensim.GeometryPath.safeDownCast(model.getComponent(path))
            if found is not None and found.getWrapSet().getSize() == 0:
                lengths[force.getName()] = found.getLength(state)
    return {
        "bodies": {body.getName(): flat(body.getTransformInGround(state)) for body in bodies_of(model)},
        "wraps": wraps,
        "markers": {m.getName(): triple(m.getLocationInGround(state)) for m in model.getMarkerSet()},
        "lengths": lengths,
    }


def bodies_of(model: Any) -> list[Any]:
    """Return all bodies, those outside the body set too."""
    found = [c for c in model.getComponentsList() if c.getConcreteClassName() == "Body"]
    return [opensim.Body.safeDownCast(component) for component in found]


def triple(vector: Any) -> list[float]:
    return [vector.get(i) for i in range(3)]


def flat(transform: Any) -> list[float]:
    return triple(transform.p()) + [transform.R().get(i, j) for i in range(3) for j in range(3)]


def muscles_of(path: Path) -> dict[str, Any]:
    """Return all number parameters of a few muscles of each class, and the parameters of their curves in use."""
    model, _ = loaded(path)
    found: dict[str, Any] = {}
    counts: dict[str, int] = {}
    for force in model.getForceSet():
        muscle = opensim.Muscle.safeDownCast(force)
        kind = force.getConcreteClassName()
        counts[kind] = counts.get(kind, 0) + 1
        if muscle is None or counts[kind] > MUSCLES:
            continue
        parameters = {}
        for i in range(muscle.getNumProperties()):
            entry = muscle.getPropertyByIndex(i)
            if entry.getTypeName() in ("double", "bool") and entry.size() == 1:
                helper = opensim.PropertyHelper
                reads = helper.getValueBool if entry.getTypeName() == "bool" else helper.getValueDouble
                parameters[entry.getName()] = float(reads(entry))
        curves = {}
        if kind == "Millard2012EquilibriumMuscle":
            curves = {curve: curve_of(muscle, kind, curve) for curve in CURVES}
        found[muscle.getName()] = {"kind": kind, "parameters": parameters, "curves": curves}
    return found


def curve_of(muscle: Any, kind: str, name: str) -> dict[str, float]:
    curve = getattr(getattr(opensim, kind).safeDownCast(muscle), f"get{name}")()
    values = {}
    for i in range(curve.getNumProperties()):
        entry = curve.getPropertyByIndex(i).getName()
        in_use = "get" + "".join(word.capitalize() for word in entry.split("_")) + "InUse"
        values[entry] = getattr(curve, in_use, None) or getattr(curve, f"get_{entry}")
    return {entry: get() for entry, get in values.items()}


def splines() -> list[dict[str, Any]]:
    """Return random knots of splines, and values and derivatives inside, outside and at the knots."""
    rng = np.random.default_rng(0)
    records = []
    for kind, counts in (("SimmSpline", (2, 3, 4, 5, 8, 20)), ("GCVSpline", (4, 6, 12))):
        for count in counts:
            function = getattr(opensim, kind)()
            if kind == "GCVSpline":
                function.setDegree(3)
            x = np.sort(rng.choice(np.arange(-2000, 2000), count, replace=False) / 1000.0).tolist()
            y = rng.normal(size=count).tolist()
            for knot, value in zip(x, y, strict=True):
                function.addPoint(knot, value)
            at = [x[0] - 0.5, x[-1] + 0.7, *rng.uniform(-2.5, 2.5, 20).tolist(), *x]
            values = [function.calcValue(opensim.Vector(1, point)) for point in at]
            first = opensim.StdVectorInt()
            first.append(0)
            slopes = [function.calcDerivative(first, opensim.Vector(1, point)) for point in at]
            records.append({"kind": kind, "x": x, "y": y, "at": at, "values": values, "slopes": slopes})
    return records


def compare(paths: list[Path]) -> None:
    """Print the largest differences of mjwrap's poses [m or 1] and lengths [m] from OpenSim's."""
    from mjwrap.osim.kinematics import body_poses, complete, frame_pose, path_length
    from mjwrap.osim.reading import read_osim

    for path in paths:
        model = read_osim(path)
        worst, longest, lengths = 0.0, 0.0, 0
        for record in alone(poses_of, path, COMPARED):
            values = complete(model, record["values"])
            poses = body_poses(model, values)
            frames = {body: poses[body] for body in record["bodies"]}
            frames |= {wrap.name: frame_pose(poses, wrap.frame) for wrap in model.wraps}
            for name, numbers in (record["bodies"] | record["wraps"]).items():
                ours = [*frames[name].position, *frames[name].rotation.ravel()]
                worst = max(worst, float(np.abs(np.subtract(ours, numbers)).max()))
            for force in model.forces:
                route = getattr(force, "path", None)
                if force.name in record["lengths"] and route is not None:
                    difference = path_length(route, poses, values) - record["lengths"][force.name]
                    longest, lengths = max(longest, abs(difference)), lengths + 1
        print(f"{path.name:45s} poses {worst:8.1e}   lengths {longest:8.1e} ({lengths})")


if __name__ == "__main__":
    main()
