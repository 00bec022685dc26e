"""Write three small OpenSim models whose coordinates constraints tie, and freeze OpenSim's moment arms for them.

    python benchmarks/osim/freeze_tied_arms.py tests/data/osim [--poses 6] [--seed 3]

It needs the package opensim. The models are a linkage closed by a PointConstraint, a kneecap held by a
ConstantDistanceConstraint, whose coordinate no axis shows, and a chain closed by a WeldConstraint; two also have a
coupled and a locked coordinate. No path wraps. For each model, tied_KIND.osim and tied_KIND.json: values of all
coordinates at the default pose and at random ones that OpenSim assembled, path lengths, and computeMomentArm about
every coordinate. OpenSim leaves a coordinate unlocked after its moment arms, so a locked one has a model of its own.
"""

import argparse
import json
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import opensim

ASSEMBLED = 1e-12  # largest error of a constraint at a pose [m or rad]


class Builder:
    """A model in the making: bodies, joints with one coordinate each, constraints and paths."""

    def __init__(self, name: str) -> None:
        self.model = opensim.Model()
        self.model.setName(name)
        self.places: dict[str, opensim.PhysicalFrame] = {"ground": self.model.getGround()}

    def body(self, name: str) -> opensim.Body:
        inertia = opensim.Inertia(0.02, 0.03, 0.04)
        body = opensim.Body(name, 1.0, opensim.Vec3(0.05, 0.01, 0.0), inertia)
        self.model.addBody(body)
        self.places[name] = body
        return body

    def joint(
        self, kind: str, name: str, parent: str, at: tuple, child: str, coordinates: dict, *more
    ) -> None:
        """Add a joint at a place of its parent, at the origin of a new body; coordinates: range by name."""
        body, zero = self.body(child), opensim.Vec3(0.0)
        frames = (self.places[parent], opensim.Vec3(*at), zero, body, zero, zero)
        joint = getattr(opensim, kind)(name, *frames, *more)
        self.model.addJoint(joint)
        for i, (coordinate, (low, high, start)) in enumerate(coordinates.items()):
            found = joint.upd_coordinates(i)
            found.setName(coordinate)
            found.setRangeMin(low)
            found.setRangeMax(high)
            found.setDefaultValue(start)

    def path(self, name: str, *points: tuple[str, tuple]) -> None:
        spring = opensim.PathSpring(name, 0.1, 10.0, 0.0)
        for i, (body, at) in enumerate(points):
            spring.updGeometryPath().appendNewPathPoint(f"{name}_{i}", self.places[body], opensim.Vec3(*at))
        self.model.addForce(spring)


def tied_point() -> opensim.Model:
    made = Builder("tied_point")
    wide = (-1.2, 1.2)
    made.joint("PinJoint", "j1", "ground", (0, 0, 0), "crank", {"crank_angle": (*wide, 0.9)})
    made.joint("UniversalJoint", "j2", "crank", (0.3, 0, 0), "coupler",
               {"coupler_twist": (*wide, 0.1), "coupler_bend": (*wide, 0.2)})  # fmt: skip
    made.joint("UniversalJoint", "j3", "ground", (0.35, -0.05, 0), "rocker",
               {"rocker_twist": (*wide, 0.2), "rocker_bend": (*wide, 0.1)})  # fmt: skip
    made.joint("PinJoint", "j4", "coupler", (0.1, 0.05, 0), "tail", {"tail_angle": (*wide, 0.3)})
    made.joint("PinJoint", "j5", "rocker", (0.0, 0.1, 0.02), "foot", {"foot_angle": (*wide, 0.2)})
    made.model.updCoordinateSet()
    ends = opensim.Vec3(0.25, 0.1, 0.03), opensim.Vec3(0.05, 0.32, 0.04)
    closing = opensim.PointConstraint(made.places["coupler"], ends[0], made.places["rocker"], ends[1])
    closing.setName("closing")
    made.model.addConstraint(closing)
    coupler = opensim.CoordinateCouplerConstraint()
    coupler.setName("tail_coupler")
    names = opensim.ArrayStr()
    names.append("crank_angle")
    coupler.setIndependentCoordinateNames(names)
    coupler.setDependentCoordinateName("tail_angle")
    coupler.setFunction(opensim.PolynomialFunction(opensim.Vector.createFromMat(np.array([0.3, 0.5, 0.1]))))
    made.model.addConstraint(coupler)
    made.model.getJointSet().get("j5").upd_coordinates(0).set_locked(True)
    made.path("a", ("ground", (0.1, -0.1, 0.02)), ("coupler", (0.12, 0.04, 0.0)))
    made.path("b", ("crank", (0.1, 0.03, 0.01)), ("rocker", (0.03, 0.2, 0.0)))
    made.path("c", ("ground", (0, 0.2, 0)), ("crank", (0.2, 0.05, 0.0)), ("tail", (0.1, 0.02, 0.01)))
    made.path("d", ("tail", (0.05, 0.03, 0)), ("coupler", (0.2, 0.02, 0.0)), ("foot", (0.1, 0.0, 0.03)))
    return made.model


