"""Parts of the writing of OpenSim models: functions in pieces, inertias, meshes, loops, errors."""

import base64
import dataclasses
import zlib

import mujoco
import numpy as np
import pytest
from osim_mechanics import written

from mjwrap.errors import OsimError
from mjwrap.osim.description.bodies import (
    Axis,
    Body,
    Coordinate,
    Coupler,
    DistanceConstraint,
    Frame,
    Joint,
    Mesh,
    PointConstraint,
    PointOnLineConstraint,
    WeldConstraint,
)
from mjwrap.osim.description.forces import ContactShape, HuntCrossley
from mjwrap.osim.description.functions import Piecewise, constant, linear
from mjwrap.osim.description.model import OsimModel
from mjwrap.osim.report import Report
from mjwrap.osim.writing.document import Document
from mjwrap.osim.writing.inertias import MassProperties, written_inertias
from mjwrap.osim.writing.meshes import write_meshes
from mjwrap.osim.writing.quartics import inverse_pieces, quartic_pieces
from mjwrap.osim.writing.tree import branches_of
from mjwrap.osim.writing.vtp import MeshError, read_vtp

ORIGIN = Frame("ground", np.zeros(3), np.eye(3))


def frame(body: str, *position: float) -> Frame:
    return Frame(body, np.array(position or (0.0, 0.0, 0.0)), np.eye(3))


def body(name: str, mass: float = 1.0, inertia: float = 0.01) -> Body:
    return Body(name, mass, np.array([0.05, 0.1, -0.02]), inertia * np.diag([1.0, 1.2, 1.5]))


def coordinate(name: str, default: float = 0.0, **options) -> Coordinate:
    given = {"clamped": False, "locked": False, "range": (-2.0, 2.0)} | options
    return Coordinate(name, "", "rotational", default, 0.0, **given)


def turning(name: str, parent: Frame, child: Frame, function: Piecewise | None = None, **options) -> Joint:
    """A joint that turns about z by a function of its coordinate, which has the joint's name."""
    still = [Axis(axis, (), constant(0.0)) for axis in np.eye(3)]
    turn = Axis(np.array([0.0, 0.0, 1.0]), (name,), function or linear(1.0))
    rest = (
        Axis(np.array([1.0, 0.0, 0.0]), (), constant(0.0)),
        Axis(np.array([0.0, 1.0, 0.0]), (), constant(0.0)),
    )
    return Joint(
        name,
        "CustomJoint",
        parent,
        child,
        (coordinate(name, **options),),
        (turn, *rest),
        (still[0], still[1], still[2]),
    )


def model(bodies, joints, constraints=()) -> OsimModel:
    return OsimModel(
        "m", 40000, np.array([0.0, -9.81, 0.0]), tuple(bodies), tuple(joints), tuple(constraints), (), ()
    )


def chain(*constraints, count: int = 3, **options) -> OsimModel:
    """A chain of bodies b0, b1, ... that turn about z, each 0.3 m along x of the one before, by coordinates j0, ..."""
    bodies = [body(f"b{k}") for k in range(count)]
    parents = [ORIGIN, *(frame(f"b{k}", 0.3, 0.0, 0.0) for k in range(count - 1))]
    joints = [
        turning(f"j{k}", parents[k], frame(f"b{k}"), default=0.3 * (k + 1), **options) for k in range(count)
    ]
    return model(bodies, joints, constraints)


# ---------------------------------------------------------------------------------------------------- functions


def test_functions_of_higher_degree_become_smooth_quartics():
    rng = np.random.default_rng(0)
    for _ in range(50):
        breaks = np.sort(rng.uniform(-1.0, 1.0, 3))
        function = Piecewise(
            breaks, rng.uniform(-1.0, 1.0, 4), rng.normal(size=(4, 10)) * 0.4 ** np.arange(10)
        )
        pieces = quartic_pieces(function, -1.5, 1.5)
        assert pieces.coefficients.shape[1] <= 5
        x = rng.uniform(-1.5, 1.5, 500)
        np.testing.assert_allclose(pieces(x), function(x), rtol=0.0, atol=1.5e-10)
        new = np.setdiff1d(pieces.breaks, breaks)
        below, above = pieces(new - 1e-9, 1), pieces(new + 1e-9, 1)
        np.testing.assert_allclose(below, above, rtol=0.0, atol=1e-5)


