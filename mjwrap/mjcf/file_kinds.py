"""Tell from its contents that a file is not a MuJoCo model, and say what it is instead."""

from __future__ import annotations

import re
from pathlib import Path

_ROOT = re.compile(rb"<\s*([A-Za-z_][\w.:-]*)")
_NOT_TAGS = re.compile(rb"<!--.*?(-->|\Z)|<\?.*?(\?>|\Z)|<!.*?(>|\Z)", re.DOTALL)
_PICTURES = (b"\x89PNG", b"\xff\xd8\xff", b"GIF8", b"%PDF")
_URDF = (
    "is a URDF file, which cannot contain tendons or muscles; save it as MJCF "
    "(mujoco.MjSpec.from_file('robot.urdf').to_file('robot.xml')), add muscles, and give the .xml"
)


def opensim(file: Path) -> str:
    """Return what an OpenSim model is and what to do with it, as the rest of a sentence."""
    out = f"{file.stem}.xml"
    return (
        f"is an OpenSim model; import it first: mjwrap import {file} -o {out} (in Python: "
        f"mw.import_osim('{file}').save('{out}')), and give {out}"
    )


def foreign(file: Path) -> str:
    """Return what a file is if it is not MJCF or MJB, as the rest of a sentence; an empty string if it may be a model.

    The outermost element of an XML file decides, whatever its suffix; without XML the first bytes.
    """
    suffix = file.suffix.lower()
    if suffix == ".mjb":
        return ""
    with file.open("rb") as stream:
        start = stream.read(65536)
    root = _ROOT.search(_NOT_TAGS.sub(b"", start))
    tag = root.group(1).decode() if root else ""
    if suffix == ".osim" or tag == "OpenSimDocument":
        return opensim(file)
    if tag == "robot":
        return _URDF
    if start.startswith(_PICTURES):
        return "is a picture, not a model; give an MJCF file (.xml) or an MJB file"
    if not start.strip():
        return "is empty; an MJCF file begins with <mujoco>"
    if b"\0" in start[:1024]:
        return "is not a text file; give an MJCF file (.xml), or an MJB file, whose name must end in .mjb"
    if not tag:
        return "contains no XML; an MJCF file begins with <mujoco>"
    if tag == "mujocoinclude":
        return "is a part that other MJCF files include (<mujocoinclude>); give the file that includes it"
    return "" if tag == "mujoco" else f"is not MJCF: it begins with <{tag}>, an MJCF file with <mujoco>"
