"""mjwrap plot: tables in any unit over the curves, labels with units, and mistakes that are named."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest
from cli_runs import ELBOW, run_here
from matplotlib.colors import to_rgb
from test_curves import ARM, triangle

import mjwrap.cli.plot.figure as figures
from mjwrap.files.columns import read_columns

ANGLES = np.linspace(-110.0, -20.0, 10)


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    path = tmp_path / "arm.xml"
    path.write_text(ARM)
    return path


def table(path: Path, heads: list[str], *columns: np.ndarray, header: str = "") -> Path:
    """Write columns of numbers as a .csv file or, with a header, as OpenSim's."""
    between = "," if path.suffix == ".csv" else "\t"
    rows = [between.join(map(repr, row)) for row in zip(*(c.tolist() for c in columns), strict=True)]
    path.write_text("\n".join([*([header] if header else []), between.join(heads), *rows]) + "\n")
    return path


def rms(ran: Any) -> list[float]:
    """Return the RMS differences that the command has told [mm]."""
    lines = [line.split() for line in ran.out.splitlines()]
    return [float(line[7]) for line in lines if len(line) > 8 and line[4].isdigit()]


LENGTH, ARM_OF = triangle(np.radians(ANGLES))
STO = "motion\nversion=1\nnRows=10\nnColumns={n}\ninDegrees={degrees}\nendheader"


@pytest.mark.parametrize(
    ("name", "heads", "columns", "header"),
    [
        ("a.csv", ["elbow", "flexor [mm]"], (ANGLES, 1e3 * ARM_OF), ""),
        ("a.csv", ["elbow (deg)", "flexor (cm)"], (ANGLES, 1e2 * ARM_OF), ""),
        ("a.csv", ["elbow [rad]", "flexor"], (np.radians(ANGLES), ARM_OF), ""),
        ("a.csv", ["angle", "flexor"], (ANGLES, ARM_OF), ""),
        ("a.csv", ["flexor", "/jointset/r/elbow/value [deg]"], (ARM_OF, ANGLES), ""),
        ("a.csv", ["qpos:elbow", "moment_arm:flexor:elbow"], (np.radians(ANGLES), ARM_OF), ""),
        ("a.csv", ["elbow", "flexor"], (np.radians(ANGLES), ARM_OF), "# inDegrees=no"),
        ("a.sto", ["elbow", "flexor"], (ANGLES, ARM_OF), STO.format(n=2, degrees="yes")),
        ("a.sto", ["elbow", "flexor"], (np.radians(ANGLES), ARM_OF), STO.format(n=2, degrees="no")),
        (
            "a.mot",
            ["time", "elbow", "flexor"],
            (np.arange(10.0), ANGLES, ARM_OF),
            STO.format(n=3, degrees="yes"),
        ),
    ],
)
def test_a_table_in_any_unit_lies_on_the_curve(
    arm: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, heads: list[str], columns: tuple,
    header: str,
) -> None:  # fmt: skip
    data = table(tmp_path / name, heads, *columns, header=header)
    ran = run_here("plot", capsys, arm, "--joint", "elbow", "--quantity", "moment_arm", "--data", data, "--csv",
                   tmp_path / "out.csv", "--samples", 1001)  # fmt: skip
    assert (ran.code, ran.err) == (0, "")
    assert rms(ran)[0] < 1e-4  # mm; the curve is interpolated linearly between samples


