"""Mean error of moment arms of imported models, beside OpenSim, and the time of the import. Needs the package opensim.

    python benchmarks/osim/moment_arm_errors.py MODEL.osim ... [--samples 21] [--bases 3] [--seed 0]

The measure of converters' reports: the mean of |r - r_OpenSim| over sweeps of one coordinate at a time through its
range, the others at their default values and at random ones; over all pairs of a muscle and a coordinate for which
OpenSim has a moment arm above 0.1 mm at one sample at least. Printed too: the mean over pairs without wraps, the
largest mean of a pair, and how many mean errors are up to 1 micrometre.
"""

import argparse
import time
from pathlib import Path

import mujoco
import numpy as np
import opensim

import mjwrap as mw

CROSSED = 1e-4  # [m]
WIDEST = 3.14159  # [rad or m]


def errors(
    file: Path, samples: int, bases: int, seed: int
) -> tuple[float, dict[tuple[str, str], float], set[str]]:
    """Return the seconds of the import, the mean error of every pair [m], and the muscles with wraps."""
    start = time.perf_counter()
    imported = mw.import_osim(file)
    seconds = time.perf_counter() - start
    model = imported.spec.compile()
    data, muscles = mujoco.MjData(model), mw.MuscleSystem(model)
    theirs = opensim.Model(str(file))
    theirs.set_assembly_accuracy(1e-12)
    state = theirs.initSystem()
    every = [theirs.getCoordinateSet().get(i) for i in range(theirs.getCoordinateSet().getSize())]
    free = [c for c in every if not c.isConstrained(state)]
    names = [c.getName() for c in free]
    settable = [n for n in names if n in muscles.coordinates]
    paths = {m.getName(): m.getGeometryPath() for m in theirs.getMuscles() if m.getName() in muscles}
    rows = [muscles.index(name) for name in paths]
    low = np.array([max(c.getRangeMin(), -WIDEST) for c in free])
    high = np.array([min(c.getRangeMax(), WIDEST) for c in free])
    default = np.array([c.getDefaultValue() for c in free])
    random = np.random.default_rng(seed)
    starts = [default, *(random.uniform(low, high) for _ in range(bases))]
    sums: dict[tuple[str, str], list[tuple[float, float]]] = {}
    for k, swept in enumerate(free):
        if swept.getName() not in settable:
            continue
        for base in starts:
            for value in np.linspace(low[k], high[k], samples):
                pose = base.copy()
                pose[k] = value
                for coordinate, q in zip(free, pose, strict=True):
                    coordinate.setValue(state, float(q), False)
                theirs.assemble(state)
                theirs.realizePosition(state)
                given = {n: c.getValue(state) for n, c in zip(names, free, strict=True) if n in settable}
                mw.osim.set_coordinates(model, data, given)
                mujoco.mj_forward(model, data)
                muscles.reset(data)
                muscles.forward(data)
                arms = muscles.moment_arms(data, [swept.getName()])[rows, 0]
                for (name, path), arm in zip(paths.items(), arms, strict=True):
                    theirs_arm = path.computeMomentArm(state, swept)
                    sums.setdefault((name, swept.getName()), []).append(
                        (abs(arm - theirs_arm), abs(theirs_arm))
                    )
    pairs = {
        pair: float(np.mean([error for error, _ in found]))
        for pair, found in sums.items()
        if max(size for _, size in found) > CROSSED
    }
    return seconds, pairs, {name for name, path in paths.items() if path.getWrapSet().getSize() > 0}


def main() -> None:
    """Print a row for every model."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("models", nargs="+", type=Path, help=".osim files")
    parser.add_argument("--samples", type=int, default=21, help="poses of a sweep (default: 21)")
    parser.add_argument(
        "--bases", type=int, default=3, help="random poses of the other coordinates (default: 3)"
    )
    parser.add_argument("--seed", type=int, default=0, help="seed of these (default: 0)")
    options = parser.parse_args()
    opensim.Logger.setLevelString("Error")
    mw.import_osim("mjwrap:leg")  # what is loaded or compiled once is not timed
    print(
        "model                          import [s]  pairs  mean [mm]  without wraps [mm]  up to 1 um  largest mean [mm]"
    )
    for file in options.models:
        seconds, pairs, wrapped = errors(file, options.samples, options.bases, options.seed)
        straight = [e for (name, _), e in pairs.items() if name not in wrapped]
        worst = max(pairs, key=lambda pair: pairs[pair])
        small = sum(e <= 1e-6 for e in pairs.values())
        print(
            f"{file.stem:30} {seconds:10.2f}  {len(pairs):5}  {1e3 * np.mean(list(pairs.values())):9.1e}  "
            f"{1e3 * np.mean(straight) if straight else float('nan'):18.1e}  {small:10}  "
            f"{1e3 * pairs[worst]:.3f} ({worst[0]} about {worst[1]})",
            flush=True,
        )


if __name__ == "__main__":
    main()
