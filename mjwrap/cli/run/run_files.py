"""The files of a run: tables, plot, recording and film, opened before the run and completed after it."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from mjwrap.cli.common.figures import need_matplotlib
from mjwrap.cli.common.output import open_analysis, open_motion, open_output, opened
from mjwrap.cli.common.outputs import Outputs
from mjwrap.cli.common.recorded import RecordingSettings, open_recorder
from mjwrap.files import SUFFIXES
from mjwrap.osim.motions import MotionFile
from mjwrap.runs.engine import Engine, PluginEngine
from mjwrap.runs.muscle_analysis_tables import MuscleAnalysisTables
from mjwrap.runs.plot_history import PlotHistory
from mjwrap.runs.run_table import DEFAULT_KINDS, RunTableFile

if TYPE_CHECKING:
    from mjwrap import Video


@dataclass(frozen=True)
class FilmSettings:
    """The settings of a film, as `Video` takes them: width and height [pixels], frames per second, speed, the look."""

    path: str
    width: int
    height: int
    fps: float
    speed: float
    camera: str | None
    background: str = "light"
    colors: str | None = None
    surfaces: bool | None = None
    legend: bool | None = None
    shadows: bool = False


@dataclass(frozen=True)
class OutputSettings:
    """The output files of a run; None for files that were not asked for.

    kinds: the quantities in the tables (csv and table). analysis: the prefix of tables in OpenSim's layout. motion: a
    file of coordinates that OpenSim replays.
    """

    recording: RecordingSettings
    film: FilmSettings | None = None
    plot: str | None = None
    csv: str | None = None
    table: str | None = None
    kinds: Sequence[str] = DEFAULT_KINDS
    analysis: str | None = None
    motion: str | None = None

    @property
    def files(self) -> dict[str, str]:
        """The files that were asked for, by kind of output."""
        places = {
            "recording": self.recording.path,
            "video": self.film.path if self.film else None,
            "plot": self.plot,
            "csv": self.csv,
            "table": self.table,
            "analysis": self.analysis,
            "motion": self.motion,
        }
        return {what: path for what, path in places.items() if path}


def open_outputs(
    settings: OutputSettings, source: str, engine: Engine, stack: contextlib.ExitStack
) -> Outputs:
    """Open the output files.

    `stack` closes what has to be closed if the run ends with an error. source: the model's file or name, for the title
    of the plot. Raises `UserError` if a file cannot be written.
    """
    model, muscles = engine.muscles.model, engine.muscles
    outputs = Outputs("run")
    plot = open_output(settings.plot, "--plot", ".png", ".pdf", ".svg") if settings.plot else None
    tables = {"csv": open_output(settings.csv, "--csv", ".csv")} if settings.csv else {}
    if settings.table:
        tables["table"] = open_output(settings.table, "--out", *SUFFIXES)
    if plot is not None:
        need_matplotlib()
    for name, output in tables.items():
        table = RunTableFile(output, model, muscles, settings.kinds)
        outputs.add(name, table.log, table.close)
    if settings.analysis:
        analysis = MuscleAnalysisTables(settings.analysis, model, muscles, open_analysis)
        outputs.add("analysis", analysis.log, analysis.close)
    if settings.motion:
        motion = MotionFile(open_motion(settings.motion), model)
        outputs.add("motion", motion.log, motion.close)
    if settings.recording.wanted:
        recorder = open_recorder(settings.recording, model, muscles, stack)
        outputs.add("recording", recorder.log, recorder.close)
    if isinstance(engine, PluginEngine) and settings.film:
        film = _open_film(settings.film, engine, stack)
        outputs.add("video", lambda _: film.log(engine.fresh()), film.close)
    if plot is not None:
        history = PlotHistory(muscles)

        def draw() -> None:
            from mjwrap.cli.run.plot import plot_run

            plot_run(plot, f"{Path(source).name}, {engine.data.time:.4g} s", model, muscles, history)

        outputs.add("plot", history.log, draw)
    return outputs


def _open_film(film: FilmSettings, engine: PluginEngine, stack: contextlib.ExitStack) -> Video:
    from mjwrap import Video  # with MuJoCo's renderer

    return stack.enter_context(
        opened(
            lambda: Video(
                engine.model, film.path, fps=film.fps, speed=film.speed, width=film.width, height=film.height,
                camera=film.camera, background=film.background, colors=film.colors, surfaces=film.surfaces,
                legend=film.legend, shadows=film.shadows,
            )
        )
    )  # fmt: skip
