"""Make the picture of docs/viewer.md: what MuJoCo's renderer shows of models with mjwrap's plugin.

python docs/_figures/viewer.py    # into docs/images; needs the myo-sim package, see [myo] in pyproject.toml
"""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import mujoco
import myo_sim
import numpy as np
from PIL import Image

import mjwrap as mw
from mjwrap.video.offscreen import Offscreen

ROOT = Path(__file__).resolve().parents[2]
WIDTH, HEIGHT = 400, 440
GAP = 6


def panel(
    model: mujoco.MjModel,
    least: float,
    look_at: Any,
    distance: float,
    azimuth: float,
    elevation: float,
    *,
    actuators: bool = False,
) -> np.ndarray[Any, Any]:
    """Return the picture of a model after 0.1 s with its first muscle excited by `least`, its last one fully."""
    data, camera, option = mujoco.MjData(model), mujoco.MjvCamera(), mujoco.MjvOption()
    data.ctrl[:] = np.linspace(least, 1.0, model.nu)
    while data.time < 0.1:
        mujoco.mj_step(model, data)
    camera.lookat[:], camera.distance = look_at, distance
    camera.azimuth, camera.elevation = azimuth, elevation
    for flag in (mujoco.mjtVisFlag.mjVIS_ACTUATOR, mujoco.mjtVisFlag.mjVIS_ACTIVATION):
        option.flags[int(flag)] = actuators
    canvas = Offscreen(model, 2 * WIDTH, 2 * HEIGHT)
    picture = canvas.picture(data, camera, option)
    canvas.close()
    return np.asarray(Image.fromarray(picture).resize((WIDTH, HEIGHT), Image.Resampling.LANCZOS))


def main() -> None:
    """Draw three models side by side."""
    warnings.simplefilter("ignore")  # myo_sim's own, about saving its models as XML
    mujoco.set_mju_user_warning(lambda text: None)
    arm = mw.install(myo_sim.load_spec("myoarm_r"))
    elbow, torus = (mw.load(ROOT / "models" / name / f"{name}.xml") for name in ("elbow", "torus_threading"))
    pictures = [
        panel(torus, 1.0, (-0.02, 0.0, -0.02), 0.26, 90, -40),
        panel(elbow, 0.05, (0.0, 0.0, 1.18), 0.75, 70, -15, actuators=True),
        panel(arm, 0.05, (0.0, -0.2, 1.35), 0.6, 130, -10),
    ]
    space = np.full((HEIGHT, GAP, 3), 255, dtype=np.uint8)
    joined = [part for picture in pictures for part in (picture, space)][:-1]
    Image.fromarray(np.hstack(joined)).save(ROOT / "docs" / "images" / "viewer.png", optimize=True)


if __name__ == "__main__":
    main()
