"""The names that other people's scripts rely on exist, with these signatures, and importing them is cheap."""

import ast
import enum
import inspect
import json
import subprocess
import sys
import time
from pathlib import Path

import pytest

import mjwrap as mw

# Each signature as a script relies on it: parameters in order, "*" before those given by name, "=" after those that
# have a default. A function may have further ones that nobody has to give.
SIGNATURES = {
    "Cylinder": "radius",
    "Sphere": "radius",
    "Obstacle": "surface, pos=, quat=, hint=",
    "ViaPoint": "pos",
    "solve_path": "origin, insertion, obstacles, *, method=, start=, tol=",
    "solve_sweep": "origin, insertion, obstacles, pos, quat, *, warm=",
    "MuscleSystem": "model, *, strict=",
    "Recorder": "model, muscles, path",
    "Motion": "time, qpos, qvel=, qacc=",
    "Motion.from_table": "model, table",
    "muscle_analysis": "muscles, motion",
    "inverse_dynamics": "model, motion, loads=",
    "joint_reactions": "muscles, motion, tension, *, on=, frame=, loads=",
    "PathSolution.points": "self, spacing",
    "PathSolution.speed": "self, origin_velocity, insertion_velocity, twists",
    "PathSolution.wrenches": "self, tension",
    "MuscleSystem.forward": "self, data",
    "MuscleSystem.apply": "self, data",
    "MuscleSystem.step": "self, data, nstep=",
    "MuscleSystem.length_jacobian": "self, data",
    "MuscleSystem.reset": "self, data",
    "MuscleSystem.points": "self, i",
    "Recorder.log": "self, data",
    "Recorder.close": "self",
}
PACKAGE = Path(mw.__file__).parent
ROOT = Path(__file__).resolve().parent.parent
HEAVY = {"rerun", "matplotlib", "tqdm"}
ERRORS = ["GeometryError", "ModelError", "PathError", "RecordingError", "StateError"]


def find(name: str) -> object:
    found: object = mw
    for part in name.split("."):
        found = getattr(found, part)
    return found


def check_signature(function: object, written: str) -> None:
    """Assert that a script that calls `function` as `written` says goes on working; further options are allowed."""
    assert callable(function)
    signature = inspect.signature(function)
    parameters = list(signature.parameters.values())
    positional = [p for p in parameters if p.kind is p.POSITIONAL_OR_KEYWORD]
    rest_by_name = False
    for place, word in enumerate(part.strip() for part in written.split(",")):
        if word == "*":
            rest_by_name = True
            continue
        name, has_default = word.removesuffix("="), word.endswith("=")
        if rest_by_name:
            assert name in signature.parameters, f"{name} is missing in {signature}"
            assert signature.parameters[name].kind is inspect.Parameter.KEYWORD_ONLY, f"{name} in {signature}"
        else:
            assert place < len(positional), f"no place for {name} in {signature}"
            assert positional[place].name == name, f"{name} is not number {place} in {signature}"
        if has_default:
            assert signature.parameters[name].default is not inspect.Parameter.empty, f"{name} in {signature}"
    given = {word.strip() for word in written.split(",")}
    needed = {
        p.name for p in parameters if p.default is p.empty and p.kind not in (p.VAR_KEYWORD, p.VAR_POSITIONAL)
    }
    assert needed <= given, f"{signature} asks for more than {written}"


@pytest.mark.parametrize("name", SIGNATURES)
def test_signatures(name: str) -> None:
    check_signature(find(name), SIGNATURES[name])


def test_every_public_name_is_listed_and_exists() -> None:
    public = (
        {name.split(".")[0] for name in SIGNATURES} | set(ERRORS) | {"MjwrapError", "Status", "PathSolution"}
    )
    assert public <= set(mw.__all__)
    assert set(mw.__all__) <= set(dir(mw))
    for name in mw.__all__:
        assert getattr(mw, name) is not None


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match=r"has no attribute .Cilinder.; it has: .*Cylinder.*write_table"):
        _ = mw.Cilinder  # pyright: ignore[reportAttributeAccessIssue]


@pytest.mark.parametrize("name", ERRORS)
def test_errors_have_one_root(name: str) -> None:
    assert issubclass(getattr(mw, name), mw.MjwrapError)


def test_public_names_have_docstrings() -> None:
    names = [*SIGNATURES, *ERRORS, "MjwrapError", "Status", "PathSolution"]
    assert [name for name in names if not inspect.getdoc(find(name))] == []


