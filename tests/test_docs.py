"""The code in README.md and docs/ runs, and prints what the page says that it prints.

The python fences of a page run in order and share their names. A fence after a comment `<!-- no-test: reason -->` is
not run. A `text` fence right below a python fence is what that one prints, numbers to 1e-9 relative or 1e-12 absolute:
digits beyond differ between processors.
"""

import contextlib
import io
import math
import re
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).resolve().parent.parent
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]

_FENCE = re.compile(
    r"^(?P<mark>```+)(?P<language>\w*)[^\n]*\n(?P<body>.*?)^(?P=mark)[ \t]*$", re.DOTALL | re.MULTILINE
)
_NO_TEST = re.compile(r"<!-- no-test: *(?P<reason>[^\n]*?) *-->\s*\Z")


class Snippet(NamedTuple):
    """A python fence: its code, the line on which it begins, and what it should print (None: not said)."""

    code: str
    line: int
    printed: str | None


def snippets(text: str) -> list[Snippet]:
    """Return the python fences of a page that are to be run."""
    found: list[Snippet] = []
    last_end = -1
    for fence in _FENCE.finditer(text):
        before, between = text[: fence.start()], text[last_end : fence.start()] if last_end >= 0 else "-"
        last_end = -1
        if fence["language"] == "text" and found and not between.strip():
            found[-1] = found[-1]._replace(printed=fence["body"])
        if fence["language"] != "python":
            continue
        exempt = _NO_TEST.search(before)
        if exempt:
            assert exempt["reason"], "a no-test comment gives its reason"
            continue
        found.append(Snippet(fence["body"], before.count("\n") + 1, None))
        last_end = fence.end()
    return found


def same(expected: str, printed: str) -> bool:
    """Return whether two texts agree word by word, numbers as numbers."""
    words, others = (re.split(r"[\s,\[\]()]+", text.strip()) for text in (expected, printed))
    return len(words) == len(others) and all(map(same_word, words, others))


def same_word(expected: str, printed: str) -> bool:
    try:
        return math.isclose(float(expected), float(printed), rel_tol=1e-9, abs_tol=1e-12)
    except ValueError:
        return expected == printed


def run(page: str, text: str) -> None:
    """Run a page's snippets; an exception points at the line of the page."""
    names: dict[str, object] = {"__name__": "__docs__"}
    for snippet in snippets(text):
        code = compile("\n" * snippet.line + snippet.code, page, "exec")
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(code, names)
        if snippet.printed is not None and not same(snippet.printed, printed.getvalue()):
            pytest.fail(f"{page}:{snippet.line} printed\n{printed.getvalue()}and not\n{snippet.printed}")


@pytest.mark.parametrize(
    "page", [page for page in PAGES if snippets(page.read_text())], ids=lambda page: page.name
)
def test_the_code_of_a_page_runs(page: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    run(str(page), page.read_text())


def test_wrong_output_is_noticed() -> None:
    page = "```python\nprint(1)\n```\n\n```text\n2\n```\n"
    with pytest.raises(pytest.fail.Exception, match="printed"):
        run("page", page)
    with pytest.raises(pytest.fail.Exception, match="printed"):
        run("page", page.replace("2", "1 and more"))
    run("page", page.replace("2", "1.0000000001"))


def test_an_exempt_snippet_needs_a_reason() -> None:
    page = "<!-- no-test: needs a screen -->\n```python\nraise SystemExit\n```\n"
    assert snippets(page) == []
    with pytest.raises(AssertionError, match="reason"):
        snippets(page.replace("needs a screen ", ""))


def test_an_error_names_the_line_of_the_page() -> None:
    with pytest.raises(ZeroDivisionError) as caught:
        run("page", "title\n\n```python\n\n1 / 0\n```\n")
    assert caught.traceback[-1].lineno + 1 == 5
