"""Search a model for possible mistakes: from its declarations, at a pose, and over the ranges of its joints."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike

from mjwrap.checking.mistakes.actuators import actuator_mistakes
from mjwrap.checking.mistakes.arms import moment_arm_mistakes, sign_changes
from mjwrap.checking.mistakes.finding import PossibleMistake
from mjwrap.checking.mistakes.joints import joint_mistakes
from mjwrap.checking.mistakes.pose import Posed, evaluated
from mjwrap.checking.mistakes.routes import route_mistakes
from mjwrap.checking.mistakes.surfaces import surface_mistakes
from mjwrap.checking.mistakes.unread import unread_elements
from mjwrap.errors import StateError
from mjwrap.system import MuscleSystem


def possible_mistakes(
    muscles: MuscleSystem, *, rest: ArrayLike | None = None, sweep: bool = True, hints: bool = True
) -> list[PossibleMistake]:
    """Find what is legal in a model and yet probably not meant.

    The last results of `muscles` and the states of its data are not changed. Parameters are judged by `implausible`.

    Args:
        muscles: the muscles.
        rest: (nq,) the pose at which paths and moment arms are judged; qpos0 if None.
        sweep: also move each joint over its range, to find moment arms that change sign.
        hints: also find hints that are not met at the pose. Without it nothing has to be compiled after an evaluation.

    Returns:
        The findings: first of elements that nothing reads, then of joints, actuators, surfaces, routes and moment arms.

    Raises:
        StateError: the pose is not possible.
    """
    model = muscles.model
    qpos = np.array(model.qpos0 if rest is None else rest, dtype=np.float64)
    if qpos.shape != (model.nq,):
        raise StateError(f"the rest pose must have shape ({model.nq},), not {qpos.shape}")
    with evaluated(muscles, qpos) as posed:
        return list(_search(posed, sweep, hints))


def _search(posed: Posed, sweep: bool, hints: bool) -> Iterator[PossibleMistake]:
    yield from unread_elements(posed.model)
    yield from joint_mistakes(posed)
    yield from actuator_mistakes(posed)
    yield from surface_mistakes(posed)
    yield from route_mistakes(posed, hints)
    yield from moment_arm_mistakes(posed)
    if sweep:
        yield from sign_changes(posed)
