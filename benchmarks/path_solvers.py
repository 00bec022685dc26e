"""The solvers that bench_paths.py times, behind one protocol: a whole sweep in, times and lengths out.

The clock counts the thread's CPU time, so that a busy machine does not add the time for which it takes the core away.
"""

from __future__ import annotations

import gc
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from time import thread_time as clock
from typing import Any, Protocol

import mujoco
import numpy as np
from path_scenes import Array, Scene

import mjwrap as mw

COPIES = 100  # of a tendon in the timed model
BLOCK, LEAD = 100, 5  # poses of a timed block, poses before it that are timed alone and subtracted


@dataclass
class Sweep:
    """One timed sweep over T poses.

    mean, samples: of the time per new pose [us]; length (T,) [m]; failed (T,): poses that the solver itself gives up.
    """

    mean: float
    samples: Array
    length: Array
    failed: Array
    notes: dict[str, float] = field(default_factory=dict)


class Solver(Protocol):
    """A solver set up for one scene."""

    name: str

    def sweep(self) -> Sweep:
        """Run and time the whole sweep once."""
        ...


class Mjwrap:
    """mjwrap.solve_sweep over a scene, warm or cold.

    The mean is the time of one whole call, its set-up and its first, cold pose included, over the number of poses. The
    samples are what the compiled loop takes: blocks of poses, each behind a short lead-in; the median time of the
    lead-ins' own calls is subtracted.
    """

    def __init__(self, scene: Scene, warm: bool) -> None:
        self.name = "mjwrap warm" if warm else "mjwrap cold"
        self.warm = warm
        self.ends = scene.origin, scene.insertion, scene.obstacles()
        self.pos, self.quat = scene.motion()

    def _call(self, first: int, last: int) -> tuple[float, mw.SweepSolution]:
        pos, quat = self.pos[first:last], self.quat[first:last]
        began = clock()
        solution = mw.solve_sweep(*self.ends, pos, quat, warm=self.warm)
        return 1e6 * (clock() - began), solution

    def sweep(self) -> Sweep:
        """Time one whole call, then every block of it."""
        poses = len(self.pos)
        total, solution = self._call(0, poses)
        starts = range(0, poses - BLOCK - LEAD + 1, BLOCK)
        lead = np.median([self._call(first, first + LEAD)[0] for first in starts for _ in range(3)])
        blocks = np.array([self._call(first, first + LEAD + BLOCK)[0] for first in starts])
        bad = (solution.status != mw.Status.CONVERGED) | ~(solution.tangency_error <= 1e-10)
        notes = {
            "iterations": float(solution.iterations.mean()),
            "evaluations": float(solution.evaluations.mean()),
            "tangency_error": float(solution.tangency_error.max()),
        }
        return Sweep(total / poses, (blocks - lead) / BLOCK, solution.length, bad, notes)


