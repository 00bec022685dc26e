"""Energy of muscles: power of fibres and tendons, stored energy, and metabolic cost.

The equations are in `mjwrap/kernels/musculotendon/power.py` and `mjwrap/kernels/musculotendon/umberger.py`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from mjwrap import validation
from mjwrap.errors import ModelError
from mjwrap.kernels.musculotendon import power as kernel
from mjwrap.kernels.musculotendon import umberger
from mjwrap.kernels.musculotendon.dispatch import has_fiber
from mjwrap.kernels.musculotendon.fiber import F_MAX, OPTIMAL

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class Umberger2010:
    """Metabolic constants of a muscle, with OpenSim's defaults (its `Umberger2010MuscleMetabolicsProbe`).

    With the last three options False it is the model as published in 2010 (doi 10.1098/rsif.2010.0084).

    Args:
        slow_twitch_ratio: share of slow-twitch fibres, 0 to 1.
        specific_tension: [Pa]. With the density it gives the muscle's mass, max_isometric_force / specific_tension
            * density * optimal_fiber_length, unless `mass` is given.
        density: [kg/m^3].
        mass: [kg]; None to compute it.
        aerobic_factor: 1.5 for primarily aerobic activities, 1.0 for others.
        minimum_heat_rate: [W/kg]; 0 for none.
        effort: factor of excitation, activation and active force, for models with more co-contraction than a person.
        recruitment: slow-twitch fibres are recruited first, and the ratio holds at full excitation (Bhargava et al.
            2004, doi 10.1016/S0021-9290(03)00239-2).
        negative_work: lengthening counts as negative work and gives more heat (Umberger et al. 2003,
            doi 10.1080/1025584031000091678).
        forbid_negative_power: add heat if the metabolic power would be negative.

    Raises:
        ModelError: a number is not finite or not in its range.
    """

    slow_twitch_ratio: float = 0.5
    specific_tension: float = 0.25e6
    density: float = 1059.7
    mass: float | None = None
    aerobic_factor: float = 1.5
    minimum_heat_rate: float = 1.0
    effort: float = 1.0
    recruitment: bool = True
    negative_work: bool = True
    forbid_negative_power: bool = True

    def __post_init__(self) -> None:
        share, most = "Umberger2010: slow_twitch_ratio", math.nextafter(1.0, 2.0)
        validation.between(self.slow_twitch_ratio, 0.0, most, share, ModelError, "in [0, 1]")
        for name in ("recruitment", "negative_work", "forbid_negative_power"):
            validation.flag(getattr(self, name), f"Umberger2010: {name}", ModelError)
        for name in ("specific_tension", "density", "mass"):
            value = getattr(self, name)
            if value is not None or name != "mass":
                validation.positive(value, f"Umberger2010: {name}", ModelError)
        for name in ("aerobic_factor", "minimum_heat_rate", "effort"):
            validation.not_negative(getattr(self, name), f"Umberger2010: {name}", ModelError)

    def muscle_mass(self, max_isometric_force: float, optimal_fiber_length: float) -> float:
        """Return the mass of a muscle [kg] of a given force [N] and fibre length [m]."""
        if self.mass is not None:
            return self.mass
        return max_isometric_force / self.specific_tension * self.density * optimal_fiber_length

    def row(self, max_isometric_force: float, optimal_fiber_length: float) -> tuple[float, ...]:
        """Return the constants in the order of the kernel's columns."""
        return (
            self.muscle_mass(max_isometric_force, optimal_fiber_length),
            self.slow_twitch_ratio,
            self.aerobic_factor,
            self.minimum_heat_rate,
            self.effort,
            float(self.recruitment),
            float(self.negative_work),
            float(self.forbid_negative_power),
        )


