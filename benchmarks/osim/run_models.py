"""Import every OpenSim model of a folder and run it, with the engine plugin and MuscleSystem; `mjwrap check` tests it.

    python benchmarks/osim/run_models.py path/to/models [--only NAME ...] [--seconds 2] [--json out.json]

Each model is imported, saved, loaded from the saved file and run with seeded random excitations, which change every
0.05 s. Printed for each: steps per second and times real time of both, evaluations of paths by their status, warnings
of MuJoCo, whether all numbers stayed finite, and which tests of `mjwrap check` failed. A model without muscles runs in
MuJoCo alone. Where a run is not finite, a run at a fifth of the time step follows, and OpenSim's own with the same
excitations, at an accuracy of 1e-5, if the `opensim` wheel is there. Exit code 1 if a model could not be imported, or a
run was not finite or gave a warning.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

import mjwrap as mw
from mjwrap.checking import check_model
from mjwrap.plugin import excitations, read

HOLD = 0.05  # an excitation is held so long [s]
FINER = 5  # times smaller is the step of a second run where the first one fails
ACCURACY = 1e-5  # of OpenSim's integrator
Row = dict[str, Any]


def controls(count: int, seconds: float, seed: int) -> np.ndarray:
    """Return random excitations (changes, count) in 0..1."""
    return np.random.default_rng(seed).uniform(0.0, 1.0, (int(np.ceil(seconds / HOLD)) + 1, count))


def start(model: mujoco.MjModel) -> mujoco.MjData:
    """Return the model's first state: the keyframe "default" where there is one."""
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    return data


def ran(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    seconds: float,
    excite: Callable[[np.ndarray], None],
    count: int,
    advance: Callable[[], None],
    statuses: Callable[[], Any],
) -> Row:
    """Run a model; return its figures."""
    drawn = controls(count, seconds, 0)
    found: Counter[str] = Counter()
    began, steps, finite, reached = time.perf_counter(), 0, True, 0.0
    while data.time < seconds - 0.5 * model.opt.timestep:
        excite(drawn[min(int(data.time / HOLD + 1e-6), len(drawn) - 1)])
        reached = data.time
        advance()
        steps += 1
        found.update(mw.Status(int(code)).name for code in statuses())
        if not np.isfinite(data.qpos).all() or data.time <= reached:
            finite = False
            break
    else:
        reached = data.time
    spent = time.perf_counter() - began
    total = sum(found.values())
    return {
        "steps_per_second": steps / spent,
        "times_real_time": reached / spent,
        "simulated": float(reached),
        "statuses": {name: n / total for name, n in found.items() if name != "CONVERGED"} if total else {},
        "finite": finite,
        "warnings": {
            mujoco.mjtWarning(i).name: int(data.warning[i].number)
            for i in range(len(data.warning))
            if data.warning[i].number
        },
        "highest_speed": float(np.abs(data.qvel).max()) if finite and model.nv else None,
    }


def by_plugin(path: Path, seconds: float, timestep: float | None = None) -> Row:
    """Run a saved model with the engine plugin; timestep [s]: None for its own."""
    try:
        model = mw.load(path)
    except mw.ModelError:  # no muscles
        model = mujoco.MjModel.from_xml_path(str(path))
        data = start(model)
        return ran(model, data, seconds, lambda _: None, 0, lambda: mujoco.mj_step(model, data), lambda: ())
    if timestep is not None:
        model.opt.timestep = timestep
    data = start(model)
    places = excitation_places(model, data, read(data).names)

    def set_controls(values: np.ndarray) -> None:
        for place, value in zip(places, values, strict=True):
            place[0] = value

    return ran(
        model, data, seconds, set_controls, len(places),
        lambda: mujoco.mj_step(model, data), lambda: read(data).status,
    )  # fmt: skip


def excitation_places(model: mujoco.MjModel, data: mujoco.MjData, names: list[str]) -> list[np.ndarray]:
    """Return where each muscle's excitation is written: its actuator's control, or the plugin's state."""
    own = excitations(data)
    found = []
    for name in names:
        actuator = _actuator(model, name)
        found.append(data.ctrl[actuator : actuator + 1] if actuator >= 0 else own[name])
    return found


def _actuator(model: mujoco.MjModel, name: str) -> int:
    return mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, name)


def by_system(path: Path, seconds: float) -> Row:
    """Run a saved model with MuscleSystem."""
    model = mujoco.MjModel.from_xml_path(str(path))
    data = start(model)
    muscles = mw.MuscleSystem(model)
    muscles.reset(data)

    excitation = np.zeros(len(muscles.names))
    places = [
        data.ctrl[actuator : actuator + 1]
        if (actuator := _actuator(model, name)) >= 0
        else excitation[i : i + 1]
        for i, name in enumerate(muscles.names)
    ]

    def set_controls(values: np.ndarray) -> None:
        for place, value in zip(places, values, strict=True):
            place[0] = value
        muscles.excitation = excitation

    return ran(
        model, data, seconds, set_controls, len(places),
        lambda: muscles.step(data), lambda: muscles.status,
    )  # fmt: skip


