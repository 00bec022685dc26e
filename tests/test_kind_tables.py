"""Surfaces and laws as rows of a table: traits that are true, and kinds and codes that nothing knows."""

from __future__ import annotations

import ctypes
import math
from typing import Any, ClassVar

import mujoco
import numpy as np
import pytest
from numba.core import config
from test_path_failures import SCENE

import mjwrap as mw
from mjwrap.errors import GeometryError, ModelError, StateError
from mjwrap.kernels import layout as lay
from mjwrap.kernels.geometry import dispatch as kinds
from mjwrap.kernels.geometry import geodesics
from mjwrap.kernels.musculotendon import actearly, activation_dynamics, fiber, power, tension
from mjwrap.kernels.musculotendon import dispatch as laws
from mjwrap.kernels.spans import chain
from mjwrap.mjcf.parameters import FIBER_LAWS
from mjwrap.mjcf.wrapping_geoms import SIZES
from mjwrap.muscles.laws import LAWS, FiberLaw, parameter_row
from mjwrap.paths.scene import Array, pack
from mjwrap.plugin import install, read
from mjwrap.plugin.callbacks import block as bk
from mjwrap.plugin.readout import block_address, head_of, instances
from mjwrap.surfaces import Surface
from mjwrap.surfaces.primitives import SURFACES
from mjwrap.surfaces.rows import surface_rows, traits
from mjwrap.surfaces.user import CustomSurface
from mjwrap.verification import shapes

EXAMPLES: dict[type[Surface], Surface] = {
    mw.Cylinder: mw.Cylinder(0.04, 0.2),
    mw.Sphere: mw.Sphere(0.04),
    mw.Ellipsoid: mw.Ellipsoid((0.04, 0.03, 0.05)),
    mw.EllipticCylinder: mw.EllipticCylinder((0.04, 0.03), 0.15),
    mw.Torus: mw.Torus(0.05, 0.02),
    mw.Cone: mw.Cone(0.05, 0.03, 0.2),
    mw.Capsule: mw.Capsule(0.04, 0.05),
}
STRANGE = (lay.KINDS, 99.0, -1.0, 2.5, math.nan, math.inf)
UNKNOWN_CODE = 77
SIZES_OF_A_MUSCLE = {"max_isometric_force": 50.0, "optimal_fiber_length": 0.1, "tendon_slack_length": 0.1}
every_surface = pytest.mark.parametrize("kind", SURFACES, ids=lambda kind: kind.__name__)
every_fiber_law = pytest.mark.parametrize("law", FIBER_LAWS.values(), ids=lambda law: law.__name__)
compiled = pytest.mark.skipif(bool(config.DISABLE_JIT), reason="MuJoCo calls compiled kernels")  # pyright: ignore[reportAttributeAccessIssue]


# ------------------------------------------------------------------------------------ traits of surfaces


def test_every_kind_has_one_class() -> None:
    assert set(EXAMPLES) == set(SURFACES) == set(shapes.SHAPES)
    assert sorted(s.kind for s in (*SURFACES, CustomSurface)) == list(range(1, lay.KINDS))
    assert [surface.numeric for surface in SURFACES] == list(SIZES)
    assert all(kinds.is_surface_kind(float(kind)) for kind in range(1, lay.KINDS))
    assert not any(kinds.is_surface_kind(kind) for kind in (lay.VIA, *STRANGE))


@every_surface
def test_traits_are_those_of_the_shape(kind: type[Surface]) -> None:
    surface, shape = EXAMPLES[kind], shapes.SHAPES[kind]
    assert (kind.touches == 1) == shape.convex  # a string bridges hollows, and those alone
    assert kind.branched == (
        shape.flat or not shape.convex
    )  # one can't slip off over an end, or out of a hole
    assert surface.z_limit == shapes.half_length(surface)
    rows = surface_rows(surface)
    assert rows[:, lay.TOUCH].tolist() == list(range(kind.touches))
    assert (rows[:, lay.Z_LIMIT] == surface.z_limit).all()
    assert (rows[:, lay.TRAITS] == traits(surface)).all()
    rng = np.random.default_rng(3)
    stretched = np.array((*surface.columns, 0.0, 0.0)[:3]) * [
        p / np.linalg.norm(p) for p in rng.normal(size=(20, 3))
    ]
    with np.errstate(invalid="ignore", divide="ignore"):
        on_it = np.abs(shape.height(shapes.sizes(surface), stretched)).max() < 1e-14
    assert on_it or not kind.ellipse_sections