def test_tables_over_time_take_their_angles_from_states(
    arm: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    time = np.linspace(0.0, 1.0, 10)
    data = table(tmp_path / "s_MuscleAnalysis_Length.sto", ["time", "flexor"], time, LENGTH,
                 header=STO.format(n=2, degrees="no"))  # fmt: skip
    states = table(
        tmp_path / "ik.mot", ["time", "elbow"], time, ANGLES, header=STO.format(n=2, degrees="yes")
    )
    given = [
        "plot",
        capsys,
        arm,
        "--joint",
        "elbow",
        "--samples",
        1001,
        "--csv",
        tmp_path / "o.csv",
        "--data",
        data,
    ]
    ran = run_here(*given, "--states", states)
    assert (ran.code, ran.err) == (0, "")
    assert rms(ran)[0] < 1e-3
    assert "name the motion with --states" in run_here(*given).err


def test_the_written_table_is_read_back(
    arm: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    first = tmp_path / "first.csv"
    assert run_here("plot", capsys, arm, "--joint", "elbow", "--csv", first).code == 0
    columns = read_columns(first)
    assert columns.names == ("elbow", "length:flexor", "moment_arm:flexor:elbow")
    assert columns["moment_arm:flexor:elbow"] == pytest.approx(
        triangle(np.radians(columns["elbow"]))[1], rel=1e-12
    )
    ran = run_here("plot", capsys, arm, "--joint", "elbow", "--data", first, "--csv", tmp_path / "second.csv")
    assert rms(ran) == pytest.approx([0.0, 0.0], abs=1e-9)


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[Any]]:
    """The figures that are drawn, in place of their files."""
    kept: list[Any] = []
    monkeypatch.setattr(figures, "save_figure", lambda figure, output: kept.append(figure))
    yield kept
    plt.close("all")


def test_the_picture_has_units_bands_points_and_models(
    arm: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], drawn: list[Any]
) -> None:
    spread = np.full(10, 2.0)
    data = table(
        tmp_path / "d.csv", ["elbow", "flexor [mm]", "flexor_std [mm]"], ANGLES, 1e3 * ARM_OF, spread
    )
    second = tmp_path / "second.xml"
    second.write_text(ARM.replace('"0 0 .3"', '"0 0 .28"'))
    ran = run_here("plot", capsys, arm, second, "--joint", "elbow", "--data", f"moment_arm={data}", "--native",
                   "-o", tmp_path / "p.png")  # fmt: skip
    assert (ran.code, ran.err) == (0, "")
    (figure,) = drawn
    length, moment = [axis for part in figure.subfigs for axis in part.axes]
    assert [part._supylabel.get_text() for part in figure.subfigs] == ["length [mm]", "moment arm [mm]"]
    assert figure.subfigs[-1]._supxlabel.get_text() == "elbow [°]"
    assert len(length.lines) == 4  # two models, each with MuJoCo's tendon
    assert len(moment.lines) == 5
    points = next(line for line in moment.lines if len(line.get_xdata()) == 10)
    assert points.get_xdata() == pytest.approx(ANGLES)
    assert points.get_ydata() == pytest.approx(1e3 * ARM_OF)
    band = moment.collections[0].get_paths()[0].vertices[:, 1]
    assert (band.min(), band.max()) == pytest.approx(((1e3 * ARM_OF).min() - 2.0, (1e3 * ARM_OF).max() + 2.0))
    words = [text.get_text() for text in length.get_legend().get_texts()]
    assert words == ["arm.xml", "second.xml", "MuJoCo's tendon", "d.csv"]


def test_muscles_share_a_panel_with_a_legend(capsys: pytest.CaptureFixture[str], drawn: list[Any]) -> None:
    ran = run_here("plot", capsys, ELBOW, "--joint", "elbow_flexion", "-o", "x.png")
    assert (ran.code, ran.err) == (0, "")
    axes = drawn[0].axes
    assert [axis.get_ylabel() for axis in axes] == ["length [mm]", "moment arm [mm]"]
    assert [len(axis.lines) for axis in axes] == [7, 7]
    assert len(axes[0].get_legend().get_texts()) == 7


