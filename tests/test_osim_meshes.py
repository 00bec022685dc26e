"""Meshes of OpenSim models: .vtp files of all forms, damaged ones, and meshes as MuJoCo draws them."""

import base64
import dataclasses
import zlib

import mujoco
import numpy as np
import pytest
from osim_mechanics import written
from osim_scenes import chain, frame

from mjwrap.osim.description.bodies import (
    Mesh,
)
from mjwrap.osim.report import Report
from mjwrap.osim.writing.document import Document
from mjwrap.osim.writing.meshes import write_meshes
from mjwrap.osim.writing.vtp import MeshError, read_vtp

POINTS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 1]], dtype=np.float32)
CELLS = [[0, 3, 2, 1], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]
CONNECTIVITY = np.concatenate(CELLS).astype(np.int32)
OFFSETS = np.cumsum([len(cell) for cell in CELLS]).astype(np.int32)


def vtp(form: str, compressed: bool = False) -> bytes:
    """Return a pyramid as a .vtp file."""
    appended = b""

    def packed(values: np.ndarray) -> bytes:
        content = values.tobytes()
        if not compressed:
            return np.uint32(len(content)).tobytes() + content
        half = len(content) // 2
        blocks = [zlib.compress(content[:half]), zlib.compress(content[half:])]
        return np.array([2, half, len(content) - half, *map(len, blocks)], np.uint32).tobytes() + b"".join(
            blocks
        )

    def coded(values: np.ndarray) -> bytes:
        content = packed(values)
        header = 20 if compressed else 0
        return base64.b64encode(content[:header]) + base64.b64encode(content[header:])

    def array(name: str, values: np.ndarray) -> str:
        nonlocal appended
        kind = "Float32" if values.dtype == np.float32 else "Int32"
        start = f'<DataArray type="{kind}" Name="{name}" '
        if form == "ascii":
            return start + 'format="ascii">' + " ".join(map(str, values.ravel())) + "</DataArray>"
        if form == "binary":
            return start + 'format="binary">' + coded(values).decode() + "</DataArray>"
        place = len(appended)
        appended += packed(values) if form == "raw" else coded(values)
        return start + f'format="appended" offset="{place}"/>'

    compressor = ' compressor="vtkZLibDataCompressor"' if compressed else ""
    text = f'<?xml version="1.0"?><VTKFile type="PolyData" byte_order="LittleEndian"{compressor}><PolyData><Piece>'
    text += f"<Points>{array('Points', POINTS)}</Points>"
    text += (
        f"<Polys>{array('connectivity', CONNECTIVITY)}{array('offsets', OFFSETS)}</Polys></Piece></PolyData>"
    )
    out = text.encode()
    if form in ("raw", "base64"):
        out += f'<AppendedData encoding="{form}">_'.encode() + appended + b"</AppendedData>"
    return out + b"</VTKFile>"


@pytest.mark.parametrize("compressed", [False, True])
@pytest.mark.parametrize("form", ["ascii", "binary", "raw", "base64"])
def test_vtp_files_of_all_forms(form, compressed):
    vertices, faces = read_vtp(vtp(form, compressed))
    np.testing.assert_array_equal(vertices, POINTS)
    assert faces.tolist() == [[0, 3, 2], [0, 2, 1], *CELLS[1:]]


def test_damaged_vtp_files_give_a_named_error():
    whole = [
        vtp(form, compressed) for form in ("ascii", "binary", "raw", "base64") for compressed in (False, True)
    ]
    rng = np.random.default_rng(4)
    errors = 0
    for content in whole:
        for _ in range(40):
            damaged = bytearray(content[: rng.integers(10, len(content))] if rng.random() < 0.5 else content)
            for place in rng.integers(0, len(damaged), 3):
                damaged[place] = rng.integers(0, 256)
            try:
                read_vtp(bytes(damaged))
            except MeshError:
                errors += 1
    assert errors > 100


def test_meshes_are_drawn_without_mass_or_contact(tmp_path):
    (tmp_path / "Pyramid.vtp").write_bytes(vtp("ascii"))
    (tmp_path / "text.stl").write_text(
        "solid s\n" + "".join(
            "facet normal 0 0 0\nouter loop\n" + "".join(f"vertex {x} {y} {z}\n" for x, y, z in POINTS[list(corners)])
            + "endloop\nendfacet\n" for corners in ((0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4))
        ) + "endsolid\n"
    )  # fmt: skip
    own = frame("b0", 0.1, 0.2, 0.3)
    shapes = [
        Mesh("m", own, "pyramid.vtp", np.ones(3)),
        Mesh("m", own, "pyramid.vtp", np.array([2.0, 1.0, -1.0])),
        Mesh("m", own, "text.stl", np.ones(3)),
        Mesh("m", own, "missing.vtp", np.ones(3)),
        Mesh("m", own, "", np.array([1.0, 2.0, 1.0]), "Cylinder", (0.1, 0.2)),
        Mesh("m", own, "", np.ones(3), "Cone", (0.1, 0.2)),
    ]
    osim = chain(count=1)
    osim = dataclasses.replace(osim, bodies=(dataclasses.replace(osim.bodies[0], meshes=tuple(shapes)),))
    found = written(dataclasses.replace(osim, bodies=(dataclasses.replace(osim.bodies[0], meshes=()),)))
    document, report = Document("m"), Report("m", 40000)
    document.bodies["b0"] = document.add("worldbody", "body", name="b0")
    write_meshes(document, osim, report, [tmp_path])
    drawn = mujoco.MjModel.from_xml_string(document.to_xml(), document.assets)
    assert [entry.outcome for entry in report.entries] == ["exact"] * 3 + ["left out", "exact", "left out"]
    assert "not found" in report.entries[3].text
    assert (drawn.ngeom, drawn.nmesh) == (4, 3)
    assert not drawn.geom_contype.any()
    assert drawn.body_mass.sum() == 0.0
    assert found.compile().body("b0").mass[0] == 1.0
    # The first mesh is where the file and the frame put it: MuJoCo moves a mesh's frame to its middle.
    data = mujoco.MjData(drawn)
    mujoco.mj_kinematics(drawn, data)
    vertices = (
        drawn.mesh_vert[: drawn.mesh_vertnum[0]] @ data.geom_xmat[0].reshape(3, 3).T + data.geom_xpos[0]
    )
    np.testing.assert_allclose(
        np.sort(vertices, axis=0), np.sort(POINTS + np.array([0.1, 0.2, 0.3]), axis=0), atol=1e-6
    )
    # A cylinder's axis is y in OpenSim.
    np.testing.assert_allclose(data.geom_xmat[3].reshape(3, 3)[:, 2], [0.0, 1.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(drawn.geom_size[3, :2], [0.1, 0.4])