@every_surface
def test_a_wrap_in_closed_form_needs_no_steps(kind: type[Surface]) -> None:
    steps = 0
    for height in (0.0, 0.005, -0.011, 0.015):
        path = mw.solve_path((-0.2, 0.007, height), (0.21, -0.005, 0.02), [mw.Obstacle(EXAMPLES[kind])])
        assert path.converged
        assert path.contacts[0].active
        steps += path.iterations
    assert kind.closed_form == (steps == 0)


@every_surface
def test_hints_choose_a_side_where_there_are_sides(kind: type[Surface]) -> None:
    lengths = []
    for hint in ((0.0, 0.1, 0.0), (0.0, -0.1, 0.0), (0.0, 0.0, 0.1), (0.0, 0.0, -0.1)):
        obstacle = mw.Obstacle(EXAMPLES[kind], hint=hint)
        lengths.append(mw.solve_path((-0.2, 0.002, 0.001), (0.21, 0.001, -0.002), [obstacle]).length)
    assert kind.one_sided == (np.ptp(lengths) < 1e-9)


@every_surface
def test_what_a_string_can_be_held_in(kind: type[Surface]) -> None:
    assert {lay.ABOUT_AXIS: mw.Cylinder, lay.ABOUT_POINT: mw.Sphere}.get(kind.held_about, kind) is kind
    surface = mw.Cylinder(0.04) if kind is mw.Cylinder else EXAMPLES[kind]
    if kind.held_about:
        assert mw.Obstacle(surface, inside=True).inside
        assert (surface_rows(surface, inside=True)[:, lay.INSIDE] == kind.held_about).all()
    else:
        with pytest.raises(GeometryError, match="inside=True"):
            mw.Obstacle(surface, inside=True)


class FourTimes(mw.Torus):
    """A ring with room for four touches."""

    touches: ClassVar[int] = 4


@pytest.mark.parametrize("bridged", [True, False])
def test_rows_for_more_touches_change_nothing_where_two_are_enough(bridged: bool) -> None:
    """Over the hole a string touches a ring twice, on its far side and on its near one; round its rim once."""
    ends, hint = ((-0.2, 0.003, 0.0), (0.21, 0.005, 0.0)), (0.0, 0.0, 0.02)
    if not bridged:
        ends, hint = ((-0.2, 0.06, 0.0), (0.21, 0.055, 0.01)), (0.0, 0.08, 0.0)
    found = []
    for ring in (mw.Torus(0.05, 0.02), FourTimes(0.05, 0.02)):
        path = mw.solve_path(*ends, [mw.Obstacle(ring, hint=hint)])
        assert path.converged
        assert len(path.branch) == ring.touches
        assert (path.contacts[0].second is not None) == bridged
        found.append(path.length)
    assert found[1] == pytest.approx(found[0], rel=1e-14)


# ------------------------------------------------------------------------------------- unknown surfaces


def strange_rows(kind: float) -> Array:
    """Return rows of two surfaces, of which the second has a kind that does not exist."""
    obstacles = [
        mw.Obstacle(mw.Cylinder(0.04)),
        mw.ViaPoint((0.1, 0.0, 0.0)),
        mw.Obstacle(mw.Sphere(0.04), (0.2, 0, 0)),
    ]
    node = pack(obstacles)
    node[2, lay.KIND] = kind
    return node


@pytest.mark.parametrize("kind", STRANGE)
@pytest.mark.parametrize("mode", [lay.COLD, lay.FREE, lay.TOUCHED])
def test_a_path_over_an_unknown_kind_has_a_status(kind: float, mode: float) -> None:
    node, info = strange_rows(kind), np.zeros((1, lay.INFO))
    node[2, lay.S_MODE] = mode
    for inside in (0.0, lay.ABOUT_POINT):
        node[2, lay.INSIDE] = inside
        chain.solve_chain(0, 3, -0.2, 0.01, 0.0, 0.4, 0.01, 0.0, node, 1e-10, True, info, 0)
        assert mw.Status(int(info[0, lay.I_STATUS])) == mw.Status.UNKNOWN_SURFACE
        assert math.isfinite(info[0, lay.I_LENGTH])


