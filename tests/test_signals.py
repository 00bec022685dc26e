"""Patterns and tables over time, and which muscle or actuator they drive."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

import mjwrap as mw
from mjwrap.runs.excitation import Excitation
from mjwrap.runs.signals import Constant, Samples, Sine, match_columns, parse_pattern, pattern_forms

TWO = """
<mujoco>
  <worldbody>
    <site name="a"/>
    <body><joint name="hinge" axis="0 1 0"/><geom size=".01" mass="1"/><site name="b" pos=".1 0 0"/></body>
  </worldbody>
  <tendon>
    <spatial name="one"><site site="a"/><site site="b"/></spatial>
    <spatial name="two"><site site="a"/><site site="b"/></spatial>
    <spatial name="alone"><site site="a"/><site site="b"/></spatial>
  </tendon>
  <actuator>
    <muscle name="flexor" tendon="one" lengthrange=".05 .2"/>
    <motor name="drive" joint="hinge"/>
    <muscle name="extensor" tendon="two" lengthrange=".05 .2"/>
  </actuator>
  <custom>
    <numeric name="mjwrap_optimal_force" data="10"/>
    <tuple name="mjwrap_alone">
      <element objtype="tendon" objname="alone"/><element objtype="numeric" objname="mjwrap_optimal_force"/>
    </tuple>
  </custom>