@dataclass(frozen=True, eq=False)
class Energetics:
    """Energies and powers of n muscles at one instant, as arrays (n,); power is positive if it is delivered.

    A fibre or tendon that shortens under tension delivers power; one that is stretched absorbs it. Muscles without
    fibres (MuJoCo's, the path actuator) have only `muscle_power`; the rest is zero. Ligaments and springs have the
    power and the energy of a tendon, and springs that of their damping too. `tendon_power` and `tendon_energy` are zero
    with a rigid tendon. Heats, work and `metabolic_power` are zero without an `Umberger2010`.

    Attributes:
        fiber_velocity: [m/s], positive when lengthening.
        active_power: power of the cross-bridges [W].
        passive_power: power of the parallel elastic element [W].
        damping_power: power of the damping [W], never positive.
        fiber_power: sum of the three powers above [W].
        tendon_power: minus the rate of tendon_energy [W].
        muscle_power: minus tension times lengthening speed [W], the power that reaches the skeleton; the sum of
            fiber_power, tendon_power and unbalanced_power.
        unbalanced_power: [W], zero except where a law limits the force: a fibre that would push on a rigid tendon,
            or an undamped fibre beyond the range of its force-velocity curve.
        tendon_energy: energy stored in the tendon [J], zero without strain.
        fiber_energy: energy stored in the parallel elastic element [J], zero without strain.
        activation_heat: [W]; with maintenance_heat the heat of a muscle that is active at constant length.
        maintenance_heat: [W].
        shortening_heat: heat of shortening or lengthening [W], including what `forbid_negative_power` adds.
        resting_heat: heat that raises the sum of the three heats to `minimum_heat_rate` [W].
        mechanical_work: the part of active_power that the metabolic model counts [W].
        metabolic_power: sum of the four heats and the work [W], without the basal rate of the body (`basal_power`).
    """

    fiber_velocity: Vector
    active_power: Vector
    passive_power: Vector
    damping_power: Vector
    fiber_power: Vector
    tendon_power: Vector
    muscle_power: Vector
    unbalanced_power: Vector
    tendon_energy: Vector
    fiber_energy: Vector
    activation_heat: Vector
    maintenance_heat: Vector
    shortening_heat: Vector
    resting_heat: Vector
    mechanical_work: Vector
    metabolic_power: Vector


def metabolic_constants(
    model: Umberger2010 | Sequence[Umberger2010 | None] | None, law: NDArray[np.int64], params: Vector
) -> Vector:
    """Return the metabolic constants of n muscles.

    Args:
        model: one metabolic model for all muscles, one for each muscle, or None for no metabolic cost.
        law: (n,) codes of the laws, as in the kernels.
        params: (n, PARAMS) parameters of the muscles, as in the kernels.

    Returns:
        The constants (n, 8).

    Raises:
        ModelError: the numbers of models and muscles differ.
    """
    several = isinstance(model, Sequence) and all(
        each is None or isinstance(each, Umberger2010) for each in model
    )
    good = (
        model is None or isinstance(model, Umberger2010) or (several and not isinstance(model, str | bytes))
    )
    validation.require(good, "metabolism", "an Umberger2010, one for each muscle, or None", model, ModelError)
    models = [model] * len(law) if model is None or isinstance(model, Umberger2010) else list(model)
    if len(models) != len(law):
        raise ModelError(
            f"{len(models)} metabolic models were given for {len(law)} muscles: give one for all, or one for each"
        )
    constants = np.zeros((len(law), umberger.CONSTANTS))
    for m, each in enumerate(models):
        if each is not None and has_fiber(law[m]):
            constants[m] = each.row(params[m, F_MAX], params[m, OPTIMAL])
    return constants


def compute_energetics(
    law: NDArray[np.int64],
    params: Vector,
    activation: Vector,
    excitation: Vector,
    length: Vector,
    velocity: Vector,
    fiber_length: Vector,
    constants: Vector,
) -> Energetics:
    """Compute the energetics of n muscles, in one compiled loop.

    Args:
        law: (n,) codes of the laws, as in the kernels.
        params: (n, PARAMS) parameters of the muscles, as in the kernels.
        activation: (n,) 0 to 1.
        excitation: (n,) 0 to 1.
        length: (n,) musculotendon lengths [m].
        velocity: (n,) lengthening speeds [m/s].
        fiber_length: (n,) [m], used only with an elastic tendon.
        constants: (n, 8) from `metabolic_constants`.

    Returns:
        Powers and energies of each muscle.
    """
    out = np.empty((kernel.OUTPUTS, len(law)))
    kernel.energetics(law, params, activation, excitation, length, velocity, fiber_length, constants, out)
    return Energetics(*out)


def basal_power(body_mass: float, coefficient: float = 1.2, exponent: float = 1.0) -> float:
    """Return the basal metabolic power of a body.

    Args:
        body_mass: [kg].
        coefficient: [W/kg] if the exponent is 1; 1.2 is for standing (Umberger et al. 2003).
        exponent: exponent of the mass.

    Returns:
        The power [W].

    Raises:
        ModelError: the mass is not positive, or a number is not finite.
    """
    validation.positive(body_mass, "body_mass", ModelError, "kg")
    validation.not_negative(coefficient, "coefficient", ModelError)
    validation.finite(exponent, "exponent", ModelError)
    return coefficient * body_mass**exponent


assert len(fields(Energetics)) == kernel.OUTPUTS
