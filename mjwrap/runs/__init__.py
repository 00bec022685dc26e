"""Run a model from Python: excitation, prescribed motion, the engine, and tables of states and results.

`simulate` runs a model and returns a table; `Simulation` gives access to the model, its muscles and every sample.
"""

from mjwrap.runs.excitation import Excitation
from mjwrap.runs.models import load, load_spec
from mjwrap.runs.muscle_analysis_tables import MuscleAnalysisTables
from mjwrap.runs.prescribed_motion import PrescribedMotion
from mjwrap.runs.run_table import RunTable, RunTableFile
from mjwrap.runs.simulation import RunSettings, Simulation, WallTime, simulate
from mjwrap.runs.state_tables import States, read_states

__all__ = [
    "Excitation",
    "MuscleAnalysisTables",
    "PrescribedMotion",
    "RunSettings",
    "RunTable",
    "RunTableFile",
    "Simulation",
    "States",
    "WallTime",
    "load",
    "load_spec",
    "read_states",
    "simulate",
]
