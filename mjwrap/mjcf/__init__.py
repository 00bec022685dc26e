"""Read the muscles that an MjModel declares, with their actuators, routes and laws.

Two forms are read (docs/declaring.md): every muscle actuator on a spatial tendon; and `<custom>` tuples whose name
contains "mjwrap", for what MuJoCo's schema cannot express. Reading does not change the model.
"""

from mjwrap.mjcf.actuators import ACTEARLY_DYNAMICS, is_muscle, keeps_state
from mjwrap.mjcf.bare_tendons import tendon_declarations
from mjwrap.mjcf.declarations import Declarations, MuscleDeclaration, Node, Route
from mjwrap.mjcf.loading import is_binary, read_model, read_spec, with_remedy
from mjwrap.mjcf.moving_points import MovingAxis, read_moving_axes
from mjwrap.mjcf.muscle_text import insert_xml, muscle_xml
from mjwrap.mjcf.names import act_names, dof_names, has_plugin, name_of, names, qpos_names
from mjwrap.mjcf.reader import read_declarations
from mjwrap.mjcf.routes import tendon_stops
from mjwrap.mjcf.writing import set_laws

__all__ = [
    "ACTEARLY_DYNAMICS",
    "Declarations",
    "MovingAxis",
    "MuscleDeclaration",
    "Node",
    "Route",
    "act_names",
    "dof_names",
    "has_plugin",
    "insert_xml",
    "is_binary",
    "is_muscle",
    "keeps_state",
    "muscle_xml",
    "name_of",
    "names",
    "qpos_names",
    "read_declarations",
    "read_model",
    "read_moving_axes",
    "read_spec",
    "set_laws",
    "tendon_declarations",
    "tendon_stops",
    "with_remedy",
]
