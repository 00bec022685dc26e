"""mjwrap compare: what it writes, and what it says when it cannot."""

import csv
import json
import re
import signal
import time
from html.parser import HTMLParser
from pathlib import Path

import pytest
from cli_runs import CASE2, ELBOW, Ran, finish, run_here, said, start
from test_comparison import BALL

from mjwrap.comparison.twins import Comparer


def compare(capsys: pytest.CaptureFixture[str], *arguments: object) -> Ran:
    return run_here("compare", capsys, *arguments)


def only_files(folder: Path, *names: str) -> None:
    assert sorted(path.name for path in folder.iterdir()) == sorted(names)


def test_a_comparison_in_text_json_csv_and_a_picture(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    outputs = ["--plot", tmp_path / "p.png", "--json", tmp_path / "j.json", "--csv", tmp_path / "c.csv"]
    ran = compare(capsys, ELBOW, "--samples", 21, "--duration", 0.1, "--check", *outputs)
    assert (ran.code, said(ran)) == (0, [])
    only_files(tmp_path, "p.png", "j.json", "c.csv")
    assert (tmp_path / "p.png").read_bytes().startswith(b"\x89PNG")
    facts = json.loads((tmp_path / "j.json").read_text())
    assert facts["totals"]["agree"] == 7 * 42
    assert facts["muscles"]["BRA"]["right"] == "both"
    assert facts["muscles"]["BRA"]["length"]["difference"] < 1e-9
    assert abs(facts["motion"]["largest"]["difference"]) < 1e-9
    with (tmp_path / "c.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 7 * 42
    assert {row["outcome"] for row in rows} == {"AGREE"}
    assert all(abs(float(row["length_mujoco"]) - float(row["length_mjwrap"])) < 1e-9 for row in rows)
    assert "both, equal at every pose" in ran.out
    assert "7 muscles with another law pull by MuJoCo's curves" in ran.out


def test_a_report_is_one_page_that_loads_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = tmp_path / "ball & <socket>.xml"
    model.write_text(BALL.format(side='sidesite="side"'))
    report, facts = tmp_path / "r.html", tmp_path / "j.json"
    ran = compare(capsys, model, "--samples", 101, "--duration", 0.02, "--report", report, "--json", facts)
    assert ran.code == 0, ran.err
    page, figures = report.read_text(encoding="utf-8"), json.loads(facts.read_text())
    assert figures["jumps"]
    reader = PageReader()
    reader.feed(page)
    assert not reader.open  # every element is closed
    assert not [link for link in reader.links if not link.startswith("#")]
    assert {f"m-{name}" for name in figures["muscles"]} <= reader.ids
    assert reader.tags.count("svg") >= 2  # a sweep and the motion
    for jump in figures["jumps"]:
        assert f"{jump['sweep']} = {jump['at']:.6f}" in reader.text
    assert "ball & <socket>.xml" in reader.text


class PageReader(HTMLParser):
    """What an HTML page holds: its text, tags, ids and links, and elements left open."""

    EMPTY = ("meta", "br", "img", "link")

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: list[str] = []
        self.links: list[str] = []
        self.ids: set[str] = set()
        self.text = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in self.EMPTY:
            self.open.append(tag)
        self.tags.append(tag)
        found = dict(attrs)
        self.ids.add(found.get("id") or "")
        self.links += [found[key] or "" for key in ("href", "src", "xlink:href") if key in found]

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        if tag not in self.EMPTY:
            self.open.pop()

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data


def test_muscles_are_chosen_by_name(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = ["--samples", 5, "--duration", 0, "--json", tmp_path / "j.json", "--keyframe", "flexed"]
    ran = compare(capsys, ELBOW, "--muscles", "TRI*", "BRA", *options)
    assert ran.code == 0, ran.err
    facts = json.loads((tmp_path / "j.json").read_text())
    assert list(facts["muscles"]) == ["TRIlong", "TRIlat", "TRImed", "BRA"]
    assert "motion" not in facts


def test_the_same_command_gives_the_same_figures(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    said_twice = []
    for seed in (3, 3, 4):
        path = tmp_path / "c.csv"
        assert (
            compare(capsys, CASE2, "--samples", 7, "--duration", 0, "--seed", seed, "--csv", path).code == 0
        )
        said_twice.append(path.read_text())
    assert said_twice[0] == said_twice[1] != said_twice[2]


def test_where_they_differ_it_says_who_is_right(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = tmp_path / "ball.xml"
    model.write_text(BALL.format(side='sidesite="side"'))
    ran = compare(capsys, model, "--samples", 41, "--duration", 0.05, "--plot", tmp_path / "p.svg", "--check")
    assert ran.code == 0, ran.err  # --check asks for mjwrap only
    assert re.search(
        r"^  m: mjwrap: MuJoCo's path is no geodesic at \d+ of 82 poses \(geom 'ball'\)", ran.out, re.M
    )
    assert "MuJoCo m at slide = -0.0100" in ran.out
    assert "where lengths differ most" in ran.out


def test_ctrl_c_leaves_nothing(tmp_path: Path) -> None:
    """Half a comparison is none."""
    outputs = ["--csv", tmp_path / "c.csv", "--json", tmp_path / "j.json"]
    process = start("compare", ELBOW, "--samples", 200_000, *outputs)
    late = time.monotonic() + 60
    while len(list(tmp_path.iterdir())) < 2:
        assert time.monotonic() < late, "the comparison did not start"
        time.sleep(0.1)
    time.sleep(1.0)
    process.send_signal(signal.SIGINT)
    ran = finish(process)
    assert ran.code == 130, ran.err
    assert said(ran) == ["mjwrap compare: stopped by Ctrl-C"]
    only_files(tmp_path)


def test_check_fails_where_mjwrap_is_wrong(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    sound = Comparer.mjwrap_at

    def spoilt(self: Comparer, qpos: object, qvel: object) -> object:
        length, velocity, jacobian, status = sound(self, qpos, qvel)  # pyright: ignore[reportArgumentType]
        return length, velocity + 1e-6, jacobian, status

    monkeypatch.setattr(Comparer, "mjwrap_at", spoilt)
    options = [CASE2, "--samples", 5, "--duration", 0]
    assert compare(capsys, *options).code == 0
    ran = compare(capsys, *options, "--check")
    assert ran.code == 1
    assert "muscle: MuJoCo: at 10 poses both are judged the same geodesic, but differ" in ran.out


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["nowhere.xml"], "nowhere.xml"),
        (["{text}"], "not a model that MuJoCo can load"),
        (["{bare}"], "no muscles"),
        ([ELBOW, "--muscles", "sartorius"], "no muscle 'sartorius'; muscles: TRIlong, TRIlat"),
        ([ELBOW, "--samples", "2"], "--samples.*3 or more"),
        ([ELBOW, "--samples", "many"], "--samples"),
        ([ELBOW, "--keyframe", "bent"], "'bent'; keyframes: extended"),
        ([ELBOW, "--duration", "-1"], "--duration"),
        ([ELBOW, "--json", "{folder}/missing/j.json"], "there is no folder"),
        ([ELBOW, "--json", "{folder}/j.txt"], r"must end in \.json"),
        ([ELBOW, "--csv", "{folder}/x.csv", "--plot", "{folder}/missing/p.png"], "missing"),
        (
            [ELBOW, "--samples", "3", "--csv", "{folder}/x.csv", "--excitation", "wiggle"],
            "'wiggle' is not a pattern",
        ),
    ],
)
def test_a_mistake_is_told_in_one_line_and_leaves_nothing(
    arguments: list[str], told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text, bare = tmp_path / "text.xml", tmp_path / "bare.xml"
    text.write_text("not MJCF")
    bare.write_text("<mujoco/>")
    ran = compare(capsys, *(a.format(text=text, bare=bare, folder=tmp_path) for a in arguments))
    assert ran.code == 2
    (line,) = said(ran)
    assert line.startswith("mjwrap compare: ")
    assert re.search(told, line), line
    assert ran.out == ""
    only_files(tmp_path, "text.xml", "bare.xml")
