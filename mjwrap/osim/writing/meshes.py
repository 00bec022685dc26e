"""Drawn shapes as geoms without mass or contact: mesh files as assets, primitives as they are."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mjwrap.osim.description.bodies import Mesh
from mjwrap.osim.description.functions import Array
from mjwrap.osim.description.model import OsimModel
from mjwrap.osim.report import EXACT, LEFT_OUT, Report
from mjwrap.osim.writing.document import Document
from mjwrap.osim.writing.motions import placed, turned
from mjwrap.osim.writing.obj import read_obj
from mjwrap.osim.writing.rotations import quaternion
from mjwrap.osim.writing.stl import binary_stl, check_scaled, read_stl, triangles
from mjwrap.osim.writing.unique_names import UniqueNames, plain_name
from mjwrap.osim.writing.vtp import MeshError, read_vtp

READERS = {".vtp": read_vtp, ".stl": read_stl, ".obj": read_obj}
DRAWN = {"contype": 0, "conaffinity": 0, "group": 1, "mass": 0}


class MeshFiles:
    """Mesh files as assets of a document, each read once; `folders` are searched in order."""

    def __init__(self, document: Document, folders: Sequence[Path]) -> None:
        self.document, self.folders = document, list(dict.fromkeys(folders))
        self.files: dict[Path, str | MeshError] = {}  # name of the asset, or why there is none
        self.meshes: dict[tuple[str, tuple[float, ...]], str] = {}
        self.corners: dict[str, Array] = {}  # of the triangles of an asset (m, 3, 3)

    def geom(self, mesh: Mesh) -> dict[str, Any]:
        """Return the attributes of a geom of a mesh file."""
        scale = tuple(float(factor) for factor in mesh.scale)
        if not np.isfinite(scale).all() or 0.0 in scale:
            raise MeshError(f"its scale factors are {scale}")
        path = self.found(mesh.file)
        if path not in self.files:
            try:
                self.files[path] = self.asset(path)
            except MeshError as error:
                self.files[path] = MeshError(f"{path.name} {error}")
        asset = self.files[path]
        if isinstance(asset, MeshError):
            raise asset
        if (asset, scale) not in self.meshes:
            check_scaled(self.corners[asset], scale)
            name = plain_name(Path(asset).stem)
            unique = UniqueNames(self.document, "mesh", section="asset").new(name)
            self.document.add("asset", "mesh", name=unique, file=asset, inertia="shell",
                              scale=None if scale == (1.0, 1.0, 1.0) else scale)  # fmt: skip
            self.meshes[asset, scale] = unique
        return {"type": "mesh", "mesh": self.meshes[asset, scale]}

    def found(self, file: str) -> Path:
        """Return a mesh file, searched in the folders, whatever the case of its letters."""
        wanted = Path(file.replace("\\", "/"))
        for folder in self.folders:
            for path in (folder / wanted, folder / wanted.name):
                if path.is_file():
                    return path
        for folder in self.folders:
            if folder.is_dir():
                for path in sorted(folder.iterdir()):
                    if path.name.lower() == wanted.name.lower() and path.is_file():
                        return path
        searched = ", ".join(map(str, self.folders)) or "no folder"
        raise MeshError(f"the file was not found in {searched}")

    def asset(self, path: Path) -> str:
        """Put the contents of a mesh file among the assets; return their name."""
        try:
            content = path.read_bytes()
        except OSError as error:
            raise MeshError(f"cannot be read: {error.strerror}") from None
        suffix = path.suffix.lower()
        if suffix not in READERS:
            raise MeshError("has a format that mjwrap does not read; it reads .vtp, .stl and .obj")
        corners = triangles(*READERS[suffix](content))
        name = f"{plain_name(path.stem)}.stl"
        count = 1
        while name in self.document.assets:
            count += 1
            name = f"{plain_name(path.stem)}_{count}.stl"
        self.document.assets[name] = binary_stl(corners)
        self.corners[name] = corners
        return name


def _primitive(mesh: Mesh) -> dict[str, Any]:
    """Return the attributes of a geom of a shape without a file."""
    size, scale = np.array(mesh.size, dtype=np.float64), np.abs(mesh.scale)
    if not np.isfinite(size).all() or (size <= 0.0).any() or (scale <= 0.0).any():
        raise MeshError(f"its sizes are {mesh.size}, and its scale factors {tuple(mesh.scale)}")
    if mesh.primitive == "Brick" and len(size) == 3:
        return {"type": "box", "size": size * scale}
    if mesh.primitive == "Ellipsoid" and len(size) == 3:
        return {"type": "ellipsoid", "size": size * scale}
    if mesh.primitive == "Sphere" and len(size) == 1:
        if np.ptp(scale) == 0.0:
            return {"type": "sphere", "size": size * scale[0]}
        return {"type": "ellipsoid", "size": size[0] * scale}
    if mesh.primitive == "Cylinder" and len(size) == 2:  # its axis is y in OpenSim, z in MuJoCo
        along_y = turned(np.array([1.0, 0.0, 0.0]), -0.5 * np.pi)
        return {"type": "cylinder", "size": (size[0] * scale[0], size[1] * scale[1]), "pose": along_y}
    raise MeshError(f"MuJoCo has no shape like {mesh.primitive}")


def write_meshes(document: Document, model: OsimModel, report: Report, folders: Sequence[Path]) -> None:
    """Write all drawn shapes; files are searched in the folders in order, and what is missing is reported."""
    files = MeshFiles(document, folders)
    for mesh in (*model.ground_meshes, *(mesh for body in model.bodies for mesh in body.meshes)):
        kind = f"Mesh of {mesh.frame.body}" if mesh.file else mesh.primitive
        name = mesh.file or mesh.name
        try:
            shape = files.geom(mesh) if mesh.file else _primitive(mesh)
        except MeshError as error:
            report.add(kind, name, LEFT_OUT, str(error))
            continue
        turn = shape.pop("pose", None)
        pose = placed(mesh.frame) if turn is None else placed(mesh.frame) @ turn
        document.add(document.bodies[mesh.frame.body], "geom", **shape, pos=pose[:3, 3],
                     quat=quaternion(pose[:3, :3]), rgba=(*mesh.color, mesh.opacity), **DRAWN)  # fmt: skip
        report.add(kind, name, EXACT)
