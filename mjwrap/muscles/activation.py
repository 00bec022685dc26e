"""Parameters of the activation dynamics; the rates are in `mjwrap/kernels/musculotendon/activation_dynamics.py`."""

from __future__ import annotations

from dataclasses import dataclass

from mjwrap import validation
from mjwrap.errors import ModelError
from mjwrap.kernels.musculotendon import activation_dynamics

FORMS = {"zajac": activation_dynamics.ZAJAC, "degroote_fregly_2016": activation_dynamics.SMOOTH}
TIMES = {"zajac": (0.010, 0.040), "degroote_fregly_2016": (0.015, 0.060)}  # [s], activation and deactivation


@dataclass(frozen=True)
class ActivationDynamics:
    """First-order dynamics from excitation to activation, both limited to [0, 1].

    Args:
        dynamics: "zajac", MuJoCo's and OpenSim's form with two rates (doi 10.1115/1.4023390), or
            "degroote_fregly_2016", smooth in the excitation (doi 10.1007/s10439-016-1591-9).
        activation_time: time constant of activation [s], positive; None for 0.010 with the former and 0.015 with the
            latter.
        deactivation_time: time constant of deactivation [s], positive; None for 0.040 with the former and 0.060 with
            the latter.
        smoothing: b of the latter, positive; a larger value is less smooth. The paper has 10, OpenSim's muscle 0.1.

    Raises:
        ModelError: a value is not possible.
    """

    dynamics: str = "zajac"
    activation_time: float | None = None
    deactivation_time: float | None = None
    smoothing: float = 10.0

    def __post_init__(self) -> None:
        if not isinstance(self.dynamics, str) or self.dynamics not in FORMS:
            raise ModelError(
                f"activation dynamics {validation.described(self.dynamics)} do not exist; there are: {', '.join(FORMS)}"
            )
        values = {
            "activation_time": self.activation_time,
            "deactivation_time": self.deactivation_time,
            "smoothing": self.smoothing,
        }
        for name, value in values.items():
            if value is not None or name == "smoothing":
                validation.positive(value, name, ModelError)

    @property
    def form(self) -> int:
        """Code of the dynamics in the kernels."""
        return FORMS[self.dynamics]

    def row(self) -> tuple[float, float, float]:
        """Return time constants [s] and smoothing in the order of the kernels."""
        up, down = TIMES[self.dynamics]
        return (
            up if self.activation_time is None else self.activation_time,
            down if self.deactivation_time is None else self.deactivation_time,
            self.smoothing,
        )
