"""Run all checks of a model: at random poses from a cold start, along sweeps of every joint, in short motions."""

from __future__ import annotations

from collections.abc import Callable

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.checking.couplings import check_couplings
from mjwrap.checking.differences import Neighbourhood, extrapolated_error, orders
from mjwrap.checking.energy import check_energy
from mjwrap.checking.forces import balance_check, evaluate_forces, power_check, work_check
from mjwrap.checking.outcome import Check, Checks
from mjwrap.checking.sweeps import Paths, Sweeper
from mjwrap.errors import ModelError
from mjwrap.mjcf import dof_names
from mjwrap.poses.joint_sweeps import PoseMaker
from mjwrap.poses.sizes import turning_dofs
from mjwrap.system import CableSystem, MuscleSystem

Array = NDArray[np.float64]
LEAST = 1e-3  # smallest moment arm to which errors are relative, as a share of the length; 1 along slides
Progress = Callable[[str, int, int], object]


def check_model(
    model: mujoco.MjModel,
    *,
    poses: int = 20,
    samples: int = 101,
    base: Array | None = None,
    seed: int = 0,
    side_rule: int | None = None,
    tendons: bool = False,
    progress: Progress | None = None,
) -> Checks:
    """Check the paths, derivatives, forces, continuity and energy of a model's muscles, and its coupled joints.

    Actuators on spatial tendons that are not muscles are checked as strings that pull with a given force: what MuJoCo
    makes of their controls is not mjwrap's. The limits are the same for every model, and relative to its own sizes: a
    model in millimetres passes like its twin in metres.

    Args:
        model: the model; it is not changed.
        poses: number of random poses.
        samples: number of poses of each joint's sweep around the base pose and around the middle of all ranges. Joints
            that are coupled to the swept one follow.
        base: (nq,) base pose; qpos0 if None.
        seed: seed of the random poses.
        side_rule: as for `MuscleSystem`.
        tendons: check spatial tendons without an actuator, too.
        progress: called with (name, number done, total number).

    Returns:
        The checks, each with its worst error.

    Raises:
        ModelError: the model has no muscles.
    """
    muscles = CableSystem(model, side_rule=side_rule, tendons=tendons, pulling=True)
    data = mujoco.MjData(model)
    if not muscles.n:
        raise ModelError("the model has no muscles with geodesic paths: nothing to check")
    start = np.array(model.qpos0 if base is None else base, dtype=np.float64)
    maker = PoseMaker(model, start, seed)
    paths = Paths()
    speed = Check("velocity", "dl/dt is the derivative of l", 1e-8, "of its size")
    arms = Check("moment_arm", "dl/dq is the derivative of l", 1e-8, "of its size")
    forces = work_check(), balance_check(), power_check()
    jumps = Check("jumps", "no jump of length or moment arm along a sweep", 0.0, "jumps")
    makers, middle = [maker], maker.middle()
    if len(maker.joints()) > 1 and not np.array_equal(middle, start):
        makers.append(PoseMaker(model, middle, seed, 1))
    free = [joint for joint in maker.joints() if not maker.follows(joint)]
    sweeps = [(each, joint, axis) for each in makers for joint in free for axis in each.axes(joint)]
    total = poses + len(sweeps) + 1
    tell = progress or (lambda name, done, all: None)

    rng = np.random.default_rng(seed)
    measured: list[Array] = []
    motion = maker.random(poses)
    for k in range(poses):
        tell("random poses", k, total)
        where = f"random pose {k}"
        data.qpos[:], data.qvel[:] = motion.qpos[k], motion.qvel[k]
        data.act[:], data.ctrl[:] = rng.uniform(0.1, 1.0, model.na), rng.uniform(0.1, 1.0, len(data.ctrl))
        muscles.excitation = rng.uniform(0.1, 1.0, muscles.n)
        muscles.reset(data)
        measured.append(_derivatives(muscles, data, where, speed, arms, paths))
        evaluate_forces(muscles, data, where, forces)
    found = np.concatenate([np.empty(0), *measured])
    if found.size:
        arms.remarks.append(f"differences converge to it with order {np.median(found):.2f} (expected: 2)")
    data.qvel[:] = 0.0
    sweeper = Sweeper(muscles, data, paths, jumps)
    for k, (each, joint, axis) in enumerate(sweeps):
        tell("sweeps", poses + k, total)
        sweeper.sweep(each, joint, axis, samples)
    tell("energy", total - 1, total)
    energy = check_energy(model, maker.base, side_rule, tendons)
    coupled = len(maker.joints()) - len(free)
    followed = check_couplings(model, maker.base, motion.qpos)
    facts = {"muscles": muscles.n, "random_poses": poses, "sweeps": len(sweeps), "poses_of_a_sweep": samples,
             "joints_that_follow": coupled, "cables": len(muscles.cables), "tendons": len(muscles.bare)}  # fmt: skip
    last = [energy] if followed is None else [energy, followed]
    return Checks([*paths.finish(), speed, arms, *forces, jumps, *last], facts)


def _derivatives(
    muscles: MuscleSystem, data: mujoco.MjData, where: str, speed: Check, arms: Check, paths: Paths
) -> Array:
    """Compare l̇ and ∂l/∂q at a pose with differences of l; return the orders with which these converge to ∂l/∂q."""
    model = muscles.model
    jacobian = muscles.length_jacobian(data)
    paths.record(muscles, data, where)
    velocity, length = muscles.velocity, muscles.length
    around = Neighbourhood(muscles, data)
    # the length itself stands for a moment arm, so that angles and slides have one scale
    units = np.where(turning_dofs(model) & (length[:, None] > 0.0), length[:, None], 1.0)
    size = np.maximum((np.abs(jacobian) / units).max(axis=1, initial=0.0), LEAST)
    full = np.maximum(np.abs(jacobian) @ np.abs(data.qvel), LEAST * (units @ np.abs(data.qvel)))
    full[full == 0.0] = 1.0  # a model without joints does not move
    speed.see(extrapolated_error(around.central(data.qvel.copy()), velocity) / full, where, muscles.names)
    found = []
    for d, dof in enumerate(dof_names(model)):
        central = around.central(np.eye(model.nv)[d])
        scale = size * units[:, d]
        arms.see(extrapolated_error(central, jacobian[:, d]) / scale, f"{dof}, {where}", muscles.names)
        found.append(orders(central, jacobian[:, d], scale))
    return np.concatenate([np.empty(0), *found])
