"""Make the picture of the muscle data behind models/elbow: docs/images/elbow_muscles.png.

    python docs/_figures/elbow.py

Parameters are those of models/elbow/elbow.xml, whose README has the source of each. The force-length curves are those
of De Groote-Fregly 2016; fibre lengths, tensions and moments are computed by mjwrap.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import mujoco
import numpy as np

import mjwrap as mw
from mjwrap.kernels.musculotendon import fiber

ROOT = Path(__file__).resolve().parents[2]
OUTPUT = ROOT / "docs" / "images" / "elbow_muscles.png"
JOINT = "elbow_flexion"


def force_length(axis: Any, curves: Any, colours: dict[str, Any]) -> None:
    """Draw the force-length curve, and below it the part that each muscle runs through."""
    x = np.linspace(0.3, 1.6, 261)
    forces = np.array([fiber.length_curves(mw.DeGrooteFregly2016.code, float(a)) for a in x])
    axis.plot(x, forces[:, 0], color="black", label="active")
    axis.plot(x, forces[:, 2], "--", color="black", label="passive")
    low, high = curves["normalized_fiber_length"].min(axis=0), curves["normalized_fiber_length"].max(axis=0)
    for place, (name, colour) in enumerate(colours.items()):
        height = -0.12 * (place + 1)
        axis.plot(
            (low[place], high[place]), (height, height), color=colour, linewidth=5, solid_capstyle="butt"
        )
        axis.text(0.22, height, name, fontsize=8, va="center", color=colour)
    axis.set(
        xlabel="fibre length [optimal lengths]",
        ylabel="force [maximum isometric forces]",
        xlim=(0.18, 1.64),
        ylim=(-1.0, 1.5),
    )
    axis.set_yticks((0.0, 0.5, 1.0, 1.5))
    axis.legend(fontsize=8, frameon=False, loc="upper left")
    axis.set_title("curves, and below them each muscle's fibre range", fontsize=10)


def main() -> None:
    """Draw the three panels."""
    model = mujoco.MjModel.from_xml_path(str(ROOT / "models" / "elbow" / "elbow.xml"))
    curves, passive = (mw.curves(model, JOINT, activation=level) for level in (1.0, 0.0))
    cycle = plt.get_cmap("tab10").colors  # pyright: ignore[reportAttributeAccessIssue]
    colours = dict(zip(curves.names, cycle, strict=False))
    figure, axes = plt.subplots(1, 3, figsize=(13, 4.2), layout="constrained")
    force_length(axes[0], curves, colours)
    degrees = np.degrees(curves.at)
    for place, (name, colour) in enumerate(colours.items()):
        law = mw.MuscleSystem(model).declarations[place].parameters
        assert isinstance(law, mw.DeGrooteFregly2016)
        label = (
            f"{name}: {law.max_isometric_force:.0f} N, {1e3 * law.optimal_fiber_length:.0f} mm, "
            f"{1e3 * law.tendon_slack_length:.0f} mm"
        )
        axes[1].plot(degrees, curves["tension"][:, place], color=colour, label=label)
        axes[1].plot(degrees, passive["tension"][:, place], ":", color=colour)
        axes[2].plot(degrees, curves["moment"][:, place], color=colour)
    axes[1].set(ylabel="tension [N]", ylim=(0.0, 1900.0))
    axes[1].set_title("fully active, and without activation (dotted)", fontsize=10)
    axes[1].legend(fontsize=7.5, frameon=False, ncols=1, loc="upper right", title="max. force, fibre, tendon")
    total = curves["moment"]
    axes[2].plot(degrees, np.where(total > 0, total, 0).sum(axis=1), color="0.3", linewidth=2.5)
    axes[2].plot(degrees, np.where(total < 0, total, 0).sum(axis=1), color="0.3", linewidth=2.5)
    axes[2].set(ylabel="moment [N m]")
    axes[2].set_title("moments, and their sums (thick)", fontsize=10)
    for axis in axes[1:]:
        axis.set_xlabel(f"{JOINT} [°]")
    for axis in axes:
        axis.grid(alpha=0.25)
    figure.savefig(OUTPUT, dpi=100)


if __name__ == "__main__":
    main()
