"""Random descriptions of OpenSim models: what is written moves as the slow twin in NumPy says."""

import mujoco
import numpy as np
import pytest
from osim_mechanics import all_values, pose, written

from mjwrap.osim.description.bodies import Axis, Body, Coordinate, Coupler, Frame, Joint
from mjwrap.osim.description.functions import Piecewise, constant, linear
from mjwrap.osim.description.model import OsimModel
from mjwrap.osim.kinematics.poses import body_poses


def spline(rng: np.random.Generator, degree: int = 3) -> Piecewise:
    """A random function with three pieces and a continuous slope."""
    breaks, origins = np.array([-0.5, 0.6]), np.array([-0.5, -0.5, 0.6])
    rows = np.zeros((3, degree + 1))
    rows[1] = rng.normal(size=degree + 1) * 0.5 ** np.arange(degree + 1)
    rows[0, :2] = rows[1, :2]
    step = 1.1
    rows[2, 0] = sum(value * step**k for k, value in enumerate(rows[1]))
    rows[2, 1] = sum(k * value * step ** (k - 1) for k, value in enumerate(rows[1]) if k)
    return Piecewise(breaks, origins, rows, "SimmSpline")


def frame(rng: np.random.Generator, body: str) -> Frame:
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return Frame(body, rng.normal(0.0, 0.1, 3), turn * np.linalg.det(turn))


def random_model(seed: int) -> OsimModel:
    """A tree of four bodies with up to three coordinates a joint; some depend on others, some joints lead to ground."""
    rng = np.random.default_rng(seed)
    names = ["ground", "a", "b", "c", "d"]
    bodies, joints, couplers = [], [], []
    coordinates: list[str] = []
    for i, name in enumerate(names[1:], start=1):
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        bodies.append(
            Body(name, rng.uniform(0.5, 2.0), rng.normal(0.0, 0.1, 3), turn @ np.diag([2, 3, 4]) @ turn.T)
        )
        own = [f"{name}{k}" for k in range(rng.integers(1, 4))]
        axes = []
        for k in range(6):
            axis = rng.normal(size=3) if k < 3 else np.eye(3)[k - 3]
            axis /= np.linalg.norm(axis)
            kind = rng.integers(0, 6)
            if k < len(own):
                kind = 0  # each coordinate has an axis of its own
            which = own[k] if k < len(own) else own[rng.integers(0, len(own))]
            function = {
                0: linear(float(rng.choice([1.0, -1.0])), float(rng.normal(0.0, 0.2))),
                1: linear(float(rng.normal()), 0.1),
                2: spline(rng),
                3: spline(rng, 6),
            }.get(int(kind))
            axes.append(Axis(axis, (), constant(0.3)) if function is None else Axis(axis, (which,), function))
        given = tuple(
            Coordinate(each, "", "rotational", float(rng.normal(0.0, 0.3)), 0.0, (-1.2, 1.2), False, False)
            for each in own
        )
        parent, child = frame(rng, names[rng.integers(0, i)]), frame(rng, name)
        if rng.random() < 0.3:
            parent, child = child, parent
        joints.append(
            Joint(f"j{name}", "CustomJoint", parent, child, given, tuple(axes[:3]), tuple(axes[3:]))
        )
        for each in own:
            if coordinates and rng.random() < 0.3:
                leader = coordinates[rng.integers(0, len(coordinates))]
                couplers.append(Coupler(f"c_{each}", each, (leader,), spline(rng), float(rng.normal())))
        coordinates += own
    gravity = np.array([0.0, -9.81, 0.0])
    return OsimModel("random", 40000, gravity, tuple(bodies), tuple(joints), tuple(couplers), (), ())


@pytest.mark.parametrize("seed", range(30))
def test_poses_are_those_of_the_slow_twin(seed):
    osim = random_model(seed)
    found = written(osim)
    compiled = found.compile()
    data = mujoco.MjData(compiled)
    assert all(entry.outcome != "left out" for entry in found.report.entries)
    rng = np.random.default_rng(seed)
    dependent = {constraint.dependent for constraint in osim.constraints if isinstance(constraint, Coupler)}
    independent = [each.name for each in osim.coordinates if each.name not in dependent]
    for k in range(5):
        values = {name: float(rng.uniform(-1.2, 1.2)) for name in independent}
        if k == 0:
            values = {name: found.skeleton.drivers.values[name] for name in independent}
        pose(found, compiled, data, values)
        for name, twin in body_poses(osim, all_values(found, values)).items():
            if name != "ground":
                # Functions of degree 6, and their compositions, are written to 1e-10.
                np.testing.assert_allclose(data.body(name).xpos, twin.position, rtol=0.0, atol=5e-9)
                np.testing.assert_allclose(
                    data.body(name).xmat.reshape(3, 3), twin.rotation, rtol=0.0, atol=5e-9
                )