def tied_distance() -> opensim.Model:
    made = Builder("tied_distance")
    made.joint("PinJoint", "knee", "ground", (0, -0.4, 0), "shank", {"knee_angle": (-1.5, 0.1, -0.3)})
    made.joint(
        "SliderJoint", "slide", "shank", (0.0, -0.06, 0), "block", {"block_slide": (-0.03, 0.03, 0.005)}
    )
    transform = opensim.SpatialTransform()
    across = {2: ((0.0, 0.0, 1.0), (-1.1, -0.5, 0.1)), 3: ((1.0, 0.0, 0.0), (0.016, 0.042, 0.05)),
              4: ((0.0, 1.0, 0.0), (-0.43, -0.40, -0.37))}  # fmt: skip
    for i in range(6):
        axis = transform.updTransformAxis(i)
        if i not in across:
            axis.set_function(opensim.Constant(0.0))
            continue
        axis.setAxis(opensim.Vec3(*across[i][0]))
        names = opensim.ArrayStr()
        names.append("patella_angle")
        axis.setCoordinateNames(names)
        spline = opensim.SimmSpline()
        for x, y in zip((-1.8, -0.8, 0.2), across[i][1], strict=True):
            spline.addPoint(x, y)
        axis.set_function(spline)
    made.joint("CustomJoint", "glide", "ground", (0, 0, 0), "patella", {"patella_angle": (-1.7, 0.15, -0.3)},
               transform)  # fmt: skip
    ends = opensim.Vec3(0.002, -0.01, 0.0), opensim.Vec3(0.035, 0.01, 0.0)
    ligament = opensim.ConstantDistanceConstraint(
        made.places["patella"], ends[0], made.places["block"], ends[1], 0.065
    )
    ligament.setName("ligament")
    made.model.addConstraint(ligament)
    made.path("a", ("ground", (0.03, -0.1, 0.01)), ("patella", (0.01, 0.02, 0.0)))
    made.path("b", ("ground", (-0.02, -0.2, 0.0)), ("shank", (-0.03, -0.1, 0.01)))
    made.path("c", ("shank", (0.0, -0.2, 0.0)), ("block", (0.02, -0.03, 0.01)), ("patella", (0.01, 0.0, 0.0)))
    return made.model


def tied_weld() -> opensim.Model:
    made = Builder("tied_weld")
    wide = (-1.0, 1.0)
    made.joint("UniversalJoint", "j1", "ground", (0, 0, 0), "first", {"q1": (*wide, 0.1), "q2": (*wide, 0.5)})
    made.joint(
        "UniversalJoint", "j2", "first", (0.3, 0, 0), "second", {"q3": (*wide, 0.2), "q4": (*wide, -0.6)}
    )
    names = ("p_1", "p_2", "p_3", "p_x", "p_y", "p_z")
    transform = opensim.SpatialTransform()
    for i, name in enumerate(names):
        axis, own = transform.updTransformAxis(i), opensim.ArrayStr()
        own.append(name)
        axis.setCoordinateNames(own)
        axis.setAxis(opensim.Vec3(*np.eye(3)[(2, 0, 1, 0, 1, 2)[i]]))
        axis.set_function(opensim.LinearFunction(1.0, 0.0))
    ranges = {name: (*(wide if k < 3 else (-0.3, 0.3)), 0.05) for k, name in enumerate(names)}
    made.joint("CustomJoint", "j3", "ground", (0.4, 0.05, 0), "plate", ranges, transform)
    made.joint("PinJoint", "j4", "plate", (0.05, 0.1, 0), "arm", {"arm_angle": (*wide, 0.3)})
    made.joint("PinJoint", "j5", "plate", (0.1, -0.1, 0), "held", {"held_angle": (*wide, 0.25)})
    made.model.getJointSet().get("j5").upd_coordinates(0).set_locked(True)
    zero = opensim.Vec3(0.0)
    weld = opensim.WeldConstraint("weld", made.places["second"], opensim.Vec3(0.25, 0.02, 0), zero,
                                  made.places["plate"], opensim.Vec3(0.02, 0.03, 0),
                                  opensim.Vec3(0, 0, 0.4))  # fmt: skip
    made.model.addConstraint(weld)
    made.path("a", ("ground", (0.1, 0.2, 0.02)), ("second", (0.1, 0.04, 0.0)))
    made.path("b", ("first", (0.1, 0.05, 0.0)), ("plate", (0.05, 0.05, 0.01)), ("arm", (0.1, 0.02, 0.0)))
    made.path("c", ("ground", (0.3, -0.2, 0.0)), ("held", (0.1, 0.03, 0.02)))
    return made.model


