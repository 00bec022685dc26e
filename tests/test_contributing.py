"""CONTRIBUTING.md names every room of the package and of the benchmarks, and files that exist."""

import re
import tomllib
from pathlib import Path

from doc_commands import FENCE, ROOT

TEXT = (ROOT / "CONTRIBUTING.md").read_text()


ROOMS_OF = (
    "mjwrap", "mjwrap/cli", "mjwrap/inverse", "mjwrap/kernels", "mjwrap/plugin", "mjwrap/surfaces", "benchmarks",
)  # fmt: skip


def rooms_named() -> dict[str, str]:
    """Return what the tree of CONTRIBUTING.md says of each folder, by its path from the root."""
    tree = next(
        x["body"] for x in FENCE.finditer(TEXT) if x["language"] == "text" and x["body"].startswith("mjwrap/")
    )
    found: dict[str, str] = {}
    above: list[str] = []
    for line in tree.splitlines():
        name, _, says = line.strip().partition("/")
        above[(len(line) - len(line.lstrip())) // 2 :] = [name]
        found["/".join(above)] = says.strip()
    return found


def folders(above: str) -> list[str]:
    """Return the folders right below one that hold Python files."""
    below = sorted(path for path in (ROOT / above).iterdir() if path.is_dir() and any(path.glob("*.py")))
    return [str(path.relative_to(ROOT)) for path in below]


def test_every_room_has_a_line_and_no_line_is_left_over() -> None:
    rooms = [room for above in ROOMS_OF for room in folders(above)]
    assert sorted(rooms_named()) == sorted(["mjwrap", "benchmarks", *rooms])


def test_every_line_says_what_the_room_holds() -> None:
    assert [room for room, says in rooms_named().items() if len(says) < 10] == []


def test_the_order_of_imports_is_that_of_the_contracts() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    layers = {each["name"]: each.get("layers") for each in project["tool"]["importlinter"]["contracts"]}
    blocks = [x["body"].splitlines() for x in FENCE.finditer(TEXT) if x["language"] == "text"]
    assert layers["Rooms"] in [[line.strip() for line in block] for block in blocks]
    told = re.search(r"Inside `kernels/` the order is (.*?)\. Contracts", TEXT, re.DOTALL)
    assert told is not None
    assert re.findall(r"`(.*?)`", told[1]) == layers["Rooms of the kernels"]


def test_files_that_are_named_exist() -> None:
    named = set(re.findall(r"`((?:mjwrap|benchmarks|tests|docs)/[\w/.]+)`", TEXT))
    assert len(named) > 20
    assert sorted(name for name in named if not Path(ROOT / name).exists()) == []


def test_one_version_is_stated_in_two_places() -> None:
    project = re.search(r'^version = "(.*)"$', (ROOT / "pyproject.toml").read_text(), re.MULTILINE)
    package = re.search(r'^__version__ = "(.*)"$', (ROOT / "mjwrap/__init__.py").read_text(), re.MULTILINE)
    assert project is not None
    assert package is not None
    assert project[1] == package[1]
