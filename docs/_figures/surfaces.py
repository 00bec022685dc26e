"""Make the pictures of docs/surfaces.md: every surface with a path over it, a recording, surfaces fitted to a bone.

    python docs/_figures/surfaces.py    # into docs/images, and out/strap.rrd; the bone needs the myo-sim package
    python docs/_figures/recordings.py out/strap.rrd docs/images/recording_surfaces.png

Paths and surfaces come from mjwrap itself; sizes are in centimetres.
"""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import mujoco
import numpy as np
from matplotlib.colors import to_rgb
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

import mjwrap as mw
from mjwrap import fitting
from mjwrap.surfaces.triangles import surface_grid, triangles

IMAGES = Path(__file__).resolve().parents[1] / "images"
BLUE, RED, YELLOW = "#4878a8", "#c03030", "#e0a010"
# the three parts of the bone in docs/surfaces.md; its frame: y up, x forwards, origin in the head
PARTS: list[tuple[str, Any, Any]] = [
    ("head", mw.fit_ellipsoid, fitting.beyond((0, -0.015, 0), (0, 1, 0))),
    ("shaft", mw.fit_cylinder, fitting.in_box((-1, -0.25, -1), (1, -0.06, 1))),
    ("elbow", mw.fit_cylinder, fitting.beyond((0, -0.28, 0), (0, -1, 0))),
]
# name, surface, origin and insertion [m], hint
PICTURES: list[tuple[str, Any, tuple[float, ...], tuple[float, ...], tuple[float, ...] | None]] = [
    ("Cylinder", mw.Cylinder(0.022, 0.04), (-0.05, 0.02, -0.03), (0.05, 0.0, 0.025), (0, -0.022, 0)),
    ("Sphere", mw.Sphere(0.033), (-0.055, 0.02, -0.01), (0.055, 0.01, 0.03), (0, -0.033, 0)),
    ("Capsule", mw.Capsule(0.02, 0.022), (-0.05, 0.02, -0.01), (0.035, 0.01, 0.045), (0, -0.02, 0.02)),
    ("Ellipsoid", mw.Ellipsoid((0.042, 0.02, 0.03)), (-0.055, 0.01, -0.02), (0.06, 0.005, 0.02), (0, -0.02, 0)),
    (
        "EllipticCylinder", mw.EllipticCylinder((0.035, 0.016), 0.04), (-0.05, 0.01, -0.03), (0.055, 0.01, 0.02),
        (0, -0.016, 0),
    ),
    ("Cone", mw.Cone(0.038, 0.012, 0.04), (-0.055, 0.015, -0.02), (0.05, 0.01, 0.02), (0, -0.025, 0)),
    ("Torus", mw.Torus(0.033, 0.014), (0.045, -0.035, -0.035), (0.045, 0.0, 0.04), (0.019, 0, 0)),
]  # fmt: skip


def draw(
    axes: Any, surface: Any, color: str = BLUE, alpha: float = 1.0, turn: Any = None, origin: Any = 0.0
) -> None:
    """Draw a surface in the frame given by a rotation (3, 3) and an origin (3,)."""
    vertices, faces = triangles(surface_grid(surface, 61, 41))
    if turn is not None:
        vertices = vertices @ np.asarray(turn).T
    sheet(axes, vertices + np.asarray(origin), faces, color, alpha)