def test_inverses_of_functions():
    rng = np.random.default_rng(1)
    x = np.linspace(-1.0, 1.0, 301)
    for sign in (1.0, -1.0):
        for _ in range(25):
            rows = np.array([[0.0, 1.0, 0.2, -0.1]]) * sign + np.array(
                [[0.0, 0.0, 0.05, 0.05]]
            ) * rng.uniform(-1, 1, 4)
            function = Piecewise(np.zeros(0), np.zeros(1), rows)
            inverse = inverse_pieces(function, -1.0, 1.0)
            assert inverse is not None
            np.testing.assert_allclose(inverse(function(x)), x, rtol=0.0, atol=1.2e-10)
            outer = Piecewise(np.array([0.1]), np.zeros(2), rng.normal(size=(2, 4)))
            both = inverse_pieces(function, -1.0, 1.0, outer=outer)
            assert both is not None
            inner = x[np.abs(x - 0.1) > 1e-6]
            np.testing.assert_allclose(both(function(inner)), outer(inner), rtol=0.0, atol=1.2e-10)
    assert inverse_pieces(Piecewise(np.zeros(0), np.zeros(1), np.array([[0.0, 0.0, 1.0]])), -1.0, 1.0) is None
    steep = inverse_pieces(linear(-2.0, 1.0), -1.0, 1.0)
    assert steep is not None
    assert steep(5.0) == -2.0


# ----------------------------------------------------------------------------------------------------- inertias


def test_the_nearest_physical_inertia_is_written():
    rng = np.random.default_rng(2)
    for _ in range(50):
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        small = rng.uniform(0.1, 1.0, 2)
        given = np.array([*np.sort(small), small.sum() + rng.uniform(0.1, 0.5)])
        odd = Body("b", 1.0, np.zeros(3), turn @ np.diag(given) @ turn.T)
        branches = branches_of(model([odd], [turning("j", ORIGIN, frame("b"))]))
        now = written_inertias((odd,), branches)["b"]
        assert now.properties is not None
        moments = now.properties.principal()[0]
        assert moments[0] + moments[1] >= moments[2]
        missing = given[2] - given[0] - given[1]
        np.testing.assert_allclose(
            moments, given + missing / 3.0 * np.array([1, 1, -1]), rtol=0.0, atol=1e-14
        )
        # No other physical set of moments is nearer.
        for other in given + rng.normal(0.0, 0.3, (100, 3)):
            if other[0] + other[1] >= other[2]:
                assert np.linalg.norm(other - given) > np.linalg.norm(moments - given) - 1e-12


def test_joined_mass_properties_are_those_of_both_bodies():
    rng = np.random.default_rng(3)
    points = rng.normal(size=(2, 4, 3))
    masses = rng.uniform(1.0, 2.0, (2, 4))

    def properties(points, masses):
        center = masses @ points / masses.sum()
        away = points - center
        parts = [m * (p @ p * np.eye(3) - np.outer(p, p)) for m, p in zip(masses, away, strict=True)]
        inertia = np.sum(parts, axis=0)
        return MassProperties(masses.sum(), center, inertia)

    joined = properties(points[0], masses[0]).joined(properties(points[1], masses[1]))
    wanted = properties(points.reshape(-1, 3), masses.ravel())
    np.testing.assert_allclose(joined.inertia, wanted.inertia, rtol=1e-13)
    np.testing.assert_allclose(joined.center, wanted.center, rtol=1e-13)


def test_a_massless_moving_body_gets_a_stated_mass():
    osim = chain()
    osim = dataclasses.replace(osim, bodies=(osim.bodies[0], body("b1", 0.0, 0.0), osim.bodies[2]))
    found = written(osim)
    assert found.compile().body("b1").mass[0] == 2e-9
    entry = next(entry for entry in found.report.entries if entry.name == "b1")
    assert entry.outcome == "approximated"
    assert "2e-09 kg" in entry.text
    assert entry.size < 1e-6


# ------------------------------------------------------------------------------------- couplings and constraints


def test_a_dependent_coordinate_without_an_axis_is_composed_through_its_coupler():
    cubic = Piecewise(
        np.array([0.2]), np.array([0.0, 0.2]), np.array([[0.1, 0.5, 0.3, -0.2], [0.2, 0.4, -0.1, 0.3]])
    )
    coupler = Coupler(
        "c", "j1", ("j0",), Piecewise(np.zeros(0), np.zeros(1), np.array([[0.05, 0.8, 0.1, 0.2]])), 1.5
    )
    osim = chain(coupler, count=2)
    osim = dataclasses.replace(
        osim, joints=(osim.joints[0], turning("j1", frame("b0", 0.3, 0, 0), frame("b1"), cubic))
    )
    found = written(osim)
    compiled = found.compile()
    assert [compiled.joint(k).name for k in range(compiled.njnt)] == ["j0", "j1_rotation1"]
    driver = found.skeleton.drivers.driver("j1")
    assert driver is not None
    joint, function = driver
    assert joint == "j0"
    assert function is not None
    for x in np.linspace(-2.0, 2.0, 41):
        assert function(x) == pytest.approx(1.5 * float(coupler.function(x)), abs=1e-14)
    data = mujoco.MjData(compiled)
    mujoco.mj_forward(compiled, data)
    assert data.qpos[1] == pytest.approx(float(cubic(1.5 * coupler.function(0.3))), abs=1e-9)
    assert np.abs(data.efc_pos[: data.ne]).max() == 0.0


