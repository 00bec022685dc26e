"""The rules by which a side site picks the way round a cylinder; MuJoCo 4 has another one than MuJoCo 3.

Seen along the axis, a string that is bent round a cylinder can go either way. MuJoCo 3 (`mju_wrap`) compares the
middles of the chords between the contact points, and takes the way whose middle lies in a direction nearer to that of
the side site, even if that is the long way round. MuJoCo 4 takes the way of a string that is pulled tight from the
polyline that leads from one end over the side site to the other: the long way only if the two legs of this polyline
together go round the axis by more than half a turn.
"""

from __future__ import annotations

import mujoco

from mjwrap.errors import ModelError
from mjwrap.mjcf.marks import stored_side_rule

SIDE_RULES = MUJOCO_3, MUJOCO_4 = 3, 4
AUTHORS = 0  # of hints that mjwrap's tuples list: the way round whose middle is nearer to the hint


def running_side_rule() -> int:
    """Return the rule of the MuJoCo that is running."""
    return MUJOCO_4 if int(mujoco.__version__.split(".")[0]) >= MUJOCO_4 else MUJOCO_3


def check_side_rule(rule: int | None) -> None:
    """Raise `ModelError` unless `rule` is one of `SIDE_RULES`, or None."""
    if rule is not None and rule not in SIDE_RULES:
        raise ModelError(f"side_rule {rule!r} does not exist; it is 3, 4, or None for the running MuJoCo's")


def choose_side_rule(model: mujoco.MjModel, rule: int | None) -> int:
    """Return the rule for a model: the given one, else the one stored by `install`, else the running MuJoCo's."""
    check_side_rule(rule)
    return rule or stored_side_rule(model) or running_side_rule()
