"""The table that a run leaves: which numbers, what they are called, and the file that they go to."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap import MuscleSystem, Table
from mjwrap.cli.common.errors import UserError
from mjwrap.files import RowWriter
from mjwrap.files.atomic import PartFile
from mjwrap.files.writing import save_npz
from mjwrap.mjcf import MuscleDeclaration, act_names, dof_names, qpos_names
from mjwrap.runs.excitation import control_names

Array = NDArray[np.float64]
MUSCLE_KINDS = ("activation", "fiber_length", "length", "velocity", "tension")
KINDS = ("qpos", "qvel", "act", "ctrl", *MUSCLE_KINDS, "moment_arm")
USUAL = "qpos,qvel,act,ctrl,activation,fiber_length,length,velocity,tension"


class Column(NamedTuple):
    """Numbers of one kind: their names, and where they are found at a sample."""

    names: list[str]
    read: Callable[[mujoco.MjData], Array]


def choose_kinds(text: str) -> list[str]:
    """Return the kinds of numbers in a list such as "length,moment_arm"; `UserError` lists them all."""
    kinds = [kind.strip() for kind in text.split(",")]
    for kind in kinds:
        if kind not in KINDS:
            raise UserError(f"--columns: no kind '{kind}'; kinds: {', '.join(KINDS)}")
    return list(dict.fromkeys(kinds))


def columns(model: mujoco.MjModel, muscles: MuscleSystem, kinds: Sequence[str]) -> list[Column]:
    """Return the columns of some kinds, each called KIND:NAME; SI units, moment arms −∂l/∂q."""
    found = []
    for kind in kinds:
        if kind == "moment_arm":
            found.append(_moment_arms(model, muscles))
            continue
        names = {"qpos": qpos_names, "qvel": dof_names, "act": act_names, "ctrl": control_names}
        named = muscles.names if kind in MUSCLE_KINDS else names[kind](model)
        owner = muscles if kind in MUSCLE_KINDS else None
        found.append(Column([f"{kind}:{name}" for name in named], _reader(owner, kind)))
    return found


def _reader(owner: MuscleSystem | None, kind: str) -> Callable[[mujoco.MjData], Array]:
    return lambda data: getattr(data if owner is None else owner, kind)


def _moment_arms(model: mujoco.MjModel, muscles: MuscleSystem) -> Column:
    """Return the moment arms of every muscle about the joints that it spans."""
    dofs = dof_names(model)
    pairs = [(i, d) for i, muscle in enumerate(muscles.declarations) for d in spanned(model, muscle)]
    rows, places = (
        np.array(part, dtype=np.int64) for part in (zip(*pairs, strict=True) if pairs else ((), ()))
    )
    names = [f"moment_arm:{muscles.names[i]}:{dofs[d]}" for i, d in pairs]
    return Column(names, lambda data: -muscles.length_jacobian(data)[rows, places])


def spanned(model: mujoco.MjModel, muscle: MuscleDeclaration) -> list[int]:
    """Return the dofs that move some, but not all, of the bodies that one of a muscle's routes runs over."""
    found: set[int] = set()
    for route in muscle.routes:
        sites = [route.origin, route.insertion, *(node.site for node in route.nodes if node.site >= 0)]
        bodies = [int(model.site_bodyid[s]) for s in sites]
        bodies += [int(model.geom_bodyid[node.geom]) for node in route.nodes if node.geom >= 0]
        chains = [_chain(model, body) for body in bodies]
        found |= set.union(*chains) - set.intersection(*chains)
    return sorted(found)


def _chain(model: mujoco.MjModel, body: int) -> set[int]:
    """Return the dofs that move a body."""
    found: set[int] = set()
    while body > 0:
        first = int(model.body_dofadr[body])
        found |= set(range(first, first + int(model.body_dofnum[body])))
        body = int(model.body_parentid[body])
    return found


class Samples:
    """Writes a row for every sample: text as the run goes on, so that a long run needs no memory; NPZ at the end."""

    def __init__(
        self, output: PartFile, model: mujoco.MjModel, muscles: MuscleSystem, kinds: Sequence[str]
    ) -> None:
        self._output = output
        self._columns = columns(model, muscles, kinds)
        self._names = [name for column in self._columns for name in column.names]
        self._kept: list[tuple[float, Array]] = []
        self._writer: RowWriter | None = None
        suffix = output.path.suffix.lower()
        if suffix != ".npz":
            with output.writing():
                self._writer = RowWriter(output.open_text(), suffix, self._names)

    def log(self, data: mujoco.MjData) -> None:
        """Write the present state."""
        row = np.concatenate([np.empty(0), *(column.read(data) for column in self._columns)])
        if self._writer is None:
            self._kept.append((float(data.time), row))
            return
        with self._output.writing():
            self._writer.add(data.time, row)

    def close(self) -> None:
        """Finish the file and give it its name."""
        with self._output.writing():
            if self._writer is not None:
                self._writer.finish()
            else:
                times = np.array([time for time, _ in self._kept])
                rows = np.array([row for _, row in self._kept]).reshape(len(times), len(self._names))
                save_npz(self._output.part, Table(times, tuple(self._names), rows))
        self._output.publish()
