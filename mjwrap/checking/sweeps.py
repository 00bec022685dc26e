"""Check along sweeps of every joint: jumps of length or slope, and poses without a path."""

from __future__ import annotations

import mujoco
import numpy as np

from mjwrap.checking.outcome import Check
from mjwrap.mjcf import name_of
from mjwrap.paths import Status
from mjwrap.poses.continuation import PathFollower
from mjwrap.poses.continuity import NARROW
from mjwrap.poses.joint_sweeps import PoseMaker
from mjwrap.poses.ties import TIE, lacks_minimum
from mjwrap.system import MuscleSystem
from mjwrap.text import counted

MODELS = (Status.ENDPOINT_INSIDE, Status.OUT_OF_RANGE)  # statuses of poses at which the model allows no path


class Paths:
    """The checks at every evaluated pose: is there a path, and how tangent is it to its surfaces?"""

    def __init__(self) -> None:
        self.tangency = Check("tangency", "tangency error", 1e-10)
        self.found = Check("paths", "a path is found where the model allows one", 0.0, "missing paths")
        self.inside = Check("model", "the model allows a path at every pose", 0.0, "missing paths")
        self._without: dict[Status, dict[str, list[str]]] = {}
        self.poses = 0

    def record(self, muscles: MuscleSystem, data: mujoco.MjData, where: str) -> None:
        """Record the muscles' last evaluation, of data."""
        status, names = muscles.status, muscles.names
        self.poses += 1
        self.tangency.see(np.where(status == 0, muscles.tangency_error, np.nan), where, names)
        for check in (self.found, self.inside):
            check.count += muscles.n
        for i in np.flatnonzero(status):
            kind = Status(int(status[i]))
            if lacks_minimum(muscles, data, int(i)):
                self.found.remarks.append(f"not counted: {names[i]}, {where}: {TIE}")
                continue
            (self.inside if kind in MODELS else self.found).worst += 1.0
            told = f"{where}: {muscles.reason(int(i))}"
            self._without.setdefault(kind, {}).setdefault(names[i], []).append(told)

    def finish(self) -> list[Check]:
        """Return the checks, with a remark for each muscle that has no path at some pose."""
        for kind, muscles in self._without.items():
            check = self.inside if kind in MODELS else self.found
            for name, places in sorted(muscles.items(), key=lambda item: -len(item[1])):
                check.remarks.append(
                    f"{name}: no path at {len(places)} of {counted(self.poses, 'pose')}; first at {places[0]}"
                )
        return [self.found, self.inside, self.tangency]


class Sweeper:
    """Sweep one joint after the other, and find jumps in the lengths and slopes of all muscles."""

    def __init__(self, muscles: MuscleSystem, data: mujoco.MjData, paths: Paths, jumps: Check) -> None:
        self._muscles, self._data, self._paths, self._jumps = muscles, data, paths, jumps
        self._follower = PathFollower(muscles, data)

    def sweep(self, maker: PoseMaker, joint: int, axis: int, samples: int) -> None:
        """Sweep a joint over its range, starting from the base pose."""
        motion, place = maker.sweep(joint, samples, axis), maker.maker(joint, axis)
        name, muscles, beside = motion.name, self._muscles, 2.0 * NARROW * float(np.ptp(motion.at))
        self._follower.move_to(maker.base, motion.qpos[0])
        trace = self._follower.trace(
            place, motion.at, lambda value: self._paths.record(muscles, self._data, f"{name} = {value:.4f}")
        )
        self._jumps.count += muscles.n
        for i, (at, size, turn) in self._follower.jumps(place, trace, motion.turning):
            beyond = 0.5 * beside
            if self._follower.is_conditional_edge(place, i, at - beyond, at + beyond):
                self._jumps.remarks.append(
                    f"not counted: {muscles.names[i]} at {name} = {at:.6f}: conditional edge: a path point comes or "
                    f"goes; length {1e3 * size:+.3f} mm, moment arm {-1e3 * turn:+.3f} mm"
                )
                continue
            cause = "" if size else self._follower.moment_arm_break(place, trace, i, at)
            if cause:
                self._jumps.remarks.append(
                    f"not counted: {muscles.names[i]} at {name} = {at:.6f}: moment arm {-1e3 * turn:+.3f} mm; {cause}, "
                    "and no path has a continuous moment arm"
                )
                continue
            before, after = (self._follower.touched(place, trace, i, at + side) for side in (-beside, beside))
            what = f"length {1e3 * size:+.3f} mm, moment arm {-1e3 * turn:+.3f} mm"
            self._jumps.worst += 1.0
            self._jumps.remarks.append(
                f"{muscles.names[i]} at {name} = {at:.6f}: {what}; touched surfaces {before}, then {after}"
                + self._sides(i)
            )

    def _sides(self, i: int) -> str:
        """Return which geoms a muscle passes on the same side at every pose, at the edge of which its path jumps."""
        nodes = [node for route in self._muscles.declarations[i].routes for node in route.nodes if node.side]
        geoms = {name_of(self._muscles.model, mujoco.mjtObj.mjOBJ_GEOM, node.geom): None for node in nodes}
        if not geoms:
            return ""
        listed = " and ".join(f"'{geom}'" for geom in geoms)
        return f"; the model holds the side of {listed} at every pose, and a path jumps at the edge of such a side"
