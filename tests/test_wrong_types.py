"""A wrong type in any public function is an error that names the argument and says what it must be."""

# pyright: reportArgumentType=false
import inspect
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import mujoco
import numpy as np
import pytest
from cli_runs import ELBOW

import mjwrap as mw
from mjwrap import plugin
from mjwrap.runs import load

PRM = (0.75, 1.05, 100.0, 0.0, 0.5, 1.6, 1.5, 1.3, 1.2)
SHAPES = ("capsule", "cone", "cylinder", "ellipsoid", "elliptic_cylinder", "sphere", "torus")
TIME = np.linspace(0.0, 0.1, 5)
CURVE = (1, 0.0, 0.0, 1.0)  # one straight piece
BALL = mw.Obstacle(mw.Sphere(0.03))
ENDS = ((0.1, 0.0, 0.0), (-0.1, 0.02, 0.03))
LAW = mw.DeGrooteFregly2016(100.0, 0.1, 0.1)
TABLE = mw.Table(np.arange(3.0), ("a",), np.zeros((3, 1)))
POINTS = np.random.default_rng(0).normal(size=(60, 3)) * [1.0, 0.8, 1.3]
MESH = """<mujoco><asset><mesh name="m" vertex="0 0 0 1 0 0 0 1 0 0 0 1"/></asset>
<worldbody><geom name="g" type="mesh" mesh="m"/></worldbody></mujoco>"""
# What a word in an annotation allows, by the names of `values` below.
ALLOWED = {
    "float": {"int", "float", "negative", "nan"},
    "int": {"int", "negative", "float"},
    "ArrayLike": {"int", "float", "negative", "nan", "list", "array"},
    "Array": {"list", "array"},
    "tuple": {"list", "texts", "array"},
    "Sequence": {"list", "texts"},
    "Iterable": {"list", "texts"},
    "Mapping": {"dict"},
    "bool": {"int"},
    "str": {"text"},
    "PathLike": {"text", "Path"},
    "None": {"None"},
    "MjModel": {"MjModel"},
    "MjData": {"MjData"},
    "MjSpec": {"MjSpec"},
    "MuscleSystem": {"MuscleSystem"},
    "SupportsIndex": {"int", "negative"},
    "Results": {"MuscleSystem"},
    "PathSolution": {"PathSolution"},
    "Surface": {"surface"},
    "Function": {"text", "class"},  # source text; a class can be called
}
# Annotations that say less than the docstring does, because mujoco is not known there.
DOCUMENTED = {
    ("mesh_points", "model"): "MjModel",
    ("mesh_points", "data"): "MjData | None",
    ("Recorder", "model"): "MjModel",
    ("Millard2012", "fiber_damping"): "float | None",  # as in its base class
    ("Table", "names"): "tuple | Mapping",  # of which the keys are taken
}


class Call(NamedTuple):
    """A function with arguments with which it works."""

    function: Callable[..., Any]
    arguments: tuple[Any, ...]


@pytest.fixture(scope="module")
def values() -> dict[str, Any]:
    """Return a value of every kind that somebody may give by mistake."""
    model = load(ELBOW)
    muscles = mw.MuscleSystem(model)
    data = mujoco.MjData(model)
    muscles.forward(data)
    return {
        "None": None, "text": "elbow", "int": 3, "float": 1.5, "negative": -1, "nan": float("nan"), "list": [1, 2],
        "texts": ["a"], "dict": {"a": 1}, "bytes": b"ab", "Path": Path("x.xml"), "array": np.zeros((2, 2)),
        "class": mw.Sphere, "object": object(), "MjSpec": mujoco.MjSpec.from_file(ELBOW), "MjModel": model,
        "MjData": data, "MuscleSystem": muscles, "PathSolution": mw.solve_path(*ENDS, [BALL]),
        "surface": mw.Sphere(1.0),
    }  # fmt: skip


