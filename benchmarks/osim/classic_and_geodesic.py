"""OpenSim's classic paths beside geodesics: one model, the same excitations. Needs the packages opensim and matplotlib.

    python benchmarks/osim/classic_and_geodesic.py arm26.osim [--plot FILE.png]

OpenSim integrates the model with a PrescribedController (accuracy 1e-8); mjwrap steps the imported model from the same
state with the same excitations. Lengths, lengthening speeds, tensions and joint torques are compared at OpenSim's
states (coordinates, speeds, activations, fibre lengths), so that only paths differ; the motions are compared as they
run. Limits of joints are off in both.
"""

import argparse
from pathlib import Path

import mujoco
import numpy as np
import opensim

import mjwrap as mw

KNOTS = (0.0, 0.1, 0.45, 0.55, 1.0)  # [s]
FLEXOR, EXTENSOR = (0.02, 0.3, 0.3, 0.05, 0.05), (0.02, 0.05, 0.05, 0.15, 0.15)
INTERVAL = 0.01  # [s]


def excitation(name: str) -> tuple[float, ...]:
    """Return the excitation of a muscle at the knots."""
    return EXTENSOR if name.upper().startswith("TRI") else FLEXOR


def run_opensim(file: Path) -> dict[str, np.ndarray]:
    """Return times, coordinates, speeds, activations, fibre lengths and OpenSim's outputs."""
    model = opensim.Model(str(file))
    names = [m.getName() for m in model.getMuscles()]
    forces = model.updForceSet()
    for i in range(forces.getSize()):
        if opensim.CoordinateLimitForce.safeDownCast(forces.get(i)) is not None:
            forces.get(i).set_appliesForce(False)
    controller = opensim.PrescribedController()
    controller.setName("excitations")
    for name in names:
        controller.addActuator(model.getMuscles().get(name))
        function = opensim.PiecewiseLinearFunction()
        for time, value in zip(KNOTS, excitation(name), strict=True):
            function.addPoint(time, value)
        controller.prescribeControlForActuator(name, function)
    model.addController(controller)
    state = model.initSystem()
    model.equilibrateMuscles(state)
    muscles = [model.getMuscles().get(name) for name in names]
    coordinates = [c for c in model.getCoordinateSet() if not c.isConstrained(state)]
    manager = opensim.Manager(model)
    manager.setIntegratorAccuracy(1e-8)
    manager.initialize(state)
    rows: dict[str, list] = {k: [] for k in ("q", "u", "a", "fiber", "length", "speed", "tension", "torque")}
    times = INTERVAL * np.arange(round(KNOTS[-1] / INTERVAL) + 1)
    for time in times:
        if time > 0.0:
            state = manager.integrate(float(time))
        model.realizeDynamics(state)
        tension = np.array([m.getTendonForce(state) for m in muscles])
        arms = np.array([[m.computeMomentArm(state, c) for c in coordinates] for m in muscles])
        rows["q"].append([c.getValue(state) for c in coordinates])
        rows["u"].append([c.getSpeedValue(state) for c in coordinates])
        rows["a"].append([m.getActivation(state) for m in muscles])
        rows["fiber"].append([m.getFiberLength(state) for m in muscles])
        rows["length"].append([m.getLength(state) for m in muscles])
        rows["speed"].append([m.getLengtheningSpeed(state) for m in muscles])
        rows["tension"].append(tension)
        rows["torque"].append(arms.T @ tension)
    found = {key: np.array(values) for key, values in rows.items()}
    return {
        "time": times,
        "muscles": np.array(names),
        "joints": np.array([c.getName() for c in coordinates]),
        **found,
    }