</mujoco>
"""


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(TWO)


def value(pattern: str, t: float, name: str = "m", index: int = 0, count: int = 1) -> float:
    return parse_pattern(pattern)(name, index, count).value(t)


@pytest.mark.parametrize(
    ("pattern", "t", "expected"),
    [
        ("constant:0.3", 7.0, 0.3),
        ("step:0.2@0.5", 0.499, 0.0),
        ("step:0.2@0.5", 0.5, 0.2),
        ("sine:2,0.25", 1.0, 2.0),
        ("sine:2,0.25,0.5,0.5", 1.0, -1.5),
        ("cosine:0.0015,1,0,0.24", 0.0, 0.0015 * np.cos(2 * np.pi * 0.24)),
        ("pulses", 0.25, 0.3),
        ("pulses:0.8,2", 0.5, 0.8),
        ("pulses:0.8,2", 1.5, 0.0),
    ],
)
def test_a_pattern_has_the_value_that_it_names(pattern: str, t: float, expected: float) -> None:
    assert value(pattern, t) == pytest.approx(expected, abs=1e-15)


def test_pulses_run_through_the_muscles_in_turn_and_begin_at_zero() -> None:
    peaks = [value("pulses:1,1", 0.25 + k / 4, index=k, count=4) for k in range(4)]
    assert peaks == pytest.approx([1.0] * 4)
    assert [value("pulses:1,1", 0.0, index=k, count=4) for k in range(4)] == [0.0] * 4


def test_rates_match_differences_at_second_order() -> None:
    rng = np.random.default_rng(3)
    for _ in range(50):
        signal, t = Sine(*rng.uniform(0.2, 2.0, 4)), rng.uniform(0.0, 3.0)
        scale = (2 * np.pi * signal.frequency) ** 3 * signal.amplitude / 6  # of the third derivative
        for h in (1e-2, 1e-3):
            rate = (signal.value(t + h) - signal.value(t - h)) / (2 * h)
            assert abs(rate - signal.rate(t)) < 1.01 * scale * h**2 + 1e-12
    assert Constant(3.0).rate(1.0) == 0.0


def test_random_is_the_same_on_every_run_and_its_own_for_every_muscle() -> None:
    times = np.linspace(0.0, 20.0, 4001)
    one, again, other = (
        np.array([value("random:5", t, name) for t in times]) for name in ("one", "one", "two")
    )
    seeded = parse_pattern("random", seed=5)("one", 0, 1)
    assert np.array_equal(one, again)
    assert np.array_equal(one, [seeded.value(t) for t in times])
    assert abs(np.corrcoef(one, other)[0, 1]) < 0.3
    assert 0.0 <= one.min() < 0.1 < 0.9 < one.max() <= 1.0
    # joined by half cosines over 0.25 s, so no faster than pi/2/0.25 a second
    assert np.abs(np.diff(one)).max() < 1.01 * np.pi / 0.5 * 0.005


@pytest.mark.parametrize(
    ("pattern", "told"),
    [
        ("triangle:1", "is not a pattern"),
        ("constant", "does not fit constant:LEVEL"),
        ("constant:x", "does not fit constant:LEVEL"),
        ("constant:nan", "must be finite"),
        ("step:1,2", "does not fit step:LEVEL@TIME"),
        ("sine:1", "does not fit sine"),
        ("pulses:1,0", "period must be positive"),
        ("random:1.5", "whole number"),
        ("random:1,-1", "must be positive"),
    ],
)
def test_a_wrong_pattern_is_told(pattern: str, told: str) -> None:
    with pytest.raises(mw.SignalError, match=told):
        parse_pattern(pattern)


def test_an_unknown_pattern_lists_the_forms() -> None:
    with pytest.raises(mw.SignalError) as caught:
        parse_pattern("triangle:1")
    assert pattern_forms() in str(caught.value)


def test_a_table_is_interpolated_and_held_outside(tmp_path: Path) -> None:
    path = tmp_path / "u.csv"
    path.write_text("\ufefftime, flexor\n0,0\n\n2,1\n3,0.5\n", encoding="utf-8")
    table = mw.read_table(path)
    signal = Samples(table.time, table["flexor"])
    assert [signal.value(t) for t in (-1.0, 0.0, 1.0, 2.5, 9.0)] == [0.0, 0.0, 0.5, 0.75, 0.5]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "is empty"),
        ("a,b\n1,2\n", "no column 'time'"),
        ("time,a\n", "no rows"),
        ("time,a,a\n0,1,2\n", "a name that no other has; check a"),
        ("time,a,\n0,1,2\n", "the empty names"),
        ("time,a\n0,1\n1\n", "line 3: 1 cells"),
        ("time,a\n0,1\n1,two\n", "line 3, column 'a': 'two' is not a number"),
        ("time,a\n0,1\n1,nan\n", "line 3, column 'a': nan is not finite"),
        ("time,a\n0,1\n1,inf\n", "line 3, column 'a': inf is not finite"),
        ("time,a\n0,1\n\n1,1\n1,1\n", "line 5: time 1 does not come after 1"),
    ],
)
def test_a_wrong_table_is_told_with_its_line(text: str, told: str, tmp_path: Path) -> None:
    path = tmp_path / "u.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(mw.SignalError, match=told) as caught:
        mw.read_table(path)
    assert "u.csv" in str(caught.value)


def test_a_table_that_is_not_text_or_not_there_is_told(tmp_path: Path) -> None:
    (tmp_path / "u.csv").write_bytes(b"\xff\xfe\x00\x80")
    with pytest.raises(mw.SignalError, match="not a text file"):
        mw.read_table(tmp_path / "u.csv")
    with pytest.raises(mw.SignalError, match="no such file"):
        mw.read_table(tmp_path / "v.csv")
    with pytest.raises(mw.SignalError, match="directory"):
        mw.read_table(tmp_path)


def test_a_pattern_drives_muscles_and_leaves_other_actuators_alone(model: mujoco.MjModel) -> None:
    muscles, data = mw.MuscleSystem(model), mujoco.MjData(model)
    data.ctrl[1] = 0.7
    Excitation(muscles, ["constant:0.3"]).write(data)
    assert data.ctrl.tolist() == [0.3, 0.7, 0.3]
    assert muscles.excitation.tolist() == [0.0, 0.0, 0.3]  # the muscle without an actuator
    assert muscles.names == ["flexor", "extensor", "alone"]


def test_an_actuator_with_several_controls_has_a_name_for_each() -> None:
    text = TWO.replace(
        '<motor name="drive" joint="hinge"/>', '<orientation name="turn" joint="ball"/>'
    ).replace(
        "</worldbody>", '<body><joint name="ball" type="ball"/><geom size=".01" mass="1"/></body></worldbody>'
    )
    model = mujoco.MjModel.from_xml_string(text)
    muscles, data = mw.MuscleSystem(model), mujoco.MjData(model)
    excitation = Excitation(muscles, ["constant:0.3", "turn[1]=constant:2", "extensor=constant:0.5"])
    assert excitation.names == ["flexor", "turn[0]", "turn[1]", "turn[2]", "extensor", "alone"]
    excitation.write(data)
    assert data.ctrl.tolist() == [0.3, 0.0, 2.0, 0.0, 0.5]


def test_a_later_entry_wins_and_names_may_be_patterns(model: mujoco.MjModel) -> None:
    muscles, data = mw.MuscleSystem(model), mujoco.MjData(model)
    entries = ["constant:0.3", "*x*=constant:0.5", "flexor=constant:0.9", "drive=constant:-2"]
    Excitation(muscles, entries).write(data)
    assert data.ctrl.tolist() == [0.9, -2.0, 0.5]


def test_a_file_drives_what_its_columns_name(model: mujoco.MjModel, tmp_path: Path) -> None:
    muscles, data = mw.MuscleSystem(model), mujoco.MjData(model)
    path = tmp_path / "u.csv"
    path.write_text("time,extensor,alone\n0,0,1\n1,1,0\n")
    data.time = 0.25
    Excitation(muscles, [str(path)]).write(data)
    assert data.ctrl.tolist() == [0.0, 0.0, 0.25]
    assert muscles.excitation.tolist() == [0.0, 0.0, 0.75]


@pytest.mark.parametrize("entry", ["flexer=constant:1", "{file}"])
def test_unknown_names_list_what_exists(entry: str, model: mujoco.MjModel, tmp_path: Path) -> None:
    path = tmp_path / "u.csv"
    path.write_text("time,flexer\n0,0\n")
    with pytest.raises(mw.SignalError, match=r"flexer.*flexor, drive, extensor, alone"):
        Excitation(mw.MuscleSystem(model), [entry.format(file=path)])


def test_something_with_a_folder_in_its_name_is_taken_for_a_file(model: mujoco.MjModel) -> None:
    with pytest.raises(mw.SignalError, match="neither a file nor a pattern"):
        Excitation(mw.MuscleSystem(model), ["out/excitation.txt"])


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("0.5", r"'0\.5' is not a pattern; for a level that stays write constant:0\.5; patterns: "),
        ("pulse", r"'pulse' is not a pattern \(did you mean 'pulses'\?\); patterns: "),
        ("table.csv", r"; a table drives the muscles of its columns: write its name alone"),
        ("wiggle", r"'wiggle' is not a pattern; patterns: "),
    ],
)
def test_what_is_not_a_pattern_is_answered_with_what_is(text: str, told: str) -> None:
    with pytest.raises(mw.SignalError, match=told):
        parse_pattern(text)


def test_a_table_for_another_option_is_named() -> None:
    def table(column: str) -> mw.Table:
        return mw.Table(np.zeros(1), (column,), np.zeros((1, 1)))

    with pytest.raises(
        mw.SignalError, match=r"no muscle for column.*there are: BRA; the motion of joints is prescribed"
    ):
        match_columns(table("/jointset/elbow/flexion/value"), ["BRA"], "muscle")
    with pytest.raises(
        mw.SignalError, match="there are: flexion; these are muscles: give the table as excitation"
    ):
        match_columns(table("/forceset/BRA"), ["flexion"], "hinge or slide")
    with pytest.raises(mw.SignalError, match=r"there are: BRA$"):
        match_columns(table("BRD"), ["BRA"], "muscle")