def calls(given: dict[str, Any], folder: Path) -> dict[str, Callable[[], Call]]:
    """Return every public function and class that a user calls, each made anew, since some change their arguments."""
    model, data, muscles, path = (given[k] for k in ("MjModel", "MjData", "MuscleSystem", "PathSolution"))
    mw.write_table(folder / "t.csv", TABLE)
    mesh = mujoco.MjModel.from_xml_string(MESH)
    motion = mw.Motion(np.arange(2.0), np.zeros((2, model.nq)))
    flexion = mw.Table(np.arange(2.0), ("elbow_flexion",), np.zeros((2, 1)))

    def spec() -> mujoco.MjSpec:
        return mujoco.MjSpec.from_file(ELBOW)

    fixed: dict[str, tuple[Any, ...]] = {
        "ActivationDynamics": ("zajac",),
        "Capsule": (0.1, 0.2),
        "Cone": (0.1, 0.05, 0.2),
        "Cylinder": (0.1,),
        "DeGrooteFregly2016": (100.0, 0.1, 0.1),
        "Ellipsoid": ((0.1, 0.2, 0.3),),
        "EllipticCylinder": ((0.1, 0.2),),
        "ExternalForce": ("b", np.arange(2.0), np.zeros((2, 3))),
        "ExternalLoads": ([],),
        "Ligament": (100.0, 0.1, CURVE),
        "Millard2012": (100.0, 0.1, 0.1),
        "Motion": (np.arange(2.0), np.zeros((2, 1))),
        "MuJoCoMuscle": (PRM, (0.1, 0.2), 1.0),
        "MuscleSystem": (model,),
        "Obstacle": (mw.Sphere(0.03),),
        "ParameterLimits": (),
        "PathActuator": (1.0,),
        "PathSpring": (100.0, 0.1),
        "Recorder": (model, muscles, folder / "r.rrd"),
        "Sphere": (0.1,),
        "Table": (np.arange(3.0), ("a",), np.zeros((3, 1))),
        "Thelen2003": (100.0, 0.1, 0.1),
        "Torus": (0.1, 0.05),
        "Umberger2010": (),
        "ViaPoint": ((0.0, 0.0, 0.0),),
        "Video": (model, folder / "v.gif"),
        "basal_power": (70.0,),
        "curves": (model, "elbow_flexion", "BRA"),
        "fit_fiber_and_slack": (0.2, 0.3),
        "hill_from_mujoco": (mw.MuJoCoMuscle(PRM, (0.1, 0.2), 1.0),),
        "implausible": (muscles,),
        "import_osim": ("mjwrap:leg",),
        "insert_xml": ("<mujoco></mujoco>", "<custom/>"),
        "inverse_dynamics": (model, motion),
        "joint_reactions": (muscles, motion, np.zeros((len(motion.time), muscles.n))),
        "length_ranges": (muscles,),
        "load": (ELBOW,),
        "mesh_points": (mesh, "g"),
        "muscle_analysis": (muscles, motion),
        "muscle_xml": (model, "X", "BRA_origin,BRA_insertion"),
        "read_table": (folder / "t.csv",),
        "solve_path": (*ENDS, [BALL]),
        "static_optimization": (muscles, motion),
        "solve_sweep": (*ENDS, [BALL], np.zeros((2, 1, 3)), np.tile([1.0, 0.0, 0.0, 0.0], (2, 1, 1))),
        "write_table": (folder / "u.csv", TABLE),
    }
    fixed |= {f"fit_{shape}": (POINTS,) for shape in SHAPES}
    found: dict[str, Callable[[], Call]] = {
        name: lambda name=name, arguments=arguments: Call(getattr(mw, name), arguments)
        for name, arguments in fixed.items()
    }
    found["ImplicitSurface"] = lambda: Call(mw.ImplicitSurface, (_ball, 1.0))
    found["ParametricSurface"] = lambda: Call(mw.ParametricSurface, (_bowl, (-1.0, 1.0), (-1.0, 1.0)))
    found["install"] = lambda: Call(mw.install, (spec(),))
    found["set_laws"] = lambda: Call(mw.set_laws, (spec(), {"BRA": LAW}))
    found["set_length_ranges"] = lambda: Call(mw.set_length_ranges, (spec(),))
    found["simulate_muscle"] = lambda: Call(_simulate, (LAW, TIME, 0.3 + 0.0 * TIME, 0.5))
    methods: dict[str, tuple[Any, ...]] = {
        "forward": (data,), "apply": (data,), "step": (data,), "reset": (data,), "length_jacobian": (data,),
        "length_jacobian_rate": (data,), "points": (0,), "forces": (0,), "contact_points": (0,), "reason": (0,),
        "unmet_hints": (0,), "index": ("BRA",), "branch": (data,), "poses": (data,), "polylines": (),
        "energetics": (), "set_branch": (data, muscles.branch(data)), "moment_arms": (data,),
        "__getitem__": ("BRA",),
    }  # fmt: skip
    for name, arguments in methods.items():
        found[f"MuscleSystem.{name}"] = lambda n=name, a=arguments: Call(getattr(muscles, n), a)
    ways: dict[str, tuple[Any, ...]] = {
        "points": (0.01,), "speed": ((0, 0, 0), (0, 0, 0), np.zeros((1, 6))), "wrenches": (1.0,),
        "stiffness_times": (np.zeros(18),),
        "contact_velocities": ((0, 0, 0), (0, 0, 0)),
    }  # fmt: skip
    for name, arguments in ways.items():
        found[f"PathSolution.{name}"] = lambda n=name, a=arguments: Call(getattr(path, n), a)
    found["Motion.from_table"] = lambda: Call(mw.Motion.from_table, (model, flexion))
    found["Motion.low_pass"] = lambda: Call(
        mw.Motion(np.arange(90.0), np.zeros((90, 1))).low_pass, (model, 0.1)
    )
    found["Motion.completed"] = lambda: Call(motion.completed, (model,))
    found["ExternalLoads.from_osim"] = lambda: Call(mw.ExternalLoads.from_osim, ("absent.xml",))
    found["plugin.native"] = lambda: Call(plugin.native, (mw.load(ELBOW),))
    found["plugin.read"] = lambda: Call(plugin.read, (mujoco.MjData(mw.load(ELBOW)),))
    return found