class Geodesics:
    """The imported model, given OpenSim's states."""

    def __init__(self, file: Path, theirs: dict[str, np.ndarray]) -> None:
        self.model = mw.import_osim(file).spec.compile()
        self.model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_LIMIT)
        self.data, self.muscles = mujoco.MjData(self.model), mw.MuscleSystem(self.model)
        self.theirs = theirs
        self.joints = [str(name) for name in theirs["joints"]]
        self.rows = [self.muscles.index(str(name)) for name in theirs["muscles"]]
        actuators = [self.model.actuator(str(name)).id for name in theirs["muscles"]]
        self.ctrl = actuators
        self.act = [int(self.model.actuator_actadr[i]) for i in actuators]

    def set(self, k: int) -> None:
        """Set OpenSim's state number k."""
        model, data, theirs = self.model, self.data, self.theirs
        mw.osim.set_coordinates(model, data, dict(zip(self.joints, theirs["q"][k].tolist(), strict=True)))
        for joint, u in zip(self.joints, theirs["u"][k], strict=True):
            data.qvel[model.joint(joint).dofadr] = u
        data.act[self.act] = theirs["a"][k]
        data.act[[i + 1 for i in self.act]] = theirs["fiber"][k]

    def outputs(self) -> dict[str, np.ndarray]:
        """Return lengths, speeds, tensions and torques at all of OpenSim's states."""
        rows: dict[str, list] = {k: [] for k in ("length", "speed", "tension", "torque")}
        for k in range(len(self.theirs["time"])):
            self.set(k)
            mujoco.mj_forward(self.model, self.data)
            self.muscles.forward(self.data)
            tension = self.muscles.tension[self.rows].copy()
            rows["length"].append(self.muscles.length[self.rows].copy())
            rows["speed"].append(self.muscles.velocity[self.rows].copy())
            rows["tension"].append(tension)
            rows["torque"].append(self.muscles.moment_arms(self.data, self.joints)[self.rows].T @ tension)
        return {key: np.array(values) for key, values in rows.items()}

    def motion(self) -> np.ndarray:
        """Return the coordinates of the motion from OpenSim's first state."""
        mujoco.mj_resetData(self.model, self.data)
        self.set(0)
        self.muscles.reset(self.data)
        found = [self.theirs["q"][0]]
        steps = round(INTERVAL / self.model.opt.timestep)
        for _ in self.theirs["time"][1:]:
            for _ in range(steps):
                middle = self.data.time + 0.5 * self.model.opt.timestep
                self.data.ctrl[self.ctrl] = [
                    np.interp(middle, KNOTS, excitation(str(n))) for n in self.theirs["muscles"]
                ]
                self.muscles.step(self.data)
            values = mw.osim.coordinates(self.model, self.data)
            found.append(np.array([values[joint] for joint in self.joints]))
        return np.array(found)


def plot(file: str, theirs: dict[str, np.ndarray], ours: dict[str, np.ndarray], motion: np.ndarray) -> None:
    """Draw differences of length, speed and tension, torques and motions."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(2, 3, figsize=(13, 6.5), layout="constrained")
    time = theirs["time"]
    kinds = (
        ("length", "length [mm]", 1e3),
        ("speed", "lengthening speed [mm/s]", 1e3),
        ("tension", "tension [N]", 1.0),
    )
    for axis, (key, label, scale) in zip(axes[0], kinds, strict=True):
        for i, name in enumerate(theirs["muscles"]):
            axis.plot(time, scale * (ours[key][:, i] - theirs[key][:, i]), label=name)
        axis.set_title(f"geodesic − classic: {label}", fontsize=10)
    axes[0, 0].legend(fontsize=8)
    for i in range(len(theirs["muscles"])):
        axes[1, 0].plot(time, theirs["tension"][:, i], "--", color=f"C{i}")
        axes[1, 0].plot(time, ours["tension"][:, i], color=f"C{i}")
    axes[1, 0].set_title("tension [N]: geodesic —, classic - -", fontsize=10)
    both = (("torque [N m]", ours["torque"], theirs["torque"]), ("coordinates [rad]", motion, theirs["q"]))
    for axis, (label, a, b) in zip(axes[1, 1:], both, strict=True):
        for i, name in enumerate(theirs["joints"]):
            axis.plot(time, a[:, i], color=f"C{i}", label=name)
            axis.plot(time, b[:, i], "--", color=f"C{i}")
        axis.set_title(f"{label}: geodesic —, classic - -", fontsize=10)
        axis.legend(fontsize=8)
    for axis in axes.flat:
        axis.set_xlabel("time [s]")
        axis.grid(alpha=0.3)
    figure.savefig(file, dpi=85)


def main() -> None:
    """Print the largest differences, and draw them."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("model", type=Path, help=".osim file")
    parser.add_argument("--plot", metavar="FILE.png", help="draw the comparison")
    options = parser.parse_args()
    opensim.Logger.setLevelString("Error")
    theirs = run_opensim(options.model)
    geodesics = Geodesics(options.model, theirs)
    ours, motion = geodesics.outputs(), geodesics.motion()
    print("largest difference, geodesic - classic, at OpenSim's states")
    print("muscle        length [mm]  speed [mm/s]  tension [N]  of at most [N]")
    for i, name in enumerate(theirs["muscles"]):
        sizes = [float(np.abs(ours[k][:, i] - theirs[k][:, i]).max()) for k in ("length", "speed", "tension")]
        print(
            f"{name:12} {1e3 * sizes[0]:12.4f} {1e3 * sizes[1]:13.3f} {sizes[2]:12.3f} "
            f"{theirs['tension'][:, i].max():15.1f}"
        )
    for i, name in enumerate(theirs["joints"]):
        torque = float(np.abs(ours["torque"][:, i] - theirs["torque"][:, i]).max())
        gap = np.abs(motion[:, i] - theirs["q"][:, i])
        most = float(np.abs(theirs["torque"][:, i]).max())
        print(
            f"{name}: torque {torque:.4f} N m of at most {most:.2f} N m; motion {gap.max():.5f} rad, "
            f"at 0.3 s {gap[30]:.6f} rad"
        )
    if options.plot:
        plot(options.plot, theirs, ours, motion)


if __name__ == "__main__":
    main()
