"""The solvers that bench_paths.py times, behind one protocol: a whole sweep in, times and lengths out.

The clock counts the thread's CPU time, so that a busy machine does not add the time for which it takes the core away.
"""

from __future__ import annotations

import gc
from collections.abc import Callable
from time import thread_time as clock
from typing import Any

import mujoco
import numpy as np
from numba.core import runtime as numba_runtime
from path_opensim import OpenSimScholz
from path_scenes import Array, Scene
from path_sweep import Solver, Sweep

import mjwrap as mw

WARM, COLD, UNAIDED = "mjwrap warm", "mjwrap cold", "mjwrap unaided"
COPIES = 100  # of a tendon in the timed model
BLOCK, LEAD = 100, 5  # poses of a timed block, poses before it that are timed alone and subtracted
runtime: Any = numba_runtime  # counts allocations; not in numba's type hints


class Mjwrap:
    """mjwrap.solve_sweep over a scene: warm; cold, every pose from nothing but its hints; unaided, without hints too.

    The mean is the time of one whole call, its set-up and its first, cold pose included, over the number of poses. The
    samples are what the compiled loop takes: blocks of poses, each behind a short lead-in; the median time of the
    lead-ins' own calls is subtracted.
    """

    against = WARM

    def __init__(self, scene: Scene, name: str) -> None:
        self.name = name
        self.warm = name == WARM
        self.other_side = name == UNAIDED
        self.ends = scene.origin, scene.insertion, scene.obstacles(hinted=name != UNAIDED)
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
        return Sweep(total / poses, (blocks - lead) / BLOCK, solution.length, bad, np.arange(poses), notes)

    def allocations(self) -> int:
        """Return how many allocations the second half of a sweep adds to those of a sweep over the first half."""
        half = len(self.pos) // 2
        return count_allocations(lambda: self._call(0, 2 * half)) - count_allocations(
            lambda: self._call(0, half)
        )


def count_allocations(call: Callable[[], object]) -> int:
    """Return how many times compiled code asked numba's runtime for memory during a call."""
    runtime._nrt_python.memsys_enable_stats()
    try:
        before = runtime.rtsys.get_allocation_stats().alloc
        call()
        return runtime.rtsys.get_allocation_stats().alloc - before
    finally:
        runtime._nrt_python.memsys_disable_stats()


class MujocoTendon:
    """MuJoCo's spatial tendon: length and Jacobian row, by `mj_tendon` alone.

    The model holds many copies of the tendon on a body that slides along y. At every pose `mj_tendon` is timed on it
    and on the same model without tendons; the difference over the number of copies is one tendon's cost. Kinematics
    are not in it, as they are not in mjwrap's. It flatters MuJoCo a little, because all copies take the same branches,
    and burdens it a little, because `mj_tendon` also fills a row of ten_J (one dof here).
    """

    name = "MuJoCo tendon"
    against = WARM
    other_side = False

    def __init__(self, scene: Scene) -> None:
        if scene.n != 1:
            raise NotImplementedError("MuJoCo wraps one geom between two sites, not several in a row")
        if not isinstance(scene.surfaces[0], mw.Cylinder | mw.Sphere):
            raise NotImplementedError("MuJoCo wraps cylinders and spheres, nothing else")
        self.scene = scene
        self.model, self.bare = (mujoco.MjModel.from_xml_string(self._xml(n)) for n in (COPIES, 0))
        self.data, self.empty = mujoco.MjData(self.model), mujoco.MjData(self.bare)

    def _xml(self, copies: int) -> str:
        scene, surface = self.scene, self.scene.surfaces[0]

        def numbers(values: Array) -> str:
            return " ".join(repr(float(value)) for value in values)

        kind, radius = type(surface).__name__.lower(), surface.dims[0]
        tendon = '<spatial><site site="a"/><geom geom="g" sidesite="side"/><site site="b"/></spatial>'
        return f"""<mujoco><worldbody>
          <site name="a" pos="{numbers(scene.origin)}"/> <site name="b" pos="{numbers(scene.insertion)}"/>
          <body pos="{numbers(scene.place[0])}"><joint type="slide" axis="0 1 0"/>
            <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
            <body quat="{numbers(scene.quat[0])}">
              <geom name="g" type="{kind}" size="{radius} 0.1" mass="0" contype="0" conaffinity="0"/>
              <site name="side" pos="{numbers(2.0 * scene.hints[0])}"/></body></body></worldbody>
          <tendon>{tendon * copies}</tendon></mujoco>"""

    def sweep(self) -> Sweep:
        """Time every pose by itself."""
        poses = self.scene.poses
        samples, lengths = np.empty(poses), np.empty(poses)
        for j in range(poses):
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
        return Sweep(float(samples.mean()), samples, lengths, np.zeros(poses, dtype=bool), np.arange(poses))


def solvers(scene: Scene) -> tuple[list[Solver], dict[str, str]]:
    """Return the solvers that can do a scene, mjwrap warm first, and why the others cannot."""
    found: list[Solver] = []
    missing: dict[str, str] = {}
    kinds: list[tuple[str, Callable[[], Solver]]] = [
        *((name, lambda name=name: Mjwrap(scene, name)) for name in (WARM, COLD, UNAIDED)),
        (MujocoTendon.name, lambda: MujocoTendon(scene)),
        ("OpenSim warm", lambda: OpenSimScholz(scene, True)),
        ("OpenSim cold", lambda: OpenSimScholz(scene, False)),
    ]
    for name, build in kinds:
        try:
            found.append(build())
        except NotImplementedError as reason:
            missing[name] = str(reason)
    gc.collect()
    return found, missing