def test_a_sweep_over_an_unknown_kind_has_a_status() -> None:
    node, info = strange_rows(99.0), np.zeros((3, lay.INFO))
    ends = np.tile([-0.2, 0.01, 0.0], (3, 1)), np.tile([0.4, 0.01, 0.0], (3, 1))
    pos = np.broadcast_to(node[:, lay.POS : lay.POS + 3], (3, 3, 3)).copy()
    quat = np.broadcast_to([1.0, 0.0, 0.0, 0.0], (3, 3, 4)).copy()
    for warm in (True, False):
        chain.solve_motion(*ends, pos, quat, node, warm, 1e-10, info)
        assert (info[:, lay.I_STATUS] == mw.Status.UNKNOWN_SURFACE).all()


@pytest.mark.parametrize("kind", STRANGE)
def test_functions_of_an_unknown_kind_give_nothing(kind: float) -> None:
    node = surface_rows(mw.Torus(0.05, 0.02))[:1]
    node[0, lay.KIND] = kind
    node[0, lay.S_P : lay.S_P + 7] = 0.07, 0.0, 0.0, 0.0, 1.0, 0.0, 0.05
    geodesics.geodesic(0, node, 0.0, 0.0, 0.0)
    assert np.isnan(node[0, lay.W_P : lay.W_KP]).all()
    point = 0.1, 0.0, 0.01
    assert np.isnan([*kinds.project(node, 0, *point), *kinds.nearest(node, 0, *point)]).all()
    assert math.isnan(kinds.height(node, 0, *point))
    assert math.isnan(kinds.segment_clearance(node, 0, *point, -0.1, 0.0, 0.01)[0])
    assert math.isnan(kinds.winding_angle(0, node))
    assert math.isnan(kinds.segment_winding_angle(0, node, *point, -0.1, 0.0, 0.01))


def test_a_class_of_an_unknown_kind_is_refused() -> None:
    class Own(mw.Sphere):
        kind: ClassVar[int] = 99

    class Nothing(Surface):
        dims = (0.1,)  # pyright: ignore[reportAssignmentType]

    for surface in (Own(0.1), Nothing()):
        with pytest.raises(GeometryError, match="the kernels have no surface of kind"):
            mw.solve_path((-0.2, 0.0, 0.0), (0.2, 0.0, 0.0), [mw.Obstacle(surface)])


def scene() -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = mujoco.MjModel.from_xml_string(SCENE)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def test_muscles_over_an_unknown_kind_have_a_status() -> None:
    model, data = scene()
    muscles = mw.MuscleSystem(model)
    muscles.forward(data)
    first = muscles.names.index("first")
    assert not muscles.status.any()
    muscles._last.node[0, lay.KIND] = 99.0
    muscles.forward(data)
    assert muscles.status[first] == mw.Status.UNKNOWN_SURFACE
    assert np.flatnonzero(muscles.status).tolist() == [first]


# ------------------------------------------------------------------------------------------ muscle laws


def test_every_code_has_one_law() -> None:
    codes = sorted(law.code for law in LAWS.values())
    assert codes == sorted((*laws.WITH_FIBER, *laws.WITHOUT_FIBER)) == list(range(len(LAWS)))
    assert all(laws.is_law_code(code) for code in codes)
    assert not any(laws.is_law_code(code) for code in (-1, len(LAWS), UNKNOWN_CODE))
    assert {law.code for law in FIBER_LAWS.values()} == set(laws.WITH_FIBER)


@every_fiber_law
def test_traits_of_a_law_are_those_of_its_curves(law: type[FiberLaw]) -> None:
    found = law(**SIZES_OF_A_MUSCLE)  # pyright: ignore[reportArgumentType]
    row = parameter_row(found)
    assert len(row) == laws.PARAMS
    assert row[fiber.LEAST] == law.least * 0.1
    curves = laws.curve_set(law.code, np.array([row]), 0)
    _, _, below, _ = laws.length_curves(curves, law.least)
    assert below == pytest.approx(0.0, abs=1e-12)  # the shortest fibre has no passive force
    slope = [laws.tendon_curve(curves, x)[1] for x in (1.05, 1.06, 1.07)]
    growth, further = slope[1] / slope[0], slope[2] / slope[1]  # an exponential's slope grows by one factor
    assert (law.code in laws.EXPONENTIAL_TENDON) == (growth > 1.01 and further == pytest.approx(growth))


