"""Models by name: those that come with mjwrap, and those of whatever myo-sim is installed, or none."""

import sys
import types
import warnings
from pathlib import Path

import mujoco
import pytest
from cli_runs import ELBOW, ROOT, run_here

import mjwrap as mw
from mjwrap.mjcf import named_models, read_model, read_spec
from mjwrap.runs import load, load_spec

FILES = {file.stem: file for file in (ROOT / "models").glob("*/*.xml")}


def test_every_model_of_the_repository_has_a_name() -> None:
    assert named_models.own_models() == FILES
    assert len(FILES) >= 7


@pytest.mark.parametrize("name", sorted(FILES))
def test_a_name_is_its_file(name: str) -> None:
    assert load(f"mjwrap:{name}").signature == load(str(FILES[name])).signature


def test_every_loader_takes_a_name() -> None:
    installed = mw.load("mjwrap:elbow")
    assert installed.signature == mw.load(ELBOW).signature
    assert read_model("mjwrap:elbow").nu == 7
    assert isinstance(read_spec("mjwrap:elbow"), mujoco.MjSpec)
    assert isinstance(load_spec("mjwrap:elbow"), mujoco.MjSpec)


@pytest.mark.parametrize("command", ["inspect", "check", "compare", "run"])
def test_every_command_takes_a_name(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    short = {
        "inspect": ["--quick"], "check": ["--poses", "1", "--samples", "3"], "run": ["--duration", "0.01"],
        "compare": ["--samples", "3", "--bases", "0", "--duration", "0"],
    }  # fmt: skip
    ran = run_here(command, capsys, "mjwrap:paper_case1", *short[command])
    assert ran.code == 0, ran.err
    assert "mjwrap:paper_case1: 1 muscle" in ran.out


@pytest.mark.parametrize("name", ["elbo", "Elbow", "", "../elbow", "elbow.xml"])
def test_a_wrong_name_lists_the_models(name: str) -> None:
    with pytest.raises(mw.ModelError, match=f"mjwrap has no model '{name}'.*it has: .*elbow, elbow_conserv"):
        mw.load(f"mjwrap:{name}")


def test_a_bare_name_is_asked_about(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(mw.ModelError, match="did you mean 'mjwrap:elbow'"):
        mw.load("elbow")


def myo(monkeypatch: pytest.MonkeyPatch, **contents: object) -> None:
    """Install a package myo_sim with these contents."""
    package = types.ModuleType("myo_sim")
    vars(package).update(contents)
    monkeypatch.setitem(sys.modules, "myo_sim", package)


def spec(name: str, build_kwargs: object = None) -> mujoco.MjSpec:
    made = mujoco.MjSpec.from_file(ELBOW)
    made.modelname = f"{name} {build_kwargs}"
    return made


def test_an_older_package_has_no_postures(monkeypatch: pytest.MonkeyPatch) -> None:
    """As 0.2.0 to 0.2.3, of which the oldest take no build_kwargs either."""
    myo(
        monkeypatch,
        REGISTRY={"elbow": ""},
        _composed_models=lambda: {"arm"},
        load_spec=lambda name: spec(name),
    )
    assert read_spec("myo_sim:arm").modelname == "arm None"
    assert load("myo_sim:elbow").nu == 7


def test_a_newer_package_adds_postures(monkeypatch: pytest.MonkeyPatch) -> None:
    myo(
        monkeypatch,
        REGISTRY={},
        _composed_models=lambda: {"arm"},
        load_spec=spec,
        list_postures=lambda name: ["x"],
    )
    assert read_spec("myo_sim:arm").modelname == "arm {'postures': True}"


def test_a_package_of_another_layout_may_have_no_composed_models(monkeypatch: pytest.MonkeyPatch) -> None:
    myo(monkeypatch, REGISTRY={"elbow": ""}, load_spec=spec)
    assert load("myo_sim:elbow").nu == 7
    with pytest.raises(mw.ModelError, match=r"myo-sim.* has no model 'arm'; it has: elbow"):
        load("myo_sim:arm")


def fails(*_: object, **__: object) -> object:
    raise AttributeError("mesh_polyvert")


@pytest.mark.parametrize(
    "contents",
    [
        {},  # a package without what mjwrap asks for
        {"REGISTRY": {"elbow": ""}},
        {"REGISTRY": {"elbow": ""}, "load_spec": fails},
        {"REGISTRY": {"elbow": ""}, "load_spec": spec, "list_postures": fails},
        {"REGISTRY": {"elbow": ""}, "_composed_models": fails},
    ],
)
def test_a_package_that_does_not_fit_is_named_with_its_version(
    contents: dict[str, object], monkeypatch: pytest.MonkeyPatch
) -> None:
    myo(monkeypatch, **contents)
    told = (
        rf"'myo_sim:elbow' cannot be loaded by myo-sim .* with MuJoCo {mujoco.__version__} \(.*Error.*0\.2\.3"
    )
    with pytest.raises(mw.ModelError, match=told):
        mw.load("myo_sim:elbow")


def test_a_model_that_does_not_compile_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(name: str) -> mujoco.MjSpec:
        made = spec(name)
        made.worldbody.add_body(name="b").add_joint(name="massless")
        return made

    myo(monkeypatch, REGISTRY={"elbow": ""}, load_spec=broken)
    with pytest.raises(mw.ModelError, match=r"cannot be loaded by myo-sim .*mass"):
        load("myo_sim:elbow")


@pytest.mark.parametrize(
    ("where", "told"), [("missing", "not installed: pip install 'mjwrap"), ("broken", "broken")]
)
def test_no_package_and_a_broken_one_are_told_apart(
    where: str, told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if where == "missing":
        monkeypatch.setattr(sys, "path", [])
    else:
        (tmp_path / "myo_sim").mkdir()
        (tmp_path / "myo_sim" / "__init__.py").write_text("raise ImportError('the package is broken')")
        monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.delitem(sys.modules, "myo_sim", raising=False)
    with pytest.raises(mw.ModelError, match=told):
        read_model("myo_sim:elbow")


@pytest.mark.parametrize("handled", [False, True])
def test_loading_a_composed_model_shows_no_warning_of_its_prefix(
    handled: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("myo_sim")
    monkeypatch.chdir(tmp_path)
    told: list[str] = []
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(told.append if handled else None)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            mw.load("myo_sim:myoarm_r")
            named_models.myo_model("myo_sim:myoarm_r")
        assert (mujoco.get_mju_user_warning() is not None) == handled
    finally:
        mujoco.set_mju_user_warning(before)
    assert told == []
    assert "empty prefix" not in "".join(capfd.readouterr())
    assert list(tmp_path.iterdir()) == []


def test_other_warnings_are_shown_as_before() -> None:
    told: list[str] = []
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(told.append)
    try:
        with named_models.quiet_prefixes("myo_sim:any"):
            handler = mujoco.get_mju_user_warning()
            handler(named_models.NOISE + " and so on")
            handler("another warning")
        with named_models.quiet_prefixes(ELBOW):
            mujoco.get_mju_user_warning()(named_models.NOISE)
    finally:
        mujoco.set_mju_user_warning(before)
    assert told == ["another warning", named_models.NOISE]