def without_sections(name: str) -> list[str]:
    """Return what is missing in the docstring of a public name that takes more than two arguments."""
    found = getattr(mw, name)
    if not callable(found) or (inspect.isclass(found) and issubclass(found, Exception | enum.Enum)):
        return []
    arguments = list(inspect.signature(found).parameters)
    text = inspect.getdoc(found) or ""
    if len(arguments) <= 2:
        return []
    if inspect.isclass(found):  # of a result, its attributes
        said = "Args:" in text or "Attributes:" in text
        return [] if said else [f"{name}: Args or Attributes"]
    missing = [f"{name}: {section}" for section in ("Args:", "Returns:") if section not in text]
    if found is not mw.set_laws:  # it changes its argument
        return missing
    return [x for x in missing if "Returns" not in x]


def test_public_functions_with_several_arguments_describe_each() -> None:
    assert [missing for name in mw.__all__ for missing in without_sections(name)] == []
    for name in (
        "solve_path",
        "solve_sweep",
        "install",
        "length_ranges",
        "simulate_muscle",
        "Obstacle",
        "Recorder",
    ):
        text = inspect.getdoc(getattr(mw, name)) or ""
        arguments = inspect.signature(getattr(mw, name)).parameters
        assert [x for x in arguments if f"    {x}: " not in text and f"    **{x}: " not in text] == [], name


def loaded_by(code: str) -> set[str]:
    """Return the modules that a fresh interpreter has loaded after `code`."""
    program = f"{code}\nimport sys, json; print(json.dumps(list(sys.modules)))"
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, cwd=ROOT
    )
    return set(json.loads(done.stdout.splitlines()[-1]))


@pytest.fixture(scope="module")
def loaded_by_numba() -> set[str]:
    """What numba loads to compile anything at all: scipy's BLAS, for one."""
    return loaded_by("import numba; numba.njit(lambda x: x + 1)(1.0)")


def test_importing_loads_nothing_that_is_not_needed() -> None:
    assert loaded_by("import mjwrap") & {*HEAVY, "scipy", "mujoco", "numba"} == set()


def test_a_path_loads_nothing_that_is_not_needed(loaded_by_numba: set[str]) -> None:
    scene = "[mw.Obstacle(mw.Sphere(.03), pos=(0, .01, 0))]"
    loaded = loaded_by(
        f"import mjwrap as mw; assert mw.solve_path((.1, 0, 0), (-.1, 0, 0), {scene}).converged"
    )
    assert loaded & {*HEAVY, "mujoco"} == set()
    assert {name for name in loaded - loaded_by_numba if name.startswith("scipy")} == set()


def test_a_simulation_loads_nothing_that_is_not_needed(loaded_by_numba: set[str]) -> None:
    code = """
import mujoco, mjwrap as mw
model = mujoco.MjModel.from_xml_path("models/elbow/elbow.xml")
data = mujoco.MjData(model)
mw.MuscleSystem(model).step(data)
"""
    loaded = loaded_by(code)
    assert loaded & HEAVY == set()
    assert {name for name in loaded - loaded_by_numba if name.startswith("scipy")} == set()


def test_import_time_is_reported(capsys: pytest.CaptureFixture[str]) -> None:
    """Wall time depends on the machine, so it is printed, not judged."""

    def seconds(code: str) -> float:
        started = time.perf_counter()
        subprocess.run([sys.executable, "-c", code], check=True)
        return time.perf_counter() - started

    mujoco = seconds("import mujoco")
    both = seconds("import mujoco, mjwrap; mjwrap.MuscleSystem")
    with capsys.disabled():
        print(f"\nimport mujoco {mujoco:.2f} s; mjwrap on top of it {both - mujoco:.2f} s")


def is_typed(function: ast.FunctionDef | ast.AsyncFunctionDef) -> bool:
    arguments = [*function.args.posonlyargs, *function.args.args, *function.args.kwonlyargs]
    return function.returns is not None and all(a.annotation or a.arg in ("self", "cls") for a in arguments)


def test_the_package_is_typed() -> None:
    """Every function of the package says what it takes and returns, kernels excepted: numba reads those itself."""
    bare = [
        f"{file.name}:{node.lineno} {node.name}"
        for file in sorted(PACKAGE.rglob("*.py"))
        if not {"kernels", "callbacks", "templates"} & set(file.parts)
        for node in ast.walk(ast.parse(file.read_text()))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and not is_typed(node)
    ]
    assert bare == []
