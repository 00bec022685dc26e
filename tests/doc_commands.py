"""The command lines that a reader meets: in the pages' shell fences and inline, and in the help texts."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from mjwrap.cli.main import COMMANDS, HELP, module_of

ROOT = Path(__file__).resolve().parent.parent
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
FENCE = re.compile(
    r"^(?P<mark>```+)(?P<language>\w*)[^\n]*\n(?P<body>.*?)^(?P=mark)[ \t]*$", re.DOTALL | re.MULTILINE
)
_INLINE = re.compile(r"`(?P<body>(?:mjwrap|python3?|pytest|pip|\.venv/\S+) [^`]+)`")


class Line(NamedTuple):
    """A command line, where it stands, and whether in a shell fence or a help text: ready to be typed."""

    text: str
    where: str
    typed: bool


def of_page(page: str, text: str) -> Iterator[Line]:
    """Return a page's command lines, `&&` taken apart."""
    for fence in FENCE.finditer(text):
        if fence["language"] in ("sh", "bash", "shell", "console"):
            yield from _split(fence["body"], page, True)
    for span in _INLINE.finditer(FENCE.sub("", text)):
        yield from _split(" ".join(span["body"].split()), page, False)


def of_help() -> Iterator[Line]:
    """Return the examples of `mjwrap --help` and of every command's."""
    for name, text in {"": HELP, **{name: _documentation(name) for name in COMMANDS}}.items():
        examples = text.partition("\nExamples:\n")[2].partition("\n\n")[0]
        assert examples, f"mjwrap {name} --help has no examples"
        yield from _split(examples, f"mjwrap {name} --help", True)


def _documentation(name: str) -> str:
    return module_of(name).__doc__ or ""


def _split(text: str, where: str, typed: bool) -> Iterator[Line]:
    for line in text.replace("\\\n", " ").splitlines():
        for part in re.sub(r"(^|\s)#.*", "", line).split("&&"):
            if part.strip():
                yield Line(part.strip(), where, typed)
