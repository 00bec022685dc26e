"""What a notebook shows, without a notebook: short texts, HTML that is well formed and escaped, axes with units."""

import subprocess
import sys
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import matplotlib.pyplot as plt
import mujoco
import numpy as np
import pytest
from cli_runs import ELBOW, ROOT
from first_model import compiled
from test_curves import ARM

import mjwrap as mw
from mjwrap import html, plots
from mjwrap.plugin import Muscles

NAMES = ["TRIlong", "TRIlat", "TRImed", "BIClong", "BICshort", "BRA", "BRD"]
AWKWARD = '<b a="1">&'


def parts(shown: str) -> ElementTree.Element:
    """Return HTML as a tree; it must be well formed."""
    return ElementTree.fromstring(f"<div>{shown}</div>")


def words(shown: str) -> str:
    return " ".join(parts(shown).itertext())


def cells(shown: str) -> list[list[str]]:
    rows = ["".join(row.itertext()) and [cell.text or "" for cell in row] for row in parts(shown).iter("tr")]
    return [list(row) for row in rows]


@pytest.fixture(scope="module")
def elbow() -> tuple[mw.MuscleSystem, mujoco.MjData]:
    model = mujoco.MjModel.from_xml_path(ELBOW)
    data = mujoco.MjData(model)
    data.qpos[0] = 1.0
    muscles = mw.MuscleSystem(model)
    muscles.forward(data)
    return muscles, data


@pytest.fixture(scope="module")
def path() -> mw.PathSolution:
    obstacles = [
        mw.Obstacle(mw.Cylinder(0.03), pos=(0.0, 0.01, 0.0), quat=(1.0, 1.0, 0.0, 0.0)),
        mw.ViaPoint((-0.08, 0.05, 0.02)),
        mw.Obstacle(mw.Torus(0.05, 0.01), pos=(-0.15, 0.05, 0.0), quat=(1.0, 0.0, 1.0, 0.0)),
    ]
    return mw.solve_path((0.1, 0.0, 0.0), (-0.25, 0.05, 0.06), obstacles)


def test_a_path_shows_its_numbers_and_a_drawing(path: mw.PathSolution) -> None:
    shown = path._repr_html_()
    assert f"{path.length:.9g} m" in words(shown)
    assert "Cylinder(radius=0.03, half_length=inf)" in words(shown)
    assert "via point" in words(shown)
    tree = parts(shown)
    assert (
        len(list(tree.iter("{http://www.w3.org/2000/svg}circle"))) == 2 + 4
    )  # ends, and P and Q of two contacts
    assert len(shown) < 20_000
    assert len(repr(path)) < 200


def test_contacts_are_short(path: mw.PathSolution) -> None:
    cylinder, via, torus = path.contacts
    assert repr(torus) == "Contact(not touched)"
    assert repr(via) == "Contact(at (-0.08, 0.05, 0.02) m)"
    assert repr(cylinder).startswith("Contact((0.009, 0.0257589")
    assert cells(cylinder._repr_html_())[0] == ["contact point", "x [m]", "y [m]", "z [m]", "arc length [m]"]
    assert float(cells(cylinder._repr_html_())[2][1]) == pytest.approx(cylinder.Q[0], rel=1e-5)  # pyright: ignore
    assert "no" in words(torus._repr_html_())


def test_a_path_without_obstacles_or_a_solution_is_shown() -> None:
    straight = mw.solve_path((0.0, 0.0, 0.0), (0.1, 0.0, 0.0))
    assert "CONVERGED" in words(straight._repr_html_())
    inside = mw.solve_path((0.0, 0.0, 0.0), (0.1, 0.0, 0.0), [mw.Obstacle(mw.Sphere(0.02))])
    assert inside.status.message in words(inside._repr_html_())


def test_a_path_is_plotted_with_units_and_one_scale(path: mw.PathSolution) -> None:
    axes = path.plot()
    assert [axes.get_xlabel(), axes.get_ylabel(), axes.get_zlabel()] == ["x [m]", "y [m]", "z [m]"]
    line, marks = axes.lines
    assert pytest.approx(path.points()) == np.array(line.get_data_3d()).T
    assert len(marks.get_data_3d()[0]) == 6
    assert len(axes.collections) == 2  # the surfaces
    assert path.plot(axes) is axes
    spans = [np.ptp(limits) for limits in (axes.get_xlim3d(), axes.get_ylim3d(), axes.get_zlim3d())]
    assert axes._box_aspect / axes._box_aspect[0] == pytest.approx(np.array(spans) / spans[0], rel=1e-9)
    plt.close("all")


