"""Warn of possible mistakes at the start of a run, one line each."""

from __future__ import annotations

import sys

from mjwrap.checking.mistakes import Mistake, possible_mistakes
from mjwrap.runs.simulation import Simulation

MOST = 5  # lines
# what the report of a run names itself, or what published models have on purpose
LEFT_OUT = (Mistake.SIDE, Mistake.SAME_ROUTE, Mistake.ON_JOINT, Mistake.NO_PATH)


def warn(model: str, simulation: Simulation) -> None:
    """Print the possible mistakes that can be seen at the start pose to standard error."""
    rest = simulation.engine.data.qpos
    searched = possible_mistakes(simulation.muscles, rest=rest, sweep=False, hints=False)
    found = [mistake for mistake in searched if mistake.kind not in LEFT_OUT]
    for mistake in found[:MOST]:
        print(f"mjwrap run: warning: {mistake}", file=sys.stderr)
    if len(found) > MOST:
        print(
            f"mjwrap run: warning: {len(found) - MOST} more; mjwrap inspect {model} lists them",
            file=sys.stderr,
        )
