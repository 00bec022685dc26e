"""Machine code counts as current as long as the sources are that its module reaches by imports, whatever their form."""

from __future__ import annotations

import ast
import json
import os
import subprocess
import sys
import textwrap
from collections.abc import Iterator
from pathlib import Path

import numba
import pytest
from fresh_starts import PACKAGE, copy_of_the_package, kernel_file, run

from mjwrap.kernels.compilation import import_closure, module_caches, self_test

CIRCUMSTANCES = ("numba", "python")


def name_of(file: Path, package: Path) -> str:
    parts = file.relative_to(package.parent).with_suffix("").parts
    return ".".join(part for part in parts if part != "__init__")


def file_of(name: str, package: Path) -> Path:
    path = package.parent.joinpath(*name.split("."))
    return path / "__init__.py" if path.is_dir() else path.with_suffix(".py")


MODULES = sorted(name_of(file, PACKAGE) for file in PACKAGE.rglob("*.py"))
KERNELS = [
    name
    for name in MODULES
    if name.startswith("mjwrap.kernels.") and not name.startswith("mjwrap.kernels.compilation")
]


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A copy of the package that may be edited, and is what keys are made of."""
    copy = copy_of_the_package(tmp_path)
    monkeypatch.setattr(import_closure, "_ROOT", copy)
    monkeypatch.setattr(
        import_closure, "_STARTED", float("inf")
    )  # edits of this process count like any other's
    import_closure.forget()
    yield copy
    monkeypatch.undo()
    import_closure.forget()


def keys() -> dict[str, str | None]:
    import_closure.forget()
    return {name: import_closure.key(name, *CIRCUMSTANCES) for name in KERNELS}


# --------------------------------------------------------------------------------- which sources count


@pytest.mark.parametrize("name", KERNELS)
def test_an_edit_counts_for_those_that_reach_it_and_no_others(name: str, package: Path) -> None:
    before = keys()
    reaching = {kernel for kernel in KERNELS if name in import_closure.reached(kernel)}
    assert name in reaching
    with file_of(name, package).open("a") as file:
        file.write("# a remark\n")
    after = keys()
    assert {kernel for kernel in KERNELS if after[kernel] != before[kernel]} == reaching


@pytest.mark.parametrize("name", ["jit", "linking"])
def test_how_kernels_are_compiled_counts_for_all(name: str, package: Path) -> None:
    before = keys()
    with kernel_file(package, name).open("a") as file:
        file.write("# a remark\n")
    after = keys()
    assert all(after[kernel] != before[kernel] for kernel in KERNELS)


@pytest.mark.parametrize(
    "file",
    [
        "kernels/compilation/cache_folders.py",
        "kernels/compilation/folder_owners.py",
        "text.py",
        "__init__.py",
    ],
)
def test_what_no_machine_code_depends_on_counts_for_none(file: str, package: Path) -> None:
    before = keys()
    with (package / file).open("a") as opened:
        opened.write("# a remark\n")
    assert keys() == before


def test_a_path_reaches_no_energetics() -> None:
    (chain,) = (name for name in KERNELS if name.endswith(".chain"))
    reached = {name.rpartition(".")[2] for name in import_closure.reached(chain)}
    assert {"newton", "geodesics", "layout"} < reached
    assert not {"umberger", "power", "millard"} & reached


def test_what_else_starts_a_new_cache(monkeypatch: pytest.MonkeyPatch) -> None:
    """Another numba, another Python, checked bounds, plain functions; and each of them another one."""
    monkeypatch.delenv("NUMBA_BOUNDSCHECK", raising=False)
    name = KERNELS[0]
    found = [import_closure.key(name, *module_caches.circumstances())]
    with monkeypatch.context() as changed:
        changed.setenv("NUMBA_BOUNDSCHECK", "1")
        found.append(import_closure.key(name, *module_caches.circumstances()))
    with monkeypatch.context() as changed:
        changed.setattr(numba, "__version__", "99.0")
        found.append(import_closure.key(name, *module_caches.circumstances()))
    with monkeypatch.context() as changed:
        changed.setattr(sys, "version_info", (4, 0, 0, "final", 0))
        found.append(import_closure.key(name, *module_caches.circumstances()))
    with monkeypatch.context() as changed:
        changed.setattr(self_test, "is_plain", lambda: True)
        found.append(import_closure.key(name, *module_caches.circumstances()))
    assert None not in found
    assert len(set(found)) == len(found)


# ------------------------------------------------------------------------------------ forms of imports


def imported(tree: ast.AST, package: str) -> Iterator[str]:
    """Yield the modules that a parsed text imports, found in another way than the one that is tested."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = package.split(".")[: len(package.split(".")) - node.level + 1] if node.level else []
            origin = ".".join([*above, *([node.module] if node.module else [])])
            for alias in node.names:
                yield f"{origin}.{alias.name}" if f"{origin}.{alias.name}" in MODULES else origin


