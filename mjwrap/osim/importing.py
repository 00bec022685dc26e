"""import_osim: an .osim file as a MuJoCo model with geodesic muscles, and a report on every element."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np

from mjwrap import validation
from mjwrap.errors import OsimError
from mjwrap.files.atomic import PartFile
from mjwrap.mjcf.named_models import osim_file
from mjwrap.osim.description.forces import Ligament, Muscle, PathActuator, PathSpring
from mjwrap.osim.description.model import OsimModel
from mjwrap.osim.reading.model import read_osim
from mjwrap.osim.report import Report
from mjwrap.osim.writing.document import Document
from mjwrap.osim.writing.mechanics import write_mechanics
from mjwrap.osim.writing.muscles import MuscleWriter
from mjwrap.osim.writing.routes import RouteWriter
from mjwrap.osim.writing.sampled_poses import sampled_poses
from mjwrap.osim.writing.sites import SiteWriter
from mjwrap.osim.writing.skeleton import Skeleton
from mjwrap.osim.writing.stable_step import PathLine, write_stable_step
from mjwrap.osim.writing.unique_names import UniqueNames
from mjwrap.osim.writing.wraps import write_wrap

MESH_FOLDERS = ("", "Geometry")  # beside the file
MESH_SUFFIXES = (".obj", ".stl", ".msh", ".png")


class Imported(NamedTuple):
    """An imported OpenSim model.

    Attributes:
        spec: the model, as `MjSpec.from_string(xml, assets=assets)`.
        report: what became of every element of the file.
        xml: MJCF text; its numbers have all their digits, which `spec.to_xml()` does not keep.
        assets: contents of mesh files by the names that `xml` has for them.
    """

    spec: mujoco.MjSpec
    report: Report
    xml: str
    assets: dict[str, bytes]

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the model to an .xml file, and its meshes beside it; either all files or none.

        Raises `RecordingError` if a file cannot be written.
        """
        target = PartFile(path, ".xml")
        parts = [target]
        try:
            for name, content in self.assets.items():
                part = PartFile(target.path.parent / name, *MESH_SUFFIXES)
                parts.insert(0, part)
                with part.writing():
                    part.part.write_bytes(content)
            with target.writing():
                target.part.write_text(self.xml, encoding="utf-8")
            for part in parts:
                part.publish()
        except BaseException:
            for part in parts:
                part.discard()
            raise


def import_osim(
    path: str | os.PathLike[str],
    *,
    meshes: Sequence[str | os.PathLike[str]] = (),
    poses: int = 60,
    limits: bool = False,
) -> Imported:
    """Import an OpenSim model (.osim) as a MuJoCo model with geodesic muscles.

    Args:
        path: the file, or "mjwrap:NAME" for a model that comes with mjwrap.
        meshes: folders in which its mesh files are searched first; then the file's own folder and its Geometry are.
        poses: number of poses within the coordinates' ranges at which the places of wrap objects on their paths are
            chosen.
        limits: whether clamped coordinates become limits of their joints. OpenSim heeds a clamp when a pose is set, not
            in a motion, so by default joints have the range, but no limit.

    Returns:
        The model, a report on every element of the file, and the text to write.

    Raises:
        OsimError: the file is not an OpenSim model, or has an element that cannot be represented; the message names it.
            An argument has a wrong type.
    """
    validation.require(
        isinstance(path, str | os.PathLike), "path", "the name of an .osim file", path, OsimError
    )
    single = isinstance(meshes, str | os.PathLike)
    good = (
        not single and isinstance(meshes, Sequence) and all(isinstance(m, str | os.PathLike) for m in meshes)
    )
    validation.require(good, "meshes", "a list of folders", meshes, OsimError)
    validation.whole(poses, 1, "poses", OsimError)
    validation.flag(limits, "limits", OsimError)
    for folder in meshes:
        if not Path(folder).is_dir():
            raise OsimError(f"meshes: '{folder}' is not a folder")
    path = osim_file(path)
    folders = [Path(folder) for folder in meshes] + [Path(path).parent / name for name in MESH_FOLDERS]
    try:
        with np.errstate(over="raise", invalid="raise"):
            return _imported(path, folders, poses, bool(limits))
    except (ArithmeticError, np.linalg.LinAlgError) as error:
        raise OsimError(
            f"'{path}': some number is too large or too small to compute with ({error})"
        ) from None


def _imported(path: str | os.PathLike[str], folders: list[Path], poses: int, limits: bool) -> Imported:
    model = read_osim(path)
    document, report = Document(model.name), Report(model.name, model.version)
    skeleton = write_mechanics(document, model, report, folders, limits)
    lines = write_paths(document, model, report, skeleton, poses)
    compiled = document.compile()
    data = mujoco.MjData(compiled)
    mujoco.mj_forward(compiled, data)
    if not all(np.isfinite(values).all() for values in (data.qpos, data.xpos, data.qacc)):
        raise OsimError(
            f"'{path}': accelerations at the default pose are not finite; some number is too large"
        )
    write_stable_step(document, compiled, report, lines)
    xml = document.to_xml()
    return Imported(mujoco.MjSpec.from_string(xml, assets=document.assets), report, xml, document.assets)


def write_paths(
    document: Document, model: OsimModel, report: Report, skeleton: Skeleton, poses: int
) -> list[PathLine]:
    """Write all wrap objects and all forces along paths; return the muscles and the sites of their paths."""
    geoms, sites = UniqueNames(document, "geom"), SiteWriter(document, report, skeleton.drivers)
    pulls = [
        force for force in model.forces if isinstance(force, Muscle | Ligament | PathSpring | PathActuator)
    ]
    wraps = {wrap.name: write_wrap(document, report, wrap, geoms, sites) for wrap in model.wraps}
    written = {name: wrap for name, wrap in wraps.items() if wrap is not None}
    used = any(pull.path.wraps or (isinstance(pull, Muscle) and pull.splines) for pull in pulls)
    samples = sampled_poses(model, poses) if used else []
    muscles = MuscleWriter(document, report, RouteWriter(report, sites, written, samples), samples)
    for pull in pulls:
        muscles.write(pull)
    if any(muscles.default_activations):
        document.add("keyframe", "key", name="default", act=muscles.default_activations)
    return muscles.lines
