"""The sources on which the machine code of a module depends: all that it reaches by imports within this package.

Imports are found in the text by regular expressions, because parsing all sources would take longer than loading the
machine code. In doubt a source counts: a package that is imported as a whole counts with everything in it.
"""

from __future__ import annotations

import hashlib
import os
import re
import time
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

PACKAGE = "mjwrap"
_ROOT = Path(__file__).parents[2]
_ROOM = "mjwrap.kernels.compilation."
_ALWAYS_COUNTED = (f"{_ROOM}jit", f"{_ROOM}linking")  # decide how every kernel is compiled
# These decide only where machine code is kept, or something that is part of every key (`circumstances`) anyway.
_NEVER_COUNTED = {
    f"{_ROOM}{name}"
    for name in (
        "cache_folders",
        "cache_locator",
        "folder_owners",
        "import_closure",
        "module_caches",
        "probe",
        "self_test",
    )
}
_STARTED = time.time()

# what stands before the word `import` in its line
_BEFORE_IMPORT = re.compile(r"(?:^|[;:])[ \t\f]*(?:from\b[ \t]*([.\w \t]+?)[ \t]*)?$")
_AFTER_IMPORT = re.compile(r"(?!\w)[ \t]*(\((?:[^)#]|#[^\n]*)*\)|[^\n;#]*)")


class Source(NamedTuple):
    """One file: a hash of its bytes, whether it is unchanged since this process began, and what it imports."""

    digest: bytes
    unchanged: bool
    imports: tuple[str, ...]


def key(module: str, *circumstances: object) -> str | None:
    """Return 16 hexadecimal digits that change with the circumstances and with all sources that a module reaches.

    None where a source was changed since this process began: the module in memory may then be older than the file.
    """
    sources = reached(module)
    if module not in sources or not all(source.unchanged for source in sources.values()):
        return None
    digest = hashlib.sha256(repr(circumstances).encode())
    for name in sorted(sources):
        digest.update(name.encode() + b"\0" + sources[name].digest)
    return digest.hexdigest()[:16]


def reached(module: str) -> dict[str, Source]:
    """Return the sources that count for a module, by name: the module, its imports, their imports, and so on.

    The `__init__.py` of each package on the way counts too, without its own imports. That of mjwrap itself does not: it
    is only a list of names.
    """
    found: dict[str, Source] = {}
    todo = [module, *_ALWAYS_COUNTED]
    while todo:
        name = todo.pop()
        if name not in found and name not in _NEVER_COUNTED and (source := read(name)):
            found[name] = source
            todo += source.imports
    for name in list(found):
        for package in _packages_of(name):
            if package != PACKAGE and (source := read(package)):
                found.setdefault(package, source)
    return found


@cache
def read(module: str) -> Source | None:
    """Return the source of a module, as it was when first asked for; None where there is no such file."""
    path = _file(module)
    if path is None:
        return None
    with open(path, "rb") as file:
        content, changed = file.read(), os.fstat(file.fileno()).st_mtime
    text = content.decode("utf-8", "replace").replace("\r\n", "\n").replace("\r", "\n").replace("\\\n", " ")
    package = module if path.endswith("__init__.py") else module.rpartition(".")[0]
    # a date in the future comes from a wrong clock, not from an edit
    unchanged = not _STARTED < changed <= time.time()
    return Source(hashlib.sha256(content).digest(), unchanged, tuple(dict.fromkeys(_imports(text, package))))


def forget() -> None:
    """Forget all sources that were read; called when a module has been loaded again."""
    read.cache_clear()
    _file.cache_clear()


@cache
def _file(module: str) -> str | None:
    """Return the file of a module of this package, None where there is none."""
    first, *parts = module.split(".")
    path = os.path.join(_ROOT, *parts)
    if first == PACKAGE:
        for file in (os.path.join(path, "__init__.py"), f"{path}.py"):
            if os.path.isfile(file):
                return file
    return None


def _packages_of(module: str) -> Iterator[str]:
    while "." in module:
        module = module.rpartition(".")[0]
        yield module


def _imports(text: str, package: str) -> Iterator[str]:
    """Yield the names of the modules of mjwrap that a text imports; package: the one to which the text belongs."""
    at = text.find("import")
    while at >= 0:
        before = _BEFORE_IMPORT.search(text[text.rfind("\n", 0, at) + 1 : at])
        after = _AFTER_IMPORT.match(text, at + len("import"))
        if before and after:
            yield from _imported(before.group(1), after.group(1), package)
        at = text.find("import", at + len("import"))


def _imported(origin: str | None, listed: str, package: str) -> Iterator[str]:
    """Yield what one import reaches: `from origin import listed`, or `import listed`."""
    if origin is None and PACKAGE in listed:
        for name, renamed in _names(listed):
            if name.split(".")[0] == PACKAGE:
                yield from _reached_by_name(name if renamed else PACKAGE)
    elif origin:
        origin = _absolute("".join(origin.split()), package)
        if origin.split(".")[0] == PACKAGE:
            yield from _reached_by_from(origin, [name for name, _ in _names(listed)])


def _names(text: str) -> Iterator[tuple[str, bool]]:
    """Yield the names that an import lists, and whether each is renamed by `as`."""
    if text.startswith("("):
        text = re.sub(r"#[^\n]*|[()]", " ", text)
    for part in text.split(","):
        words = part.split()
        if words:
            yield "".join(words[: words.index("as")] if "as" in words else words), "as" in words


def _absolute(origin: str, package: str) -> str:
    """Return a module's full name; n leading dots stand for the package n - 1 levels above the given one."""
    name = origin.lstrip(".")
    level = len(origin) - len(name)
    if not level:
        return name
    above = package.split(".")[: len(package.split(".")) - level + 1]
    return ".".join([*above, name] if name else above)


def _reached_by_from(origin: str, names: list[str]) -> Iterator[str]:
    """Yield what `from origin import names` reaches."""
    path = _file(origin)
    if path is None or not path.endswith("__init__.py"):
        yield origin
        return
    for name in names:
        if name == "*":
            yield from _reached_by_name(origin)
        elif _file(f"{origin}.{name}"):
            yield from _reached_by_name(f"{origin}.{name}")
        else:
            yield origin


def _reached_by_name(module: str) -> Iterator[str]:
    """Yield what can be reached by a module's name: for a package, everything in it."""
    path = _file(module)
    yield module
    if path and path.endswith("__init__.py"):
        folder = Path(path).parent
        for file in sorted(folder.rglob("*.py")):
            parts = file.relative_to(folder).with_suffix("").parts
            yield ".".join([module, *(part for part in parts if part != "__init__")])