def _ball(x: float, y: float, z: float) -> float:
    return x * x + y * y + z * z - 0.25


def _bowl(u: float, v: float) -> tuple[float, float, float]:
    return u, v, u * u + v * v


def _simulate(law: Any, time: Any, length: Any, excitation: Any, **rest: Any) -> Any:
    return mw.simulate_muscle(law, time, length, excitation=excitation, **rest)


_simulate.__signature__ = inspect.Signature([  # type: ignore[attr-defined]
    p.replace(kind=p.POSITIONAL_OR_KEYWORD)
    for p in inspect.signature(mw.simulate_muscle).parameters.values()
    if p.name != "activation"
])  # fmt: skip


def legal(name: str, parameter: inspect.Parameter) -> set[str]:
    """Return the names of the values that the annotation of a parameter allows."""
    text = DOCUMENTED.get((name, parameter.name), str(parameter.annotation))
    words = set(re.findall(r"\w+", text))
    return {value for word, found in ALLOWED.items() if word in words for value in found}


def wrong(
    name: str, call: Call, given: dict[str, Any]
) -> Iterator[tuple[str, str, tuple[Any, ...], dict[str, Any]]]:
    """Yield parameter, name of the value, and the arguments, of every call with one argument replaced."""
    for i, parameter in enumerate(inspect.signature(call.function).parameters.values()):
        if parameter.kind in (parameter.VAR_KEYWORD, parameter.VAR_POSITIONAL):
            continue
        for kind, value in given.items():
            arguments = list(call.arguments)
            named: dict[str, Any] = {}
            if i < len(arguments):
                arguments[i] = value
            else:
                named[parameter.name] = value
            yield parameter.name, kind, tuple(arguments), named


