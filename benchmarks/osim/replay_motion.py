"""Replay a motion of an imported model in OpenSim, and compare coordinates, lengths and moment arms.

    python benchmarks/osim/replay_motion.py MODEL.osim [--motion FILE.mot] [--frozen FILE.json]

Needs the package opensim. The motion, seeded sines of the independent coordinates, is written as .mot and .sto; OpenSim
reads each as a Storage and as a TimeSeriesTable, and its MuscleAnalysis runs along it. Printed: largest differences.
--motion takes the motion that `mjwrap run --motion` wrote instead. --frozen keeps OpenSim's lengths and moment arms at
the motion for the tests.
"""

import argparse
import json
import tempfile
from pathlib import Path

import mujoco
import numpy as np
import opensim  # pyright: ignore[reportMissingImports]

import mjwrap as mw
from mjwrap.osim.motions import motion_table


def motion(model: mujoco.MjModel) -> tuple[np.ndarray, np.ndarray]:
    """Return times (T,) and positions (T, nq) of a seeded motion with everything that follows in place."""
    data, rng = mujoco.MjData(model), np.random.default_rng(5)
    names = mw.MuscleSystem(model).coordinates
    start = mw.osim.coordinates(model, data)
    sizes = {name: rng.uniform(0.05, 0.3) for name in names}
    time = np.linspace(0.0, 1.0, 11)
    rows = []
    for t in time:
        values = {n: start[n] + sizes[n] * np.sin(3.0 * t) for n in names}
        mw.osim.set_coordinates(model, data, values)
        rows.append(data.qpos.copy())
    return time, np.array(rows)


def written(model: mujoco.MjModel, file: Path) -> tuple[np.ndarray, np.ndarray]:
    """Return times and positions of a written motion; joints that follow others are put in place, as OpenSim does."""
    table, data = mw.read_table(file), mujoco.MjData(model)
    names = mw.MuscleSystem(model).coordinates
    rows = []
    for k in range(len(table.time)):
        mw.osim.set_coordinates(model, data, {name: float(table[name][k]) for name in names})
        rows.append(data.qpos.copy())
    return table.time, np.array(rows)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("model", type=Path)
    parser.add_argument("--motion", type=Path)
    parser.add_argument("--frozen", type=Path)
    options = parser.parse_args()
    opensim.Logger.setLevelString("off")
    model = mw.import_osim(options.model).spec.compile()
    time, qpos = motion(model) if options.motion is None else written(model, options.motion)
    table = motion_table(model, time, qpos)
    with tempfile.TemporaryDirectory() as folder:
        for suffix in (".mot", ".sto"):
            file = Path(folder) / f"motion{suffix}"
            mw.write_table(file, table)
            columns = opensim.TimeSeriesTable(str(file))
            storage = opensim.Storage(str(file))
            assert columns.getNumRows() == storage.getSize() == len(time)
            assert not storage.isInDegrees()
            numbers = replay(options.model, file, Path(folder), table)
            compare(model, qpos, numbers, suffix)
    if options.frozen:
        given = {"made by": "benchmarks/osim/replay_motion.py", "OpenSim": opensim.GetVersion()}
        options.frozen.write_text(json.dumps(given | {"model": options.model.name} | numbers) + "\n")


def replay(path: Path, file: Path, folder: Path, table: mw.Table) -> dict:
    """Return coordinates, lengths and moment arms that OpenSim has along the motion in a file."""
    model = opensim.Model(str(path))
    analysis = opensim.MuscleAnalysis()
    analysis.setComputeMoments(True)
    tool = opensim.AnalyzeTool()
    tool.setName("back")
    tool.setModelFilename(str(path.resolve()))
    tool.setCoordinatesFileName(str(file))
    tool.setLowpassCutoffFrequency(-1.0)
    tool.setInitialTime(float(table.time[0]))
    tool.setFinalTime(float(table.time[-1]))
    tool.setResultsDir(str(folder))
    tool.updAnalysisSet().cloneAndAppend(analysis)
    setup = folder / "setup.xml"
    tool.printToXML(str(setup))
    opensim.AnalyzeTool(str(setup)).run()
    found: dict = {"time": table.time.tolist(), "coordinates": {}, "lengths": {}, "moment_arms": {}}
    lengths = mw.read_table(folder / "back_MuscleAnalysis_Length.sto")
    for name in lengths.names:
        found["lengths"][name] = lengths[name].tolist()
    every = model.getCoordinateSet()
    for i in range(every.getSize()):
        name = every.get(i).getName()
        if name in table.names:
            found["coordinates"][name] = table[name].tolist()
        arms = folder / f"back_MuscleAnalysis_MomentArm_{name}.sto"
        if arms.exists():
            read = mw.read_table(arms)
            found["moment_arms"][name] = {muscle: read[muscle].tolist() for muscle in read.names}
    return found


def compare(model: mujoco.MjModel, qpos: np.ndarray, numbers: dict, suffix: str) -> None:
    """Print the largest differences of lengths and moment arms."""
    data, muscles = mujoco.MjData(model), mw.MuscleSystem(model)
    lengths, arms = 0.0, 0.0
    about = [name for name in muscles.coordinates if name in numbers["moment_arms"]]
    for k, pose in enumerate(qpos):
        data.qpos[:] = pose
        mujoco.mj_forward(model, data)
        muscles.forward(data)
        own = muscles.moment_arms(data, about)
        for i, name in enumerate(muscles.names):
            if name in numbers["lengths"]:
                lengths = max(lengths, abs(muscles.length[i] - numbers["lengths"][name][k]))
                for j, coordinate in enumerate(about):
                    arms = max(arms, abs(own[i, j] - numbers["moment_arms"][coordinate][name][k]))
    print(f"{suffix}: lengths within {lengths:.1e} m, moment arms within {arms:.1e} m")


if __name__ == "__main__":
    main()
