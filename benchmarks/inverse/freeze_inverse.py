"""Freeze OpenSim's inverse dynamics and moment arms along a gait-like motion into a JSON file, for tests.

    python benchmarks/inverse/freeze_inverse.py MODEL.osim OUTPUT.json [APPLIED_TO ...]

It needs the package `opensim`. The motion is a sum of two harmonics for every coordinate, with a walking pelvis;
coordinates that follow a coupler are where OpenSim's assembly puts them. On each body given, a force acts like a
ground reaction, in the frame of the ground; on the first one also a force and torque whose axes and point are in
bodies' frames. Stored are the motion, the loads and their .xml file, the tables that InverseDynamicsTool writes with
and without the loads, the rate of the mechanical energy at some frames, by differences along the splines that OpenSim
has, and what `computeMomentArm` gives there for paths without wrapping objects.
"""

from __future__ import annotations

import json
import sys
import tempfile
from hashlib import sha256
from pathlib import Path

import numpy as np
import opensim
from scipy.interpolate import make_interp_spline

FRAMES, DURATION, SOME = 31, 1.2, (3, 9, 17)
STEP = 5e-5  # [s] of the differences of energy
LOADED = 121  # times of the loads, others than the motion's
# mean, amplitudes of the first and second harmonic [rad, m]; others are small swings about the default
SHAPES = {
    "knee_angle": (-0.6, 0.45, 0.25), "hip_flexion": (0.15, 0.4, 0.05), "ankle_angle": (0.0, 0.2, 0.1),
    "r_elbow_flex": (1.0, 0.5, 0.1), "pelvis_tx": (0.0, 0.02, 0.01), "pelvis_ty": (0.95, 0.01, 0.02),
}  # fmt: skip
SPEED = 1.3  # [m/s] of the pelvis
FORCE = """<ExternalForce name="{name}"><applied_to_body>{body}</applied_to_body>
<force_expressed_in_body>{axes}</force_expressed_in_body><point_expressed_in_body>{frame}</point_expressed_in_body>
<force_identifier>{mark}_v</force_identifier><point_identifier>{mark}_p</point_identifier>
<torque_identifier>{mark}_m</torque_identifier></ExternalForce>"""
DOCUMENT = """<?xml version="1.0" encoding="UTF-8"?>
<OpenSimDocument Version="40000"><ExternalLoads name="loads"><objects>{}</objects>
<datafile>loads.mot</datafile></ExternalLoads></OpenSimDocument>
"""


def main() -> None:
    path, output, bodies = Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3:]
    opensim.Logger.setLevelString("Off")
    model = opensim.Model(str(path))
    state = model.initSystem()
    names = [c.getName() for c in model.getCoordinateSet()]
    time = np.round(np.linspace(0.0, DURATION, FRAMES), 6)
    free = [name for name in names if not model.getCoordinateSet().get(name).isConstrained(state)]
    values = motion(model, state, names, time)
    columns, loads = external_loads(bodies)
    xml = DOCUMENT.format("".join(external_forces(model, bodies)))
    about = {
        "made by": "benchmarks/inverse/freeze_inverse.py",
        "OpenSim": opensim.GetVersion(),
        "model": path.name,
        "sha256": sha256(path.read_bytes()).hexdigest(),
        "coordinates": names,
        "time": time.tolist(),
        "values": values.tolist(),
        "loads": {"columns": columns, "values": loads.tolist(), "xml": xml},
        "free": free,
        "arms": moment_arms(model, state, names, free, values),
        "frames": SOME,
        "energy_rate": energy_rates(path, names, time, values),
    }
    with tempfile.TemporaryDirectory() as folder:
        write(Path(folder, "motion.mot"), names, np.column_stack([time, values]))
        write(Path(folder, "loads.mot"), columns, loads)
        Path(folder, "loads.xml").write_text(xml)
        about["unloaded"] = inverse_dynamics(path, folder, "")
        about["loaded"] = inverse_dynamics(path, folder, "loads.xml") if bodies else None
    output.write_text(json.dumps(about) + "\n")


def motion(model: opensim.Model, state: opensim.State, names: list[str], time: np.ndarray) -> np.ndarray:
    """Return values (T, c) of all coordinates."""
    rng = np.random.default_rng(17)
    phase = 2 * np.pi * time / DURATION
    columns = []
    for name in names:
        coordinate = model.getCoordinateSet().get(name)
        stem = name.removesuffix("_r").removesuffix("_l")
        small = 0.02 if coordinate.getMotionType() == 2 else 0.08
        mean, first, second = SHAPES.get(stem, (coordinate.getDefaultValue(), small, small / 3))
        if stem == "knee_angle" and coordinate.getRangeMax() > 1.0:
            mean = -mean  # this model flexes its knee towards positive angles
        start = np.pi if name.endswith("_l") else 0.0
        shift = rng.uniform(0.0, 0.6)
        wave = first * np.cos(phase + start + shift) + second * np.cos(2 * (phase + start) + shift)
        columns.append(np.round(mean + wave + (SPEED * time if name == "pelvis_tx" else 0.0), 6))
    values = np.column_stack(columns)
    for row in values:
        for name, value in zip(names, row, strict=True):
            coordinate = model.getCoordinateSet().get(name)
            if not coordinate.isConstrained(state):
                coordinate.setValue(state, float(value), False)
        model.setUseVisualizer(False)
        model.assemble(state)
        row[:] = [model.getCoordinateSet().get(name).getValue(state) for name in names]
    return values


