"""mjwrap compare: what it writes, and what it says when it cannot."""

import csv
import json
import re
import signal
import time
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from cli_runs import CASE2, ELBOW, Ran, finish, run_here, said, start
from test_comparison import BALL

import mjwrap as mw
from mjwrap.comparison.paired_evaluation import Comparer


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
    assert "7 muscles with another law: MuJoCo's curves in both" in ran.out


def test_a_report_is_one_page_that_loads_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = tmp_path / 'ball & <socket> "1".xml'
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
    assert 'ball & <socket> "1".xml' in reader.text


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
        r"^  m: mjwrap: MuJoCo's path is not a geodesic at \d+ of 82 poses \(geom 'ball'\)", ran.out, re.M
    )
    assert "MuJoCo m at slide = -0.0100" in ran.out
    assert "largest differences of length" in ran.out


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
    assert "muscle: MuJoCo: at 10 poses both are judged to be the same geodesic, but differ" in ran.out


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
        ([ELBOW, "--json", "{text}/j.json"], "text.xml' is not a folder"),
        ([ELBOW, "--json", "{folder}/j.txt"], r"must end in \.json"),
        ([ELBOW, "--csv", "{folder}/out/x.csv", "--plot", "{text}/p.png"], "is not a folder"),
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


ELLIPSE = """
<mujoco>
  <worldbody>
    <geom name="ball" type="ellipsoid" size=".03 .03 .03" contype="0" conaffinity="0"/>
    <geom name="roll" type="cylinder" size=".03 .1" zaxis="0 1 0" pos="0 1 0" contype="0" conaffinity="0"/>
    <site name="a" pos="-.1 0 0"/> <site name="a2" pos="-.1 1 0"/>
    <site name="up" pos="0 0 .05"/> <site name="up2" pos="0 1 .05"/>
    <body><joint name="turn" axis="0 -1 0" limited="true" range="-60 60"/>
      <geom size=".005" mass="1" contype="0" conaffinity="0"/>
      <site name="b" pos=".1 0 0"/> <site name="b2" pos=".1 1 0"/></body>
  </worldbody>
  <tendon>
    <spatial name="over_ball"><site site="a"/><site site="b"/></spatial>
    <spatial name="over_roll"><site site="a2"/><geom geom="roll" sidesite="up2"/><site site="b2"/></spatial>
  </tendon>
  <actuator>
    <muscle name="over_ball" tendon="over_ball" lengthrange=".1 .3"/>
    <muscle name="over_roll" tendon="over_roll" lengthrange=".1 .3"/>
  </actuator>
  <custom>
    <tuple name="mjwrap_over_ball">
      <element objtype="actuator" objname="over_ball"/>
      <element objtype="site" objname="a"/> <element objtype="geom" objname="ball"/>
      <element objtype="site" objname="up" prm="1"/> <element objtype="site" objname="b"/>
    </tuple>
  </custom>
</mujoco>
"""


def write_tables(folder: Path, offset: float) -> list[object]:
    """Files as OpenSim writes them of a string over a circle of 0.03 m that passes it on the side of +z."""
    time = np.linspace(0.0, 1.0, 21)
    angle = np.radians(2.0 + 30.0 * time)  # positive: the far end goes up
    straight = 2.0 * np.sqrt(0.1**2 - 0.03**2)
    arc = 0.03 * (np.pi - angle - 2.0 * np.arccos(0.3))
    assert (arc > 0.0).all()
    lengths = straight + arc + offset
    names = ("/forceset/over_ball", "/forceset/over_roll")
    motion = mw.Table(time, ("/jointset/hinge/turn/value",), np.degrees(angle)[:, None], {"inDegrees": "yes"})
    mw.write_table(folder / "states.sto", motion)
    mw.write_table(folder / "length.sto", mw.Table(time, names, np.stack([lengths, lengths], axis=1)))
    arms = np.full((21, 2), 0.03)
    arms[7, 1] += 0.001  # a fault to be found
    mw.write_table(folder / "arm.sto", mw.Table(time, names, arms))
    return ["--states", folder / "states.sto", "--lengths", folder / "length.sto", "--moment-arms",
            f"turn={folder / 'arm.sto'}"]  # fmt: skip


