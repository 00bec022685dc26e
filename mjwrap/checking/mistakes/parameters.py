"""Find parameters of muscles in another unit than mjwrap's: lengths, time constants, contraction velocities."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco

from mjwrap.checking.mistakes.finding import Mistake, PossibleMistake, millimetres, muscle_of
from mjwrap.mjcf import MuscleDeclaration
from mjwrap.system import pulls_as_cable

OTHER_UNIT = 20.0  # least length of fibre or tendon that is not in metres, in sizes of the muscle
SLOW = 2.0  # [s] a longer time constant is not in seconds
SLUGGISH = 2.0  # [optimal fibre lengths/s] a smaller largest velocity is not in this unit


def parameter_mistakes(
    model: mujoco.MjModel, muscle: MuscleDeclaration, size: float
) -> Iterator[PossibleMistake]:
    """Yield the findings about the parameters of a muscle of a size [m]."""

    def finding(text: str, remedy: str) -> PossibleMistake:
        return PossibleMistake(Mistake.PARAMETER, muscle_of(model, muscle), text, remedy)

    for name in ("optimal_fiber_length", "tendon_slack_length"):
        length = getattr(muscle.parameters, name, None)
        if length is not None and length > OTHER_UNIT * size:
            a = "an" if name[0] in "aeiou" else "a"
            apart = f"its stops are only {millimetres(size)} apart"
            yield finding(f"has {a} {name} of {millimetres(length)}, and {apart}", "lengths are in metres")
    speed = getattr(muscle.parameters, "max_contraction_velocity", None)
    if speed is not None and speed < SLUGGISH:
        yield finding(
            f"has a max_contraction_velocity of only {speed:g}",
            "it is in optimal fibre lengths per second, about 10, not in m/s",
        )
    rise, fall = _time_constants(model, muscle)
    if max(rise, fall) > SLOW:
        yield finding(
            f"has time constants of activation and deactivation of {rise:g} and {fall:g} s",
            "they are in seconds, such as 0.01 and 0.04, not in milliseconds",
        )
    elif rise > fall > 0.0:
        yield finding(
            f"is activated more slowly ({rise:g} s) than deactivated ({fall:g} s)",
            "the time constant of activation comes first",
        )


def _time_constants(model: mujoco.MjModel, muscle: MuscleDeclaration) -> tuple[float, float]:
    """Return the time constants of activation and deactivation that act [s]; zeros if there are none."""
    i = muscle.actuator
    if pulls_as_cable(model, muscle):
        return 0.0, 0.0
    if i >= 0 and int(model.actuator_dyntype[i]) != int(mujoco.mjtDyn.mjDYN_USER):
        its_own = int(model.actuator_dyntype[i]) == int(mujoco.mjtDyn.mjDYN_MUSCLE)
        rise, fall = model.actuator_dynprm[i, :2].tolist() if its_own else (0.0, 0.0)
        return rise, fall
    rise, fall, _ = muscle.activation.row()
    return rise, fall
