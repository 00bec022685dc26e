"""The initial layout of the viewer, and the groups of muscles in it."""

import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import mujoco
import numpy as np
import pytest

import mjwrap as mw

pytest.importorskip("rerun", reason="recordings need the rerun-sdk package")

from cli_runs import ENTERS
from made_up_runs import MEASURED, ROOT, XML, Muscles, read, recorder, states
from rerun.chunk import RrdReader

from mjwrap.recording.groups import LEAST, MOST, crossed_coordinates, given_groups, moved_groups

QUANTITIES = {*MEASURED, "power"}


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(XML)


def layout(path: Path, component: str) -> list[Any]:
    """Every value of a component in the blueprint of a recording."""
    reader = RrdReader(path)
    (entry,) = reader.blueprints()
    found = []
    for chunk in reader.stream(store=entry):
        columns = chunk.to_record_batch()
        if component in columns.schema.names:
            found += [value for row in columns.column(component).to_pylist() for value in row]
    return found


def record(model: mujoco.MjModel, path: Path, count: int, **options: Any) -> tuple[str, ...]:
    names = tuple(f"m{i}" for i in range(count))
    muscles = Muscles(model, names)
    with recorder(model, muscles, path, **options) as run:
        for data in states(model, muscles, 3):
            run.log(data)
    return names


@pytest.mark.parametrize("count", [2, 20, 60])
def test_the_layout_shows_the_model_and_every_muscle(
    model: mujoco.MjModel, tmp_path: Path, count: int
) -> None:
    names = record(model, tmp_path / "run.rrd", count)
    content = read(tmp_path / "run.rrd")
    shown = layout(tmp_path / "run.rrd", "ViewContents:query")
    for quantity in QUANTITIES - {"iterations"}:
        curves = [line for line in shown if line.startswith(f"+ /{quantity}/")]
        assert sorted(curves) == sorted(f"+ /{quantity}/{name}" for name in names)  # each once, none lost
    assert {line.removeprefix("+ ") for line in shown if line.startswith("+ /")} <= content.keys()
    kinds = layout(tmp_path / "run.rrd", "ViewBlueprint:class_identifier")
    assert kinds.count("3D") == 1
    pages = -(-count // 8)
    assert (
        kinds.count("TimeSeries") == 9 * pages + 2
    )  # six quantities, moment arms, the angle, iterations with the names; the solver's two


def test_the_layout_says_whose_curves_stand_together(model: mujoco.MjModel, tmp_path: Path) -> None:
    record(model, tmp_path / "run.rrd", 20, groups={"flexors": ["m1", "m1?"], "biceps": "m2"})
    titles = layout(tmp_path / "run.rrd", "ContainerBlueprint:display_name")
    assert {"flexors", "biceps", "others", "all groups", "solver"} <= set(titles)
    pages = [title for title in titles if "…" in title]
    assert sorted(pages) == ["m1 … m14", "m15 … m19"]  # the eleven flexors in two; eight others fit one
    shown = layout(tmp_path / "run.rrd", "ViewContents:query")
    assert [line for line in shown if line.startswith("+ /groups/power/")] == [
        f"+ /groups/power/{name}" for name in ("flexors", "biceps", "others")
    ]


def test_groups_that_cannot_be_are_errors() -> None:
    with pytest.raises(mw.RecordingError, match=r"group 'a': no muscle 'TRI\*'; muscles: BIC, BRA"):
        given_groups({"a": ["TRI*"]}, ["BIC", "BRA"])
    with pytest.raises(mw.RecordingError, match="muscle 'BIC' is in two groups: 'a' and 'b'"):
        given_groups({"a": "BIC", "b": "B*"}, ["BIC", "BRA"])


def random_tree(rng: np.random.Generator, bodies: int, muscles: int) -> mujoco.MjModel:
    """A tree of bodies with none to three hinges or slides each, and muscles between any two of them."""
    spec = mujoco.MjSpec()
    nodes = [spec.worldbody]
    for i in range(bodies):
        parent = nodes[int(rng.integers(max(0, len(nodes) - 4), len(nodes)))]
        body = parent.add_body(name=f"b{i}", pos=rng.uniform(-0.2, 0.2, 3))
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.01, 0, 0])
        for j in range(int(rng.integers(0, 4))):
            kind = mujoco.mjtJoint.mjJNT_SLIDE if rng.random() < 0.2 else mujoco.mjtJoint.mjJNT_HINGE
            body.add_joint(
                name=f"j{i}_{j}", type=kind, axis=rng.normal(size=3), pos=rng.uniform(-0.1, 0.1, 3)
            )
        nodes.append(body)
    for i, body in enumerate(nodes):
        body.add_site(name=f"s{i}", pos=rng.uniform(-0.05, 0.05, 3))
    for m in range(muscles):
        route = rng.choice(len(nodes), size=int(rng.integers(2, 4)), replace=False)
        tendon = spec.add_tendon(name=f"t{m}")
        for node in route:
            tendon.wrap_site(f"s{node}")
        spec.add_actuator(
            name=f"m{m}", target=f"t{m}", trntype=mujoco.mjtTrn.mjTRN_TENDON, dyntype=mujoco.mjtDyn.mjDYN_MUSCLE,
            gaintype=mujoco.mjtGain.mjGAIN_MUSCLE, biastype=mujoco.mjtBias.mjBIAS_MUSCLE,
            gainprm=[0.75, 1.05, 100, 200, 0.5, 1.6, 1.5, 1.3, 1.2, 0],
            biasprm=[0.75, 1.05, 100, 200, 0.5, 1.6, 1.5, 1.3, 1.2, 0], lengthrange=[0.1, 0.5],
        )  # fmt: skip
    return spec.compile()


