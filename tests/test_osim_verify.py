"""`mjwrap import --verify` beside OpenSim's frozen numbers, its page, its JSON, and damaged files."""

import json

import pytest
from cli_runs import run_here
from osim_models import FROZEN, model_file

TIGHT = {  # largest allowed differences by quantity
    "position of bodies": 1e-9,
    "rotation of bodies": 1e-9,
    "reduced mass matrix, share of its diagonal": 1e-9,
    "length of paths without contact": 1e-12,
    "moment arms of paths without contact": 1e-9,
    "tension at OpenSim's length, share of the maximum force": 1e-7,
}
MODELS = {  # models, and the quantities that they have
    "arm26": 6, "CoupledCoordinatesMPPsMomentArmTest": 6, "leg6dof9musc": 6, "PathOnConstrainedBodyMomentArmTest": 6,
    "Tug_of_War_Millard": 6, "WrapPathCustomJointMomentArmTest": 4, "StationDefinedFrames_Basic": 2,
}  # fmt: skip


def verified(folder, capsys, name, *extra):
    """Return exit code, output and JSON of an import beside the frozen numbers."""
    numbers = FROZEN / f"verify_{name}.json"
    files = "-o", folder / "m.xml", "--report", folder / "m.html", "--json", folder / "m.json"
    found = run_here("import", capsys, model_file(name), "--numbers", numbers, *files, *extra)
    return found, json.loads((folder / "m.json").read_text())


@pytest.mark.parametrize("name", MODELS)
def test_imported_models_have_opensims_numbers(name, tmp_path, capsys):
    found, values = verified(tmp_path, capsys, name, "--verify")
    checked = values["verification"]
    largest = {q["what"]: q["largest"] for q in checked["quantities"]}
    assert len(TIGHT.keys() & largest.keys()) == MODELS[name]
    for what, allowed in TIGHT.items():
        assert largest.get(what, 0.0) <= allowed, what
    assert checked["opensim"].startswith("4.6")
    assert checked["poses"] == 4
    unexplained = [d for d in checked["differences"] if d["reason"].startswith("not explained")]
    assert found.code == (1 if unexplained else 0)
    page = (tmp_path / "m.html").read_text()
    assert all(q["what"].replace("'", "&#39;") in page for q in checked["quantities"])
    assert all(d["reason"].replace("'", "&#39;") in page for d in checked["differences"])


def test_large_differences_of_lengths_have_reasons(tmp_path, capsys):
    _, values = verified(tmp_path, capsys, "arm26")
    differences = [d for d in values["verification"]["differences"] if "motion" not in d["what"]]
    reasons = " ".join(d["reason"] for d in differences)
    assert len(differences) > 4
    assert "not explained" not in reasons
    assert "OpenSim's arc is shorter than its own chord on TRIlongglen" in reasons
    assert "OpenSim's path is not taut: its straight line meets TRIlonghh" in reasons
    assert "OpenSim's moment arm is not the slope of its own length" in reasons


def shifted(given):
    given["poses"][1]["bodies"]["r_humerus"][0] += 0.01


def longer(given):
    given["poses"][0]["lengths"]["BICshort"] += 0.01


@pytest.mark.parametrize(
    ("change", "what"), [(shifted, ("position", "r_humerus")), (longer, ("length", "BICshort"))]
)
def test_wrong_numbers_are_found_and_not_explained(change, what, tmp_path, capsys):
    given = json.loads((FROZEN / "verify_arm26.json").read_text())
    change(given)
    numbers, out = tmp_path / "n.json", tmp_path / "m.json"
    numbers.write_text(json.dumps(given))
    found = run_here(
        "import", capsys, model_file("arm26"), "-o", tmp_path / "m.xml", "--numbers", numbers, "--json", out
    )
    assert found.code == 1
    differences = json.loads(out.read_text())["verification"]["differences"]
    reasons = [d["reason"] for d in differences if (d["what"], d["name"]) == what]
    assert len(reasons) == 1
    assert reasons[0].startswith("not explained")


def damage(change):
    given = json.loads((FROZEN / "verify_arm26.json").read_text())
    change(given)
    return json.dumps(given)


DAMAGES = {
    "not JSON": lambda: "{",
    "entries are missing": lambda: "[]",
    "another version": lambda: damage(lambda g: g.update(format=1)),
    "missing or damaged": lambda: damage(lambda g: g["poses"][0].pop("bodies")),
    "mass of pose 1": lambda: damage(lambda g: g["poses"][1].update(mass=[[1.0]])),
    "lengths of pose 0": lambda: damage(lambda g: g["poses"][0]["lengths"].update(BRA=float("nan"))),
    "bodies of pose 0": lambda: damage(lambda g: g["poses"][0]["bodies"].update(r_humerus=[0.0])),
    "lacks coordinate 'r_elbow_flex'": lambda: damage(lambda g: g["poses"][0]["coordinates"].pop("r_elbow_flex")),
    "of a motion": lambda: damage(lambda g: g["passive"]["coordinates"].update(r_elbow_flex=[0.0])),
    "another file": lambda: damage(lambda g: g.update(sha256="0")),
}  # fmt: skip


@pytest.mark.parametrize("told", DAMAGES)
def test_damaged_numbers_are_refused_in_one_line(told, tmp_path, capsys):
    numbers = tmp_path / "n.json"
    numbers.write_text(DAMAGES[told]())
    found = run_here(
        "import", capsys, model_file("arm26"), "-o", tmp_path / "m.xml", "--verify", "--numbers", numbers
    )
    assert found.code == 2
    assert told in found.err
    assert "Traceback" not in found.err
    assert not (tmp_path / "m.xml").exists()


def test_files_that_cannot_be_used_are_refused(tmp_path, capsys):
    other = tmp_path / "model.xml"
    other.write_text("<mujoco/>")
    for arguments, told in (
        ([tmp_path / "none.osim"], "is not a file"),
        ([other], "OpenSimDocument"),
        ([other, "-o", tmp_path / "m.txt"], "ends in .xml"),
        ([other, "-o", tmp_path / "m.xml", "--report", tmp_path / "m.txt"], ".html"),
    ):
        found = run_here("import", capsys, *arguments)
        assert found.code == 2
        assert told in found.err
        assert "Traceback" not in found.err
