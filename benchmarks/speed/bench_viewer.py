"""Cost of drawing: filling a scene with a model's muscles, and with its native twin's tendons, in turns, in one run.

Prints medians and 95th percentiles of `mjv_updateScene`, which needs no OpenGL, with tendons shown and not shown.

    python benchmarks/speed/bench_viewer.py                       # models/elbow
    python benchmarks/speed/bench_viewer.py myo_sim:myoarm_r myo_sim:myofullbody
"""

from __future__ import annotations

import argparse
import json
import platform
import sys
import time
import warnings
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

import mjwrap as mw
from mjwrap.runs.models import load_spec

ELBOW = Path(__file__).resolve().parents[2] / "models" / "elbow" / "elbow.xml"
STEPS = 50  # of a weakly excited motion, before a scene is filled
ROOM = 20_000  # geoms


class Scene:
    """A model in motion, and the scene that shows it."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self.model, self.data, self.scene = model, mujoco.MjData(model), mujoco.MjvScene(model, ROOM)
        self.option, self.camera = mujoco.MjvOption(), mujoco.MjvCamera()
        self.data.ctrl[:] = 0.3
        mujoco.mj_step(model, self.data, nstep=STEPS)

    def fill(self, tendons: bool) -> float:
        """Fill the scene; return how long that took [us]."""
        self.option.flags[int(mujoco.mjtVisFlag.mjVIS_TENDON)] = tendons
        start = time.perf_counter()
        mujoco.mjv_updateScene(
            self.model, self.data, self.option, None, self.camera, int(mujoco.mjtCatBit.mjCAT_ALL), self.scene
        )
        return 1e6 * (time.perf_counter() - start)


def measure(source: str, turns: int) -> dict[str, Any]:
    """Fill both scenes in turns."""
    scenes = {"native": Scene(load_spec(source).compile()), "mjwrap": Scene(mw.install(load_spec(source)))}
    times = {(kind, shown): [] for kind in scenes for shown in (True, False)}
    for _ in range(turns):
        for (kind, shown), taken in times.items():
            taken.append(scenes[kind].fill(shown))
    result: dict[str, Any] = {"model": source}
    for kind, scene in scenes.items():
        scene.fill(True)
        result[kind] = {"geoms": int(scene.scene.ngeom), "muscles": int(scene.model.nu)}
        for shown, name in ((True, "with tendons"), (False, "without")):
            median, slow = np.percentile(times[kind, shown], [50, 95])
            result[kind][name] = {"median_us": float(median), "p95_us": float(slow)}
    return result


def main() -> int:
    """Measure each model and print one line for each of its twins."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("models", nargs="*", default=[str(ELBOW)], help="MJCF files, or myo_sim:NAME")
    parser.add_argument("--turns", type=int, default=300)
    parser.add_argument("--json", type=Path, help="write the results there")
    options = parser.parse_args()
    warnings.simplefilter("ignore")  # myo_sim's own, about saving its models as XML
    mujoco.set_mju_user_warning(lambda text: None)
    results = [measure(source, options.turns) for source in options.models]
    for result in results:
        for kind in ("native", "mjwrap"):
            one = result[kind]
            shown, hidden = one["with tendons"], one["without"]
            print(
                f"{Path(result['model']).stem} {kind}: {one['geoms']} geoms, {shown['median_us']:.1f} us "
                f"(p95 {shown['p95_us']:.1f}); without tendons {hidden['median_us']:.1f} us"
            )
    if options.json:
        about = {"mujoco": mujoco.__version__, "machine": platform.machine(), "results": results}
        options.json.write_text(json.dumps(about, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