def test_functions_of_an_unknown_law_give_nothing() -> None:
    params = np.array([parameter_row(mw.DeGrooteFregly2016(**SIZES_OF_A_MUSCLE, tendon="elastic"))])
    law = UNKNOWN_CODE
    assert math.isnan(tension.tension(law, params, 0, 0.5, 0.2, 0.0))
    assert np.isnan(
        [*laws.length_curves(law, 1.0), *laws.velocity_curve(law, 0.0), *laws.tendon_curve(law, 1.1)]
    ).all()
    assert np.isnan(
        [*laws.law_balancing_velocity(law, 1.0, 0.1, 0.5, 1e-8), laws.inverse_velocity(law, 0.5)]
    ).all()
    assert np.isnan([laws.passive_energy(law, 1.2), laws.tendon_energy(law, 1.2)]).all()
    one, out = np.full(1, 0.2), np.zeros((power.OUTPUTS, 1))
    power.energetics(np.array([law]), params, one, one, one, one, one, np.zeros((1, 8)), out)
    assert math.isnan(out[power.MUSCLE, 0])


def test_an_unknown_form_of_activation_dynamics_gives_nothing() -> None:
    assert math.isnan(activation_dynamics.rate(7, 0.5, 0.2, 0.01, 0.04, 10.0))
    assert math.isnan(activation_dynamics.advance(7, 0.2, 0.5, 0.01, 0.04, 10.0, 0.001))
    assert math.isnan(actearly.next_activation(9, np.ones((1, 5)), 0, 0.2, 0.5, 0.001))


def test_a_law_of_an_unknown_code_is_refused() -> None:
    class Own(mw.DeGrooteFregly2016):
        code: ClassVar[int] = UNKNOWN_CODE

    with pytest.raises(ModelError, match="the kernels have no law of code 77"):
        mw.simulate_muscle(Own(**SIZES_OF_A_MUSCLE), [0.0, 0.1], 0.2, activation=0.5)  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize("what", ["law", "form"])
def test_a_muscle_of_an_unknown_law_has_a_status(what: str) -> None:
    model, data = scene()
    muscles = mw.MuscleSystem(model)
    muscles.excitation[:] = 0.5
    muscles.step(data)
    first = muscles.names.index("first")
    assert not muscles.status.any()
    before = muscles.tension[first]
    getattr(muscles._plan, what)[first] = UNKNOWN_CODE
    with pytest.raises(StateError, match="muscle 'first': a pose or force is not finite"):
        muscles.step(data)
    assert muscles.status[first] == mw.Status.NON_FINITE
    assert np.flatnonzero(muscles.status).tolist() == [first]
    assert muscles.tension[first] == before


# --------------------------------------------------------------------------------------- engine plugin


def array_of(data: mujoco.MjData, column: int, kind: Any) -> Any:
    """Return the first number of an array of the plugin's block."""
    block = block_address(data, instances(data.model)[0])
    return kind.from_address(block + int(head_of(block)[column]))


@compiled
@pytest.mark.parametrize(
    ("column", "kind", "status"),
    [
        (bk.A_NODE, ctypes.c_double, mw.Status.UNKNOWN_SURFACE),
        (bk.A_LAW, ctypes.c_int64, mw.Status.NON_FINITE),
    ],
)
def test_the_plugin_gives_the_same_status(column: int, kind: Any, status: mw.Status) -> None:
    model = install(mujoco.MjSpec.from_string(SCENE))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert not read(data).status.any()
    names = read(data).names
    array_of(data, column, kind).value = UNKNOWN_CODE  # of the first row, which belongs to the first muscle
    mujoco.mj_forward(model, data)
    owner = names.index("first") if column == bk.A_NODE else 0
    assert read(data).status[owner] == status
    assert np.count_nonzero(read(data).status) == 1