def test_a_long_table_is_seen_on_its_curve_and_its_long_name_leaves_room(
    arm: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], drawn: list[Any]
) -> None:
    at = np.linspace(ANGLES[0], ANGLES[-1], 100)
    name = "subject_01_MuscleAnalysis_MomentArm_of_the_elbow.csv"
    data = table(tmp_path / name, ["elbow", "flexor [mm]"], at, np.full(100, 20.0))
    ran = run_here("plot", capsys, arm, "--joint", "elbow", "--data", f"moment_arm={data}", "-o", "p.png")
    assert (ran.code, ran.err) == (0, "")
    (figure,) = drawn
    parts = [axis for part in figure.subfigs for axis in part.axes] or figure.axes
    (line,) = [line for axis in parts for line in axis.lines if len(line.get_xdata()) == 100]
    curve = next(other for other in line.axes.lines if len(other.get_xdata()) == 91)
    assert sum(to_rgb(line.get_color())) < 0.6 * sum(to_rgb(curve.get_color()))
    legends = [x for x in (*figure.legends, *(axis.get_legend() for axis in parts)) if x]
    words = [text.get_text() for text in legends[0].get_texts() if "subject" in text.get_text()]
    assert words[0].replace("\n", "") == name
    assert max(map(len, words[0].split("\n"))) <= 30


def test_many_muscles_have_a_panel_each(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], drawn: list[Any]
) -> None:
    names = [f"m{k:02d}" for k in range(60)]
    tendons = "".join(f'<spatial name="{n}"><site site="o"/><site site="i"/></spatial>' for n in names)
    muscles = "".join(f'<muscle name="{n}" tendon="{n}" lengthrange=".2 .4"/>' for n in names)
    start, _, _ = ARM.partition("<tendon>")
    model = tmp_path / "many.xml"
    model.write_text(f"{start}<tendon>{tendons}</tendon><actuator>{muscles}</actuator></mujoco>")
    ran = run_here(
        "plot", capsys, model, "--joint", "elbow", "--quantity", "moment_arm", "-o", tmp_path / "p.png"
    )
    assert (ran.code, ran.err) == (0, "")
    (part,) = drawn[0].subfigs
    assert [axis.get_title() for axis in part.axes] == names


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--joint", "elbow"], "nothing to write: add -o FILE.png or --csv"),
        (["--joint", "knee", "--csv", "{out}"], "arm.xml: no hinge or slide 'knee'; there are: elbow"),
        (["--joint", "elbow", "knee", "--csv", "{out}"], "2 joints for 1 models"),
        (["--joint", "elbow", "--muscle", "BRA", "--csv", "{out}"], "no muscle 'BRA'; muscles: flexor"),
        (["--joint", "elbow", "--quantity", "stiffness", "--csv", "{out}"], "invalid choice: 'stiffness'"),
        (
            ["--joint", "elbow", "--qpos", "elbow=90", "--csv", "{out}"],
            "90 rad are 14.3 turns.*if degrees are meant, write 90deg",
        ),
        (["--joint", "elbow", "--range", "90deg,0deg", "--csv", "{out}"], "second number must be larger"),
        (
            ["--joint", "elbow", "--range", "0,90", "--csv", "{out}"],
            "0 to 90 rad are 14.3 turns.*write 0deg,90deg$",
        ),
        (["--joint", "elbow", "--range", "0", "--csv", "{out}"], "write LOW,HIGH, such as"),
        (
            ["--joint", "elbow", "--quantity", "length", "fiber_length", "--csv", "{out}"],
            "no muscle has a value of 'fiber_length': their laws have no fibres",
        ),
        (["--joint", "elbow", "--activation", "2", "--csv", "{out}"], "between 0 and 1"),
        (["--joint", "elbow", "--csv", "{out}", "--states", "x.mot"], "--states needs a table: add --data"),
        (["--joint", "elbow", "--csv", "{out}", "--data", "{data}"], "write --data QUANTITY=FILE"),
        (["--joint", "elbow", "--csv", "{out}", "--data", "tension={data}"], "tension is not drawn here"),
        (
            ["--joint", "elbow", "--csv", "{out}", "--data", "arm={data}"],
            "no quantity 'arm'; quantities: length",
        ),
        (
            ["--joint", "elbow", "--csv", "{out}", "--data", "length={other}"],
            "no column for any.*muscles: flexor",
        ),
        (
            ["--joint", "elbow", "--csv", "{out}", "--data", "length={half}"],
            "both flexor_low and flexor_high",
        ),
        (
            ["--joint", "elbow", "--csv", "{out}", "--data", "length={text}"],
            "line 2, column 'flexor': 'long' is not",
        ),
        (["--joint", "elbow", "--csv", "{out}", "--data", "length=nowhere.csv"], "cannot read 'nowhere.csv'"),
        (["--joint", "elbow", "--csv", "{out}", "--data", "length={out}"], "cannot read"),
    ],
)
def test_mistakes_are_named(
    arm: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], told: str
) -> None:
    files = {
        "out": tmp_path / "out.csv",
        "data": table(tmp_path / "d.csv", ["elbow", "flexor"], ANGLES, ARM_OF),
        "other": table(tmp_path / "o.csv", ["elbow", "BRA"], ANGLES, ARM_OF),
        "half": table(tmp_path / "h.csv", ["elbow", "flexor_low"], ANGLES, ARM_OF),
        "text": tmp_path / "t.csv",
    }
    files["text"].write_text("elbow,flexor\n0,long\n")
    ran = run_here("plot", capsys, arm, *(word.format(**files) for word in arguments))
    assert ran.code == 2
    assert len(ran.err.splitlines()) == 1
    assert re.search(told, ran.err), ran.err
    assert not files["out"].exists()