class MujocoTendon:
    """MuJoCo's spatial tendon: length and Jacobian row, by `mj_tendon` alone.

    The model holds many copies of the tendon on a body that slides along y. At every pose `mj_tendon` is timed on it
    and on the same model without tendons; the difference over the number of copies is one tendon's cost. Kinematics
    are not in it, as they are not in mjwrap's. It flatters MuJoCo a little, because all copies take the same branches,
    and burdens it a little, because `mj_tendon` also fills a row of ten_J (one dof here).
    """

    name = "MuJoCo tendon"

    def __init__(self, scene: Scene) -> None:
        if scene.n != 1:
            raise NotImplementedError("MuJoCo wraps one geom between two sites, not several in a row")
        self.scene = scene
        self.model, self.bare = (mujoco.MjModel.from_xml_string(self._xml(n)) for n in (COPIES, 0))
        self.data, self.empty = mujoco.MjData(self.model), mujoco.MjData(self.bare)

    def _xml(self, copies: int) -> str:
        scene = self.scene

        def numbers(values: Array) -> str:
            return " ".join(repr(float(value)) for value in values)

        tendon = '<spatial><site site="a"/><geom geom="g" sidesite="side"/><site site="b"/></spatial>'
        return f"""<mujoco><worldbody>
          <site name="a" pos="{numbers(scene.origin)}"/> <site name="b" pos="{numbers(scene.insertion)}"/>
          <body pos="{numbers(scene.place[0])}"><joint type="slide" axis="0 1 0"/>
            <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
            <body quat="{numbers(scene.quat[0])}">
              <geom name="g" type="{scene.kind}" size="{scene.radius} 0.1" mass="0" contype="0" conaffinity="0"/>
              <site name="side" pos="{numbers(2.0 * scene.hints[0])}"/></body></body></worldbody>
          <tendon>{tendon * copies}</tendon></mujoco>"""

    def sweep(self) -> Sweep:
        """Time every pose by itself."""
        samples, lengths = np.empty(self.scene.poses), np.empty(self.scene.poses)
        for j in range(self.scene.poses):
            spent = []
            for model, data in ((self.bare, self.empty), (self.model, self.data)):
                data.qpos[0] = self.scene.y[j, 0]
                mujoco.mj_kinematics(model, data)
                mujoco.mj_comPos(model, data)
                began = clock()
                mujoco.mj_tendon(model, data)
                spent.append(1e6 * (clock() - began))
            samples[j] = (spent[1] - spent[0]) / COPIES
            lengths[j] = self.data.ten_length[COPIES // 2]
        return Sweep(float(samples.mean()), samples, lengths, np.zeros(self.scene.poses, dtype=bool))


class OpenSimScholz:
    """OpenSim's `Scholz2015GeometryPath`, as it ships, at a new pose along the same sweep.

    Every obstacle is a contact geometry on a body with a slider coordinate. At every pose coordinates are set, then
    positions realised and the length read; the same without the path is timed beside it and subtracted.
    """

    name = "OpenSim Scholz2015"

    def __init__(self, scene: Scene) -> None:
        try:
            import opensim
        except ImportError as error:
            raise NotImplementedError(f"the opensim wheel is not installed ({error})") from None
        opensim.Logger.setLevelString("off")
        self.scene, self.osim = scene, opensim
        self.path: Any = None
        self.with_path, self.without = self._model(True), self._model(False)

    def _model(self, with_path: bool) -> tuple[Any, Any, list[Any]]:
        osim, scene = self.osim, self.scene
        model = osim.Model()
        ground = model.getGround()
        path = osim.Scholz2015GeometryPath()
        path.setName("path")
        path.appendPathPoint(ground, osim.Vec3(*scene.origin))
        along_y = osim.Vec3(0.0, 0.0, 0.5 * math.pi)  # a slider moves along its x axis
        for k in range(scene.n):
            body = osim.Body(f"body{k}", 1.0, osim.Vec3(0.0), osim.Inertia(1.0, 1.0, 1.0))
            model.addBody(body)
            place = osim.Vec3(*scene.place[k])
            model.addJoint(
                osim.SliderJoint(f"joint{k}", ground, place, along_y, body, osim.Vec3(0.0), along_y)
            )
            tilt = osim.Vec3(*scene.tilt[k], 0.0)
            kind = osim.ContactCylinder if scene.kind == "cylinder" else osim.ContactSphere
            shape = (
                kind(scene.radius, osim.Vec3(0.0), tilt, body)
                if scene.kind == "cylinder"
                else kind(scene.radius, osim.Vec3(0.0), body)
            )
            shape.setName(f"surface{k}")
            model.addContactGeometry(shape)
            path.appendObstacle(shape, osim.Vec3(*scene.hints[k]))
        path.appendPathPoint(ground, osim.Vec3(*scene.insertion))
        if with_path:
            model.addComponent(path)
            self.path = path
        state = model.initSystem()
        coordinates = [model.getCoordinateSet().get(f"joint{k}_coord_0") for k in range(scene.n)]
        return model, state, coordinates

    def _pose(
        self, loaded: tuple[Any, Any, list[Any]], heights: list[float], read: Callable[[Any], float]
    ) -> tuple[float, float]:
        model, state, coordinates = loaded
        for coordinate, height in zip(coordinates, heights, strict=True):
            coordinate.setValue(state, height, False)
        began = clock()
        model.realizePosition(state)
        length = read(state)
        return 1e6 * (clock() - began), length

    def sweep(self) -> Sweep:
        """Time every pose by itself; a pose fails where OpenSim throws."""
        poses = self.scene.poses
        samples, lengths = np.empty(poses), np.full(poses, np.nan)
        heights = self.scene.y.tolist()
        nothing = self.without[0].getNumCoordinates  # a call across the same border, to be subtracted
        for j in range(poses):
            bare, _ = self._pose(self.without, heights[j], lambda state: nothing())
            try:
                full, lengths[j] = self._pose(self.with_path, heights[j], self.path.getLength)
            except RuntimeError:
                full = np.nan
            samples[j] = full - bare
        return Sweep(float(np.nanmean(samples)), samples, lengths, np.isnan(lengths))


def solvers(scene: Scene) -> tuple[list[Solver], dict[str, str]]:
    """Return the solvers that can do a scene, and why the others cannot."""
    found: list[Solver] = []
    missing: dict[str, str] = {}
    kinds: list[tuple[str, Callable[[], Solver]]] = [
        ("mjwrap warm", lambda: Mjwrap(scene, True)),
        ("mjwrap cold", lambda: Mjwrap(scene, False)),
        (MujocoTendon.name, lambda: MujocoTendon(scene)),
        (OpenSimScholz.name, lambda: OpenSimScholz(scene)),
    ]
    for name, build in kinds:
        try:
            found.append(build())
        except NotImplementedError as reason:
            missing[name] = str(reason)
    gc.collect()
    return found, missing
