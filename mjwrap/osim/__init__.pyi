"""The names of `mjwrap.osim`, each with the module that it comes from."""

from .coordinates import coordinates as coordinates
from .coordinates import set_coordinates as set_coordinates
from .inertias import restore_inertias as restore_inertias
from .motions import motion_table as motion_table

__all__: list[str]
