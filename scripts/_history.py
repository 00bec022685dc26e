"""What a run leaves behind: rows of a CSV file while it runs, and as many samples as a plot can show."""

from __future__ import annotations

import mujoco
import numpy as np
from _common import Output
from numpy.typing import NDArray

from mjwrap import MuscleSystem
from mjwrap.excitation import control_names
from mjwrap.mjcf import name_of

Array = NDArray[np.float64]
MOST = 4000  # samples that a plot keeps; every second one goes when there are more


class CsvWriter:
    """Writes one row a sample: time, qpos, ctrl, and activation, length, velocity and tension of every muscle."""

    def __init__(self, output: Output, model: mujoco.MjModel, muscles: MuscleSystem) -> None:
        self._output, self._muscles = output, muscles
        self._file = output.open_text()
        header = ["time"]
        header += [f"qpos:{name}" for name in qpos_names(model)]
        header += [f"ctrl:{name}" for name in control_names(model)]
        for kind in ("activation", "length", "velocity", "tension"):
            header += [f"{kind}:{name}" for name in muscles.names]
        with output.writing():
            self._file.write(",".join(_quoted(name) for name in header) + "\n")

    def log(self, data: mujoco.MjData) -> None:
        """Write the present state."""
        m = self._muscles
        row = np.concatenate(
            ([data.time], data.qpos, data.ctrl, m.activation, m.length, m.velocity, m.tension)
        )
        with self._output.writing():
            self._file.write(",".join(map(repr, row.tolist())) + "\n")

    def close(self) -> None:
        """Finish the file and give it its name."""
        self._output.publish()


class History:
    """Samples for a plot, (T, ...) each: time, qpos, activation, length, tension."""

    def __init__(self, muscles: MuscleSystem) -> None:
        self._muscles = muscles
        self._rows: list[tuple[float, Array, Array, Array, Array]] = []
        self._stride, self._skip = 1, 0

    def log(self, data: mujoco.MjData) -> None:
        """Keep the present state."""
        self._skip -= 1
        if self._skip >= 0:
            return
        self._skip = self._stride - 1
        m = self._muscles
        self._rows.append(
            (float(data.time), data.qpos.copy(), m.activation.copy(), m.length.copy(), m.tension.copy())
        )
        if len(self._rows) >= MOST:
            self._rows = self._rows[::2]
            self._stride *= 2

    @property
    def time(self) -> Array:
        """Times (T,) [s]."""
        return np.array([row[0] for row in self._rows])

    def column(self, place: int) -> Array:
        """Return qpos (1), activation (2), length (3) or tension (4), (T, n)."""
        return np.array([row[place] for row in self._rows])


def qpos_names(model: mujoco.MjModel) -> list[str]:
    """Return a name for every entry of qpos: its joint's, with a number where the joint has several."""
    found = []
    for j in range(model.njnt):
        first = int(model.jnt_qposadr[j])
        last = int(model.jnt_qposadr[j + 1]) if j + 1 < model.njnt else model.nq
        name = name_of(model, mujoco.mjtObj.mjOBJ_JOINT, j)
        found += [name] if last - first == 1 else [f"{name}[{i}]" for i in range(last - first)]
    return found


def _quoted(name: str) -> str:
    return '"' + name.replace('"', '""') + '"' if any(c in name for c in ',"\n') else name