def sheet(axes: Any, vertices: Any, faces: Any, color: str, alpha: float) -> None:
    """Draw a closed mesh: the half that faces the eye, lit from above."""
    corners = 100 * vertices[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    rise, turn = np.radians((axes.elev, axes.azim))
    eye = np.array([np.cos(rise) * np.cos(turn), np.cos(rise) * np.sin(turn), np.sin(rise)])
    near = normal @ eye > 0
    light = 0.55 + 0.45 * np.clip(normal[near] @ (eye + np.array([0.0, 0.0, 0.8])) / 1.4, 0, 1)
    pale = 0.35 + 0.65 * np.array(to_rgb(color))
    colors = np.column_stack([pale * light[:, None], np.full(near.sum(), alpha)])
    edges: dict[str, Any] = (
        {"edgecolors": colors, "linewidths": 0.4} if alpha == 1.0 else {"edgecolors": "none"}
    )
    axes.add_collection3d(Poly3DCollection(corners[near], facecolors=colors, **edges))


def equal(axes: Any, points: Any) -> None:
    """Show points (m, 3) with the same scale along all axes, and no frame."""
    low, high = np.min(points, axis=0), np.max(points, axis=0)
    axes.set_box_aspect(high - low, zoom=1.18)
    for setter, a, b in zip((axes.set_xlim, axes.set_ylim, axes.set_zlim), low, high, strict=True):
        setter(a, b)
    axes.set_axis_off()


def every_surface(path: Path) -> None:
    """Draw every surface with a path over it, its axes and contact points."""
    figure = plt.figure(figsize=(11, 5.4))
    for k, (name, surface, origin, insertion, hint) in enumerate(PICTURES):
        axes: Any = figure.add_subplot(2, 4, k + 1, projection="3d", computed_zorder=False)
        axes.view_init(elev=24, azim=-66)
        found = mw.solve_path(origin, insertion, [mw.Obstacle(surface, hint=hint)])
        print(
            f"{name}: {found.status.name}, {100 * found.length:.3f} cm, tangency error {found.tangency_error:.1e}"
        )
        draw(axes, surface)
        for axis, letter in zip(3.4 * np.eye(3), "xyz", strict=True):
            axes.plot(*np.column_stack([np.zeros(3), axis]), color="0.25", linewidth=0.8)
            axes.text(*(1.12 * axis), letter, fontsize=8, color="0.25")
        axes.plot(*(100 * found.points(0.001)).T, color=RED, linewidth=2.2)
        axes.scatter(*(100 * np.array([origin, insertion])).T, color=RED, s=16, depthshade=False)
        contact = found.contacts[0]
        axes.scatter(*(100 * np.array([contact.P, contact.Q])).T, color=YELLOW, s=20, depthshade=False)
        axes.set_title(name, fontsize=11, y=1.0)
        equal(axes, np.array([[-4.6, -4.6, -4.2], [4.6, 4.6, 4.2]]))
    figure.subplots_adjust(0, 0, 1, 0.93, 0, 0.08)
    figure.savefig(path, dpi=110)


def record_strap(path: Path) -> None:
    """Record a muscle over four surfaces in a row, with varying activation."""
    model = mujoco.MjModel.from_xml_path(str(Path(__file__).with_name("strap.xml")))
    data, muscles = mujoco.MjData(model), mw.MuscleSystem(model)
    data.qpos[:] = 0.5, 0.7
    path.parent.mkdir(exist_ok=True)
    with mw.Recorder(model, muscles, path) as recorder:
        for k in range(400):
            muscles.excitation[:] = 0.5 + 0.5 * np.sin(0.02 * k)
            muscles.step(data)
            recorder.log(data)
    print(f"{path}: {muscles.report() or 'a path at every step'}")


def fitted_bone(path: Path) -> None:
    """Draw the humerus of myo_sim's arm with the surfaces that are fitted to it in docs/surfaces.md."""
    import myo_sim

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        model: Any = myo_sim.load_model("myoarm_r")
    up = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]], dtype=float)  # the bone stands on its elbow
    mesh = int(model.geom_dataid[model.geom("humerus_r").id])
    first, start = int(model.mesh_faceadr[mesh]), int(model.mesh_vertadr[mesh])
    faces = model.mesh_face[first : first + int(model.mesh_facenum[mesh])]
    geom = model.geom("humerus_r")
    bone = model.mesh_vert[start : start + int(model.mesh_vertnum[mesh])] @ matrix(geom.quat).T + geom.pos
    figure = plt.figure(figsize=(10, 4.6))
    dots: Any = None
    for k, (name, fit, region) in enumerate(PARTS):
        x = mw.mesh_points(model, "humerus_r", region=region)
        found = fit(x)
        axes: Any = figure.add_subplot(1, 3, k + 1, projection="3d", computed_zorder=False)
        axes.view_init(elev=12, azim=-60)
        inside = region(bone)[faces].any(axis=1)
        sheet(axes, bone @ up.T, faces[inside], "#b8b0a0", 1.0)
        draw(axes, found.surface, BLUE, 0.45, up @ matrix(found.quat), up @ np.array(found.pos))
        dots = axes.scatter(
            *(100 * x @ up.T).T,
            c=1e3 * found.distances,
            cmap="coolwarm",
            vmin=-5,
            vmax=5,
            s=9,
            depthshade=False,
        )
        axes.set_title(
            f"{name}: {type(found.surface).__name__}\nrms {1e3 * found.rms:.1f} mm, "
            f"max {1e3 * found.max_distance:.1f} mm",
            fontsize=10, y=1.02,
        )  # fmt: skip
        middle, half = 50 * (x.min(axis=0) + x.max(axis=0)) @ up.T, 55 * np.ptp(x, axis=0).max()
        equal(axes, np.array([middle - half, middle + half]))
    figure.subplots_adjust(0, 0, 0.9, 0.84, 0, 0)
    bar = figure.colorbar(dots, cax=figure.add_axes((0.92, 0.2, 0.012, 0.6)))
    bar.set_label("distance of a vertex [mm]; positive: it sticks out")
    figure.savefig(path, dpi=110)


def matrix(quat: Any) -> Any:
    """Return the rotation (3, 3) of a unit quaternion w, x, y, z."""
    w, x, y, z = quat
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


if __name__ == "__main__":
    every_surface(IMAGES / "surfaces.png")
    record_strap(IMAGES.parents[1] / "out" / "strap.rrd")
    fitted_bone(IMAGES / "bone_fit.png")
