"""The three solvers of Muñoz-Pepi et al. (2023), on NumPy, for comparison: NR, BFGS and Broyden's method (BR).

`solve_chain` solves a whole path; `ChainProblem`, a solver of `METHODS` and `iterate` are its parts.
"""

from mjwrap.methods.bfgs import Bfgs
from mjwrap.methods.broyden import Broyden
from mjwrap.methods.iteration import Outcome, iterate
from mjwrap.methods.newton_raphson import NewtonRaphson
from mjwrap.methods.problem import ChainProblem
from mjwrap.methods.registry import METHODS, make_solver
from mjwrap.methods.whole_path import MethodResult, solve_chain

__all__ = [
    "METHODS",
    "Bfgs",
    "Broyden",
    "ChainProblem",
    "MethodResult",
    "NewtonRaphson",
    "Outcome",
    "iterate",
    "make_solver",
    "solve_chain",
]
