"""Paths in space without MuJoCo: from obstacles with world poses to a certified geodesic path.

Everything is in SI units and world coordinates unless it says otherwise.
"""

from mjwrap.paths.contact import Contact
from mjwrap.paths.derivatives import ContactVelocity
from mjwrap.paths.scene import Obstacle, ViaPoint
from mjwrap.paths.solution import PathSolution
from mjwrap.paths.solve import solve_path
from mjwrap.paths.status import Status
from mjwrap.paths.sweep import SweepSolution, solve_sweep

__all__ = [
    "Contact",
    "ContactVelocity",
    "Obstacle",
    "PathSolution",
    "Status",
    "SweepSolution",
    "ViaPoint",
    "solve_path",
    "solve_sweep",
]
