"""Files that are not models are named as what they are, and names that a model lacks with those that resemble them."""

import re
from pathlib import Path

import mujoco
import pytest
from cli_runs import ELBOW, ROOT, run_here, said

import mjwrap as mw
from mjwrap.mjcf import read_model

TWO = (ROOT / "models/paper_two_cylinders/paper_two_cylinders.xml").read_text()
MUSCLES = Path(ELBOW).read_text()
OSIM = '<?xml version="1.0"?>\n<!-- <mujoco> -->\n<OpenSimDocument Version="40000"><Model/></OpenSimDocument>'


@pytest.mark.parametrize(
    ("name", "contents", "told"),
    [
        ("arm.osim", OSIM, "an OpenSim model; import it first: mjwrap import "),
        ("arm.osim", None, "an OpenSim model; import it first: mjwrap import "),
        ("arm.xml", OSIM, "an OpenSim model; import it first: mjwrap import "),
        ("r.urdf", '<!-- a --><robot name="r"><link name="a"/></robot>', "a URDF file, which cannot contain"),
        ("r.xml", '<robot name="r"><link name="a"/></robot>', "a URDF file"),
        ("s.xml", '<!DOCTYPE sdf><sdf version="1.9"/>', "begins with <sdf>, an MJCF file with <mujoco>"),
        ("i.xml", "<mujocoinclude/>", "a part that other MJCF files include"),
        ("t.xml", "hello", "contains no XML"),
        ("e.xml", "  \n", "is empty"),
        ("p.png", b"\x89PNG\r\n\x1a\n\0", "a picture"),
        ("b.xml", b"\0\1\2", "not a text file"),
        ("m.mjb", b"\0\1\2", "not a model that MuJoCo can load"),
    ],
)
@pytest.mark.parametrize("command", ["run", "inspect", "load"])
def test_another_file_is_named(
    name: str,
    contents: str | bytes | None,
    told: str,
    command: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    file = tmp_path / name
    if contents is not None:
        file.write_bytes(contents.encode() if isinstance(contents, str) else contents)
    if command == "load":
        with pytest.raises(mw.ModelError, match=told):
            mw.load(file)
        return
    ran = run_here(command, capsys, file)
    assert ran.code == 2
    (line,) = said(ran)
    assert told in line
    assert str(file) in line


@pytest.mark.parametrize(
    "head", ["", "\ufeff", '<?xml version="1.0"?>\n', "<!-- <robot> -->", "<!DOCTYPE mujoco>\n"]
)
def test_a_model_is_a_model_whatever_precedes_it(head: str, tmp_path: Path) -> None:
    file = tmp_path / "model"
    file.write_text(f'{head}<mujoco model="m"/>', encoding="utf-8")
    assert read_model(file).nq == 0


@pytest.mark.parametrize("option", ["--excitation", "--prescribe"])
def test_a_model_of_opensim_is_not_a_table(
    option: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "arm.osim"
    file.write_text(OSIM)
    ran = run_here("run", capsys, ELBOW, option, file)
    assert ran.code == 2
    assert "arm.osim" in said(ran)[-1]
    with pytest.raises(
        mw.TableError, match=r"a model of OpenSim, not a table: mjwrap import reads it; tables end in \.sto"
    ):
        mw.read_table(file)


@pytest.mark.parametrize(
    ("file", "told"),
    [
        ("arm.osim", "a model of OpenSim: mjwrap import arm.osim makes a MuJoCo model of it"),
        ("arm.xml", "is a model, not a recording .* mjwrap run arm.xml --excitation pulses --record"),
        ("mjwrap:elbow", "mjwrap run mjwrap:elbow"),
    ],
)
def test_a_model_is_not_replayed(file: str, told: str, capsys: pytest.CaptureFixture[str]) -> None:
    ran = run_here("replay", capsys, file)
    assert ran.code == 2
    assert re.search(told, said(ran)[-1])


@pytest.mark.parametrize(
    ("text", "before", "after", "told"),
    [
        (
            TWO,
            'objname="cylinder1"',
            'objname="cylindr1"',
            r"no geom 'cylindr1' \(did you mean 'cylinder1' or",
        ),
        (TWO, 'geom" objname="cylinder1"', 'geom" objname="insertion"', "'insertion' is a site, not a geom"),
        (TWO, 'objname="insertion"', 'objname="zzz"', "no site 'zzz'; there are: origin, insertion"),
        (
            TWO,
            'muscle_pennation_angle"/',
            'muscle_penation_angle"/',
            "did you mean 'mjwrap_muscle_pennation_angle'",
        ),
        (MUSCLES, 'geom="elbow_cylinder"', 'geom="elbow_cylindr"', "did you mean 'elbow_cylinder'"),
        (
            MUSCLES,
            'sidesite="elbow_side"',
            'sidesite="elbow_sid"',
            r"no site 'elbow_sid' \(did you mean 'elbow_side'",
        ),
        (MUSCLES, 'site="BRA_origin"', 'site="BRA_orign"', "did you mean 'BRA_origin'"),
        (MUSCLES, 'tendon="BRA_tendon"', 'tendon="BRA_tendn"', "no tendon .*did you mean 'BRA_tendon'"),
        (MUSCLES, 'tendon="BRA_tendon"', 'tendon="elbow_flexion_"', "did you mean 'elbow_flexion'"),
    ],
)
def test_a_misspelt_name_lists_those_that_resemble_it(
    text: str, before: str, after: str, told: str, tmp_path: Path
) -> None:
    assert before in text
    file = tmp_path / "m.xml"
    file.write_text(text.replace(before, after, 1))
    with pytest.raises(mw.ModelError, match=told):
        read_model(file)
    with pytest.raises(mw.ModelError, match=told):
        mw.install(mujoco.MjSpec.from_file(str(file)))


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("mjwrap:leg", "import it first: mjwrap import mjwrap:leg -o leg.xml"),
        ("mjwrap:lge", "no model 'lge'"),
    ],
)
def test_a_model_of_opensim_that_comes_with_mjwrap_is_imported(name: str, told: str) -> None:
    with pytest.raises(mw.ModelError, match=told):
        mw.load(name)
    if name.endswith("leg"):
        assert mw.import_osim(name).report.model == "leg"
    else:
        with pytest.raises(mw.OsimError, match="did you mean 'leg'"):
            mw.import_osim(name)