# with legal values, which other tests give
EXPENSIVE = {"ImplicitSurface", "ParametricSurface", "implausible", "length_ranges", "set_length_ranges"}
EXPENSIVE |= {f"fit_{shape}" for shape in SHAPES}
RESULTS = {  # that functions return; nobody makes them
    "Contact", "Energetics", "FiberFit", "Finding", "Fit", "HillFit", "Implausible", "Imported", "JointCurves",
    "LengthRange", "MuscleAnalysis", "MuscleTrial", "ParameterReport", "PathSolution", "StaticOptimization", "Status",
    "SweepSolution",
}  # fmt: skip


def test_every_public_name_is_called_here(values: dict[str, Any], tmp_path: Path) -> None:
    public = {name: getattr(mw, name) for name in mw.__all__ if callable(getattr(mw, name))}
    errors = {n for n, each in public.items() if isinstance(each, type) and issubclass(each, mw.MjwrapError)}
    assert set(public) - errors - RESULTS - {"register"} <= set(calls(values, tmp_path))


@pytest.mark.filterwarnings("ignore")  # of films and recordings that are not closed, as most fail
def test_a_wrong_type_is_named(
    values: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    bad: list[str] = []
    count = 0
    for name, make in calls(values, tmp_path).items():
        signature = inspect.signature(make().function)
        for parameter, kind, arguments, named in wrong(name, make(), values):
            allowed = kind in legal(name, signature.parameters[parameter])
            if allowed and name in EXPENSIVE:
                continue
            fresh = make()
            if not (arguments and arguments[0] is values.get(kind)):
                arguments = (*fresh.arguments[:1], *arguments[1:])  # not changed by an earlier call
            count += 1
            case = f"{name}({parameter}={kind})"
            try:
                made = fresh.function(*arguments, **named)
            except mw.MjwrapError as error:
                if not allowed and not re.search(rf"\b{parameter.replace('_', '[_ ]')}\b", str(error)):
                    bad.append(f"{case} does not name it: {error}")
            except Exception as error:
                bad.append(f"{case} raises {type(error).__name__}: {error}")
            else:
                if not allowed:
                    bad.append(f"{case} is accepted")
                if isinstance(made, mw.Recorder):  # one without a sample is complete, a film is not
                    made.close()
    assert count > 1000
    assert not bad, "\n".join(bad)


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (lambda v: mw.MuscleSystem(ELBOW), r"model: expected an MjModel, not 'models|from_xml_path"),
        (lambda v: mw.MuscleSystem(v["MjSpec"]), r"not an MjSpec; compile it: spec\.compile\(\)"),
        (lambda v: mw.MuscleSystem(v["MjData"]), "not an MjData; give the model of this data"),
        (lambda v: mw.install(v["MjModel"]), "not an MjModel; a compiled model cannot be changed"),
        (lambda v: mw.install(ELBOW), r"mw\.load\(path\)"),
        (lambda v: mw.load(v["MjModel"]), r"not an MjModel; .*mw\.MuscleSystem\(model\)"),
        (lambda v: mw.load(v["MjSpec"]), r"not an MjSpec; a spec goes to mw\.install\(spec\)"),
        (
            lambda v: mw.load("<mujoco>\n</mujoco>"),
            r"not the text of a model: write mw\.install\(mujoco\.MjSpec",
        ),
        (lambda v: mw.load(""), "path must be the name of a file, or mjwrap:NAME or myo_sim:NAME, .*not ''"),
        (lambda v: mw.load(None), "path must be the name of a file, or mjwrap:NAME or myo_sim:NAME"),
        (lambda v: mw.length_ranges(v["MjModel"]), r"make one: mw\.MuscleSystem\(model\)"),
        (lambda v: v["MuscleSystem"].forward(v["MjModel"]), r"mujoco\.MjData\(model\)"),
        (lambda v: mw.solve_path(*ENDS, BALL), r"obstacles must be a list of Obstacle"),
        (lambda v: mw.solve_path(*ENDS, [mw.Sphere(0.1)]), r"obstacles\[0\] must be an Obstacle"),
    ],
)
def test_the_message_says_what_to_do(
    call: Callable[[dict[str, Any]], object], told: str, values: dict[str, Any]
) -> None:
    with pytest.raises(mw.MjwrapError, match=told):
        call(values)
