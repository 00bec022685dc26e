#!/usr/bin/env python3
"""Verify every OpenSim model of a folder beside OpenSim, one row each, as a table in Markdown.

    python benchmarks/osim/verify_models.py FOLDER [--poses 50] [--geodesics 10] [--numbers CACHE] > verify_table.md

Needs the package opensim. Every model has a process of its own. Each cell is the largest difference, or a share.
"wrapped" is the share of touching pairs of path and pose within 1e-9 m of OpenSim's own geodesics,
`Scholz2015GeometryPath`, at `--geodesics` poses; scholz_lengths.py lists the others.
"import" is the time of reading and writing [s].
"""

from __future__ import annotations

import argparse
import json
import shlex
import subprocess
import sys
import tempfile
import time
from datetime import UTC, datetime
from pathlib import Path

import mujoco
import opensim  # pyright: ignore[reportMissingImports]
import scholz_lengths

import mjwrap as mw
from mjwrap.osim.verifying.differences import verify
from mjwrap.osim.verifying.opensim_numbers import compute_reference, opensim_geodesic
from mjwrap.osim.verifying.reference import read_reference

COLUMNS = {  # heads of the table by the beginning of a quantity's name
    "positions [m]": "position of bodies",
    "mass": "reduced mass matrix",
    "straight [m]": "length of paths without",
    "arms [m]": "moment arms of paths without",
    "laws [F_max]": "tension at OpenSim's",
    "passive": "coordinates in the passive",
    "driven": "coordinates in the driven",
}


def row(path: Path, poses: int, geodesics: int, cache: Path | None) -> dict[str, str]:
    """Return the cells of a model."""
    opensim.Logger.setLevelString("off")
    known = cache / f"{path.stem}.json" if cache is not None else None
    if known is not None and known.exists():
        reference = read_reference(known)
    else:
        reference = compute_reference(path, poses)
        if known is not None:
            reference.save(known)
    start = time.perf_counter()
    imported = mw.import_osim(path)
    cells = {"model": path.stem, "import [s]": f"{time.perf_counter() - start:.2f}"}
    with tempfile.TemporaryDirectory() as folder:
        imported.save(Path(folder) / "model.xml")
        model = mujoco.MjModel.from_xml_path(str(Path(folder) / "model.xml"))
        mw.osim.restore_inertias(model)
    found = verify(model, reference, geodesic=opensim_geodesic())
    for head, begin in COLUMNS.items():
        largest = [q.largest for q in found.quantities if q.what.startswith(begin)]
        cells[head] = f"{largest[0]:.1e}" if largest else ""
    cells["above 1 mm or 1 %, not explained"] = f"{len(found.differences)}, {len(found.unexplained)}"
    count, lines = scholz_lengths.compare(path, geodesics, 0, []) if model.ntuple and geodesics else (0, [])
    cells["wrapped"] = f"{count - len(lines)} of {count}" if count else ""
    return cells


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path, help="folder of models, or one model")
    parser.add_argument("--poses", type=int, default=50)
    parser.add_argument("--geodesics", type=int, default=10)
    parser.add_argument("--numbers", type=Path, help="folder that keeps OpenSim's numbers")
    options = parser.parse_args()
    if options.folder.is_file():
        print(json.dumps(row(options.folder, options.poses, options.geodesics, options.numbers)))
        return
    heads: list[str] = []
    for path in sorted(options.folder.glob("*.osim"), key=lambda p: p.stat().st_size):
        command = [sys.executable, __file__, str(path), *sys.argv[2:]]
        ran = subprocess.run(command, capture_output=True, text=True, check=False)
        if ran.returncode:
            cells = {
                "model": path.stem,
                "import [s]": (ran.stderr.strip().splitlines() or ["failed"])[-1][:120],
            }
        else:
            cells = json.loads(ran.stdout.strip().splitlines()[-1])
        if not heads:
            heads = list(cells)
            print("| " + " | ".join(heads) + " |\n|" + "---|" * len(heads))
        print("| " + " | ".join(cells.get(head, "") for head in heads) + " |", flush=True)
    command = shlex.join(["python", "benchmarks/osim/verify_models.py", *sys.argv[1:]])
    print(
        f"\n`{command}`; OpenSim {opensim.GetVersion()}, MuJoCo {mujoco.__version__}, mjwrap {mw.__version__}, "
        f"{datetime.now(UTC):%Y-%m-%d}"
    )


if __name__ == "__main__":
    main()
