"""The time step of the written model: small enough for its stiffest muscles on its lightest bodies.

RK4 follows an oscillation of circular frequency w only with steps below 2.78 / w, and a decay of rate r with steps
below 2.78 / r. Muscles' forces are explicit in it, so both come from them: an elastic tendon is a spring between
bodies, and a rigid one passes the slope of the force-velocity curve on to them as a damper. With J = dl/dq of all
muscles, the mass matrix M, reduced by the equalities, stiffnesses k and dampings c, w^2 is the largest eigenvalue of
sqrt(k) J M^-1 J^T sqrt(k), and r that of sqrt(c) J M^-1 J^T sqrt(c). They are taken at the default pose along the
straight lines between the sites of the paths, tendons at F_max, fibres at half activation and optimal length.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import mujoco
import numpy as np

from mjwrap.osim.description.forces import Muscle
from mjwrap.osim.description.functions import Array
from mjwrap.osim.report import APPROXIMATED, Report
from mjwrap.osim.writing.couplings import SOLREF, TIMESTEP
from mjwrap.osim.writing.document import Document, text_of

LIMIT = 2.78  # of RK4: largest step times frequency or rate
STEPS = (1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5)  # [s]
SAFETY = 0.8
ACTIVATION = 0.5
TENDON_SLOPE = 1.4  # of a tendon at F_max, in F_max for each strain at F_max
TENDON_STRAIN = 0.049  # at F_max, of a file that has none
VELOCITY_SLOPE = 5.0  # of the force-velocity curve where a fibre holds still, in F_max
SPEED = 10.0  # optimal fibre lengths a second, of a file without maximum speed


@dataclass(frozen=True)
class PathLine:
    """A muscle, and the sites of its path by name."""

    muscle: Muscle
    sites: tuple[str, ...]

    @property
    def stiffness(self) -> float:
        """Stiffness of an elastic tendon at F_max [N/m], 0 of a rigid one."""
        given = self.muscle.parameters
        slack = given.get("tendon_slack_length", 0.0)
        if self.muscle.rigid_tendon or not slack > 0.0:
            return 0.0
        strain = given.get("FmaxTendonStrain", TENDON_STRAIN)
        strain = self.muscle.curves.get("TendonForceLengthCurve", {}).get("strain_at_one_norm_force", strain)
        return TENDON_SLOPE * given["max_isometric_force"] / (slack * strain) if strain > 0.0 else 0.0

    @property
    def damping(self) -> float:
        """Damping of the fibre of a rigid tendon at half activation [N s/m], 0 of an elastic one."""
        given = self.muscle.parameters
        if self.stiffness > 0.0:
            return 0.0
        speed = given.get("max_contraction_velocity", SPEED) * given["optimal_fiber_length"]
        return ACTIVATION * VELOCITY_SLOPE * given["max_isometric_force"] / speed if speed > 0.0 else 0.0


def write_stable_step(
    document: Document, model: mujoco.MjModel, report: Report, lines: list[PathLine]
) -> None:
    """Write a smaller time step than 1 ms where muscles need it, and say so in the report.

    model: the document, compiled. The time constants of equalities stay two steps. Nothing is written where a step of
    1 ms is small enough.
    """
    if not lines or not model.nv:
        return
    mobility = _mobility(model, lines)
    rates = {}
    for what, sizes, power in (("tendon", [line.stiffness for line in lines], 0.5),
                               ("rigid tendon", [line.damping for line in lines], 1.0)):  # fmt: skip
        root = np.sqrt(sizes)
        values, vectors = np.linalg.eigh(root[:, None] * mobility * root)
        rates[what] = max(float(values[-1]), 0.0) ** power, lines[int(np.abs(vectors[:, -1]).argmax())]
    what = max(rates, key=lambda each: rates[each][0])
    rate, line = rates[what]
    if not math.isfinite(rate) or rate * TIMESTEP <= SAFETY * LIMIT:
        return
    step = next((each for each in STEPS if rate * each <= SAFETY * LIMIT), STEPS[-1])
    document.section("option").set("timestep", repr(step))
    for element in document.section("equality"):
        if element.get("solref") == text_of(SOLREF):
            element.set("solref", text_of((2.0 * step, SOLREF[1])))
    why = (f"its tendon ({line.stiffness:.3g} N/m) moves bodies so light that they can oscillate with {rate:.3g} rad/s"
           if what == "tendon" else
           f"its rigid tendon passes the slope of the force-velocity curve on to light bodies: at half activation a "
           f"damper of {line.damping:.3g} N s/m, which stops them at a rate of {rate:.3g} 1/s")  # fmt: skip
    report.add("TimeStep", line.muscle.name, APPROXIMATED, f"{why}; RK4 is stable with steps below "
               f"{1e3 * LIMIT / rate:.2g} ms, so the model has {1e3 * step:g} ms in place of {1e3 * TIMESTEP:g} ms",
               step, "s")  # fmt: skip


def _mobility(model: mujoco.MjModel, lines: list[PathLine]) -> Array:
    """Return J M^-1 J^T (n, n) of the paths' straight lines at the default pose, along active equalities [1/kg]."""
    before = int(model.opt.jacobian)
    model.opt.jacobian = int(mujoco.mjtJacobian.mjJAC_DENSE)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    model.opt.jacobian = before
    mass = np.zeros((model.nv, model.nv))
    for k, unit in enumerate(np.eye(model.nv)):
        mujoco.mj_mulM(model, data, mass[k], unit)
    inverse = np.linalg.pinv(mass, hermitian=True)
    held = data.efc_J.reshape(-1, model.nv)[: data.ne]
    inverse -= inverse @ held.T @ np.linalg.pinv(held @ inverse @ held.T, hermitian=True) @ held @ inverse
    jacobian = np.array([_slopes(model, data, line.sites) for line in lines])
    return jacobian @ inverse @ jacobian.T


def _slopes(model: mujoco.MjModel, data: mujoco.MjData, sites: tuple[str, ...]) -> Array:
    """Return the slopes of the length of the straight lines between sites by all degrees of freedom (nv,)."""
    total = np.zeros(model.nv)
    points, slopes = [], []
    for site in sites:
        slopes.append(np.zeros((3, model.nv)))
        mujoco.mj_jacSite(model, data, slopes[-1], None, model.site(site).id)
        points.append(data.site(site).xpos.copy())
    for k in range(1, len(points)):
        along = points[k] - points[k - 1]
        length = float(np.linalg.norm(along))
        if length > 0.0:
            total += along / length @ (slopes[k] - slopes[k - 1])
    return total
