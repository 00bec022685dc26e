"""Mesh files of all three formats, whole and damaged: drawn, or left out with a reason; MuJoCo loads the model."""

import base64
import re
import struct
import zlib

import numpy as np
import pytest

import mjwrap as mw

MUTANTS = 35  # of each file: 210
MODEL = (
    '<OpenSimDocument Version="40000"><Model name="m"><Ground name="ground"/><BodySet><objects><Body name="b">'
    "<mass>1</mass>"
    "<inertia>1 1 1 0 0 0</inertia><attached_geometry><Mesh name='g'><mesh_file>{}</mesh_file><scale_factors>{}"
    "</scale_factors></Mesh></attached_geometry></Body></objects></BodySet></Model></OpenSimDocument>"
)
SCALES = ("1 1 1", "1 1 1", "1 1 1", "1e-9 1 1", "0 1 1", "-1 1 1", "1e20 1 1", "1e-9 1e-9 1e-9")
NUMBERS = (b"nan", b"inf", b"1e300", b"-1", b"99999999999", b"1e-30", b"x", b"", b"1e12", b"1e40")
CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=np.float64)
FACES = ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))


def vtp(form: str) -> bytes:
    """Return a tetrahedron, one face of it cut in two, as .vtp in ASCII, in base64, or in base64 with zlib."""

    def array(name: str, values: np.ndarray, kind: str) -> str:
        raw = values.tobytes()
        if form == "ascii":
            text = " ".join(map(str, values.ravel()))
        elif form == "zlib":
            packed = zlib.compress(raw)
            text = base64.b64encode(struct.pack("<4I", 1, len(raw), len(raw), len(packed))).decode()
            text += base64.b64encode(packed).decode()
        else:
            text = base64.b64encode(struct.pack("<I", len(raw)) + raw).decode()
        kept = "ascii" if form == "ascii" else "binary"
        return f'<DataArray type="{kind}" Name="{name}" format="{kept}">{text}</DataArray>'

    cells = array("connectivity", np.array(FACES, dtype=np.int32), "Int32")
    cells += array("offsets", np.array([3, 6, 9, 12], dtype=np.int32), "Int32")
    packed = ' compressor="vtkZLibDataCompressor"' if form == "zlib" else ""
    points = array("Points", CORNERS, "Float64")
    return (
        f'<VTKFile type="PolyData" byte_order="LittleEndian"{packed}><PolyData><Piece NumberOfPoints="4"><Points>'
        f"{points}</Points><Polys>{cells}</Polys></Piece></PolyData></VTKFile>"
    ).encode()


def text_stl() -> bytes:
    lines = ["solid x"]
    for face in FACES:
        corners = [f"vertex {x:g} {y:g} {z:g}" for x, y, z in CORNERS[list(face)]]
        lines += ["facet normal 0 0 1", "outer loop", *corners, "endloop", "endfacet"]
    return "\n".join([*lines, "endsolid", ""]).encode()


def binary_stl() -> bytes:
    triangles = [struct.pack("<12fH", 0, 0, 0, *CORNERS[list(face)].ravel(), 0) for face in FACES]
    return bytes(80) + struct.pack("<I", len(FACES)) + b"".join(triangles)


OBJ = (
    b"# a tetrahedron\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvn 0 0 1\n"
    b"f 1 3 2\nf 1//1 2//1 4//1\nf -4/1 -1/1 -2/1\nf 2 3 4\n"
)
FILES = {
    "ascii.vtp": vtp("ascii"),
    "base64.vtp": vtp("base64"),
    "zlib.vtp": vtp("zlib"),
    "text.stl": text_stl(),
    "binary.stl": binary_stl(),
    "shape.obj": OBJ,
}


def mutant(content: bytes, rng: np.random.Generator) -> bytes:
    kind, at = rng.integers(0, 6), int(rng.integers(0, len(content)))
    if kind == 0:
        return content[:at]
    if kind == 1:
        damaged = bytearray(content)
        for place in rng.integers(0, len(content), rng.integers(1, 20)):
            damaged[place] = rng.integers(0, 256)
        return bytes(damaged)
    if kind == 2:
        return rng.bytes(int(rng.integers(0, 3000)))
    if kind == 3:
        return content[:at] + content[at + int(rng.integers(1, 50)) :]
    spots = list(re.finditer(rb"(?<=[ >])-?\d[\d.e-]*(?=[ <\n/])", content))
    if kind == 4 or not spots:
        return content[:at] + rng.bytes(30) + content[at:]
    spot = spots[rng.integers(0, len(spots))]
    return content[: spot.start()] + NUMBERS[rng.integers(0, len(NUMBERS))] + content[spot.end() :]


def drawn(folder, name: str, content: bytes, scale: str = "1 1 1") -> tuple[str, str, mw.Imported]:
    """Return the outcome and the text of the report, and the import."""
    (folder / name).write_bytes(content)
    (folder / "model.osim").write_text(MODEL.format(name, scale))
    found = mw.import_osim(folder / "model.osim")
    (entry,) = [entry for entry in found.report.entries if entry.kind == "Mesh of b"]
    return entry.outcome, entry.text, found


@pytest.mark.parametrize("name", FILES)
def test_whole_files_have_their_triangles(name, tmp_path):
    outcome, _, found = drawn(tmp_path, name, FILES[name])
    model = found.spec.compile()
    assert outcome == "exact"
    assert (model.nmesh, model.nmeshvert, model.nmeshface) == (1, 4, 4)
    # the area of the tetrahedron is the same wherever its frame is
    corners = model.mesh_vert[model.mesh_face]
    area = (
        0.5
        * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum()
    )
    assert area == pytest.approx(1.5 + np.sqrt(3.0) / 2.0, rel=1e-6)


@pytest.mark.parametrize("name", FILES)
def test_damaged_files_are_drawn_or_left_out(name, tmp_path):
    rng = np.random.default_rng(7)
    left_out = 0
    for _ in range(MUTANTS):
        outcome, text, found = drawn(
            tmp_path, name, mutant(FILES[name], rng), SCALES[rng.integers(0, len(SCALES))]
        )
        assert found.spec.compile().nmesh == (outcome == "exact")
        assert outcome == "exact" or text
        left_out += outcome == "left out"
    assert left_out > MUTANTS // 2


@pytest.mark.parametrize(
    ("name", "content", "told"),
    [
        ("cut.stl", binary_stl()[:-20], "is neither a binary nor a text STL file; it may be cut off"),
        (
            "huge.obj",
            OBJ.replace(b"f 2 3 4", b"f 2 3 99999"),
            "has triangles with points that it does not have",
        ),
        ("flat.obj", OBJ.replace(b"f 2 3 4", b"f 2 3 x"), "has a line that cannot be read, line 10"),
        ("nan.stl", text_stl().replace(b"vertex 1 0", b"vertex nan 0"), "has numbers that are not finite"),
        ("far.vtp", vtp("ascii").replace(b"1.0", b"1e20"), "has coordinates beyond 1e\\+09"),
        ("empty.vtp", b"", "is not XML"),
    ],
)
def test_reasons(name, content, told, tmp_path):
    outcome, text, _ = drawn(tmp_path, name, content)
    assert outcome == "left out"
    assert re.search(told, text)
    assert text.startswith(name)