@pytest.mark.parametrize("name", MODULES)
def test_no_import_is_overlooked(name: str) -> None:
    source = import_closure.read(name)
    assert source is not None
    path = PACKAGE.joinpath(*name.split(".")[1:])
    is_package = path.is_dir()
    text = (path / "__init__.py" if is_package else path.with_suffix(".py")).read_text(encoding="utf-8")
    expected = set(imported(ast.parse(text), name if is_package else name.rpartition(".")[0]))
    assert expected & set(MODULES) <= set(source.imports)


FORMS = {
    "from {p}.near import value": "near",
    "from {p} import near": "near",
    "from {p} import near as other, far": "near far",
    "import {p}.near as other": "near",
    "from . import near": "near",
    "from .near import value": "near",
    "from .  near import value": "near",
    "from ...kernels.sandbox.near import value": "near",
    "from {p} import (\n    far,  # ) and near too\n    near,\n)": "near far",
    "from {p}.near import (value)": "near",
    "from {p}.near import(value)": "near",
    "from {p}.near import *": "near",
    "from {p} \\\n    import near": "near",
    "from {p} import far, \\\n    near": "near far",
    "import math; from {p} import near": "near",
    "def f():\n    from {p}.near import value\n    return value": "near",
    "try: from {p} import near\nexcept ImportError: pass": "near",
    "if True:\n\timport {p}.near as other": "near",
    "import math, {p}.near as other": "near",
    "from {p} import below": "below below.leaf",
    "from {p} import *": "near far below below.leaf through through.inner",
    "from {p}.below.leaf import value": "below.leaf",
    "from {p}.below import leaf": "below.leaf",
    "from {p}.through import value": "through through.inner",
    "import math": "",
    "x = 'from {p} or import near'": "",
}


@pytest.mark.parametrize("line", FORMS)
@pytest.mark.parametrize("ends", ["\n", "\r\n"])
def test_forms_of_imports(line: str, ends: str, package: Path) -> None:
    sandbox = package / "kernels" / "sandbox"
    for name in ("near", "far", "below/leaf", "through/inner"):
        file = sandbox / f"{name}.py"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text("value = 1.0\n")
    (sandbox / "below" / "__init__.py").touch()
    (sandbox / "through" / "__init__.py").write_text("from .inner import value\n")
    (sandbox / "__init__.py").touch()
    text = line.format(p="mjwrap.kernels.sandbox") + "\n"
    (sandbox / "top.py").write_bytes(text.replace("\n", ends).encode())
    compile(text, "top.py", "exec")
    import_closure.forget()
    prefix = "mjwrap.kernels.sandbox."
    found = {
        name.removeprefix(prefix)
        for name in import_closure.reached(f"{prefix}top")
        if name.startswith(prefix)
    }
    on_the_way = {name.rpartition(".")[0] for name in found} - {""}
    assert found - {"top"} - on_the_way == set(FORMS[line].split()) - on_the_way
    assert set(FORMS[line].split()) <= found


# ---------------------------------------------------------------------------------- in running programs

LEAF = "from mjwrap.kernels.compilation.jit import jit\n\n\n@jit\ndef leaf(x):\n    return x + 1.0\n"
MIDDLE = """
from mjwrap.kernels.compilation.jit import jit
from .. import constants as con
from ..below.leaf import (
    leaf,  # the deepest
)


@jit
def middle(x):
    return con.TWO * leaf(x)
"""
TOP = """
from mjwrap.kernels.compilation.jit import no_inline
from mjwrap.kernels.sandbox.between import middle as mid


@no_inline
def top(x):
    return mid.middle(x)
"""
CALL = """
import json
from mjwrap.kernels.compilation import cache_folders
from mjwrap.kernels.sandbox import top
print(json.dumps({"numbers": [top.top(1.0)], "folder": str(cache_folders.base())}))
"""


def write_sandbox(package: Path) -> Path:
    """Write kernels in sub-folders that call each other, and return their folder."""
    sandbox = package / "kernels" / "sandbox"
    for name, text in {
        "top": TOP, "between/middle": MIDDLE, "below/leaf": LEAF, "constants": "TWO = 2.0\n",
        "__init__": "", "between/__init__": "", "below/__init__": "",
    }.items():  # fmt: skip
        file = sandbox / f"{name}.py"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    return sandbox


