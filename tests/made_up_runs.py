"""Runs to be recorded whose numbers are made up, each different from all others, and what a recording then holds."""

from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import mujoco
import numpy as np
from rerun.chunk import RrdReader

import mjwrap as mw
from mjwrap.mjcf import MuscleDeclaration, Node, Route

ROOT = Path(__file__).resolve().parent.parent
MEASURED = ("length", "velocity", "tension", "activation", "fiber_length", "status", "iterations")
XML = """
<mujoco model="bench">
  <asset>
    <mesh name="wedge" vertex="0 0 0  .1 0 0  0 .1 0  0 0 .1"/>
    <hfield name="hill" nrow="3" ncol="4" size=".4 .3 .2 .1" elevation="0 0 0 0  0 1 1 0  0 0 0 0"/>
    <material name="brick" rgba=".8 .2 .1 1"/>
  </asset>
  <worldbody>
    <geom name="floor" type="plane" size="0 0 1"/>
    <geom name="hill" type="hfield" hfield="hill" pos="2 0 0"/>
    <site name="origin" pos=".2 0 .3"/>
    <site name="my muscle/2 start" pos=".2 .1 .3"/>
    <body name="fixed" pos="0 0 .5" euler="0 30 0">
      <geom name="box" type="box" size=".1 .02 .03" material="brick"/>
      <geom name="shell" type="box" size=".1 .02 .03" group="3"/>
    </body>
    <body name="arm" pos="0 .5 .5">
      <joint name="hinge" axis="0 1 0"/>
      <geom name="drum" type="cylinder" size=".05 .12" rgba=".5 .6 .7 1" euler="90 0 0"/>
      <geom name="ball" type="sphere" size=".03"/>
      <geom name="egg" type="ellipsoid" size=".03 .04 .05"/>
      <geom name="pill" type="capsule" size=".02 .1"/>
      <geom type="mesh" mesh="wedge"/>
      <site name="via" pos="0 .1 0"/>
      <site name="insertion" pos="-.2 0 0"/>
    </body>
    <body mocap="true" pos="1 0 0"><geom size=".01"/></body>
  </worldbody>
</mujoco>
"""


class Muscles:
    """MuscleSystem's face over made-up numbers: everything differs in every row, so that mixing any two shows."""

    def __init__(self, model: mujoco.MjModel, names: tuple[str, ...] = ("BIC", "my muscle/2")) -> None:
        self.n, self.names = len(names), list(names)
        sites = {name: model.site(name).id for name in ("origin", "via", "insertion")}
        starts = sites["origin"], model.site("my muscle/2 start").id
        stops = Node(site=sites["via"]), Node(geom=model.geom("drum").id, surface=mw.Cylinder(0.05))
        self.declarations = [
            MuscleDeclaration(
                name,
                (Route(starts[min(i, 1)], stops if i == 0 else (), sites["insertion"]),),
                mw.Millard2012(100.0 * (i + 1), 0.1, 0.2),
            )
            for i, name in enumerate(names)
        ]
        self.time = 0.0
        self.row = -1

    def forward(self, data: mujoco.MjData) -> None:
        self.time, self.row = data.time, self.row + 1
        rng = np.random.default_rng(self.row)
        self.length, self.velocity, self.tension, self.fiber_length = rng.normal(size=(4, self.n))
        self.activation = rng.uniform(size=self.n)
        self.status = rng.integers(0, 3, self.n)
        self.iterations = rng.integers(0, 100, self.n)

    def poses(self, data: mujoco.MjData) -> mujoco.MjData:
        return data

    def history(self, rows: int, muscles: np.ndarray, dofs: np.ndarray) -> "History":
        return History(self, (muscles, dofs))

    def moment_arms(self, row: int, muscles: np.ndarray, dofs: np.ndarray) -> np.ndarray:
        """Of pairs of a muscle and a coordinate, (K,)."""
        return np.cos(row + muscles + 7.0 * dofs)

    def points(self, i: int) -> np.ndarray:
        count = 2 + (self.row + i) % 3
        if i == 1 and self.row == 0:
            count = 0  # no path found yet
        return np.random.default_rng([self.row, i]).normal(size=(count, 3))

    def contact_points(self, i: int) -> np.ndarray:
        return np.random.default_rng([self.row, i, 1]).normal(size=((self.row + i) % 2, 2, 3))

    def arrows(self, i: int) -> np.ndarray:
        """Tails [m] and forces [N], (k, 2, 3)."""
        return np.random.default_rng([self.row, i, 2]).normal(size=(2 + (self.row + i) % 2, 2, 3))