def test_a_surface_is_drawn_where_the_path_touches_it(path: mw.PathSolution) -> None:
    """The points of a drawn cylinder have its radius about its axis, in the world."""
    from mjwrap.paths.pictures import surface_grids

    obstacle = path._obstacles[0]
    assert isinstance(obstacle, mw.Obstacle)
    (grid,) = surface_grids([obstacle], 0.05)
    axis = np.array([0.0, -1.0, 0.0])  # z of a frame that is turned by 90 degrees about x
    away = grid - np.array(obstacle.pos)
    distance = np.linalg.norm(away - (away @ axis)[..., None] * axis, axis=-1)
    assert distance == pytest.approx(np.full(distance.shape, 0.03), rel=1e-12)


def test_without_matplotlib_the_extra_is_named(
    path: mw.PathSolution, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib.pyplot", None)
    with pytest.raises(mw.MissingPackageError, match=r"matplotlib.*pip install 'mjwrap\[demo\]'") as caught:
        path.plot()
    assert isinstance(caught.value, ImportError)


def test_a_system_is_a_table_of_its_muscles(elbow: tuple[mw.MuscleSystem, mujoco.MjData]) -> None:
    muscles, _ = elbow
    assert repr(muscles) == "MuscleSystem(7 muscles: TRIlong, TRIlat, TRImed, BIClong, BICshort, BRA, ...)"
    rows = cells(muscles._repr_html_())
    assert rows[0][:4] == ["muscle", "law", "path", "length [m]"]
    assert [row[0] for row in rows[1:]] == NAMES
    assert [float(row[3]) for row in rows[1:]] == pytest.approx(muscles.length, rel=1e-4)
    assert rows[6][-1] == "BRA_origin > flexor_cylinder (cylinder, side flexor_side) > BRA_insertion"


def test_a_muscle_by_name(elbow: tuple[mw.MuscleSystem, mujoco.MjData]) -> None:
    muscles, data = elbow
    bra = muscles["BRA"]
    i = NAMES.index("BRA")
    assert (bra.name, bra.index) == ("BRA", i)
    for name in ("length", "velocity", "tension", "activation", "fiber_length", "held"):
        assert getattr(bra, name) == getattr(muscles, name)[i], name
    assert bra.status is mw.Status.CONVERGED
    assert bra.reason == ""
    assert bra.declaration is muscles.declarations[i]
    assert bra.parameters == muscles.declarations[i].parameters
    assert np.array_equal(bra.points(), muscles.points(i))
    assert np.array_equal(bra.contact_points(), muscles.contact_points(i))
    assert len(bra.forces()) == len(muscles.forces(i))
    assert bra.moment_arms(data) == {"elbow_flexion": muscles.moment_arms(data)[i, 0]}
    assert "987.26" in words(bra._repr_html_())
    assert repr(bra).startswith("MuscleView('BRA', CONVERGED, length 0.1336")


def test_muscles_are_a_sequence(elbow: tuple[mw.MuscleSystem, mujoco.MjData]) -> None:
    muscles, _ = elbow
    assert [muscle.name for muscle in muscles] == NAMES
    assert len(muscles) == 7
    assert "BRA" in muscles
    assert "BR" not in muscles
    assert muscles[0].name == "TRIlong"
    assert muscles[-1].name == "BRD"
    assert muscles[np.int64(1)].name == "TRIlat"
    for wrong in (7, -8):
        with pytest.raises(mw.GeometryError, match="does not exist; there are 7"):
            muscles[wrong]
    with pytest.raises(
        mw.GeometryError, match=r"no muscle 'BRa' .did you mean 'BRA' or 'BRD'.*muscles: TRIlong"
    ):
        muscles["BRa"]


def test_a_system_without_muscles_is_true_and_shown() -> None:
    muscles = mw.MuscleSystem(mujoco.MjModel.from_xml_string("<mujoco/>"))
    assert muscles
    assert len(muscles) == 0
    assert repr(muscles) == "MuscleSystem(0 muscles)"
    parts(muscles._repr_html_())


def test_results_change_with_the_next_evaluation(elbow: tuple[mw.MuscleSystem, mujoco.MjData]) -> None:
    muscles = mw.MuscleSystem(elbow[0].model)
    data = mujoco.MjData(muscles.model)
    muscles.forward(data)
    bra = muscles["BRA"]
    before = bra.length
    data.qpos[0] = 2.0
    muscles.forward(data)
    assert abs(bra.length - before) > 0.01


def test_muscles_of_the_plugin_are_shown_too() -> None:
    model = mw.load(ELBOW)
    data = mujoco.MjData(model)
    muscles = Muscles(data)
    parts(muscles._repr_html_())
    assert repr(muscles).startswith("Muscles(7 muscles: TRIlong")
    mujoco.mj_step(model, data)
    assert muscles["BRA"].length == muscles.length[NAMES.index("BRA")]
    with pytest.raises(mw.StateError, match="have no moment arms"):
        muscles["BRA"].moment_arms(data)


def test_all_muscles_are_plotted_with_a_legend(elbow: tuple[mw.MuscleSystem, mujoco.MjData]) -> None:
    muscles, _ = elbow
    axes = muscles.plot()
    assert [text.get_text() for text in axes.get_legend().get_texts()] == NAMES
    one = muscles["BRA"].plot()
    assert pytest.approx(muscles["BRA"].points()) == np.array(one.lines[0].get_data_3d()).T
    plt.close("all")


def test_a_legend_of_many_paths_fits_into_the_figure() -> None:
    line = np.array([[0.0, 0.0, 0.0], [0.1, 0.1, 0.3]])
    axes = plots.draw_paths([(f"muscle_{k}", line + 0.01 * k) for k in range(62)], np.empty((0, 3)), [])
    axes.figure.canvas.draw()
    box = axes.get_legend().get_window_extent()
    assert box.x1 <= axes.figure.bbox.x1
    assert box.y0 >= 0.0
    assert len({tuple(line.get_color()) for line in axes.lines}) == 62
    plt.close("all")


@pytest.mark.parametrize(
    "surface",
    [
        mw.Cylinder(0.02), mw.Cylinder(0.02, 0.05), mw.Sphere(0.02), mw.Ellipsoid((0.01, 0.02, 0.03)),
        mw.EllipticCylinder((0.01, 0.02)), mw.Cone(0.02, 0.01, 0.05), mw.Torus(0.03, 0.01), mw.Capsule(0.01, 0.02),
    ],
    ids=lambda surface: type(surface).__name__,
)  # fmt: skip
def test_surfaces_are_drawn(surface: Any) -> None:
    shown = surface._repr_html_()
    assert repr(surface) in words(shown)
    assert list(parts(shown).iter("{http://www.w3.org/2000/svg}path"))


def test_declarations_are_short(elbow: tuple[mw.MuscleSystem, mujoco.MjData]) -> None:
    bra = elbow[0].declarations[NAMES.index("BRA")]
    route = "Route(site 28 > geom 5: Cylinder(radius=0.016, half_length=inf), hint site 2 > site 35)"
    assert repr(bra) == f"MuscleDeclaration('BRA', law degroote_fregly_2016, actuator 5, {route})"
    assert repr(bra.routes[0].nodes[0]).startswith("Node(geom 5: Cylinder")
    assert "max_isometric_force=987.26" in words(bra._repr_html_())


def test_tables_show_their_ends() -> None:
    names = tuple(f"c{k}" for k in range(12))
    table = mw.Table(np.linspace(0.0, 1.0, 101), names, np.arange(1212.0).reshape(101, 12))
    assert repr(table) == "Table(101 rows from 0 to 1 s, 12 columns: c0, c1, c2, c3, c4, c5, ...)"
    rows = cells(table._repr_html_())
    assert rows[0] == ["time [s]", *names[:8], "..."]
    assert [row[0] for row in rows[1:]] == ["0", "0.01", "0.02", "0.03", "...", "0.97", "0.98", "0.99", "1"]
    assert rows[-1][1:3] == ["1200", "1201"]


def test_a_recorder_tells_its_state(elbow: tuple[mw.MuscleSystem, mujoco.MjData], tmp_path: Path) -> None:
    muscles, data = elbow
    recorder = mw.Recorder(muscles.model, muscles, tmp_path / "r.rrd")
    recorder.log(data)
    assert repr(recorder) == f"Recorder({str(tmp_path / 'r.rrd')!r}, 7 muscles, 1 state, open)"
    recorder.close()
    assert "it is closed" in repr(recorder)
    assert "BRA" in words(recorder._repr_html_())


def test_names_are_escaped() -> None:
    name = html.escaped(AWKWARD)
    model = mujoco.MjModel.from_xml_string(ARM.replace('"flexor"', f'"{name}"').replace('"o"', f'"{name}"'))
    muscles = mw.MuscleSystem(model)
    muscles.forward(mujoco.MjData(model))
    assert muscles.names == [AWKWARD]
    for shown in (
        muscles._repr_html_(), muscles[0]._repr_html_(), muscles.declarations[0]._repr_html_(),
        mw.Table(np.array([0.0]), (AWKWARD,), np.array([[1.0]]))._repr_html_(),
    ):  # fmt: skip
        assert AWKWARD in words(shown)
        assert not list(parts(shown).iter("b"))


def test_showing_loads_nothing_heavy() -> None:
    code = """
import mujoco, mjwrap as mw, sys
model = mujoco.MjModel.from_xml_path("models/elbow/elbow.xml")
muscles = mw.MuscleSystem(model)
muscles.forward(mujoco.MjData(model))
muscles._repr_html_(), muscles["BRA"]._repr_html_(), repr(muscles)
print(sorted({"matplotlib", "rerun", "IPython", "jinja2"} & set(sys.modules)))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert done.stdout.strip() == "[]"


def test_curves_and_sweeps_are_short() -> None:
    model = mujoco.MjModel.from_xml_string(ARM)
    curves = mw.curves(model, "elbow", samples=5)
    assert repr(curves) == "JointCurves(elbow from -114.6° to -17.19°, 5 positions, 1 muscle: flexor)"
    rows = cells(curves._repr_html_())
    assert rows[0] == ["muscle", "length [m]", "moment_arm [m]", "tension [N]"]
    arms = curves["moment_arm"]
    assert rows[1][2] == f"{arms.min():.4g} to {arms.max():.4g}"
    sweep = mw.solve_sweep((0.1, 0, 0), (-0.1, 0, 0), [mw.Obstacle(mw.Sphere(0.03))], np.full((4, 1, 3), 0.01),
                           np.tile([1.0, 0, 0, 0], (4, 1, 1)))  # fmt: skip
    assert repr(sweep).startswith("SweepSolution(4 poses, all converged, length 0.2")
    assert len(repr(sweep)) < 100


def test_a_system_that_is_not_evaluated_says_so() -> None:
    model = mujoco.MjModel.from_xml_path(ELBOW)
    muscles, data = mw.MuscleSystem(model), mujoco.MjData(model)
    for shown in (muscles, muscles["BRA"]):
        assert not muscles.evaluated
        assert "not evaluated yet: call forward(data)" in repr(shown)
        assert "not evaluated yet" in shown._repr_html_()
        assert "CONVERGED" not in repr(shown) + shown._repr_html_()
        with pytest.raises(mw.StateError, match="no paths to draw: not evaluated yet"):
            shown.plot()
        muscles.forward(data)
        assert muscles.evaluated
        assert "not evaluated" not in repr(shown) + shown._repr_html_()
        assert "CONVERGED" in shown._repr_html_()
        muscles.reset(data)
    installed = mw.load(ELBOW)
    inside = mujoco.MjData(installed)
    results = Muscles(inside)
    assert "not evaluated yet" in repr(results)
    mujoco.mj_step(installed, inside)
    assert results.evaluated
    assert "CONVERGED" in repr(results["BRA"])


def test_a_picture_says_which_path_was_not_found() -> None:
    inside = mw.solve_path((0, 0.01, 0), (-0.2, 0.05, 0.06), [mw.Obstacle(mw.Cylinder(0.03))])
    assert "ENDPOINT_INSIDE" in inside.plot().get_title()
    assert mw.solve_path((0.1, 0.01, 0), (-0.2, 0.05, 0.06)).plot().get_title() == ""
    model = compiled(('"insertion" pos=".022 0 -.08"', '"insertion" pos=".01 0 -.01"'))
    muscles = mw.MuscleSystem(model)
    muscles.forward(mujoco.MjData(model))
    assert [text.get_text() for text in muscles.plot().get_legend().get_texts()] == [
        "BIC (ENDPOINT_INSIDE)",
        "TRI",
    ]
    plt.close("all")


@pytest.mark.parametrize("wrong", ["x", 3, "plane"])
def test_axes_of_another_kind_are_a_named_error(wrong: object) -> None:
    model = mujoco.MjModel.from_xml_path(ELBOW)
    muscles = mw.MuscleSystem(model)
    muscles.forward(mujoco.MjData(model))
    axes = plt.subplots()[1] if wrong == "plane" else wrong
    for shown in (muscles, muscles["BRA"], mw.solve_path((0, 0, 0), (1, 1, 1))):
        with pytest.raises(mw.GeometryError, match="axes must be matplotlib's 3D axes"):
            shown.plot(axes)
    plt.close("all")
