"""Where the import puts wrap objects on their paths, and how it writes points, muscles and other pulls."""

import math
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import mujoco
import numpy as np
import pytest

import mjwrap as mw
from mjwrap.osim.description.functions import Piecewise, linear
from mjwrap.osim.writing.piece_algebra import composed, flattened, preimage, weighted_sum

POINT = """<PathPoint name="{name}"><socket_parent_frame>{frame}</socket_parent_frame>
<location>{at}</location></PathPoint>"""
CYLINDER = """<WrapCylinder name="{name}"><active>true</active><xyz_body_rotation>0 0 0</xyz_body_rotation>
<translation>{at}</translation><quadrant>{quadrant}</quadrant><radius>{radius}</radius><length>{length}</length>
</WrapCylinder>"""


def osim(
    points: list[tuple[str, str, str]], wraps: str, listed: list[str], force: str = "PathActuator"
) -> str:
    """Return an .osim text: a body that slides along x of ground, wrap objects on ground, and one path over them."""
    frames = {"ground": "/ground", "b": "/bodyset/b"}
    path = "".join(POINT.format(name=name, frame=frames[frame], at=at) for name, frame, at in points)
    over = "".join(
        f'<PathWrap name="w{k}"><wrap_object>{name}</wrap_object><method>hybrid</method><range>-1 -1</range></PathWrap>'
        for k, name in enumerate(listed)
    )
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<OpenSimDocument Version="40000"><Model name="m">
<Ground name="ground"><WrapObjectSet name="s"><objects>{wraps}</objects></WrapObjectSet></Ground>
<gravity>0 -9.81 0</gravity>
<BodySet name="bodyset"><objects><Body name="b"><mass>1</mass><mass_center>0 0 0</mass_center>
<inertia>1 1 1 0 0 0</inertia></Body></objects></BodySet>
<JointSet name="jointset"><objects><SliderJoint name="j"><socket_parent_frame>/ground</socket_parent_frame>
<socket_child_frame>/bodyset/b</socket_child_frame><coordinates><Coordinate name="x"><default_value>0</default_value>
<range>-0.02 0.02</range></Coordinate></coordinates></SliderJoint></objects></JointSet>
<ForceSet name="forceset"><objects><{force} name="pull"><optimal_force>10</optimal_force>
<GeometryPath name="path"><PathPointSet name="p"><objects>{path}</objects></PathPointSet>
<PathWrapSet name="pathwrapset"><objects>{over}</objects></PathWrapSet></GeometryPath></{force}></objects></ForceSet>
</Model></OpenSimDocument>"""


def imported(tmp_path: Path, *args, **options) -> mw.Imported:
    file = tmp_path / "m.osim"
    file.write_text(osim(*args, **options))
    return mw.import_osim(file)


def route(found: mw.Imported) -> list[str]:
    """Return the names of the sites and geoms of the only path, in order; a side with a star."""
    tuples = [t for t in ElementTree.fromstring(found.xml).iter("tuple") if t.get("name") == "mjwrap_pull"]
    return [
        element.get("objname", "") + "*" * (element.get("prm") == "2")
        for element in tuples[0].iter("element")
        if element.get("objtype") in ("site", "geom")
    ]


def path_length(found: mw.Imported) -> float:
    model = mujoco.MjModel.from_xml_string(found.xml)
    data, muscles = mujoco.MjData(model), mw.MuscleSystem(model)
    mujoco.mj_forward(model, data)
    muscles.forward(data)
    assert muscles.status[0] == mw.Status.CONVERGED
    return float(muscles.length[0])


ENDS = [("a", "ground", "-0.1 0.01 0"), ("b", "b", "0.1 0.01 0")]


def over_cylinder(x: float, y: float, radius: float, above: bool) -> float:
    """Return the length of the path between (-x, y) and (x, y) over a circle round the origin."""
    far = math.hypot(x, y)
    turn = 2.0 * (math.atan2(x, y if above else -y) - math.acos(radius / far))
    return 2.0 * math.sqrt(far * far - radius * radius) + radius * turn


@pytest.mark.parametrize(("quadrant", "above"), [("all", True), ("+y", True), ("-y", False)])
def test_a_quadrant_is_a_side_at_every_pose(tmp_path, quadrant, above):
    wrap = CYLINDER.format(name="w", at="0 0 0", quadrant=quadrant, radius=0.03, length=0.1)
    found = imported(tmp_path, ENDS, wrap, ["w"])
    assert route(found) == ["pull_a", "w", *["w_side*"] * (quadrant != "all"), "pull_b"]
    assert path_length(found) == pytest.approx(over_cylinder(0.1, 0.01, 0.03, above), rel=1e-12)


def test_order_and_segments_are_those_along_the_path(tmp_path):
    """The file lists the wraps backwards; the last one lies between the via point and the end."""
    places = {"one": "-0.05 0 0", "two": "0 0.005 0", "three": "0.15 0 0"}
    wraps = "".join(
        CYLINDER.format(name=n, at=at, quadrant="all", radius=0.02, length=0.2) for n, at in places.items()
    )
    points = [("a", "ground", "-0.1 0.01 0"), ("m", "ground", "0.1 0.01 0"), ("b", "b", "0.2 0.01 0")]
    found = imported(tmp_path, points, wraps, ["three", "two", "one"])
    assert route(found) == ["pull_a", "one", "two", "pull_m", "three", "pull_b"]


def test_a_cylinder_that_is_met_only_beyond_its_ends_is_left_out(tmp_path):
    wraps = CYLINDER.format(name="w", at="0 0 1", quadrant="all", radius=0.03, length=0.1)
    found = imported(tmp_path, ENDS, wraps, ["w"])
    entries = [entry for entry in found.report.entries if entry.kind == "PathWrap"]
    assert [entry.outcome for entry in entries] == ["left out"]
    assert "beyond its ends" in entries[0].text
    assert route(found) == ["pull_a", "pull_b"]


def test_a_wrap_with_an_end_inside_at_every_pose_is_left_out(tmp_path):
    wraps = CYLINDER.format(name="w", at="-0.1 0 0", quadrant="all", radius=0.03, length=0.1)
    found = imported(tmp_path, ENDS, wraps, ["w"])
    assert route(found) == ["pull_a", "pull_b"]
    assert any("inside it at every sampled pose" in entry.text for entry in found.report.entries)


def test_a_wrap_that_is_never_met_stays_on_the_path(tmp_path):
    wraps = CYLINDER.format(name="w", at="0 0.5 0", quadrant="all", radius=0.03, length=0.1)
    assert route(imported(tmp_path, ENDS, wraps, ["w"])) == ["pull_a", "w", "pull_b"]


def test_a_model_is_saved_whole_or_not_at_all(tmp_path):
    found = imported(tmp_path, ENDS, "", [])
    found.save(tmp_path / "out" / "m.xml")
    assert mujoco.MjModel.from_xml_path(str(tmp_path / "out" / "m.xml")).ntuple == 1
    with pytest.raises(mw.RecordingError):
        found._replace(assets={"notes.txt": b""}).save(tmp_path / "second" / "m.xml")
    assert not (tmp_path / "second").exists()


def random_pieces(random: np.random.Generator, count: int, degree: int = 3) -> Piecewise:
    breaks = np.sort(random.uniform(-1.0, 1.0, count - 1))
    return Piecewise(breaks, random.uniform(-1.0, 1.0, count), random.normal(size=(count, degree + 1)))


def test_sums_and_compositions_of_pieces():
    random = np.random.default_rng(3)
    x = random.uniform(-1.5, 1.5, 300)
    for _ in range(20):
        first, second = random_pieces(random, 4), random_pieces(random, 3)
        total = weighted_sum([first, second], [0.3, -2.0], 0.7)
        np.testing.assert_allclose(total(x), 0.7 + 0.3 * first(x) - 2.0 * second(x), rtol=1e-11, atol=1e-11)
        for inner in (linear(-2.0, 0.3), linear(0.5), random_pieces(random, 2, 1)):
            np.testing.assert_allclose(composed(first, inner)(x), first(inner(x)), rtol=1e-9, atol=1e-9)
        data = flattened(first)
        assert data[0] == 4
        np.testing.assert_array_equal(data[1:4], first.breaks)
        np.testing.assert_array_equal(data[8:], first.coefficients.ravel())


def test_the_range_of_a_condition_on_a_coordinate_that_follows_a_joint():
    assert preimage(linear(-2.0, 1.0), 0.0, 3.0) == pytest.approx((-1.0, 0.5))
    bent = Piecewise(np.array([0.0]), np.zeros(2), np.array([[0.0, 1.0], [0.0, 3.0]]))
    assert preimage(bent, -1.0, 6.0) == pytest.approx((-1.0, 2.0))
    parabola = Piecewise(np.zeros(0), np.zeros(1), np.array([[0.0, 0.0, 1.0]]))
    assert preimage(parabola, 1.0, 4.0) is None  # two intervals
