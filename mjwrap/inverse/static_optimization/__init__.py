"""Static optimisation: from the moments of a motion to muscle activations and forces.

optimize.py   `static_optimization`: the whole, and linearising again where forces are not affine
choices.py    weights, reserves and bounds by name
forces.py     muscle forces as affine functions of activation
programs.py   the quadratic programs of all frames in threads
result.py     the result, its report and its tables
"""

from mjwrap.inverse.static_optimization.optimize import OPENSIM_PARITY, static_optimization
from mjwrap.inverse.static_optimization.result import StaticOptimization

__all__ = ["OPENSIM_PARITY", "StaticOptimization", "static_optimization"]
