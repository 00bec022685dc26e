"""The files that a run leaves: tables, plot, recording and film, each opened before it and completed after it."""

from __future__ import annotations

import argparse
import contextlib
from collections.abc import Callable
from pathlib import Path

import mujoco

from mjwrap.cli.common.output import open_output, opened
from mjwrap.cli.common.progress import need_matplotlib
from mjwrap.cli.common.recorded import open_recorder
from mjwrap.cli.run.analysis import Analysis
from mjwrap.cli.run.engine import Engine, PluginEngine
from mjwrap.cli.run.history import History
from mjwrap.cli.run.samples import Samples, choose_kinds
from mjwrap.files import SUFFIXES

Log = Callable[[mujoco.MjData], object]
OUTPUTS = (("recording", "record"), ("video", "video"), ("plot", "plot"), ("csv", "csv"), ("table", "out"),
           ("analysis", "analysis"))  # fmt: skip


def open_outputs(
    options: argparse.Namespace, engine: Engine, stack: contextlib.ExitStack, connect: str
) -> tuple[list[Log], list[Callable[[], None]]]:
    """Open every file that was asked for: what to call at each sample, and what at the end.

    A place that cannot be written shows here, before the run. What has to be closed in any case goes on `stack`.
    connect: the viewer for browsers that a recording goes to, if there is one.
    """
    model, muscles = engine.muscles.model, engine.muscles
    logs: list[Log] = []
    closes: list[Callable[[], None]] = []
    kinds = choose_kinds(options.columns)
    plot = open_output(options.plot, "--plot", ".png", ".pdf", ".svg") if options.plot else None
    tables = [open_output(options.csv, "--csv", ".csv")] if options.csv else []
    tables += [open_output(options.out, "--out", *SUFFIXES)] if options.out else []
    if plot is not None:
        need_matplotlib()
    for output in tables:
        samples = Samples(output, model, muscles, kinds)
        logs.append(samples.log)
        closes.append(samples.close)
    if options.analysis:
        analysis = Analysis(options.analysis, model, muscles)
        logs.append(analysis.log)
        closes.append(analysis.close)
    connect = connect or options.connect or ""
    if options.record or connect:
        logs.append(open_recorder(options, model, muscles, stack, options.record, connect).log)
    if isinstance(engine, PluginEngine) and options.video:
        from mjwrap import Video  # with MuJoCo's renderer

        width, height = options.video_size
        film = stack.enter_context(
            opened(
                lambda: Video(
                    engine.model, options.video, fps=options.fps, speed=options.speed, width=width,
                    height=height, camera=options.camera,
                )
            )
        )  # fmt: skip
        logs.append(lambda _: film.log(engine.fresh()))
    if plot is not None:
        history = History(muscles)
        logs.append(history.log)

        def draw() -> None:
            from mjwrap.cli.run.plot import plot_run

            plot_run(plot, f"{Path(options.model).name}, {engine.data.time:.4g} s", model, muscles, history)

        closes.append(draw)
    return logs, closes