def plain(text: str) -> str:
    """Return the text of a model without comments, groups and what only draws it."""
    text = re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL)
    text = re.sub(r"<(FrameGeometry|Appearance|attached_geometry).*?</\1>", "", text, flags=re.DOTALL)
    text = re.sub(r"<ModelVisualPreferences.*?</ModelVisualPreferences>", "", text, flags=re.DOTALL)
    return "\n".join(line.replace("\t", " ").rstrip() for line in text.splitlines() if line.strip()) + "\n"


def opened(file: Path) -> tuple[opensim.Model, opensim.State, dict[str, opensim.Coordinate]]:
    """Return a model from a file, its state, and its coordinates by name."""
    model = opensim.Model(str(file))
    model.set_assembly_accuracy(1e-14)
    state = model.initSystem()
    every = model.getCoordinateSet()
    return model, state, {every.get(i).getName(): every.get(i) for i in range(every.getSize())}


def posed(file: Path, values: dict[str, float]) -> tuple[opensim.Model, opensim.State, dict]:
    """Return a fresh model whose state has these values, without an assembly."""
    model, state, coordinates = opened(file)
    for name, value in values.items():
        coordinates[name].setLocked(state, False)
        coordinates[name].setValue(state, value, False)
        coordinates[name].setLocked(state, coordinates[name].getDefaultLocked())
    model.realizePosition(state)
    return model, state, coordinates


def error_of(model: opensim.Model, state: opensim.State) -> float:
    model.realizePosition(state)
    errors = state.getQErr()
    return max(abs(errors.get(i)) for i in range(errors.size()))


def pose(file: Path, rng: np.random.Generator, spread: float) -> dict[str, float]:
    """Return the values of all coordinates at a pose that OpenSim assembled near the default one."""
    while True:
        model, state, coordinates = opened(file)
        for coordinate in coordinates.values():
            if not coordinate.isConstrained(state):
                width = coordinate.getRangeMax() - coordinate.getRangeMin()
                value = coordinate.getValue(state) + spread * width * rng.uniform(-1.0, 1.0)
                coordinate.setValue(state, float(value), False)
        model.assemble(state)
        if error_of(model, state) <= ASSEMBLED:
            return {name: float(c.getValue(state)) for name, c in coordinates.items()}


def frozen(file: Path, poses: int, rng: np.random.Generator) -> dict:
    """Return values, lengths and moment arms at the default pose and at random ones."""
    values, lengths, arms = [], [], []
    for k in range(poses + 1):
        values.append(pose(file, rng, 0.15 if k else 0.0))
        model, state, coordinates = posed(file, values[-1])
        paths = {force.getName(): force.getGeometryPath() for force in springs(model)}
        lengths.append({name: float(path.getLength(state)) for name, path in paths.items()})
        about: dict[str, dict[str, float]] = {name: {} for name in paths}
        for name, coordinate in coordinates.items():
            use, at, own = paths, state, coordinate
            if coordinate.getDefaultLocked():
                other, at, every = posed(file, values[-1])
                own, use = every[name], {force.getName(): force.getGeometryPath() for force in springs(other)}
            for path in use:
                about[path][name] = float(use[path].computeMomentArm(at, own))
        arms.append(about)
    return {"values": values, "lengths": lengths, "moment_arms": arms}


def springs(model: opensim.Model) -> list:
    forces = model.getForceSet()
    return [opensim.PathSpring.safeDownCast(forces.get(i)) for i in range(forces.getSize())]


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("output", type=Path)
    parser.add_argument("--poses", type=int, default=6)
    parser.add_argument("--seed", type=int, default=3)
    options = parser.parse_args()
    opensim.Logger.setLevelString("off")
    rng = np.random.default_rng(options.seed)
    makers: tuple[Callable[[], opensim.Model], ...] = (tied_point, tied_distance, tied_weld)
    for make in makers:
        file = options.output / f"{make.__name__}.osim"
        model = make()
        model.finalizeConnections()
        model.printToXML(str(file))
        file.write_text(plain(file.read_text()))
        found = {"made by": "benchmarks/osim/freeze_tied_arms.py", "OpenSim": opensim.GetVersion()}
        found |= {"seed": options.seed, **frozen(file, options.poses, rng)}
        file.with_suffix(".json").write_text(json.dumps(found) + "\n")


if __name__ == "__main__":
    main()
