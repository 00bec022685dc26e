"""The engine of a run: a `CableSystem` that is stepped, or the engine plugin inside MuJoCo."""

from __future__ import annotations

from typing import Protocol

import mujoco

from mjwrap.errors import ModelError, PathError
from mjwrap.mjcf import has_plugin, read_declarations, read_model
from mjwrap.paths import Status
from mjwrap.runs.models import load, load_spec
from mjwrap.runs.state_tables import put_own
from mjwrap.system import CableSystem, MuscleSystem, is_cable
from mjwrap.system.checks import ResetWatch
from mjwrap.text import counted

MODES = PYTHON, WRENCH, TRANSMISSION = "python", "wrench", "transmission"
NO_MUSCLE = "it is not a muscle; modes python and transmission drive it along mjwrap's path"


class Engine(Protocol):
    """A model in motion. `data` moves; after `evaluate` a sample is read from `sampled` and `muscles`."""

    model: mujoco.MjModel
    data: mujoco.MjData
    sampled: mujoco.MjData
    muscles: MuscleSystem

    def step(self) -> None:
        """Advance by one time step; `StateError` if the motion becomes unstable."""
        ...

    def evaluate(self) -> None:
        """Evaluate the muscles at the present state."""
        ...

    def failures(self) -> dict[str, str]:
        """Return, by muscle, the number of steps without a path, and the last reason."""
        ...


class PythonEngine:
    """A `CableSystem` that is stepped."""

    def __init__(self, source: str, strict: bool, side_rule: int | None = None) -> None:
        self.model = load(source)
        self.muscles: MuscleSystem = CableSystem(self.model, strict=strict, side_rule=side_rule)
        self.data = self.sampled = mujoco.MjData(self.model)

    def step(self) -> None:
        """Advance by one time step."""
        self.muscles.step(self.data)

    def evaluate(self) -> None:
        """Evaluate the muscles at the present state."""
        self.muscles.forward(self.data)

    def failures(self) -> dict[str, str]:
        """Return, by muscle, the number of steps without a path, and the last reason."""
        lines = self.muscles.report().splitlines()
        return dict(line.split(": ", 1) for line in lines)


class PluginEngine:
    """Plain `mj_step` with the muscles in the engine plugin; a MuscleSystem on a second model computes the samples."""

    def __init__(self, source: str, mode: str, strict: bool, side_rule: int | None = None) -> None:
        from mjwrap import plugin

        self._read = plugin.read
        is_binary = source.lower().endswith(".mjb")  # cannot be changed, and may have the plugin already
        if is_binary:
            self.model = plugin.load(source, mode, side_rule=side_rule)
        else:
            self.model = plugin.install(load_spec(source), mode, side_rule=side_rule)
        self.data = mujoco.MjData(self.model)
        self.muscles = _sampler(load(source), mode, side_rule)
        self.sampled = mujoco.MjData(self.muscles.model)
        self._strict = strict
        self._excitations = plugin.excitations(self.data)
        self._copy = mujoco.MjData(self.model)
        # of muscles without an actuator, whose states the plugin keeps
        self._own = [i for i, muscle in enumerate(self.muscles.declarations) if muscle.actuator < 0]

    def fresh(self) -> mujoco.MjData:
        """Return a copy of the data with everything computed at the present state; the run is not changed."""
        mujoco.mj_copyData(self._copy, self.model, self.data)
        mujoco.mj_forward(self.model, self._copy)
        return self._copy

    def step(self) -> None:
        """Advance by one time step."""
        for i in self._own:
            self._excitations[self.muscles.names[i]][0] = self.muscles.excitation[i]
        watch = ResetWatch(self.data)
        mujoco.mj_step(self.model, self.data)
        watch.end()
        if watch.reset:
            raise watch.error()
        if self._strict:
            for name, why in self.failures().items():
                raise PathError(f"muscle '{name}' at time {self.data.time:g} s: {why}")

    def evaluate(self) -> None:
        """Copy the state to the second model and evaluate the muscles there."""
        sampled, data = self.sampled, self.data
        sampled.time = data.time
        for name in ("qpos", "qvel", "act", "ctrl", "mocap_pos", "mocap_quat"):
            getattr(sampled, name)[:] = getattr(data, name)
        if self._own:
            held = self._read(self.fresh())
            places = {i: held.names.index(self.muscles.names[i]) for i in self._own}
            own = {i: (float(held.activation[k]), float(held.fiber_length[k])) for i, k in places.items()}
            put_own(self.muscles, sampled, own)
        self.muscles.forward(sampled)

    def failures(self) -> dict[str, str]:
        """Return, by muscle, the number of steps without a path, and the reason if it has none now."""
        held = self._read(self.data)
        found = {}
        for name, count, code in zip(held.names, held.failures.tolist(), held.status.tolist(), strict=True):
            if count:
                why = f"; now {Status(code).message}" if code else ""
                found[name] = f"{counted(count, 'step')} without a path{why}"
        return found


def _sampler(model: mujoco.MjModel, mode: str, side_rule: int | None) -> MuscleSystem:
    """Return the muscles and cables that a mode of the plugin drives; in mode "wrench" cables stay with MuJoCo."""
    if mode == TRANSMISSION:
        return CableSystem(model, side_rule=side_rule, transmission=True)
    cables = _cables(model, side_rule)  # read before the MuscleSystem disables the muscles
    muscles = MuscleSystem(model, side_rule=side_rule)
    muscles.native |= dict.fromkeys(cables, NO_MUSCLE)
    return muscles


def _cables(model: mujoco.MjModel, side_rule: int | None = None) -> list[str]:
    """Return the actuators on spatial tendons that are not muscles and can pull along mjwrap's paths."""
    found = read_declarations(model, cables=True, side_rule=side_rule).muscles
    return [muscle.name for muscle in found if is_cable(muscle)]


def film_mode(source: str) -> str:
    """Return the mode of the plugin in which all muscles and cables of a model pull along mjwrap's paths.

    That is "transmission" for a model with cables, else "wrench"; a binary file keeps the mode with which it was saved.
    """
    model = read_model(source) if source.lower().endswith(".mjb") else load(source)
    if has_plugin(model):
        from mjwrap.plugin.readout import saved_modes

        return next(iter(saved_modes(model)))
    return TRANSMISSION if _cables(model) else WRENCH


def start_engine(source: str, mode: str, strict: bool, side_rule: int | None = None) -> Engine:
    """Return the engine of a model (a file, "mjwrap:NAME" or "myo_sim:NAME") for a mode of `MODES`.

    "python" is `CableSystem`; the others are modes of the plugin's `install`. strict: raise `PathError` at the first
    step at which a muscle has no path. side_rule: as for `MuscleSystem` and `install`.
    """
    if mode not in MODES:
        raise ModelError(f"mode '{mode}' does not exist; modes: {', '.join(MODES)}")
    if mode == "python":
        return PythonEngine(source, strict, side_rule)
    return PluginEngine(source, mode, strict, side_rule)