def test_locked_and_prescribed_coordinates_are_held():
    osim = chain()
    joints = (
        turning("j0", ORIGIN, frame("b0"), default=0.4, locked=True),
        turning("j1", frame("b0", 0.3, 0.0, 0.0), frame("b1"), default=0.2, prescribed=linear(1.0, 0.7)),
        osim.joints[2],
    )
    found = written(dataclasses.replace(osim, joints=joints))
    compiled = found.compile()
    data = mujoco.MjData(compiled)
    assert compiled.qpos0.tolist() == [0.4, 0.7, pytest.approx(0.9)]
    for _ in range(200):
        mujoco.mj_step(compiled, data)
    np.testing.assert_allclose(data.qpos[:2], [0.4, 0.7], rtol=0.0, atol=1e-7)
    assert abs(data.qpos[2] - 0.9) > 0.01


def test_clamped_coordinates_are_limited_only_where_they_start_inside():
    osim = chain(clamped=True, count=3, range=(-1.0, 0.7))
    compiled = written(osim).compile()
    assert compiled.jnt_limited.tolist() == [1, 1, 0]
    np.testing.assert_array_equal(compiled.jnt_range[0], [-1.0, 0.7])


CONSTRAINTS = [
    PointConstraint("c", frame("b2", 0.3, 0.0, 0.0), frame("ground", 0.4, 0.35, 0.0)),
    DistanceConstraint("c", frame("b2", 0.3, 0.1, 0.0), frame("ground", 0.9, 0.1, 0.0), 0.5),
    PointOnLineConstraint(
        "c", frame("ground", 0.1, 0.4, 0.0), np.array([1.0, 0.2, 0.0]), frame("b2", 0.3, 0.0, 0.0)
    ),
    WeldConstraint("c", frame("b2", 0.3, 0.0, 0.0), frame("ground", 0.35, 0.4, 0.0)),
]


@pytest.mark.parametrize("constraint", CONSTRAINTS, ids=lambda each: type(each).__name__)
def test_constraints_hold_from_the_default_pose_on(constraint):
    found = written(chain(constraint))
    compiled = found.compile()
    compiled.opt.timestep = 2e-4
    compiled.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    compiled.eq_solref[:, 0] = 4e-4
    data = mujoco.MjData(compiled)
    mujoco.mj_forward(compiled, data)
    assert np.abs(data.efc_pos[: data.ne]).max() < 1e-12
    energy = data.energy.sum()
    for _ in range(1000):
        mujoco.mj_step(compiled, data)
    mujoco.mj_forward(compiled, data)
    tip, turn = data.body("b2").xpos, data.body("b2").xmat.reshape(3, 3)
    first = constraint.point if isinstance(constraint, PointOnLineConstraint) else constraint.first
    point = tip + turn @ first.position
    if isinstance(constraint, PointOnLineConstraint):
        away = np.cross(
            point - constraint.line.position, constraint.direction / np.linalg.norm(constraint.direction)
        )
        assert np.linalg.norm(away) < 5e-6
    elif isinstance(constraint, DistanceConstraint):
        assert abs(np.linalg.norm(point - constraint.second.position) - constraint.distance) < 5e-6
    else:
        np.testing.assert_allclose(point, constraint.second.position, rtol=0.0, atol=5e-6)
    assert data.energy.sum() == pytest.approx(energy, abs=2e-4)


def test_the_default_pose_is_the_nearest_one_that_satisfies_the_constraints():
    constraint = CONSTRAINTS[0]
    found = written(chain(constraint))
    values = np.array([found.skeleton.drivers.values[f"j{k}"] for k in range(3)])
    start, target = np.array([0.3, 0.6, 0.9]), np.array([0.4, 0.35])

    def tip(q):
        angles = np.cumsum(q)
        return 0.3 * np.array([np.cos(angles).sum(), np.sin(angles).sum()])

    np.testing.assert_allclose(tip(values), target, rtol=0.0, atol=1e-13)
    # At the nearest pose the way back is across the directions that the constraint leaves free.
    angles = np.cumsum(values)
    slopes = 0.3 * np.array(
        [[-np.sin(angles[k:]).sum() for k in range(3)], [np.cos(angles[k:]).sum() for k in range(3)]]
    )
    free = np.linalg.svd(slopes)[2][2]
    assert abs(free @ (values - start)) < 1e-8


