"""Run a model: settings, start, and the loop over time steps."""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import mujoco
import numpy as np

from mjwrap.errors import ModelError
from mjwrap.files import Table
from mjwrap.paths import Status
from mjwrap.runs.compile_time import CompileClock, rehearse
from mjwrap.runs.control_limits import check_levels
from mjwrap.runs.engine import MODES, start_engine
from mjwrap.runs.excitation import Excitation
from mjwrap.runs.models import INTEGRATORS, place_followers, set_state, start_keyframe
from mjwrap.runs.prescribed_motion import PrescribedMotion, check_free
from mjwrap.runs.pushing import Pushes
from mjwrap.runs.run_table import DEFAULT_KINDS, RunTable
from mjwrap.runs.table_spans import uncovered

CONTROLS_AT = 101  # times at which `Simulation.driven` looks
Log = Callable[[mujoco.MjData], object]  # called with the state of a sample


@dataclass(frozen=True)
class RunSettings:
    """The settings of a run.

    Args:
        duration: simulated time [s], rounded to whole time steps.
        sample: time between samples [s], rounded to whole time steps.
        timestep: time step [s]; None for the model's.
        integrator: "euler", "rk4", "implicit" or "implicitfast"; None for the model's.
        mode: "python" for a `MuscleSystem`; "wrench" or "transmission" for the engine plugin in this mode.
        excitation: entries as for `Excitation`.
        seed: seed of the excitation pattern `random`.
        prescribed: joints that follow a motion, as for `PrescribedMotion`.
        keyframe: name of the keyframe of the start; None for qpos0.
        positions: start positions of hinges and slides by name [rad, m].
        strict: raise `PathError` if a muscle's path cannot be found.
        side_rule: as for `MuscleSystem` and `install`.
    """

    duration: float = 1.0
    sample: float = 0.005
    timestep: float | None = None
    integrator: str | None = None
    mode: str = MODES[0]
    excitation: Sequence[str] = ()
    seed: int = 0
    prescribed: Sequence[str] = ()
    keyframe: str | None = None
    positions: Mapping[str, float] = field(default_factory=dict)
    strict: bool = False
    side_rule: int | None = None


class WallTime(NamedTuple):
    """Wall time [s] of the simulation, and of sampling, drawing and writing, without compiling kernels."""

    simulation: float
    outputs: float