@pytest.mark.parametrize("seed", range(4))
def test_a_muscle_crosses_the_joints_that_change_its_length(seed: int) -> None:
    rng = np.random.default_rng(seed)
    model = random_tree(rng, bodies=12, muscles=15)
    muscles, data = mw.MuscleSystem(model), mujoco.MjData(model)
    joints = [model.joint(i).name for i in range(model.njnt)]
    crossing = np.zeros((muscles.n, model.nv), dtype=bool)
    for coordinate in crossed_coordinates(model, muscles.declarations, joints):
        assert coordinate.name == joints[model.dof_jntid[coordinate.dof]]
        crossing[coordinate.muscles, coordinate.dof] = True
    changes = np.zeros_like(crossing)
    for _ in range(3):
        data.qpos[:] = rng.uniform(-1, 1, model.nq)
        changes |= muscles.length_jacobian(data) != 0.0  # exactly zero about a joint that is not crossed
    np.testing.assert_array_equal(crossing, changes)


@pytest.mark.parametrize("seed", range(6))
def test_groups_part_the_muscles_by_the_body_they_move(seed: int) -> None:
    rng = np.random.default_rng(seed)
    model = random_tree(rng, bodies=40, muscles=0)
    ends = rng.integers(0, model.nsite, size=(150, 2))
    declared = [SimpleNamespace(origin_site=a, insertion_site=b) for a, b in ends]
    names = [model.body(i).name for i in range(model.nbody)]
    groups = moved_groups(model, declared, names)
    assert sorted(i for group in groups for i in group.members) == list(range(150))
    assert 1 < len(groups) <= MOST
    assert sum(len(group.members) < LEAST for group in groups) <= 1  # only what is left at the world
    for group in groups:
        body = names.index(group.name)
        for i in group.members:
            chains = [_ancestors(model, int(model.site_bodyid[site])) for site in ends[i]]
            assert any(body in chain for chain in chains)


def _ancestors(model: mujoco.MjModel, body: int) -> list[int]:
    """A body and all between it and the world, and the world."""
    chain = [body]
    while chain[-1]:
        chain.append(int(model.body_parentid[chain[-1]]))
    return chain


def test_the_eye_follows_a_body_that_carries_all_muscles_and_moves_freely(tmp_path: Path) -> None:
    spec = mujoco.MjSpec.from_file(str(ROOT / "models/elbow/elbow.xml"))
    for free in (False, True):
        root = spec.worldbody.first_body()
        if free:
            root.add_freejoint()
        model = spec.compile()
        muscles, data = mw.MuscleSystem(model), mujoco.MjData(model)
        muscles.forward(data)
        with mw.Recorder(model, muscles, tmp_path / "run.rrd") as run:
            run.log(data)
        followed = layout(tmp_path / "run.rrd", "EyeControls3D:tracking_entity")
        origins = {model.body(model.site_bodyid[m.origin_site]).name for m in muscles.declarations}
        assert bool(followed) == (free and "world" not in origins)


def test_a_model_of_the_world_alone_is_looked_at(tmp_path: Path) -> None:
    """No body says from which side."""
    model = mujoco.MjModel.from_xml_string(re.sub("</?body>|<joint[^>]*/>", "", ENTERS))
    assert model.nbody == 1
    muscles, data = mw.MuscleSystem(model), mujoco.MjData(model)
    muscles.forward(data)
    with mw.Recorder(model, muscles, tmp_path / "run.rrd") as run:
        run.log(data)
    (eye,) = layout(tmp_path / "run.rrd", "EyeControls3D:position")
    assert np.isfinite(eye).all()


@pytest.mark.parametrize(
    ("gravity", "axes"),
    [("0 0 -9.81", (3, 5, 1)), ("0 -9.81 0", (3, 1, 6)), ("0 0 0", (3, 5, 1))],
)
def test_the_viewer_is_told_which_axis_points_up(
    gravity: str, axes: tuple[int, int, int], tmp_path: Path
) -> None:
    """rerun numbers the directions of x, y and z: up 1, down 2, right 3, left 4, forward 5, back 6."""
    model = mujoco.MjModel.from_xml_string(XML)
    model.opt.gravity[:] = [float(x) for x in gravity.split()]
    record(model, tmp_path / "run.rrd", 1)
    component = "ViewCoordinates:xyz"
    found = [
        value
        for chunk in RrdReader(tmp_path / "run.rrd").stream()
        if component in (batch := chunk.to_record_batch()).schema.names
        for row in batch.column(component).to_pylist()
        for value in row
    ]
    assert [tuple(value) for value in found] == [axes]
