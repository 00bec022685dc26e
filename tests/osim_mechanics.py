"""OpenSim models written without muscles and meshes: compiled from the written text, posed, reduced and stepped."""

import functools
from typing import NamedTuple

import mujoco
import numpy as np
from osim_models import OBJ, model_file, set_coordinates

from mjwrap.osim.description.model import OsimModel
from mjwrap.osim.reading.model import read_osim
from mjwrap.osim.report import Report
from mjwrap.osim.writing.document import Document
from mjwrap.osim.writing.mechanics import write_mechanics
from mjwrap.osim.writing.skeleton import Skeleton


class Written(NamedTuple):
    """A model, what was written, and the report."""

    osim: OsimModel
    skeleton: Skeleton
    report: Report
    xml: str

    def compile(self) -> mujoco.MjModel:
        """Return the model of the text."""
        return mujoco.MjModel.from_xml_string(self.xml)


def written(osim: OsimModel, *, limits: bool = False) -> Written:
    """Write a model without meshes; limits: whether clamped coordinates become limits."""
    document, report = Document("test"), Report(osim.name, osim.version)
    skeleton = write_mechanics(document, osim, report, limits=limits)
    return Written(osim, skeleton, report, document.to_xml())


@functools.cache
def mechanics(name: str) -> Written:
    """Write a model of the shared folder; the test is skipped where it is absent."""
    return written(read_osim(model_file(name)))


def all_values(found: Written, independent: dict[str, float]) -> dict[str, float]:
    """Return the values of all coordinates at values of the independent ones."""
    drivers = found.skeleton.drivers
    kept = drivers.values
    drivers.settle(dict(independent))
    values, drivers.values = drivers.values, kept
    return values


def pose(found: Written, model: mujoco.MjModel, data: mujoco.MjData, independent: dict[str, float]) -> None:
    """Set a pose through the written text: joints that follow others by its equalities, whatever the writer knows.

    Slides of ellipsoid joints, which two tendons hold, and joints that stand for a coordinate are set by the writer.
    """
    values = all_values(found, independent)
    by_equalities = set(model.eq_obj1id[model.eq_type == mujoco.mjtEq.mjEQ_JOINT].tolist())
    for name, value in found.skeleton.qpos(values).items():
        joint = mujoco.mj_name2id(model, OBJ.mjOBJ_JOINT, name)
        if joint not in by_equalities:
            data.qpos[model.jnt_qposadr[joint]] = value
    switch(model, data)
    set_coordinates(model, data, independent)
    switch(model, data)
    mujoco.mj_forward(model, data)


def switch(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Switch the pieces of couplings by qpos, from the meaning of the tuples."""
    for i in range(model.ntuple):
        if model.tuple(i).name.startswith("mjwrap_coupling_"):
            first, last = model.tuple_adr[i], model.tuple_adr[i] + model.tuple_size[i] - 1
            equalities, numeric = model.tuple_objid[first:last], model.tuple_objid[last]
            knots = model.numeric_data[model.numeric_adr[numeric] :][: model.numeric_size[numeric]]
            leader = model.jnt_qposadr[model.eq_obj2id[equalities[0]]]
            data.eq_active[equalities] = 0
            data.eq_active[equalities[np.searchsorted(knots, data.qpos[leader], side="right")]] = 1


def followers(found: Written, model: mujoco.MjModel, independent: list[str]) -> np.ndarray:
    """Return the dofs of the joints that are no independent coordinates, nor stand for one."""
    shown = {*independent, *(each.joint for each in found.skeleton.drivers.substitutes.values())}
    return np.array(
        [model.jnt_dofadr[j] for j in range(model.njnt) if model.joint(j).name not in shown], dtype=int
    )


def reduction(
    found: Written, model: mujoco.MjModel, data: mujoco.MjData, independent: list[str]
) -> np.ndarray:
    """Return N (nv, k), columns as `independent`, from MuJoCo's own Jacobian of the constraints at a pose.

    The model must use dense Jacobians. Locks and constraints that are no couplings are left aside.
    """
    kept = data.eq_active.copy()
    for e in range(model.neq):
        name = model.equality(e).name
        data.eq_active[e] = kept[e] if "_coupling" in name else "_plane_" in name
    mujoco.mj_forward(model, data)
    rows = data.efc_J.reshape(-1, model.nv)[: data.ne]
    data.eq_active[:] = kept
    following = followers(found, model, independent)
    rest = np.setdiff1d(np.arange(model.nv), following)
    spread = np.zeros((model.nv, len(rest)))
    spread[rest] = np.eye(len(rest))
    if len(following):
        spread[following] = -np.linalg.solve(rows[:, following], rows[:, rest])
    columns = []
    substitutes = found.skeleton.drivers.substitutes
    for name in independent:
        joint = substitutes[name].joint if name in substitutes else name
        column = spread[:, list(rest).index(model.joint(joint).dofadr[0])].copy()
        if name in substitutes:  # its rate is the joint's by the slope of the function
            inverse = found.skeleton.drivers.driver(name)
            assert inverse is not None
            assert inverse[1] is not None
            function = substitutes[name].motion.function
            value = float(inverse[1](data.qpos[model.joint(joint).qposadr[0]]))
            column *= float(function(value, 1))
        columns.append(column)
    return np.stack(columns, axis=1) if columns else np.zeros((model.nv, 0))


def mass_matrix(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    """Return the mass matrix (nv, nv)."""
    full = np.zeros((model.nv, model.nv))
    for k, unit in enumerate(np.eye(model.nv)):
        mujoco.mj_mulM(model, data, full[k], unit)
    return full