def test_tables_of_another_program_are_compared_with_both(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = tmp_path / "m.xml"
    model.write_text(ELLIPSE)
    given = write_tables(tmp_path, 0.002)
    page = tmp_path / "p.html"
    ran = compare(capsys, model, "--samples", 5, "--duration", 0, "--json", "-", "--report", page, *given)
    assert ran.code == 0, ran.err
    found = {(d["muscle"], d["program"], d["quantity"]): d for d in json.loads(ran.out)["tables"]}
    assert set(found) == {
        (muscle, program, quantity)
        for muscle, program in (("over_ball", "mjwrap"), ("over_roll", "mjwrap"), ("over_roll", "MuJoCo"))
        for quantity in ("length", "moment arm")
    }  # the tendon of over_ball is straight: only a place for the actuator
    for (muscle, _, quantity), told in found.items():
        assert told["rows"] == 21
        if quantity == "length":
            assert told["mean"] == pytest.approx(-0.002, abs=1e-8)  # the file has eight digits
            assert told["spread"] < 1e-8
        elif muscle == "over_roll":
            assert told["largest"] == pytest.approx(-0.001, abs=1e-8)
            assert told["time"] == pytest.approx(0.35)
        else:
            assert abs(told["largest"]) < 1e-8
    assert "moment arm, turn" in page.read_text(encoding="utf-8")


def test_tables_that_mjwrap_wrote_fit(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Another joint's moment arms are no muscle's."""
    table = tmp_path / "t.npz"
    ran = run_here("run", capsys, ELBOW, "--duration", 0.1, "--excitation", "constant:0.3", "--out", table,
                   "--columns", "qpos,length,moment_arm")  # fmt: skip
    assert ran.code == 0, ran.err
    given = ["--states", table, "--lengths", table, "--moment-arms", f"elbow_flexion={table}"]
    ran = compare(capsys, ELBOW, "--samples", 3, "--duration", 0, "--json", "-", *given)
    assert ran.code == 0, ran.err
    told = [d for d in json.loads(ran.out)["tables"] if d["program"] == "mjwrap"]
    assert len(told) == 14
    assert max(abs(d["largest"]) for d in told) < 1e-12


def test_mujoco_that_does_not_load_is_told_in_a_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MUJOCO_GL", "foo")
    done = finish(start("inspect", ELBOW))
    assert done.code == 2
    assert "MUJOCO_GL=foo" in done.err
    assert len(done.err.splitlines()) == 1


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["--lengths", "length.sto"], "need --states"),
        (["--states", "states.sto"], "needs --lengths or --moment-arms"),
        (["--states", "states.sto", "--moment-arms", "arm.sto"], "write JOINT=FILE"),
        (["--states", "states.sto", "--moment-arms", "knee=arm.sto"], "no hinge or slide 'knee'"),
        (["--states", "states.sto", "--lengths", "states.sto"], "has no column for any of the muscles"),
        (["--states", "half.sto", "--lengths", "length.sto"], "the motion from 0 to 0.5 s"),
    ],
)
def test_tables_that_do_not_fit_are_refused(
    arguments: list[str], reason: str, tmp_path: Path, capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    (tmp_path / "m.xml").write_text(ELLIPSE)
    write_tables(tmp_path, 0.0)
    states = mw.read_table(tmp_path / "states.sto")
    mw.write_table(
        tmp_path / "half.sto", mw.Table(states.time[:11], states.names, states.values[:11], states.metadata)
    )
    monkeypatch.chdir(tmp_path)
    ran = compare(capsys, "m.xml", "--samples", 3, "--duration", 0, *arguments)
    assert ran.code == 2
    assert reason in ran.err
    assert len(said(ran)) == 1