class History:
    """The same for `MuscleSystem.history`."""

    def __init__(self, muscles: Muscles, pairs: tuple[np.ndarray, np.ndarray]) -> None:
        self._muscles, self._pairs = muscles, pairs
        self._poses: list[tuple[np.ndarray, np.ndarray]] = []
        self._states: list[dict[str, np.ndarray]] = []
        self._frames: list[list[list[np.ndarray]]] = []  # frame, kind, muscle
        self._rows: list[int] = []

    def put_state(self, row: int) -> None:
        del self._states[row:]
        self._states.append({name: getattr(self._muscles, name).copy() for name in MEASURED})

    def put_frame(self, frame: int, poses: mujoco.MjData, spacing: float | None) -> None:
        del self._frames[frame:], self._rows[frame:], self._poses[frame:]
        self._poses.append((poses.xpos.copy(), poses.xquat.copy()))
        muscles = self._muscles
        kinds = (muscles.points, lambda i: muscles.contact_points(i).reshape(-1, 3), muscles.arrows)
        self._frames.append([[kind(i) for i in range(muscles.n)] for kind in kinds])
        self._rows.append(muscles.row)

    def states(self, rows: int) -> dict[str, np.ndarray]:
        return {name: np.array([state[name] for state in self._states[:rows]]) for name in MEASURED}

    def _ragged(self, kind: int, frames: int) -> tuple[np.ndarray, np.ndarray]:
        parts = [[frame[kind][i] for frame in self._frames[:frames]] for i in range(self._muscles.n)]
        counts = np.array([[len(each) for each in muscle] for muscle in parts])
        return np.concatenate([each for muscle in parts for each in muscle]), counts

    def bodies(self, frames: int) -> tuple[np.ndarray, np.ndarray]:
        positions, quaternions = zip(*self._poses[:frames], strict=True)
        return np.array(positions), np.array(quaternions)

    def polylines(self, frames: int, room: Any = None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        points, counts = self._ragged(0, frames)
        return points, counts[counts > 0], (counts > 0).astype(np.int64)

    def contacts(self, frames: int, room: Any = None) -> tuple[np.ndarray, np.ndarray]:
        return self._ragged(1, frames)

    def arrows(
        self, frames: int, scale: float, room: Any = None
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        arrows, counts = self._ragged(2, frames)
        return arrows[:, 0], scale * arrows[:, 1], counts

    def moment_arms(self, frames: int) -> np.ndarray:
        rows = [self._muscles.moment_arms(row, *self._pairs) for row in self._rows[:frames]]
        return np.array(rows).reshape(frames, len(self._pairs[0]))


def simulate(
    model: mujoco.MjModel, path: Path | None, steps: int = 100, **options: Any
) -> tuple[list[SimpleNamespace], Muscles]:
    """Record `steps` states and return what each of them was."""
    muscles = Muscles(model)
    log: list[SimpleNamespace] = []
    with recorder(model, muscles, path, **options) as record:
        for data in states(model, muscles, steps):
            record.log(data)
            log.append(
                SimpleNamespace(
                    time=data.time,
                    xpos=data.xpos.copy(),
                    xquat=data.xquat.copy(),
                    points=[muscles.points(i) for i in range(muscles.n)],
                    contacts=[muscles.contact_points(i) for i in range(muscles.n)],
                    arrows=[muscles.arrows(i) for i in range(muscles.n)],
                    arms=muscles.moment_arms(muscles.row, np.arange(muscles.n), np.zeros(muscles.n)),
                    **{name: getattr(muscles, name).copy() for name in MEASURED},
                )
            )
    return log, muscles


def recorder(model: mujoco.MjModel, muscles: Any, path: Path | None, **options: Any) -> mw.Recorder:
    """A Recorder that takes `Muscles` for a MuscleSystem."""
    return mw.Recorder(model, muscles, path, **options)


def states(model: mujoco.MjModel, muscles: Muscles, steps: int) -> Iterator[mujoco.MjData]:
    """`steps` states of the model, 2 ms apart, with joint and mocap body on the move."""
    data = mujoco.MjData(model)
    for step in range(steps):
        data.time = 0.002 * step
        data.qpos[0] = 0.03 * step
        data.mocap_pos[0, 2] = 0.01 * step
        mujoco.mj_kinematics(model, data)
        muscles.forward(data)
        yield data


def read(path: Path) -> dict[str, dict[str, list[tuple[int | None, Any]]]]:
    """Everything in a recording: entity, component -> rows (time [ns], None where static; value) by time."""
    content: dict[str, dict[str, list[tuple[int | None, Any]]]] = {}
    for chunk in RrdReader(path).store().stream():
        columns = chunk.to_record_batch()
        times: list[int | None] = [None] * chunk.num_rows
        if not chunk.is_static:
            times = columns.column("sim_time").cast("int64").to_pylist()
        for name in columns.schema.names:
            if name not in ("sim_time", "rerun.controls.RowId"):
                rows = content.setdefault(chunk.entity_path, {}).setdefault(name, [])
                rows.extend(zip(times, columns.column(name).to_pylist(), strict=True))
    for components in content.values():
        for rows in components.values():
            rows.sort(key=lambda row: row[0] or 0)
    return content


def moving(rows: list[tuple[int | None, Any]]) -> list[tuple[int | None, Any]]:
    return [row for row in rows if row[0] is not None]


def static(content: dict[str, dict[str, list[tuple[int | None, Any]]]], entity: str, component: str) -> Any:
    ((time_, value),) = content[entity][component]
    assert time_ is None
    return value
