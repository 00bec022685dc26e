"""Texts of a comparison: verdicts in motion, jumps of the moment arm alone, and differences of zero."""

from collections import Counter

import pytest

from mjwrap.cli.compare.text import millimetres
from mjwrap.comparison import Jump, MuscleSummary, verdict


def jump(length: float, slope: float) -> Jump:
    return Jump("MuJoCo", "LAT", "elbow", 0.5, length, slope, "before", "after", other_smooth=True)


def summary(**counts: int) -> MuscleSummary:
    found = MuscleSummary("LAT", poses=sum(counts.values()), longer_branch=0.0423)
    found.counts = Counter(counts)
    return found


@pytest.mark.parametrize(
    ("counts", "jumps", "right"),
    [
        ({"AGREE": 10}, [], "both"),
        ({"AGREE": 8, "OTHER_BRANCH": 2}, [], "both"),
        ({"AGREE": 8, "OTHER_BRANCH": 2}, [jump(0.01, 0.02)], "mjwrap in motion"),
        ({"AGREE": 8, "MUJOCO_NOT_GEODESIC": 2}, [jump(0.01, 0.02)], "mjwrap"),
        ({"AGREE": 8, "MUJOCO_NOT_GEODESIC": 2}, [], "mjwrap"),
    ],
)
def test_a_jump_between_true_geodesics_is_a_fault_in_motion_only(
    counts: dict[str, int], jumps: list[Jump], right: str
) -> None:
    assert verdict(summary(**counts), jumps).right == right


def test_the_longer_of_two_geodesics_is_explained() -> None:
    _, why = verdict(summary(AGREE=8, OTHER_BRANCH=2), [jump(0.01, 0.02)])
    assert "MuJoCo jumps 1 time, by up to 10 mm, its moment arm by up to 20 mm" in why
    assert "mjwrap's up to 42.3 mm longer" in why
    assert "keeps it along a sweep, because a string cannot pass through the cylinder" in why


def test_a_jump_of_the_moment_arm_alone_is_called_that() -> None:
    _, why = verdict(summary(AGREE=8, OTHER_BRANCH=2), [jump(0.0, 0.02), jump(0.0, -0.03)])
    assert "MuJoCo's moment arm (not its length) jumps 2 times, by up to 30 mm" in why


@pytest.mark.parametrize(
    ("metres", "text"),
    [(1e-17, "0"), (-1e-17, "0"), (0.0, "0"), (-4e-7, "0"), (-6e-7, "-0.001"), (0.01, "+10.000")],
)
def test_what_the_digits_cannot_show_is_0(metres: float, text: str) -> None:
    assert millimetres(metres) == text
