"""import_osim: an .osim file as a MuJoCo model with geodesic muscles, and a report on every element."""

from __future__ import annotations

import os
from pathlib import Path
from typing import NamedTuple

import mujoco

from mjwrap.files.atomic import PartFile
from mjwrap.osim.report import Report

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
