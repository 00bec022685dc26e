"""A model with the plugin in other processes, pickled, as MJB or as XML: the same motion to the bit."""

from __future__ import annotations

import json
import multiprocessing
import os
import pickle
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import mujoco
import numpy as np
import pytest
from test_plugin import SCENES, moving, spec_of, state_of

import mjwrap as mw
from mjwrap.plugin import announcing, install
from mjwrap.plugin.mujoco_c.registration import PLUGIN_NAME, slot_of

STEPS = 20
SCENE = "elastic arm"


def installed(mode: str = "wrench") -> mujoco.MjModel:
    return install(spec_of(SCENES[SCENE]), mode)


def motion(model: mujoco.MjModel) -> list[float]:
    """Return the state after some steps from a moving start."""
    data = moving(model)
    mujoco.mj_step(model, data, nstep=STEPS)
    return state_of(data).tolist()


def go_on(data: mujoco.MjData) -> list[float]:
    """Return the state of data after some steps more."""
    mujoco.mj_step(data.model, data, nstep=STEPS)
    return state_of(data).tolist()


# ------------------------------------------------------------------------- programs that call nothing of mjwrap


PROGRAM = """
import json, sys
{imports}
{load}
state = {state}
mujoco.mj_setState(model, data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
mujoco.mj_step(model, data, nstep={steps})
import numpy
out = numpy.zeros(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_INTEGRATION))
mujoco.mj_getState(model, data, out, mujoco.mjtState.mjSTATE_INTEGRATION)
print(json.dumps(out.tolist()))
"""
LOADS = {
    "MJB": "model = mujoco.MjModel.from_binary_path('model.mjb'); data = mujoco.MjData(model)",
    "XML": "model = mujoco.MjModel.from_xml_path('model.xml'); data = mujoco.MjData(model)",
    "XML text": "model = mujoco.MjModel.from_xml_string(open('model.xml').read()); data = mujoco.MjData(model)",
    "MjSpec": "model = mujoco.MjSpec.from_file('model.xml').compile(); data = mujoco.MjData(model)",
    "pickled model": "import pickle; model = pickle.load(open('model.pkl', 'rb')); import mujoco; "
    "data = mujoco.MjData(model)",
    "pickled data": "import pickle; data = pickle.load(open('data.pkl', 'rb')); model = data.model; import mujoco",
}
IMPORTS = {
    "mjwrap first": "import mjwrap, mujoco",
    "mujoco first": "import mujoco, mjwrap",
    "mujoco alone": "",  # where the pickle itself imports mjwrap
}


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A model with the plugin in every form in which it can reach another process, and the state that follows."""
    folder = tmp_path_factory.mktemp("installed")
    spec = spec_of(SCENES[SCENE])
    model = install(spec)
    (folder / "model.xml").write_text(spec.to_xml())
    mujoco.mj_saveModel(model, str(folder / "model.mjb"))
    (folder / "model.pkl").write_bytes(pickle.dumps(model))
    data = moving(model)
    (folder / "data.pkl").write_bytes(pickle.dumps(data))
    kind = mujoco.mjtState.mjSTATE_INTEGRATION
    state = np.zeros(mujoco.mj_stateSize(model, kind))
    mujoco.mj_getState(model, data, state, kind)
    (folder / "start.json").write_text(json.dumps(state.tolist()))
    # XML has fewer digits than a model: what it becomes in this process counts
    for name, each in (
        ("end", model),
        ("end of XML", mujoco.MjModel.from_xml_path(str(folder / "model.xml"))),
    ):
        data = mujoco.MjData(each)
        mujoco.mj_setState(each, data, np.array(json.loads((folder / "start.json").read_text())), kind)
        mujoco.mj_step(each, data, nstep=STEPS)
        mujoco.mj_getState(each, data, state, kind)
        (folder / f"{name}.json").write_text(json.dumps(state.tolist()))
    return folder


@pytest.mark.parametrize(
    ("imports", "load"),
    [
        *(("mjwrap first", load) for load in LOADS),
        ("mujoco first", "MJB"),
        ("mujoco alone", "pickled model"),
        ("mujoco alone", "pickled data"),
    ],
)
def test_a_process_that_calls_nothing_moves_it_alike(imports: str, load: str, files: Path) -> None:
    start = json.loads((files / "start.json").read_text())
    program = PROGRAM.format(imports=IMPORTS[imports], load=LOADS[load], state=start, steps=STEPS)
    done = subprocess.run(
        [sys.executable, "-X", "faulthandler", "-c", program], cwd=files, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    end = "end" if load == "MJB" or load.startswith("pickled") else "end of XML"
    assert json.loads(done.stdout) == json.loads((files / f"{end}.json").read_text())


# --------------------------------------------------------------------------------------------- worker processes


@pytest.mark.parametrize("method", ["spawn", "forkserver", "fork"])
@pytest.mark.parametrize("mode", ["wrench", "transmission"])
def test_workers_of_any_start_method_move_it_alike(method: str, mode: str) -> None:
    if method not in multiprocessing.get_all_start_methods():
        pytest.skip(f"this system has no start method '{method}'")
    model = installed(mode)
    data = moving(model)
    with ProcessPoolExecutor(1, multiprocessing.get_context(method)) as pool:
        assert pool.submit(motion, model).result() == motion(model)
        assert pool.submit(go_on, data).result() == go_on(data)


def test_workers_of_joblib_move_it_alike() -> None:
    joblib = pytest.importorskip("joblib", reason="needs joblib (pip install 'mjwrap[test]')")
    model = installed()
    here = Path(__file__).parent
    os.environ["PYTHONPATH"] = os.pathsep.join([str(here), os.environ.get("PYTHONPATH", "")])
    with joblib.parallel_config("loky", n_jobs=2):
        found = joblib.Parallel()(joblib.delayed(motion)(model) for _ in range(2))
    assert found == [motion(model)] * 2


# ----------------------------------------------------------------------------------------------- what stays as it was


def test_other_models_are_pickled_as_mujoco_does() -> None:
    model = spec_of(SCENES[SCENE]).compile()
    assert b"mjwrap" not in pickle.dumps(model).split(b"arm")[0][:200]
    for value in (model, mujoco.MjData(model)):
        assert announcing._reduce(value)[0] is not announcing.restore
        assert type(pickle.loads(pickle.dumps(value))) is type(value)


def test_models_with_other_plugins_only_are_pickled_as_mujoco_does() -> None:
    spec = mujoco.MjSpec.from_string(SCENES[SCENE])
    spec.activate_plugin("mjwrap.probe")  # of the verification: it does nothing
    spec.add_plugin(name="other", plugin_name="mjwrap.probe", active=True)
    model = spec.compile()
    assert model.nplugin == 1
    for value in (model, mujoco.MjData(model)):
        assert announcing._reduce(value)[0] is not announcing.restore
        assert pickle.loads(pickle.dumps(value)) is not None


@pytest.mark.parametrize("protocol", range(2, pickle.HIGHEST_PROTOCOL + 1))
def test_every_protocol_keeps_the_motion(protocol: int) -> None:
    model = installed()
    assert motion(pickle.loads(pickle.dumps(model, protocol))) == motion(model)


def test_a_plugin_with_another_number_is_found_or_refused() -> None:
    """Numbers are given in the order in which plugins are registered, which another process may not share."""
    model = installed()
    slot = slot_of(PLUGIN_NAME)
    _, (_, state, kept) = announcing._reduce(model)
    assert kept == slot
    model.plugin[:] = slot + 7
    moved = pickle.loads(pickle.dumps(model))
    np.testing.assert_array_equal(moved.plugin, slot)
    with pytest.raises(mw.VersionError, match=f"number {slot + 7}, and here it has {slot}"):
        announcing.restore(mujoco.MjData, state, slot + 7)


def test_register_may_be_called_at_any_time() -> None:
    mw.register()
    mw.register()
    assert slot_of(PLUGIN_NAME) >= 0


def test_importing_mjwrap_imports_no_mujoco_and_hides_nothing() -> None:
    program = (
        "import mjwrap, sys; assert 'mujoco' not in sys.modules; import mujoco, importlib.resources as r;"
        "assert mujoco.__spec__.name == 'mujoco'; print(r.files('mujoco').joinpath('__init__.py').is_file(),"
        "[type(f).__name__ for f in sys.meta_path].count('_Watcher'))"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["True", "0"]
