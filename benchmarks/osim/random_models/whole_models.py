"""A whole random model as the text of an .osim file."""

from __future__ import annotations

import numpy as np
from elements import element, listed
from forces import contact, forces, wrap_object
from skeletons import COUNTS, CUSTOM, ON_SURFACES, Maker, marker

MESHES = "".join(
    f"<{tag}>{sizes}</{tag}>"
    for tag, sizes in (
        ("Brick", "<half_lengths>0.1 0.02 0.03</half_lengths>"),
        ("Sphere", "<radius>0.02</radius><scale_factors>1 2 1</scale_factors>"),
        ("Cylinder", "<radius>0.02</radius><half_height>0.1</half_height>"),
        ("Mesh", "<mesh_file>absent.vtp</mesh_file>"),
    )
)


def random_model(
    seed: int, *, closed: bool = False, odd_names: bool = False, curved: bool = False, surfaces: bool = False
) -> str:
    """Return a random model.

    closed: with a constraint between two bodies. odd_names: names that are not ASCII, or that MuJoCo or XML know.
    curved: some coordinates drive nothing but splines. surfaces: with joints whose centres move on ellipsoids.
    """
    rng = np.random.default_rng(seed)
    maker = Maker(rng, odd_names, curved)
    made = maker.skeleton
    count = int(rng.integers(2, 6))
    kinds = [kind for kind in COUNTS if surfaces or kind not in ON_SURFACES]
    parents = [int(rng.integers(-1, max(index, 1))) if index else -1 for index in range(count)]
    leaves = set(range(count)) - set(parents)
    wraps: list[str] = []
    for index in range(count):
        inside = ""
        if rng.random() < 0.6:
            names = [f"over{index}_{k}" for k in range(int(rng.integers(1, 3)))]
            wraps += names
            inside += listed("WrapObjectSet", [wrap_object(rng, name) for name in names])
        if rng.random() < 0.3:
            inside += f"<attached_geometry>{MESHES}</attached_geometry>"
        maker.body(index, inside, light=index not in leaves and rng.random() < 0.15)
    for index, parent in enumerate(parents):
        kind = CUSTOM if rng.random() < 0.4 else str(rng.choice(kinds))
        maker.joint(index, "ground" if parent < 0 else made.bodies[parent], made.bodies[index], kind)
    maker.couplers()
    if closed:
        maker.constraint()
    pulls = forces(rng, made, wraps)
    geometry = ""
    if rng.random() < 0.25:
        geometry, force = contact(rng, made)
        pulls.append(force)
    markers = [marker(rng, f"marker{k}", str(rng.choice(made.frames))) for k in range(3)]
    ground_wraps = listed("WrapObjectSet", [wrap_object(rng, "on_ground")] * (rng.random() < 0.2))
    model = element(
        "Model",
        element("Ground", ground_wraps, name="ground"),
        listed("BodySet", made.body_set),
        listed("JointSet", made.joint_set),
        listed("ConstraintSet", made.constraint_set),
        listed("ForceSet", pulls),
        listed("MarkerSet", markers),
        geometry,
        name=f"random_{seed}",
        gravity=(0.0, -9.80665, 0.0),
    )
    return f'<?xml version="1.0" encoding="UTF-8"?>\n<OpenSimDocument Version="40600">\n{model}</OpenSimDocument>\n'
