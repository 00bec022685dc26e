"""Contact shapes as geoms, and contact forces as contact pairs whose stiffness is matched at one load."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import numpy as np

from mjwrap.osim.description.bodies import Mesh
from mjwrap.osim.description.forces import ContactShape, HuntCrossley
from mjwrap.osim.description.model import OsimModel
from mjwrap.osim.report import APPROXIMATED, EXACT, LEFT_OUT, Report
from mjwrap.osim.writing.couplings import TIMESTEP
from mjwrap.osim.writing.document import Document
from mjwrap.osim.writing.meshes import MeshFiles
from mjwrap.osim.writing.motions import placed, turned
from mjwrap.osim.writing.rotations import quaternion
from mjwrap.osim.writing.skeleton import Skeleton
from mjwrap.osim.writing.unique_names import UniqueNames
from mjwrap.osim.writing.vtp import MeshError

IMPACT = 1.0  # [m/s] at which the restitution is that of the file
HALF_SPACE = "ContactHalfSpace"
WIDTH = 10.0  # [m] half the width of the box for a half-space that moves


@dataclass(frozen=True)
class _Shape:
    geom: str
    shape: ContactShape
    radius: float  # [m] infinite for a half-space


class _Writer:
    def __init__(
        self,
        document: Document,
        model: OsimModel,
        report: Report,
        skeleton: Skeleton,
        folders: Sequence[Path],
    ) -> None:
        self.document, self.report, self.files = document, report, MeshFiles(document, folders)
        self.names = UniqueNames(document, "geom")
        self.still = {"ground"}
        for branch in skeleton.branches:
            if branch.fixed and branch.parent in self.still:
                self.still.add(branch.body)
        self.weight = sum(body.mass for body in model.bodies) * (float(np.linalg.norm(model.gravity)) or 9.81)
        self.shapes: dict[str, _Shape] = {}

    def geom(self, shape: ContactShape) -> None:
        """Write a contact shape as a geom that collides only in pairs."""
        pose, radius = placed(shape.frame), np.inf
        sizes = np.array(shape.dimensions, dtype=np.float64)
        if not np.isfinite(sizes).all() or (sizes <= 0.0).any():
            self.report.add(shape.kind, shape.name, LEFT_OUT, f"its sizes are {shape.dimensions}")
            return
        attributes: dict[str, object]
        outcome, text = EXACT, ""
        if shape.kind == HALF_SPACE and shape.frame.body in self.still:
            attributes = {"type": "plane", "size": (0, 0, 1)}
            pose = pose @ turned(np.array([0.0, 1.0, 0.0]), -0.5 * np.pi)
        elif shape.kind == HALF_SPACE:
            attributes = {"type": "box", "size": (0.5, WIDTH, WIDTH)}
            pose = pose.copy()
            pose[:3, 3] += 0.5 * pose[:3, 0]
            outcome, text = APPROXIMATED, "a box 1 m thick and 20 m wide: MuJoCo's planes cannot move"
        elif shape.kind == "ContactSphere" and len(sizes) == 1:
            attributes, radius = {"type": "sphere", "size": sizes}, float(sizes[0])
        elif shape.kind == "ContactEllipsoid" and len(sizes) == 3:
            attributes, radius = {"type": "ellipsoid", "size": sizes}, float(np.prod(sizes) ** (1.0 / 3.0))
        elif shape.kind == "ContactMesh":
            mesh = Mesh(shape.name, shape.frame, shape.file, np.ones(3))
            try:
                attributes, radius = self.files.geom(mesh), 0.01
            except MeshError as error:
                self.report.add(shape.kind, shape.name, LEFT_OUT, str(error))
                return
            outcome, text = APPROXIMATED, "MuJoCo uses its convex hull for contact"
        else:
            self.report.add(shape.kind, shape.name, LEFT_OUT, "MuJoCo has no such contact shape")
            return
        name = self.names.new(shape.name)
        self.document.add(self.document.bodies[shape.frame.body], "geom", name=name, **attributes, pos=pose[:3, 3],
                          quat=quaternion(pose[:3, :3]), contype=0, conaffinity=0, group=3, mass=0,
                          rgba=(0.4, 0.6, 0.8, 0.5))  # fmt: skip
        self.shapes[shape.name] = _Shape(name, shape, radius)
        self.report.add(shape.kind, shape.name, outcome, text)

    def pairs(self, force: HuntCrossley, inverse_mass: Mapping[str, float]) -> None:
        """Write the contact pairs of a force: all shapes that it lists, of different bodies, against each other."""
        shapes = [self.shapes[name] for name in force.shapes if name in self.shapes]
        written = 0
        for first, second in combinations(shapes, 2):
            bodies = first.shape.frame.body, second.shape.frame.body
            if bodies[0] == bodies[1] or all(body in self.still for body in bodies):
                continue
            inverse = inverse_mass[bodies[0]] + inverse_mass[bodies[1]]
            law = _law(force, first, second, self.weight)
            friction = law.friction
            # Four rows of a pyramid are as stiff as one row with this share of its regularization. With the impedance
            # below, a contact pushes half by its spring, half against what accelerates the body.
            share = 0.5 * friction**2 * (1.0 + friction**2) if friction > 0.0 else 1.0
            impedance = share / (1.0 + share)
            stiffness = min(law.stiffness * inverse, 0.2 / TIMESTEP**2)
            damping = min(4.0 * law.damping_ratio * (0.5 * stiffness) ** 0.5, 0.9 / TIMESTEP)
            rough = friction > 0.0
            self.document.add(
                "contact",
                "pair",
                geom1=first.geom,
                geom2=second.geom,
                solref=(-stiffness * impedance, -damping * impedance),
                solimp=(impedance, impedance, 0.001, 0.5, 2),
                condim=3 if rough else 1,
                friction=(friction, friction, 0.005, 0.0001, 0.0001) if rough else None,
            )
            written += 1
            text = (
                f"'{first.shape.name}' and '{second.shape.name}': a linear spring and damper in MuJoCo, as stiff as "
                f"the file's force at the model's weight, {self.weight:.4g} N, where the indentation is "
                f"{1e3 * law.indentation:.3g} mm, and with its restitution at {IMPACT:g} m/s; friction {friction:.3g}, "
                f"the dynamic one; no static, no viscous one"
            )
            self.report.add(force.kind, force.name, APPROXIMATED, text)
        if not written:
            self.report.add(
                force.kind,
                force.name,
                LEFT_OUT,
                "it has no two shapes on bodies that move in each other",
            )


@dataclass(frozen=True)
class _Law:
    stiffness: float  # [N/m] load by indentation at the load
    damping_ratio: float  # of the linear spring and damper with the restitution at the speed IMPACT
    indentation: float  # [m] at the load
    friction: float


def _law(force: HuntCrossley, first: _Shape, second: _Shape, load: float) -> _Law:
    """Return a contact force at a load [N]: Hertz' force with Hunt and Crossley's damping, of two materials.

    force = 4/3 k sqrt(R k x) x (1 + 3/2 c v), where k = k1 k2 / (k1 + k2) and ki = stiffness_i^(2/3).
    """
    parts = [{**force.parameters, **force.by_shape.get(each.shape.name, {})} for each in (first, second)]
    k1, k2 = (max(part.get("stiffness", 1e6), 1e-6) ** (2.0 / 3.0) for part in parts)
    dissipation = [part.get("dissipation", 0.0) for part in parts]
    share = k2 / (k1 + k2)
    radius = 1.0 / (1.0 / first.radius + 1.0 / second.radius)
    if not np.isfinite(radius):
        radius = 0.01
    if force.kind == "SmoothSphereHalfSpaceForce":
        k1 = k2 = 2.0 * (0.5 * parts[0].get("stiffness", 1.0) ** (2.0 / 3.0))
        share = 0.5
    hertz = 4.0 / 3.0 * (k1 * share) ** 1.5 * radius**0.5
    indentation = (load / hertz) ** (2.0 / 3.0)
    frictions = [part.get("dynamic_friction", 0.0) for part in parts]
    total = sum(frictions)
    friction = 2.0 * frictions[0] * frictions[1] / total if total > 0.0 else 0.0
    # Hunt and Crossley's restitution falls from 1 as 1 - c v; 1 / (1 + c v) does so too, and stays positive.
    mixed = dissipation[0] * share + dissipation[1] * (1.0 - share)
    bounce = float(np.log1p(mixed * IMPACT))
    return _Law(load / indentation, bounce / float(np.hypot(np.pi, bounce)), indentation, friction)


def write_contacts(
    document: Document, model: OsimModel, report: Report, skeleton: Skeleton, folders: Sequence[Path]
) -> None:
    """Write contact shapes and contact forces. Nothing else collides in the written model."""
    writer = _Writer(document, model, report, skeleton, folders)
    for shape in model.contacts:
        if shape.frame.body in document.bodies:
            writer.geom(shape)
    forces = [force for force in model.forces if isinstance(force, HuntCrossley)]
    if not forces:
        return
    compiled = document.compile()
    names = {body: element.get("name", "world") for body, element in document.bodies.items()}
    inverse_mass = {
        body: float(compiled.body_invweight0[compiled.body(name).id, 0]) for body, name in names.items()
    }
    for force in forces:
        if force.active:
            writer.pairs(force, inverse_mass)
        else:
            report.add(force.kind, force.name, LEFT_OUT, "switched off in the file")
