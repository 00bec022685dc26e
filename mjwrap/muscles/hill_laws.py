"""Laws with a fibre and a tendon: De Groote-Fregly 2016, Millard 2012, Thelen 2003."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import ClassVar

from mjwrap import validation
from mjwrap.errors import ModelError
from mjwrap.kernels.musculotendon import degroote_fregly, millard, thelen
from mjwrap.muscles import curve_sets, millard_curves
from mjwrap.muscles.fiber_law import FiberLaw, positive

# [max isometric forces per max contraction velocity] a smaller damping is none (OpenSim's Millard2012EquilibriumMuscle)
LEAST_DAMPING = 0.001
UNDAMPED_ACTIVATION = 0.01  # least activation of a Millard muscle without damping, as in OpenSim


@dataclass(frozen=True)
class DeGrooteFregly2016(FiberLaw):
    """The muscle of De Groote et al. 2016 (doi 10.1007/s10439-016-1591-9) with pennation, rigid or elastic tendon.

    Args:
        max_isometric_force: [N], positive.
        optimal_fiber_length: [m], positive.
        tendon_slack_length: [m], not negative.
        pennation_angle: at optimal fibre length [rad], in [0, pi/2).
        max_contraction_velocity: [optimal fibre lengths/s].
        fiber_damping: not negative [max isometric forces per max contraction velocity]; None for 0 with a rigid tendon
            and 0.1 with an elastic one, so that the fibre's velocity is unique at every activation.
        tendon: "rigid" or "elastic". A tendon shorter than 1e-4 optimal fibre lengths is always rigid.
        minimum_activation: in [0, 1): a smaller activation counts as this one; None for 0.
        max_pennation: pennation angle [rad] at which the fibre is as short as it can be, at most pi/2; None for that
            with a cosine of 0.1.

    Raises:
        ModelError: a value is not possible.
    """

    code: ClassVar[int] = degroote_fregly.CODE
    law: ClassVar[str] = "degroote_fregly_2016"
    least: ClassVar[float] = degroote_fregly.LEAST


@dataclass(frozen=True)
class Millard2012(FiberLaw):
    """The damped muscle of Millard et al. 2013 (doi 10.1115/1.4023390, OpenSim's Millard2012EquilibriumMuscle).

    Curves have OpenSim's default shapes, or those of the parameters below, in OpenSim's order and with its conditions.
    A muscle with an elastic tendon and a damping below 0.001 is undamped, as in OpenSim: its active curve does not fall
    below 0.1, its force-velocity curve goes on beyond its ends with at least half the slopes near them, and its
    activation counts as at least 0.01.

    Args:
        max_isometric_force: [N], positive.
        optimal_fiber_length: [m], positive.
        tendon_slack_length: [m], not negative.
        pennation_angle: at optimal fibre length [rad], in [0, pi/2).
        max_contraction_velocity: [optimal fibre lengths/s].
        fiber_damping: not negative [max isometric forces per max contraction velocity], with either tendon.
        tendon: "rigid" or "elastic". A tendon shorter than 1e-4 optimal fibre lengths is always rigid.
        minimum_activation: in [0, 1): a smaller activation counts as this one; None for 0, undamped for 0.01.
        max_pennation: pennation angle [rad] at which the fibre is as short as it can be, at most pi/2; None for that
            with a cosine of 0.1.
        active_force_length_curve: (5,) min_norm_active_fiber_length, transition_norm_fiber_length,
            max_norm_active_fiber_length, shallow_ascending_slope, minimum_value (used without damping only).
        force_velocity_curve: (8,) concentric_slope_at_vmax (used without damping only), concentric_slope_near_vmax,
            isometric_slope, eccentric_slope_at_vmax (the same), eccentric_slope_near_vmax,
            max_eccentric_velocity_force_multiplier, concentric_curviness, eccentric_curviness.
        fiber_force_length_curve: (2,) strain_at_zero_force, strain_at_one_norm_force; or (5,) with
            stiffness_at_low_force, stiffness_at_one_norm_force, curviness, which else follow by OpenSim's rules.
        tendon_force_length_curve: (1,) strain_at_one_norm_force; or (4,) with stiffness_at_one_norm_force,
            norm_force_at_toe_end, curviness.

    Raises:
        ModelError: a value is not possible.
    """

    fiber_damping: float = 0.1
    active_force_length_curve: Sequence[float] | None = None
    force_velocity_curve: Sequence[float] | None = None
    fiber_force_length_curve: Sequence[float] | None = None
    tendon_force_length_curve: Sequence[float] | None = None
    code: ClassVar[int] = millard.CODE
    law: ClassVar[str] = "millard_2012"
    least: ClassVar[float] = millard.LEAST
    takes: ClassVar[tuple[str, ...]] = (*FiberLaw.takes, *millard_curves.PARAMETERS)

    def __post_init__(self) -> None:
        super().__post_init__()
        for key in millard_curves.PARAMETERS:
            given = getattr(self, key)
            if given is not None:
                millard_curves.completed(key, given, self.law)
                object.__setattr__(self, key, tuple(float(x) for x in given))

    @property
    def undamped(self) -> bool:
        """Return whether a singularity has to be kept away by other curves: an elastic tendon without damping."""
        return self.elastic and self.fiber_damping < LEAST_DAMPING

    @property
    def damping(self) -> float:
        """Return the fibre damping: the given one, none where the muscle is undamped."""
        return self.fiber_damping if self.tendon != "elastic" or self.fiber_damping >= LEAST_DAMPING else 0.0

    @property
    def least_activation(self) -> float:
        """Return the activation that a smaller one counts as."""
        return max(super().least_activation, UNDAMPED_ACTIVATION if self.undamped else 0.0)

    @property
    def shortest(self) -> float:
        """Return the length of the shortest fibre with active force [l_o]."""
        given = self.active_force_length_curve
        return self.least if given is None else given[0]

    @property
    def curves(self) -> float:
        """Return the address of curves of the muscle's own in memory; 0 if it has OpenSim's default ones, damped."""
        found = self._curves(millard_curves.PARAMETERS)
        return 0.0 if found == _DEFAULT_CURVES else curve_sets.millard(*found)

    def _curves(self, keys: Iterable[str]) -> tuple[tuple[float, ...], ...]:
        """Return all parameters of the curves as they are used."""
        active, velocity, passive, tendon = (
            millard_curves.completed(key, getattr(self, key), self.law) for key in keys
        )
        return (*millard_curves.free_of_singularities(active, velocity, not self.undamped), passive, tendon)


_DEFAULT_CURVES = Millard2012(1.0, 1.0, 1.0)._curves(millard_curves.PARAMETERS)


@dataclass(frozen=True)
class Thelen2003(FiberLaw):
    """The muscle of Thelen 2003 (doi 10.1115/1.1531112), with OpenSim's defaults (its Thelen2003Muscle).

    Args:
        max_isometric_force: [N], positive.
        optimal_fiber_length: [m], positive.
        tendon_slack_length: [m], not negative.
        pennation_angle: at optimal fibre length [rad], in [0, pi/2).
        max_contraction_velocity: [optimal fibre lengths/s], at full activation.
        fiber_damping: not negative [max isometric forces per max contraction velocity]; the published muscle has none.
        tendon: "rigid" or "elastic". A tendon shorter than 1e-4 optimal fibre lengths is always rigid.
        minimum_activation: in [0, 1): a smaller activation counts as this one.
        max_pennation: pennation angle [rad] at which the fibre is as short as it can be, at most pi/2; None for that
            with a cosine of 0.1.
        max_tendon_strain: the tendon's strain at maximum isometric force (FmaxTendonStrain), positive.
        max_fiber_strain: the passive fibre's strain at maximum isometric force (FmaxMuscleStrain), positive.
        active_shape: width of the active force-length curve (KshapeActive), positive.
        passive_shape: exponent of the passive curve (KshapePassive), positive.
        velocity_shape: shape of the force-velocity curve (Af), positive.
        max_lengthening_force: largest force of a lengthening fibre (Flen), above 1.
        velocity_extrapolation: share of that force, below 1 and above 1 / max_lengthening_force, beyond which the
            force-velocity curve is straight (fv_linear_extrap_threshold).

    Raises:
        ModelError: a value is not possible.
    """

    fiber_damping: float = 0.0
    minimum_activation: float = 0.01
    max_tendon_strain: float = 0.04
    max_fiber_strain: float = 0.6
    active_shape: float = 0.45
    passive_shape: float = 5.0
    velocity_shape: float = 0.25
    max_lengthening_force: float = 1.4
    velocity_extrapolation: float = 0.95
    code: ClassVar[int] = thelen.CODE
    law: ClassVar[str] = "thelen_2003"
    least: ClassVar[float] = thelen.LEAST
    takes: ClassVar[tuple[str, ...]] = (
        *FiberLaw.takes,
        "max_tendon_strain",
        "max_fiber_strain",
        "active_shape",
        "passive_shape",
        "velocity_shape",
        "max_lengthening_force",
        "velocity_extrapolation",
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        for key in ("fiber_damping", "minimum_activation"):  # other laws take None for their own default
            validation.not_negative(getattr(self, key), f"{self.law}: {key}", ModelError)
        positive(self, **{key: getattr(self, key) for key in self.takes[len(FiberLaw.takes) :]})
        most, name = self.max_lengthening_force, f"{self.law}: max_lengthening_force"
        validation.between(most, math.nextafter(1.0, 2.0), math.inf, name, ModelError, "above 1")
        name, least = f"{self.law}: velocity_extrapolation", math.nextafter(1.0 / most, 1.0)
        wanted = f"above {1.0 / most:.9g}, which is 1 / max_lengthening_force, and below 1"
        validation.between(self.velocity_extrapolation, least, 1.0, name, ModelError, wanted)

    @property
    def curves(self) -> float:
        """Return the address of the constants in memory."""
        return curve_sets.thelen_2003(
            self.max_tendon_strain,
            self.max_fiber_strain,
            self.active_shape,
            self.passive_shape,
            self.velocity_shape,
            self.max_lengthening_force,
            self.velocity_extrapolation,
        )
