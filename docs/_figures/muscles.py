"""Make the pictures of docs/muscles.md: curves, force-length-velocity surfaces, a quick release.

    python docs/_figures/muscles.py    # into docs/images

Every number comes from mjwrap itself: the curves from its kernels, the experiments from `mw.simulate_muscle`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import mjwrap as mw
from mjwrap.kernels.musculotendon import fiber

IMAGES = Path(__file__).resolve().parents[1] / "images"
LAWS: dict[str, Any] = {"De Groote–Fregly 2016": mw.DeGrooteFregly2016, "Millard 2012": mw.Millard2012}
COLORS = {"De Groote–Fregly 2016": "#4878a8", "Millard 2012": "#c03030"}
SOLEUS = {  # a long tendon beside short, pennate fibres
    "max_isometric_force": 3549.0,
    "optimal_fiber_length": 0.05,
    "tendon_slack_length": 0.25,
    "pennation_angle": np.deg2rad(25.0),
}


def curves() -> None:
    """Draw the four curves of each law."""
    x, v = np.linspace(0.3, 1.8, 301), np.linspace(-1.2, 1.2, 301)
    strain = np.linspace(-0.01, 0.06, 201)
    figure, axes = plt.subplots(1, 4, figsize=(12, 3), layout="constrained")
    for name, law in LAWS.items():
        code = law.code
        lengths = np.array([fiber.length_curves(code, float(a)) for a in x])
        axes[0].plot(x, lengths[:, 0], color=COLORS[name], label=name)
        axes[1].plot(x, lengths[:, 2], color=COLORS[name])
        axes[2].plot(v, [fiber.velocity_curve(code, float(a))[0] for a in v], color=COLORS[name])
        axes[3].plot(
            100 * strain, [fiber.tendon_curve(code, 1.0 + float(a))[0] for a in strain], color=COLORS[name]
        )
    for axis, title, label in zip(
        axes,
        ("active force–length", "passive force–length", "force–velocity", "tendon"),
        (
            "fibre length [optimal lengths]",
            "fibre length [optimal lengths]",
            "fibre velocity [max. velocities]",
            "tendon strain [%]",
        ),
        strict=True,
    ):
        axis.set(title=title, xlabel=label)
        axis.grid(alpha=0.3)
    axes[0].set_ylabel("force [max. isometric forces]")
    axes[1].set_ylim(-0.05, 2.0)
    axes[0].legend(fontsize=7)
    figure.savefig(IMAGES / "muscle_curves.png", dpi=110)


def surfaces() -> None:
    """Draw the tension of a fully active muscle with a rigid tendon over fibre length and velocity."""
    length, speed = np.meshgrid(np.linspace(0.4, 1.6, 61), np.linspace(-1.0, 1.0, 61))
    figure = plt.figure(figsize=(10, 4.2), layout="constrained")
    for i, (name, law) in enumerate(LAWS.items()):
        muscle = law(max_isometric_force=1.0, optimal_fiber_length=1.0, tendon_slack_length=0.0)
        force = mw.simulate_muscle(
            muscle, np.arange(length.size), length.ravel(), velocity=10.0 * speed.ravel(), activation=1.0
        ).tension.reshape(length.shape)
        axis: Any = figure.add_subplot(1, 2, i + 1, projection="3d")
        axis.plot_surface(length, speed, force, cmap="viridis", linewidth=0)
        axis.set(
            title=name, xlabel="fibre length [l_o]", ylabel="fibre velocity [v_max]", zlabel="tension [F_max]"
        )
        axis.set_xticks((0.5, 1.0, 1.5))
        axis.set_yticks((-1.0, 0.0, 1.0))
        axis.view_init(25, -60)
        axis.set_box_aspect(None, zoom=0.9)
    figure.savefig(IMAGES / "muscle_surface.png", dpi=110)


def quick_release() -> None:
    """Let a held, active muscle shorten by 3 mm within 2 ms, with either tendon."""
    time = np.arange(0.0, 0.2, 1e-4)
    length = 0.30 - 0.003 * np.clip((time - 0.05) / 0.002, 0.0, 1.0)
    figure, axes = plt.subplots(1, 3, figsize=(11, 3), layout="constrained")
    for name, law in LAWS.items():
        for tendon, style in (("elastic", "-"), ("rigid", ":")):
            run = mw.simulate_muscle(
                law(**SOLEUS, fiber_damping=0.1, tendon=tendon), time, length, activation=0.5
            )
            label = f"{name}, {tendon}"
            axes[1].plot(1e3 * time, run.tension, style, color=COLORS[name], label=label)
            axes[2].plot(1e3 * time, 1e3 * run.fiber_length, style, color=COLORS[name])
    axes[0].plot(1e3 * time, 1e3 * length, color="black")
    for axis, title, label in zip(
        axes, ("musculotendon length", "tension", "fibre length"), ("[mm]", "[N]", "[mm]"), strict=True
    ):
        axis.set(title=title, xlabel="time [ms]", ylabel=label)
        axis.grid(alpha=0.3)
    axes[1].legend(fontsize=7)
    figure.savefig(IMAGES / "quick_release.png", dpi=110)


if __name__ == "__main__":
    curves()
    surfaces()
    quick_release()
