"""Tell by its name what a `<custom>` tuple declares: a muscle, a coupling, a moving point, a coordinate, or axes."""

from __future__ import annotations

OURS = "mjwrap"  # in the names of all tuples that mjwrap reads
COUPLING = "mjwrap_coupling_"  # pieces of a coupling of joints (`coupling_pieces.py`)
MOVING = "mjwrap_moving_"  # a site that moves in its body's frame

COORDINATE = "mjwrap_coordinate_"  # a coordinate of an OpenSim model that is no joint's qpos
AXES = "mjwrap_axes"  # joints that are no coordinates: axes of a joint of an OpenSim model
_OTHERS = COUPLING, MOVING, COORDINATE, AXES


def is_ours(name: str) -> bool:
    """Return whether mjwrap reads a tuple of this name; `attach` may have put a prefix before it."""
    return OURS in name


def declares_muscle(name: str) -> bool:
    """Return whether a tuple of this name declares a muscle."""
    return is_ours(name) and not any(word in name for word in _OTHERS)


def declares_coupling(name: str) -> bool:
    """Return whether a tuple of this name lists the pieces of a coupling."""
    return COUPLING in name