def test_an_edit_in_a_sub_folder_is_noticed_by_all_that_reach_it(tmp_path: Path) -> None:
    package, home = copy_of_the_package(tmp_path), tmp_path / "cache"
    sandbox = write_sandbox(package)
    assert run(CALL, home, package).numbers == [4.0]
    assert run(CALL, home, package).told == []
    leaf, constants = sandbox / "below" / "leaf.py", sandbox / "constants.py"
    stamps = leaf.stat()
    leaf.write_text(LEAF.replace("1.0", "3.0"))
    os.utime(leaf, ns=(stamps.st_atime_ns, stamps.st_mtime_ns))  # the same date and size: contents count
    assert run(CALL, home, package).numbers == [8.0]
    constants.write_text("TWO = 5.0\n")
    assert run(CALL, home, package).numbers == [20.0]
    kept = {path.name for path in (home / "mjwrap").iterdir()}
    (sandbox / "between" / "__init__.py").write_text("# on the way to middle\n")
    assert run(CALL, home, package).numbers == [20.0]
    new = {path.name.rpartition("-")[0] for path in (home / "mjwrap").iterdir() if path.name not in kept}
    assert new == {"mjwrap.kernels.sandbox.between.middle", "mjwrap.kernels.sandbox.top"}
    leaf.write_text(LEAF)
    constants.write_text("TWO = 2.0\n")
    (sandbox / "between" / "__init__.py").write_text("")
    again = run(CALL, home, package)
    assert (again.numbers, again.told) == ([4.0], [])


WHILE_RUNNING = """
import importlib, json, pathlib, time
from mjwrap.kernels.compilation import cache_folders
from mjwrap.kernels.sandbox import constants
from mjwrap.kernels.sandbox.below import leaf
numbers = [leaf.leaf(1.0)]
time.sleep(0.05)
for module, before, after in ((leaf, "1.0", "3.0"), (constants, "2.0", "5.0")):
    file = pathlib.Path(module.__file__)
    file.write_text(file.read_text().replace(before, after))
from mjwrap.kernels.sandbox import top  # compiled of what was loaded before the edit
numbers.append(top.top(1.0))
for module in (constants, leaf, top.mid, top):
    importlib.reload(module)
numbers.append(top.top(1.0))
print(json.dumps({"numbers": numbers, "folder": str(cache_folders.base())}))
"""


def test_an_edit_while_a_program_runs_leaves_nothing_wrong_behind(tmp_path: Path) -> None:
    """Its memory holds the old text or the new one: what it compiles then is not kept for others."""
    package, home = copy_of_the_package(tmp_path), tmp_path / "cache"
    write_sandbox(package)
    found = run(WHILE_RUNNING, home, package)
    assert found.numbers[:2] == [2.0, 4.0]
    assert found.numbers[2] == 20.0  # loaded again, it is the new one
    assert {path.name.rpartition("-")[0] for path in (home / "mjwrap").iterdir()} == {
        "mjwrap.kernels.sandbox.below.leaf"
    }
    assert not list(tmp_path.glob("mjwrap-*"))  # nor anywhere else
    assert run(CALL, home, package).numbers == [20.0]


LOCATORS = """
import json, numba
from mjwrap.kernels.compilation import cache_folders
from mjwrap.kernels.sandbox import top
print(json.dumps({"numbers": [top.top(1.0)], "folder": top.top._cache.cache_path}))
"""


def test_a_user_may_choose_locators_of_numba(tmp_path: Path) -> None:
    package, home = copy_of_the_package(tmp_path), tmp_path / "cache"
    write_sandbox(package)
    usual = run(LOCATORS, home, package)
    chosen = run(LOCATORS, home, package, NUMBA_CACHE_LOCATOR_CLASSES="InTreeCacheLocator")
    assert chosen.folder == usual.folder
    assert chosen.told == []


def test_a_numba_without_locators_keeps_it_by_its_setting(tmp_path: Path) -> None:
    package, home = copy_of_the_package(tmp_path), tmp_path / "cache"
    sandbox = write_sandbox(package)
    without = "import numba.core.caching\ndel numba.core.caching._CacheLocator\n"
    first = run(without + LOCATORS, home, package)
    assert first.folder.is_relative_to(home / "mjwrap")
    assert run(without + LOCATORS, home, package).told == []
    (sandbox / "below" / "leaf.py").write_text(LEAF.replace("1.0", "3.0"))
    assert run(without + LOCATORS, home, package).numbers == [8.0]


def test_reading_imports_takes_little_time() -> None:
    """Every start pays for it: about 15 ms of processor time for all kernels."""
    program = textwrap.dedent(
        """
        import json, sys, time
        from mjwrap.kernels.compilation import import_closure
        names = json.loads(sys.argv[1])
        started = time.process_time()
        for name in names:
            import_closure.key(name)
        print(time.process_time() - started)
        """
    )
    done = subprocess.run(
        [sys.executable, "-c", program, json.dumps(KERNELS)],
        capture_output=True, text=True, check=True, cwd=PACKAGE.parent,
    )  # fmt: skip
    assert float(done.stdout) < 0.25  # machines that run tests are busy