def external_loads(bodies: list[str]) -> tuple[list[str], np.ndarray]:
    """Return the names of columns and the values (S, 1 + columns) of the loads, with their times first."""
    time = np.round(np.linspace(-0.05, DURATION + 0.05, LOADED), 6)
    columns, values = [], [time]
    for i, _ in enumerate(bodies):
        stance = np.clip(((time / DURATION + 0.5 * i) % 1.0) / 0.6, 0.0, 1.0)
        hump = np.sin(np.pi * stance) + 0.25 * np.sin(3 * np.pi * stance)
        zero = np.zeros_like(time)
        columns += [f"{i}_{kind}{axis}" for kind in "vpm" for axis in "xyz"]
        values += [-120 * np.sin(2 * np.pi * stance), 750 * hump, 40 * np.sin(np.pi * stance)]
        values += [SPEED * time + 0.2 * stance, zero, 0.1 - 0.2 * i + zero]
        values += [zero, 8 * np.sin(2 * np.pi * stance), zero]
    return columns, np.round(np.column_stack(values), 6)


def external_forces(model: opensim.Model, bodies: list[str]) -> list[str]:
    """Return the elements of all external forces."""
    found = [
        FORCE.format(name=f"load_{i}", body=body, axes="ground", frame="ground", mark=i)
        for i, body in enumerate(bodies)
    ]
    if bodies:
        last = model.getBodySet().get(model.getBodySet().getSize() - 1).getName()
        found.append(FORCE.format(name="frames", body=bodies[0], axes=last, frame=bodies[0], mark=0))
    return found


def moment_arms(
    model: opensim.Model, state: opensim.State, names: list[str], free: list[str], values: np.ndarray
) -> dict[str, list[list[float]]]:
    """Return moment arms [m], rows for frames `SOME`, columns for free coordinates, by muscle without wrapping."""
    found: dict[str, list[list[float]]] = {}
    for k in SOME:
        for name, value in zip(names, values[k], strict=True):
            model.getCoordinateSet().get(name).setValue(state, float(value), False)
        model.realizePosition(state)
        for muscle in model.getMuscles():
            if muscle.getGeometryPath().getWrapSet().getSize():
                continue
            arms = [muscle.computeMomentArm(state, model.getCoordinateSet().get(name)) for name in free]
            found.setdefault(muscle.getName(), []).append(arms)
    return found


def energy_rates(path: Path, names: list[str], time: np.ndarray, values: np.ndarray) -> list[float]:
    """Return the rate of kinetic and potential energy [W] at frames `SOME`, by differences of fourth order."""
    model = opensim.Model(str(path))
    for force in model.getForceSet():  # muscles store energy, too
        force.set_appliesForce(False)
    state = model.initSystem()
    none = np.zeros(len(names))
    end = [(3, none), (4, none)]
    curve = make_interp_spline(time, values, k=5, bc_type=(end, end))
    speed = curve.derivative()

    def energy(t: float) -> float:
        for place, rates in (("setValue", curve), ("setSpeedValue", speed)):
            for name, value in zip(names, rates(t), strict=True):
                coordinate = model.getCoordinateSet().get(name)
                more = (False,) if place == "setValue" else ()
                if not coordinate.getLocked(state):
                    getattr(coordinate, place)(state, float(value), *more)
        model.realizeDynamics(state)
        return model.calcKineticEnergy(state) + model.calcPotentialEnergy(state)

    found = []
    for t in time[list(SOME)]:
        near, far = (energy(t + k * STEP) - energy(t - k * STEP) for k in (1, 2))
        found.append((8 * near - far) / (12 * STEP))
    return found


def inverse_dynamics(path: Path, folder: str, loads: str) -> dict[str, list[float]]:
    """Return the columns of the table of generalised forces that OpenSim's tool writes."""
    tool = opensim.InverseDynamicsTool()
    model = opensim.Model(str(path))
    model.initSystem()
    tool.setModel(model)
    tool.setCoordinatesFileName(f"{folder}/motion.mot")
    if loads:
        tool.setExternalLoadsFileName(f"{folder}/{loads}")
    excluded = opensim.ArrayStr()
    excluded.append("Muscles")
    tool.setExcludedForces(excluded)
    tool.setStartTime(0.0)
    tool.setEndTime(DURATION)
    tool.setLowpassCutoffFrequency(-1.0)
    tool.setResultsDir(folder)
    tool.setOutputGenForceFileName("forces.sto")
    if not tool.run():
        raise RuntimeError("OpenSim's InverseDynamicsTool failed")
    lines = Path(folder, "forces.sto").read_text().split("endheader\n")[1].splitlines()
    rows = np.array([[float(cell) for cell in line.split()] for line in lines[1:]])
    return {name: rows[:, i].tolist() for i, name in enumerate(lines[0].split())}


def write(path: Path, columns: list[str], values: np.ndarray) -> None:
    """Write a table whose first column is time."""
    head = (
        f"{path.stem}\nversion=1\nnRows={len(values)}\nnColumns={len(columns) + 1}\ninDegrees=no\nendheader\n"
    )
    rows = ["\t".join(["time", *columns]), *("\t".join(repr(float(x)) for x in row) for row in values)]
    path.write_text(head + "\n".join(rows) + "\n")


if __name__ == "__main__":
    main()