class Simulation:
    """A model at the start of a run, with its excitation and its prescribed joints.

    Call `begin`, then `advance`. `engine.model` and `engine.data` are the simulated model and its data; `muscles` has
    the results at the last sample.

    Args:
        source: an MJCF or MJB file, "mjwrap:NAME" or "myo_sim:NAME".
        settings: the settings of the run.
        option: name of the command-line option for prescribed joints, for messages.

    Raises:
        ModelError: the model cannot be loaded, or a setting does not fit it.
        SignalError: an entry of the excitation or of the prescribed joints is not valid.
    """

    def __init__(self, source: str, settings: RunSettings, *, option: str = "") -> None:
        self.settings = settings
        self.engine = engine = start_engine(source, settings.mode, settings.strict, settings.side_rule)
        self.muscles = engine.muscles
        for model in {id(m): m for m in (engine.model, engine.muscles.model)}.values():
            if settings.timestep is not None:
                model.opt.timestep = settings.timestep
            if settings.integrator is not None:
                model.opt.integrator = _integrator(settings.integrator)
        key = start_keyframe(engine.model, settings.keyframe)
        set_state(engine.model, engine.data, key, settings.positions)
        self.start = (
            engine.data.qpos.copy()
        )  # (nq,) positions at the start, also of joints that are prescribed
        self.excitation = Excitation(engine.muscles, settings.excitation, settings.seed)
        check_levels(engine.muscles, self.excitation)
        self.prescribed = PrescribedMotion(engine.model, settings.prescribed, option=option)
        check_free(engine.model, self.prescribed.joints, settings.positions)
        self.pushes = Pushes(engine.muscles)
        entries = (*settings.excitation, *settings.prescribed)
        if told := uncovered(entries, self.duration, self._timestep):
            warnings.warn(told, stacklevel=2)

    @property
    def duration(self) -> float:
        """The duration [s], rounded to whole time steps."""
        return self._steps * self._timestep

    @property
    def _timestep(self) -> float:
        return float(self.engine.model.opt.timestep)

    @property
    def _steps(self) -> int:
        return max(1, math.ceil(self.settings.duration / self._timestep - 1e-6))

    @property
    def driven(self) -> bool:
        """Whether a control or an excitation is not zero at some time of the run."""
        muscles, data = self.muscles, self.engine.data
        signals = self.excitation.signals.values()
        times = np.linspace(0.0, self.duration, CONTROLS_AT).tolist() if signals else []
        return (
            bool(data.ctrl.any() or muscles.excitation.any())
            or any(signal.value(t) != 0.0 for signal in signals for t in times)
        )  # fmt: skip

    def begin(self) -> None:
        """Evaluate everything at the start, and rehearse a step, which compiles kernels before time is measured.

        Raises `ModelError` if a muscle has no path at the start, because an end lies inside a surface: it has no last
        valid force to keep.
        """
        self.prescribed.place(self.engine.data)
        place_followers(self.engine.model, self.engine.data, self.prescribed.joints)
        self.start = self.engine.data.qpos.copy()
        self.excitation.write(self.engine.data)
        rehearse(self.engine)
        self.engine.evaluate()
        muscles = self.muscles
        inside = muscles.held & (muscles.status == Status.ENDPOINT_INSIDE)
        for i in np.flatnonzero(inside)[:1].tolist():
            raise ModelError(f"muscle '{muscles.names[i]}' has no path at the start: {muscles.reason(i)}")

    def advance(
        self,
        logs: Sequence[Log] = (),
        *,
        progress: Callable[[float], object] = lambda seconds: None,
        stopped: Callable[[], object] = lambda: False,
    ) -> WallTime:
        """Run for the duration, or until `stopped` returns a true value.

        Args:
            logs: called with the data of every sample, after the muscles' evaluation; also at the end, unless stopped.
            progress: called at every sample with the simulated time since the last one [s].
            stopped: called before every step; a true value ends the run.

        Returns:
            The wall time.

        Raises:
            StateError: the motion became unstable.
            PathError: a path was not found, with `strict`.
        """
        data, timestep, steps = self.engine.data, self._timestep, self._steps
        stride = max(1, round(self.settings.sample / timestep))
        with CompileClock() as compiling:
            started, outputs = time.perf_counter(), 0.0
            for k in range(steps):
                if k % stride == 0:
                    self.pushes.look(data)
                    outputs += self._sample(logs, compiling)
                    progress(0.0 if k == 0 else stride * timestep)
                if stopped():
                    break
                self.prescribed.drive(data)
                self.engine.step()
                self.prescribed.place(data)
                self.excitation.write(data)
            else:
                self.pushes.look(data)
                outputs += self._sample(logs, compiling)
            return WallTime(time.perf_counter() - started - compiling.seconds - outputs, outputs)

    def _sample(self, logs: Sequence[Log], compiling: CompileClock) -> float:
        """Log the present state; return the wall time [s] of this, without compilation."""
        started = time.perf_counter() - compiling.seconds
        if logs:
            self.engine.evaluate()
            for log in logs:
                log(self.engine.sampled)
        return time.perf_counter() - compiling.seconds - started


def simulate(source: str, settings: RunSettings | None = None, kinds: Iterable[str] = DEFAULT_KINDS) -> Table:
    """Run a model and return its samples as a table, as `mjwrap run --out` writes it.

    Args:
        source: an MJCF or MJB file, "mjwrap:NAME" or "myo_sim:NAME".
        settings: the settings of the run; None for the defaults.
        kinds: the quantities in the table, such as "qpos", "length" or "moment_arm", as for `mjwrap run --columns`.

    Returns:
        The table, with columns called KIND:NAME, in SI units.

    Raises:
        ModelError: the model cannot be loaded, or a setting does not fit it.
        SignalError: an entry of the excitation or of the prescribed joints is not valid.
        StateError: the motion became unstable.
        PathError: a path was not found, with `strict`.
        TableError: a kind is unknown.
    """
    simulation = Simulation(source, settings or RunSettings())
    table = RunTable(simulation.muscles.model, simulation.muscles, kinds)
    simulation.begin()
    simulation.advance([table.log])
    return table.table()


def _integrator(name: str) -> mujoco.mjtIntegrator:
    if name not in INTEGRATORS:
        raise ModelError(f"integrator '{name}' does not exist; integrators: {', '.join(INTEGRATORS)}")
    return INTEGRATORS[name]
