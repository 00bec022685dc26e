"""A misspelt name is answered with the names that resemble it, in one wording everywhere."""

from __future__ import annotations

from collections.abc import Callable

import mujoco
import pytest
from cli_runs import ELBOW

import mjwrap as mw
from mjwrap.runs.excitation import Excitation
from mjwrap.runs.models import find_joint, start_keyframe
from mjwrap.text import nearest


def test_near_names_are_the_best_first_whatever_their_capitals() -> None:
    assert nearest("bra", ["BRD", "BRA", "TRI"]) == " (did you mean 'BRA' or 'BRD'?)"
    assert nearest("Bra", ["BRA", "bra"]) == " (did you mean 'BRA' or 'bra'?)"
    assert nearest("knee", ["elbow", "hip"]) == ""
    assert nearest("muscle", [f"muscle{k}" for k in range(9)]).count("'") == 6
    assert nearest("x", []) == ""


def model() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_path(ELBOW)


def misspelt() -> dict[str, tuple[Callable[[], object], str]]:
    """Return by their kind of name: calls that misspell it, and the right name."""
    elbow = model()
    muscles = mw.MuscleSystem(model())
    data = mujoco.MjData(muscles.model)
    route = "BRA_origin,BRA_insertion"
    return {
        "muscle": (lambda: muscles["bra"], "BRA"),
        "coordinate": (lambda: muscles.moment_arms(data, "elbow_flexon"), "elbow_flexion"),
        "joint of curves": (lambda: mw.curves(elbow, "elbow_flexon"), "elbow_flexion"),
        "muscle of curves": (lambda: mw.curves(elbow, "elbow_flexion", "BICshrt"), "BICshort"),
        "quantity": (lambda: mw.curves(elbow, "elbow_flexion", "BRA")["moment_arms"], "moment_arm"),
        "site": (lambda: mw.muscle_xml(elbow, "X", "BRA_orgin,BRA_insertion"), "BRA_origin"),
        "parameter": (
            lambda: mw.muscle_xml(elbow, "X", route, parameters={"optimal_fibre_length": 1.0}),
            "optimal_fiber_length",
        ),
        "model": (lambda: mw.load("mjwrap:elbo"), "elbow"),
        "excitation": (lambda: Excitation(muscles, ["BICshrt=constant:1"]), "BICshort"),
        "joint of an option": (lambda: find_joint(elbow, "elbow_flexon", "entry"), "elbow_flexion"),
        "keyframe": (lambda: start_keyframe(elbow, "flexd"), "flexed"),
        "camera": (lambda: mw.Video(elbow, "x.gif", camera="limbs"), "limb"),
    }


@pytest.mark.parametrize("kind", list(misspelt()))
def test_a_misspelt_name_is_answered_with_the_right_one(kind: str) -> None:
    call, right = misspelt()[kind]
    with pytest.raises(mw.MjwrapError, match=rf"\(did you mean '{right}'"):
        call()
