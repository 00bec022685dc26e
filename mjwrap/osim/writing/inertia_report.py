"""What the rule for inertias that MuJoCo refuses does to a model: entries of the report, and the file's values."""

from __future__ import annotations

import mujoco
import numpy as np

from mjwrap.mjcf.file_inertias import MARK
from mjwrap.osim.description.functions import Array
from mjwrap.osim.report import APPROXIMATED, EXACT, Report
from mjwrap.osim.writing.document import Document
from mjwrap.osim.writing.inertias import Written
from mjwrap.osim.writing.skeleton import Skeleton

JOINTS = int(mujoco.mjtEq.mjEQ_JOINT)
UNIT = "of the mass matrix's diagonal"


def report_inertias(document: Document, report: Report, skeleton: Skeleton) -> None:
    """Report every body; where principal moments were changed, also the largest change of the reduced mass matrix.

    That is relative to its diagonal, at the default pose. The numeric "mjwrap_inertia_BODY" keeps the principal moments
    of the file, with which `mjcf.file_inertias` undoes the change; not for a body to which mass was added.
    """
    changed = {name: written for name, written in skeleton.inertias.items() if written.original is not None}
    model = document.compile() if changed else None
    for branch in skeleton.branches:
        written = skeleton.inertias[branch.body]
        if branch.body in changed and model is not None:
            effect = _effect(model, document.bodies[branch.body].get("name", ""), written)
            _report_changed(document, report, branch.body, written, effect)
        elif written.joined_to:
            report.add("Body", branch.body, EXACT, f"its mass is counted with '{written.joined_to}', to which it is "
                       "welded, because its inertia alone is not physical")  # fmt: skip
        elif not branch.copy_of:
            report.add("Body", branch.body, EXACT)


def _report_changed(document: Document, report: Report, body: str, written: Written, effect: float) -> None:
    original, properties = written.original, written.properties
    assert original is not None
    assert properties is not None
    now = properties.principal()[0]
    moments = f"principal moments {_listed(original)} -> {_listed(now)} kg m^2"
    if float(np.abs(now - original).max()) <= 1e-12 * float(np.abs(now).max()) and written.mass_added == 0.0:
        report.add("Body", body, EXACT, f"{moments}: changed by rounding only", effect, UNIT)
        return
    why = "massless" if written.mass_added > 0.0 else "its inertia is not physical"
    mass = f"mass + {written.mass_added:.3g} kg, " if written.mass_added > 0.0 else ""
    undone = ""
    if written.mass_added == 0.0 and float(original.min()) > 0.0:
        document.numeric(f"{MARK}{body}", original)
        undone = "; mjwrap restores the file's in the compiled model, MuJoCo alone does not"
    report.add("Body", body, APPROXIMATED, f"{why}: {mass}{moments}{undone}", effect, UNIT)


def _listed(moments: Array) -> str:
    return ", ".join(f"{moment:.4g}" for moment in moments)


def _effect(model: mujoco.MjModel, body: str, written: Written) -> float:
    """Return the largest change of the reduced mass matrix M by one body's change; of M_ij relative to √(M_ii M_jj)."""
    index = model.body(body).id
    after = _reduced_mass(model)
    inertia, mass = model.body_inertia[index].copy(), float(model.body_mass[index])
    model.body_inertia[index] = written.original
    model.body_mass[index] = mass - written.mass_added
    before = _reduced_mass(model)
    model.body_inertia[index], model.body_mass[index] = inertia, mass
    diagonal = np.sqrt(np.maximum(np.diag(before), 0.0))
    sizes = np.outer(diagonal, diagonal)
    return float((np.abs(after - before)[sizes > 0.0] / sizes[sizes > 0.0]).max(initial=0.0))


def _reduced_mass(model: mujoco.MjModel) -> Array:
    """Return the mass matrix at the default pose, reduced by joint equalities with a leader."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    full = np.zeros((model.nv, model.nv))
    for k, unit in enumerate(np.eye(model.nv)):
        mujoco.mj_mulM(model, data, full[k], unit)
    slopes = np.zeros((model.nv, model.nv))
    for k in range(model.neq):
        if model.eq_type[k] == JOINTS and model.eq_active0[k] and model.eq_obj2id[k] >= 0:
            follower, leader = model.jnt_dofadr[[model.eq_obj1id[k], model.eq_obj2id[k]]]
            slopes[follower] = 0.0
            slopes[follower, leader] = model.eq_data[k, 1]
    free = np.flatnonzero(~slopes.any(axis=1))
    # A follower may lead others: N = (1 - S)^-1 restricted to the independent joints.
    spread = np.linalg.inv(np.eye(model.nv) - slopes)[:, free]
    return spread.T @ full @ spread
