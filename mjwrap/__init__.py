"""Geodesic muscles for MuJoCo: C1 paths over any number of wrapping surfaces."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from mjwrap.errors import (
    GeometryError,
    MjwrapError,
    ModelError,
    PathError,
    RecordingError,
    SignalError,
    StateError,
    TableError,
    VersionError,
)

if TYPE_CHECKING:
    from mjwrap.calibration import (
        FiberFit,
        Finding,
        HillFit,
        Implausible,
        LengthRange,
        ParameterLimits,
        ParameterReport,
        fit_fiber_and_slack,
        hill_from_mujoco,
        implausible,
        length_ranges,
    )
    from mjwrap.files import Table, read_table, write_table
    from mjwrap.fitting import (
        Fit,
        fit_capsule,
        fit_cone,
        fit_cylinder,
        fit_ellipsoid,
        fit_elliptic_cylinder,
        fit_sphere,
        fit_torus,
        mesh_points,
    )
    from mjwrap.mjcf import set_laws
    from mjwrap.muscles.activation import ActivationDynamics
    from mjwrap.muscles.bench import MuscleTrial, simulate_muscle
    from mjwrap.muscles.energetics import Energetics, Umberger2010, basal_power
    from mjwrap.muscles.laws import DeGrooteFregly2016, Millard2012, MuJoCoMuscle, PathActuator
    from mjwrap.paths import (
        Contact,
        Obstacle,
        PathSolution,
        Status,
        SweepSolution,
        ViaPoint,
        solve_path,
        solve_sweep,
    )
    from mjwrap.plugin import install, load
    from mjwrap.recording import Recorder
    from mjwrap.surfaces import (
        Capsule,
        Cone,
        Cylinder,
        Ellipsoid,
        EllipticCylinder,
        Sphere,
        Torus,
    )
    from mjwrap.surfaces.user import ImplicitSurface, ParametricSurface
    from mjwrap.system import MuscleSystem
    from mjwrap.video import Video

__version__ = "0.1.0"

_HOMES = {
    "FiberFit": "calibration",
    "Finding": "calibration",
    "HillFit": "calibration",
    "Implausible": "calibration",
    "LengthRange": "calibration",
    "ParameterLimits": "calibration",
    "ParameterReport": "calibration",
    "fit_fiber_and_slack": "calibration",
    "hill_from_mujoco": "calibration",
    "implausible": "calibration",
    "length_ranges": "calibration",
    "ImplicitSurface": "surfaces.user",
    "ParametricSurface": "surfaces.user",
    "Capsule": "surfaces",
    "Cone": "surfaces",
    "Cylinder": "surfaces",
    "Ellipsoid": "surfaces",
    "EllipticCylinder": "surfaces",
    "Sphere": "surfaces",
    "Torus": "surfaces",
    "Contact": "paths",
    "Obstacle": "paths",
    "PathSolution": "paths",
    "Status": "paths",
    "SweepSolution": "paths",
    "ViaPoint": "paths",
    "solve_path": "paths",
    "solve_sweep": "paths",
    "Table": "files",
    "read_table": "files",
    "write_table": "files",
    "Fit": "fitting",
    "fit_capsule": "fitting",
    "fit_cone": "fitting",
    "fit_cylinder": "fitting",
    "fit_ellipsoid": "fitting",
    "fit_elliptic_cylinder": "fitting",
    "fit_sphere": "fitting",
    "fit_torus": "fitting",
    "mesh_points": "fitting",
    "DeGrooteFregly2016": "muscles",
    "Millard2012": "muscles",
    "set_laws": "mjcf",
    "ActivationDynamics": "muscles",
    "simulate_muscle": "muscles.bench",
    "MuscleTrial": "muscles.bench",
    "MuJoCoMuscle": "muscles",
    "PathActuator": "muscles",
    "Energetics": "muscles.energetics",
    "Umberger2010": "muscles.energetics",
    "basal_power": "muscles.energetics",
    "MuscleSystem": "system",
    "Recorder": "recording",
    "install": "plugin",
    "load": "plugin",
    "Video": "video",
}

__all__ = [
    "ActivationDynamics",
    "Capsule",
    "Cone",
    "Contact",
    "Cylinder",
    "DeGrooteFregly2016",
    "Ellipsoid",
    "EllipticCylinder",
    "Energetics",
    "FiberFit",
    "Finding",
    "Fit",
    "GeometryError",
    "HillFit",
    "Implausible",
    "ImplicitSurface",
    "LengthRange",
    "Millard2012",
    "MjwrapError",
    "ModelError",
    "MuJoCoMuscle",
    "MuscleSystem",
    "MuscleTrial",
    "Obstacle",
    "ParameterLimits",
    "ParameterReport",
    "ParametricSurface",
    "PathActuator",
    "PathError",
    "PathSolution",
    "Recorder",
    "RecordingError",
    "SignalError",
    "Sphere",
    "StateError",
    "Status",
    "SweepSolution",
    "Table",
    "TableError",
    "Torus",
    "Umberger2010",
    "VersionError",
    "ViaPoint",
    "Video",
    "basal_power",
    "fit_capsule",
    "fit_cone",
    "fit_cylinder",
    "fit_ellipsoid",
    "fit_elliptic_cylinder",
    "fit_fiber_and_slack",
    "fit_sphere",
    "fit_torus",
    "hill_from_mujoco",
    "implausible",
    "install",
    "length_ranges",
    "load",
    "mesh_points",
    "read_table",
    "set_laws",
    "simulate_muscle",
    "solve_path",
    "solve_sweep",
    "write_table",
]


def __getattr__(name: str) -> Any:
    """Load a public name from its module when it is first used, so that importing mjwrap costs next to nothing."""
    if name not in _HOMES:
        raise AttributeError(f"module 'mjwrap' has no attribute {name!r}; it has: {', '.join(__all__)}")
    value = getattr(importlib.import_module(f"mjwrap.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__
