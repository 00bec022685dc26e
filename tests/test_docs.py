"""The code in README.md, CONTRIBUTING.md and docs/ runs, and prints what the page says that it prints.

The python fences of a page run in order and share their names. A fence after a comment `<!-- no-test: reason -->` is
not run, but read: it compiles and names what exists. A `text` fence right below a python fence is what that one
prints, numbers to 1e-9 relative or 1e-12 absolute: digits beyond differ between processors. An `xml` fence compiles in
the model that it is written for. For command lines there is test_doc_commands.py.
"""

import ast
import contextlib
import io
import math
import re
import warnings
from pathlib import Path
from typing import NamedTuple

import mujoco
import pytest
from doc_commands import FENCE, PAGES, ROOT

import mjwrap as mw
from mjwrap.mjcf import read_declarations

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
    for fence in FENCE.finditer(text):
        before, between = text[: fence.start()], text[last_end : fence.start()] if last_end >= 0 else "-"
        last_end = -1
        if fence["language"] == "text" and found and not between.strip():
            found[-1] = found[-1]._replace(printed=fence["body"])
        if fence["language"] != "python":
            continue
        exempt = _NO_TEST.search(before)
        if exempt:
            assert exempt["reason"], "a no-test comment gives its reason"
            named(fence["body"])
            continue
        found.append(Snippet(fence["body"], before.count("\n") + 1, None))
        last_end = fence.end()
    return found


def named(code: str) -> None:
    """Read code that is not run: it compiles, and what it takes from `mw` exists."""
    for node in ast.walk(ast.parse(code)):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "mw":
            assert hasattr(mw, node.attr), f"mjwrap has no '{node.attr}'"


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
    text = page.read_text()
    with warnings.catch_warnings():
        if any("myo_sim:" in snippet.code for snippet in snippets(text)):
            pytest.importorskip("myo_sim", reason="the models of the page are in myo-sim")
            warnings.filterwarnings("ignore", message=".*empty prefix")  # from how it composes its models
        run(str(page), text)


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


def test_code_that_is_not_run_names_what_exists() -> None:
    page = "<!-- no-test: needs a screen -->\n```python\nimport mjwrap as mw\n\nmw.{}\n```\n"
    assert snippets(page.format("Video")) == []
    with pytest.raises(AssertionError, match="no 'Vidio'"):
        snippets(page.format("Vidio"))


def test_every_fence_is_of_a_language_that_is_tested() -> None:
    marks = {(page.name, fence["language"]) for page in PAGES for fence in FENCE.finditer(page.read_text())}
    assert {mark for mark in marks if mark[1] not in ("python", "text", "sh", "xml")} == set()


# What each page's XML is a part of: the fence's place is marked.
_ANKLE = """<mujoco><worldbody><site name="origin"/><body><joint/><geom size=".1"/>
<site name="insertion" pos="0 0 1"/></body></worldbody>
<tendon><spatial name="soleus"><site site="origin"/><site site="insertion"/></spatial></tendon>
<actuator>{}</actuator></mujoco>"""

_COUPLED = """<mujoco><worldbody><body><joint name="knee"/><joint name="slide" type="slide"/><geom size=".1"/></body>
</worldbody>{}</mujoco>"""


def test_xml_fences_compile_in_their_models() -> None:
    fences = [
        (page.name, fence["body"])
        for page in PAGES
        for fence in FENCE.finditer(page.read_text())
        if fence["language"] == "xml"
    ]
    found = dict(reversed(fences))  # the first one of each page
    assert [name for name, _ in fences] == ["cables.md", "declaring.md", "declaring.md", "muscles.md"]
    coupling = mujoco.MjModel.from_xml_string(_COUPLED.format(fences[2][1]))
    assert (coupling.neq, coupling.ntuple) == (2, 1)
    assert set(found) == {"cables.md", "declaring.md", "muscles.md"}, (
        "say here what another page's XML is a part of"
    )
    model = mujoco.MjModel.from_xml_string(_ANKLE.format(found["muscles.md"]))
    assert (model.na, model.actuator("soleus").dyntype.item()) == (2, mujoco.mjtDyn.mjDYN_USER)
    elbow = re.sub(
        r"<custom>.*?</custom>", "", (ROOT / "models/elbow/elbow.xml").read_text(), flags=re.DOTALL
    )
    muscles = mw.MuscleSystem(
        mujoco.MjModel.from_xml_string(elbow.replace("</mujoco>", found["declaring.md"] + "</mujoco>"))
    )
    law = muscles.declarations[muscles.index("TRIlat")].parameters
    assert isinstance(law, mw.DeGrooteFregly2016)
    assert (law.max_isometric_force, law.optimal_fiber_length, law.tendon_slack_length) == (
        624.3,
        0.1138,
        0.098,
    )
    finger = (ROOT / "models/finger/finger.xml").read_text()
    custom = f"<custom>{found['cables.md']}</custom>"
    spec = mujoco.MjSpec.from_string(re.sub(r"<custom>.*?</custom>", custom, finger, flags=re.DOTALL))
    cables = read_declarations(spec.compile(), cables=True).muscles
    (fdp,) = [cable for cable in cables if cable.name == "fdp"]
    assert [type(surface) for surface in fdp.surfaces] == [mw.Torus]