def checked(path: Path) -> Row:
    """Return which tests of `mjwrap check` failed, each with its words."""
    model = mujoco.MjModel.from_xml_path(str(path))
    outcome = check_model(model, poses=5, samples=31, base=start(model).qpos, seed=0)
    return {"tests": len(outcome.checks), "failed": [_words(check) for check in outcome.failed]}


def _words(check: Any) -> str:
    return " ".join(str(part) for part in vars(check).values()) if hasattr(check, "__dict__") else str(check)


def by_opensim(path: Path, seconds: float) -> str:
    """Say how OpenSim's own run of a file with the same kind of excitations ends."""
    try:
        import opensim  # pyright: ignore[reportMissingImports]
    except ImportError:
        return "the opensim wheel is not there"
    opensim.Logger.setLevelString("Off")
    model = opensim.Model(str(path))
    model.initSystem()
    muscles = model.getMuscles()
    drawn = controls(muscles.getSize(), seconds, 0)
    control = opensim.PrescribedController()
    control.setName("random_excitations")
    for i in range(muscles.getSize()):
        steps = opensim.PiecewiseConstantFunction()
        for k, value in enumerate(drawn[:, i]):
            steps.addPoint(k * HOLD, float(value))
        control.addActuator(muscles.get(i))
        control.prescribeControlForActuator(muscles.get(i).getName(), steps)
    model.addController(control)
    reached = 0.0
    began = time.perf_counter()
    try:
        state = model.initSystem()
        model.equilibrateMuscles(state)
        manager = opensim.Manager(model)
        manager.setIntegratorAccuracy(ACCURACY)
        manager.initialize(state)
        while reached < seconds - 1e-9 and time.perf_counter() - began < 120.0:
            state = manager.integrate(reached + HOLD)
            reached += HOLD
    except RuntimeError as error:
        return f"fails after {reached:.2f} s: {' '.join(str(error).split())[:160]}"
    return f"reaches {reached:.2f} s in {time.perf_counter() - began:.1f} s"


def attempt(what: Callable[[], Row]) -> Row:
    """Return the figures, or the error."""
    try:
        return what()
    except Exception as error:
        return {"error": f"{type(error).__name__}: {' '.join(str(error).split())[:300]}"}


def measure(path: Path, folder: Path, seconds: float) -> Row:
    """Return everything measured of one file."""
    began = time.perf_counter()
    row: Row = {"model": path.name}
    try:
        imported = mw.import_osim(path)
        target = folder / f"{path.stem}.xml"
        imported.save(target)
    except mw.MjwrapError as error:
        return row | {"error": f"{type(error).__name__}: {error}"}
    row["import_seconds"] = time.perf_counter() - began
    row["plugin"] = attempt(lambda: by_plugin(target, seconds))
    row["system"] = attempt(lambda: by_system(target, seconds))
    row["check"] = attempt(lambda: checked(target))
    if bad(row):
        finer = mujoco.MjModel.from_xml_path(str(target)).opt.timestep / FINER
        row[f"plugin, step {finer:g} s"] = attempt(lambda: by_plugin(target, seconds, finer))
        row["OpenSim"] = by_opensim(path, seconds)
    return row


def bad(row: Row) -> bool:
    """Return whether a run of a model did not end well."""
    runs = [row.get(name, {}) for name in ("plugin", "system")]
    return "error" in row or any("error" in run or not run["finite"] or run["warnings"] for run in runs)


def say(row: Row) -> None:
    """Print the figures of one model."""
    print(
        f"\n{row['model']}: {row.get('error') or 'import {:.2f} s'.format(row['import_seconds'])}", flush=True
    )
    for name, run in row.items():
        if not name.startswith(("plugin", "system")):
            continue
        if "error" in run:
            print(f"  {name:8} {run['error']}")
            continue
        failures = ", ".join(f"{key} {value:.2%}" for key, value in run["statuses"].items()) or "none"
        ending = "finite" if run["finite"] else f"not finite after {run['simulated']:.3f} s"
        print(
            f"  {name:8} {run['steps_per_second']:8.0f} steps/s  {run['times_real_time']:6.2f} x real time  {ending}  "
            f"path failures: {failures}  warnings: {run['warnings'] or 'none'}"
        )
    if "check" in row:
        found = row["check"]
        print(f"  check    {found.get('error') or (found['failed'] or 'no check failed')}")
    if "OpenSim" in row:
        print(f"  OpenSim  {row['OpenSim']}", flush=True)


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", nargs="*", default=None, metavar="NAME", help="parts of file names")
    parser.add_argument("--seconds", type=float, default=2.0)
    parser.add_argument("--json", type=Path, default=None)
    options = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for path in sorted(options.folder.glob("*.osim")):
            if options.only is not None and not any(part in path.name for part in options.only):
                continue
            rows.append(measure(path, Path(folder), options.seconds))
            say(rows[-1])
    if options.json is not None:
        options.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    return 1 if any(bad(row) for row in rows) else 0


if __name__ == "__main__":
    sys.exit(main())
