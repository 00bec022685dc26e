#!/usr/bin/env python3
"""Compare random models over all classes of elements with OpenSim: poses, mass matrix, lengths, moment arms, tensions.

    python benchmarks/osim/random_models/compare.py [--first 0] [--count 300] [--poses 4] [--keep FOLDER]

Needs the package opensim. A third of the models has odd names, a tenth a closing constraint (seed % 10 == 9), a tenth
coordinates that drive splines only (8), a tenth joints on ellipsoids (7): of these three, poses set by name need not
be OpenSim's. For every quantity it prints how many comparisons there were, the largest difference, the seeds of the
models beyond a tolerance, and the models that only one of the two programs reads. Not judged: paths with contact, as
OpenSim's are approximate; moment arms, which OpenSim takes about angular velocities in ball joints, without segments
between moving points; and tensions, as half of the muscle classes are approximated, which the report of an import says.
Lengths and mass matrices may be off by what functions of degrees above 4, and bodies without mass, are approximated by.
A process of its own takes the models, as OpenSim may end its process.
"""

from __future__ import annotations

import argparse
import collections
import concurrent.futures
import multiprocessing
import tempfile
from pathlib import Path
from typing import Any

from whole_models import random_model

NOT_JUDGED = ("tension", "length of paths with contact", "moment arms")
LOOSER = {"length of paths without contact": 1e-9, "reduced mass matrix, share of its diagonal": 1e-6}


def traits(seed: int) -> dict[str, bool]:
    """Return what the model of a seed has."""
    return {
        "closed": seed % 10 == 9,
        "curved": seed % 10 == 8,
        "surfaces": seed % 10 == 7,
        "odd_names": seed % 3 == 2,
    }


def compared(seed: int, poses: int, folder: str) -> dict[str, Any]:
    """Return the largest differences of one model, or what each program says if it refuses it."""
    import mujoco

    import mjwrap as mw
    from mjwrap.osim.verifying.differences import verify
    from mjwrap.osim.verifying.opensim_numbers import compute_reference

    path = Path(folder) / f"random_{seed}.osim"
    path.write_text(random_model(seed, **traits(seed)), encoding="utf-8")
    found: dict[str, Any] = {"seed": seed}
    try:
        imported = mw.import_osim(path)
        found["left out"] = [
            f"{e.kind}: {e.text}" for e in imported.report.entries if e.outcome == "left out"
        ]
    except mw.OsimError as error:
        found["mjwrap"] = str(error)
    except Exception as error:  # whatever it is, it is a finding
        return found | {"broken": f"{type(error).__name__}: {error}"}
    try:
        reference = compute_reference(path, poses, motions=False)
    except (mw.OsimError, RuntimeError) as error:
        found["opensim"] = str(error)
    if "mjwrap" in found or "opensim" in found:
        return found
    model = mujoco.MjModel.from_xml_string(imported.xml, imported.assets)
    try:
        result = verify(model, reference)
    except Exception as error:
        return found | {"broken": f"{type(error).__name__}: {error}"}
    found["quantities"] = {q.what: (q.count, q.largest, q.tight, q.worst) for q in result.quantities}
    found["missing"] = result.missing
    return found


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--first", type=int, default=0, metavar="SEED")
    parser.add_argument("--count", type=int, default=300, metavar="N")
    parser.add_argument("--poses", type=int, default=4, metavar="N")
    parser.add_argument("--keep", metavar="FOLDER", help="keep the models here")
    options = parser.parse_args()
    spawn = multiprocessing.get_context("spawn")
    results: list[dict[str, Any]] = []
    with tempfile.TemporaryDirectory() as folder:
        seeds = list(range(options.first, options.first + options.count))
        while seeds:
            # one worker, so that a crash of OpenSim is that of the model that was next
            with concurrent.futures.ProcessPoolExecutor(1, spawn, max_tasks_per_child=60) as pool:
                for seed in list(seeds):
                    try:
                        job = pool.submit(compared, seed, options.poses, options.keep or folder)
                        results.append(job.result())
                    except concurrent.futures.process.BrokenProcessPool:
                        results.append({"seed": seed, "opensim": "ends its process"})
                        seeds.remove(seed)
                        break
                    seeds.remove(seed)
    tell(results)


def tell(results: list[dict[str, Any]]) -> None:
    """Print what was found."""
    both = [found for found in results if "quantities" in found]
    print(f"{len(results)} models, {len(both)} compared")
    for who, other in (("mjwrap", "opensim"), ("opensim", "mjwrap")):
        alone = [f for f in results if who in f]
        print(f"refused by {who}: {len(alone)}, of these by {other} too: {sum(other in f for f in alone)}")
        for found in alone:
            if other not in found:
                print(f"  {found['seed']}: {found[who][:300]}")
    for found in results:
        if "broken" in found:
            print(f"  {found['seed']}: {found['broken'][:300]}")
    for what in dict.fromkeys(what for found in both for what in found["quantities"]):
        rows = [(found["quantities"][what], found["seed"]) for found in both if what in found["quantities"]]
        (_, largest, tight, worst), seed = max(rows, key=lambda row: row[0][1])
        tight = LOOSER.get(what, tight)
        beyond = [seed for row, seed in rows if not row[1] <= tight]
        print(
            f"{what}: {sum(row[0] for row, _ in rows)} compared, largest {largest:.2e} ({worst}, seed {seed})"
        )
        if beyond and not what.startswith(NOT_JUDGED):
            print(f"  not within {tight:g}: {len(beyond)} models: {' '.join(map(str, beyond))}")
    for title in ("left out", "missing"):
        counts = collections.Counter(text for found in results for text in found.get(title, ()))
        for text, count in counts.most_common(12):
            print(f"{title} {count}: {text[:160]}")


if __name__ == "__main__":
    main()