def test_cables_have_no_tension_over_a_joint(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out.csv"
    ran = run_here("plot", capsys, "mjwrap:finger", "--joint", "mcp", "--quantity", "tension", "--csv", out)
    assert ran.code == 2
    assert "no muscle has a value of 'tension': cables have lengths and moment arms only" in ran.err
    assert not out.exists()


def test_a_table_in_another_unit_is_warned_of(
    arm: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data = table(tmp_path / "d.csv", ["elbow", "flexor"], ANGLES, 1e3 * ARM_OF)
    given = [
        "plot",
        capsys,
        arm,
        "--joint",
        "elbow",
        "--csv",
        tmp_path / "o.csv",
        "--data",
        f"moment_arm={data}",
    ]
    ran = run_here(*given)
    assert ran.code == 0
    assert (
        "if the table is in another unit, write it in the head of the column, such as 'flexor [mm]'"
        in ran.err
    )
    assert run_here(*given, "--data-unit", "mm").err == ""
    small = table(tmp_path / "r.csv", ["elbow", "flexor"], np.radians(ANGLES), ARM_OF)
    ran = run_here(*given[:-1], f"moment_arm={small}")
    assert "taken as degrees: if they are radians, call the column 'elbow [rad]'" in ran.out


def test_compare_draws_tables_over_both_programs(
    arm: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    import mjwrap.cli.compare.plot as compared

    kept: list[Any] = []
    monkeypatch.setattr(compared, "save_figure", lambda figure, output: kept.append(figure))
    data = table(tmp_path / "d.csv", ["elbow", "flexor [mm]"], ANGLES, 1e3 * ARM_OF)
    small = ["--samples", 5, "--bases", 0, "--duration", 0]
    ran = run_here(
        "compare", capsys, arm, *small, "--plot", tmp_path / "p.png", "--data", f"moment_arm={data}"
    )
    assert (ran.code, ran.err) == (0, "")
    moment = kept[0].axes[2]
    assert (moment.get_xlabel(), moment.get_ylabel()) == ("elbow [°]", "moment arm [mm]")
    assert moment.lines[2].get_ydata() == pytest.approx(1e3 * ARM_OF)
    plt.close("all")
    assert "--data needs a plot" in run_here("compare", capsys, arm, *small, "--data", data).err
