"""The engine of a run: `MuscleSystem` step by step, or the engine plugin inside MuJoCo."""

from __future__ import annotations

from typing import Protocol

import mujoco

from mjwrap.errors import ModelError, PathError, StateError
from mjwrap.paths import Status
from mjwrap.runs.models import load, load_spec
from mjwrap.runs.state_tables import put_own
from mjwrap.system import MuscleSystem
from mjwrap.system.checks import resets
from mjwrap.text import counted

MODES = ("python", "wrench", "transmission")


class Engine(Protocol):
    """A model in motion. `data` is what moves; `seen` and `muscles` are what a sample is read from, after `look`."""

    model: mujoco.MjModel
    data: mujoco.MjData
    seen: mujoco.MjData
    muscles: MuscleSystem

    def step(self) -> None:
        """Advance by one time step; `StateError` where the motion becomes unstable."""
        ...

    def look(self) -> None:
        """Evaluate the muscles at the present state."""
        ...

    def failures(self) -> dict[str, str]:
        """Return, by muscle, on how many steps it had no path, and why at last."""
        ...


class PythonEngine:
    """`MuscleSystem` reads and writes the mjData."""

    def __init__(self, source: str, strict: bool) -> None:
        self.model = load(source)
        self.muscles = MuscleSystem(self.model, strict=strict)
        self.data = self.seen = mujoco.MjData(self.model)

    def step(self) -> None:
        """Advance by one time step."""
        self.muscles.step(self.data)

    def look(self) -> None:
        """Evaluate the muscles at the present state."""
        self.muscles.forward(self.data)

    def failures(self) -> dict[str, str]:
        """Return, by muscle, on how many steps it had no path, and why at last."""
        lines = self.muscles.report().splitlines()
        return dict(line.split(": ", 1) for line in lines)


class PluginEngine:
    """Plain mj_step with the muscles inside MuJoCo; a MuscleSystem on a second model is there to be looked at."""

    def __init__(self, source: str, mode: str, strict: bool) -> None:
        from mjwrap import plugin

        self._read = plugin.read
        is_binary = source.lower().endswith(".mjb")  # cannot be changed, and may have the plugin already
        self.model = plugin.load(source, mode) if is_binary else plugin.install(load_spec(source), mode)
        self.data = mujoco.MjData(self.model)
        self.muscles = MuscleSystem(load(source))
        self.seen = mujoco.MjData(self.muscles.model)
        self._strict = strict
        self._excitations = plugin.excitations(self.data)
        self._copy = mujoco.MjData(self.model)
        # muscles without an actuator: their states are the plugin's
        self._own = [i for i, muscle in enumerate(self.muscles.declarations) if muscle.actuator < 0]

    def fresh(self) -> mujoco.MjData:
        """Return a copy in which all is computed at the present state, so that the run stays as it is."""
        mujoco.mj_copyData(self._copy, self.model, self.data)
        mujoco.mj_forward(self.model, self._copy)
        return self._copy

    def step(self) -> None:
        """Advance by one time step."""
        for i in self._own:
            self._excitations[self.muscles.names[i]][0] = self.muscles.excitation[i]
        before = resets(self.data)
        mujoco.mj_step(self.model, self.data)
        if resets(self.data) > before:
            raise StateError(
                "the motion became unstable and MuJoCo reset the data; "
                "a smaller time step or more joint damping may help"
            )
        if self._strict:
            for name, why in self.failures().items():
                raise PathError(f"muscle '{name}' at time {self.data.time:g} s: {why}")

    def look(self) -> None:
        """Take the state over and evaluate the muscles there."""
        seen, data = self.seen, self.data
        seen.time = data.time
        for name in ("qpos", "qvel", "act", "ctrl", "mocap_pos", "mocap_quat"):
            getattr(seen, name)[:] = getattr(data, name)
        if self._own:
            held = self._read(self.fresh())
            places = {i: held.names.index(self.muscles.names[i]) for i in self._own}
            own = {i: (float(held.activation[k]), float(held.fiber_length[k])) for i, k in places.items()}
            put_own(self.muscles, seen, own)
        self.muscles.forward(seen)

    def failures(self) -> dict[str, str]:
        """Return, by muscle, on how many steps it had no path, and why, where that is so now."""
        held = self._read(self.data)
        found = {}
        for name, count, code in zip(held.names, held.failures.tolist(), held.status.tolist(), strict=True):
            if count:
                why = f"; now {Status(code).message}" if code else ""
                found[name] = f"{counted(count, 'step')} without a path{why}"
        return found


def start_engine(source: str, mode: str, strict: bool) -> Engine:
    """Return the engine for a model (a file, or "myo_sim:NAME") in one of `MODES`.

    "python" is `MuscleSystem`; the others are modes of the plugin's `install`. strict: raise `PathError` at the first
    step at which a muscle has no path.
    """
    if mode not in MODES:
        raise ModelError(f"mode '{mode}' does not exist; modes: {', '.join(MODES)}")
    return PythonEngine(source, strict) if mode == "python" else PluginEngine(source, mode, strict)
