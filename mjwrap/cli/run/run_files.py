"""The files of a run: tables, plot, recording and film, opened before the run and completed after it."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from mjwrap.cli.common.figures import need_matplotlib
from mjwrap.cli.common.output import open_analysis, open_output, opened
from mjwrap.cli.common.recorded import RecordingSettings, open_recorder
from mjwrap.files import SUFFIXES
from mjwrap.runs.engine import Engine, PluginEngine
from mjwrap.runs.muscle_analysis_tables import MuscleAnalysisTables
from mjwrap.runs.plot_history import PlotHistory
from mjwrap.runs.run_table import DEFAULT_KINDS, RunTableFile
from mjwrap.runs.simulation import Log


@dataclass(frozen=True)
class FilmSettings:
    """The settings of a film, as `Video` takes them: width and height [pixels], frames per second, speed, camera."""

    path: str
    width: int
    height: int
    fps: float
    speed: float
    camera: str | None


@dataclass(frozen=True)
class OutputSettings:
    """The output files of a run; None for files that were not asked for.

    kinds: the quantities in the tables (csv and table). analysis: the prefix of tables in OpenSim's layout.
    """

    recording: RecordingSettings
    film: FilmSettings | None = None
    plot: str | None = None
    csv: str | None = None
    table: str | None = None
    kinds: Sequence[str] = DEFAULT_KINDS
    analysis: str | None = None

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
        }
        return {what: path for what, path in places.items() if path}


def open_outputs(
    settings: OutputSettings, source: str, engine: Engine, stack: contextlib.ExitStack
) -> tuple[list[Log], list[Callable[[], None]]]:
    """Open the output files; return the functions to call at each sample, and those to call at the end.

    `stack` closes what has to be closed however the run ends. source: the model's file or name, for the title of the
    plot. Raises `UserError` if a file cannot be written.
    """
    model, muscles = engine.muscles.model, engine.muscles
    logs: list[Log] = []
    closes: list[Callable[[], None]] = []
    plot = open_output(settings.plot, "--plot", ".png", ".pdf", ".svg") if settings.plot else None
    tables = [open_output(settings.csv, "--csv", ".csv")] if settings.csv else []
    tables += [open_output(settings.table, "--out", *SUFFIXES)] if settings.table else []
    if plot is not None:
        need_matplotlib()
    for output in tables:
        table = RunTableFile(output, model, muscles, settings.kinds)
        logs.append(table.log)
        closes.append(table.close)
    if settings.analysis:
        analysis = MuscleAnalysisTables(settings.analysis, model, muscles, open_analysis)
        logs.append(analysis.log)
        closes.append(analysis.close)
    if settings.recording.wanted:
        logs.append(open_recorder(settings.recording, model, muscles, stack).log)
    if isinstance(engine, PluginEngine) and settings.film:
        logs.append(_open_film(settings.film, engine, stack))
    if plot is not None:
        history = PlotHistory(muscles)
        logs.append(history.log)

        def draw() -> None:
            from mjwrap.cli.run.plot import plot_run

            plot_run(plot, f"{Path(source).name}, {engine.data.time:.4g} s", model, muscles, history)

        closes.append(draw)
    return logs, closes


def _open_film(film: FilmSettings, engine: PluginEngine, stack: contextlib.ExitStack) -> Log:
    from mjwrap import Video  # with MuJoCo's renderer

    video = stack.enter_context(
        opened(
            lambda: Video(
                engine.model, film.path, fps=film.fps, speed=film.speed, width=film.width, height=film.height,
                camera=film.camera,
            )
        )
    )  # fmt: skip
    return lambda _: video.log(engine.fresh())