def test_a_loop_is_closed_by_copies_that_share_the_mass():
    osim = chain()
    closing = turning("j3", frame("ground", 0.4, 0.2, 0.0), frame("b2", 0.3, 0.0, 0.0))
    found = written(dataclasses.replace(osim, joints=(*osim.joints, closing)))
    compiled = found.compile()
    assert compiled.body("b2").mass[0] == compiled.body("b2_j3").mass[0] == 0.5
    compiled.opt.timestep = 2e-4
    compiled.eq_solref[:, 0] = 4e-4
    data = mujoco.MjData(compiled)
    for _ in range(1500):
        mujoco.mj_step(compiled, data)
    np.testing.assert_allclose(data.body("b2").xpos, data.body("b2_j3").xpos, rtol=0.0, atol=2e-5)


def test_a_joint_towards_ground_is_turned_round():
    forward = chain(count=2)
    backward = turning("j1", frame("b1"), frame("b0", 0.3, 0.0, 0.0), default=-0.6)
    there = written(forward)
    back = written(dataclasses.replace(forward, joints=(forward.joints[0], backward)))
    for angle in (-1.0, 0.4):
        poses = []
        for found, sign in ((there, 1.0), (back, -1.0)):
            compiled = found.compile()
            data = mujoco.MjData(compiled)
            data.qpos[:] = 0.5, sign * angle
            mujoco.mj_kinematics(compiled, data)
            poses.append(np.concatenate([data.body("b1").xpos, data.body("b1").xmat]))
        np.testing.assert_allclose(poses[0], poses[1], rtol=0.0, atol=1e-15)


def test_a_body_without_a_joint_moves_freely():
    found = written(model([body("b0"), body("b1")], [turning("j0", ORIGIN, frame("b0"))]))
    compiled = found.compile()
    assert compiled.nv == 7
    data = mujoco.MjData(compiled)
    for _ in range(100):
        mujoco.mj_step(compiled, data)
    assert data.body("b1").xpos[1] == pytest.approx(-0.5 * 9.81 * 0.1**2, rel=1e-3)


def test_descriptions_that_cannot_be_written_name_the_element():
    circle = (Coupler("c1", "j0", ("j1",), linear(1.0)), Coupler("c2", "j1", ("j0",), linear(1.0)))
    two = Coupler("c3", "j0", ("j1", "j2"), linear(1.0))
    lost = Coupler("c4", "j0", ("nowhere",), linear(1.0))
    for constraints, words in ((circle, "circle"), ((two,), "'c3' has 2"), ((lost,), "'nowhere' not found")):
        with pytest.raises(OsimError, match=words):
            written(chain(*constraints))
    with pytest.raises(OsimError, match="joins body 'b0' to itself"):
        written(model([body("b0")], [turning("j0", frame("b0"), frame("b0"))]))
    with pytest.raises(OsimError, match="body 'b7' not found; bodies: b0"):
        written(model([body("b0")], [turning("j0", ORIGIN, frame("b7"))]))


# ----------------------------------------------------------------------------------------------------- contacts


@pytest.mark.parametrize("friction", [0.0, 0.3, 0.8])
def test_a_ball_comes_to_rest_as_deep_as_hertz_force_says(friction):
    radius, stiffness = 0.5, 1e4
    parameters = {"stiffness": stiffness, "dissipation": 0.75, "dynamic_friction": friction}
    osim = chain(count=1)
    slide = dataclasses.replace(
        osim.joints[0],
        rotations=tuple(Axis(axis, (), constant(0.0)) for axis in np.eye(3)),
        translations=(
            Axis(np.array([1.0, 0.0, 0.0]), (), constant(0.0)),
            Axis(np.array([0.0, 1.0, 0.0]), ("j0",), linear(1.0)),
            Axis(np.array([0.0, 0.0, 1.0]), (), constant(0.0)),
        ),
    )
    floor = Frame("ground", np.zeros(3), np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]))
    shapes = (
        ContactShape("floor", "ContactHalfSpace", floor),
        ContactShape("ball", "ContactSphere", frame("b0"), (radius,)),
    )
    force = HuntCrossley("contact", "HuntCrossleyForce", ("floor", "ball"), parameters)
    compiled = written(dataclasses.replace(osim, joints=(slide,), contacts=shapes, forces=(force,))).compile()
    data = mujoco.MjData(compiled)
    data.qpos[:] = radius
    for _ in range(6000):
        mujoco.mj_step(compiled, data)
    # Two equal materials: 4/3 k sqrt(R k x) x with k half of stiffness^(2/3).
    half = 0.5 * stiffness ** (2.0 / 3.0)
    depth = (9.81 / (4.0 / 3.0 * half**1.5 * radius**0.5)) ** (2.0 / 3.0)
    assert radius - data.qpos[0] == pytest.approx(depth, rel=0.02)


# ------------------------------------------------------------------------------------------------------- meshes

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
