"""Write what OpenSim's quadrants do to a JSON file, against which tests compare mjwrap's sides.

Needs the `opensim` wheel (numbers in tests/data/osim/sides.json: OpenSim 4.6). Run from the repository's root:

    python benchmarks/osim/sides.py path/to/models tests/data/osim/sides.json

For every muscle of arm26.osim and every wrap of it with a quadrant: the points before and after the wrap in the wrap
object's frame, over the range of every coordinate, and OpenSim's length between them. And single strings that move past
a cylinder, an ellipsoid and a sphere.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import opensim  # pyright: ignore[reportMissingImports]

POSES = 13  # over the range of each coordinate
AXES = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}


def direction(quadrant: str) -> list[float]:
    sign = -1.0 if quadrant.startswith("-") else 1.0
    return [sign * x for x in AXES[quadrant[-1]]]


def shape(wrap: Any) -> dict[str, Any]:
    kind = wrap.getConcreteClassName()
    if kind == "WrapCylinder":
        sizes = [opensim.WrapCylinder.safeDownCast(wrap).get_radius()]
    elif kind == "WrapSphere":
        sizes = [opensim.WrapSphere.safeDownCast(wrap).get_radius()]
    else:
        dimensions = opensim.WrapEllipsoid.safeDownCast(wrap).get_dimensions()
        sizes = [dimensions.get(i) for i in range(3)]
    return {"kind": kind, "sizes": sizes, "side": direction(wrap.get_quadrant())}


def local_to_wrap(wrap: Any, state: Any, point: Any) -> list[float]:
    """Return a ground point in the wrap object's frame [m]."""
    found = wrap.getTransform().shiftBaseStationToFrame(
        wrap.getFrame().getTransformInGround(state).shiftBaseStationToFrame(point)
    )
    return [found.get(i) for i in range(3)]


def muscle_wraps(model: Any, state: Any, path: Any) -> list[tuple[Any, str, Any, Any, float]]:
    """Return wrap, point before, point after and OpenSim's length between them, for every wrap that touches now."""
    points = path.getCurrentPath(state)
    found = []
    for i in range(1, points.getSize()):
        wrap, before = points.get(i).getWrapObject(), points.get(i - 1).getWrapObject()
        if wrap is None or before is None or wrap.getName() != before.getName():
            continue
        here = [points.get(j).getLocationInGround(state) for j in (i - 2, i - 1, i, i + 1)]
        numbers = [np.array([p.get(k) for k in range(3)]) for p in here]
        over = opensim.PathWrapPoint.safeDownCast(points.get(i)).getWrapLength(state)
        length = np.linalg.norm(numbers[1] - numbers[0]) + over + np.linalg.norm(numbers[3] - numbers[2])
        names = f"{points.get(i - 2).getName()} {points.get(i + 1).getName()}"
        found.append((wrap, names, here[0], here[3], float(length)))
    return found


def model_rows(file: Path) -> list[dict[str, Any]]:
    model = opensim.Model(str(file))
    state = model.initSystem()
    rows: dict[tuple[str, str], dict[str, Any]] = {}
    coordinates = model.getCoordinateSet()
    for c in range(coordinates.getSize()):
        coordinate = coordinates.get(c)
        for value in np.linspace(coordinate.getRangeMin(), coordinate.getRangeMax(), POSES):
            for other in range(coordinates.getSize()):
                coordinates.get(other).setValue(state, coordinates.get(other).getDefaultValue(), False)
            coordinate.setValue(state, float(value), False)
            model.realizePosition(state)
            for m in range(model.getMuscles().getSize()):
                muscle = model.getMuscles().get(m)
                for wrap, names, a, b, length in muscle_wraps(model, state, muscle.getGeometryPath()):
                    if wrap.get_quadrant() == "all":
                        continue
                    key = muscle.getName(), wrap.getName()
                    row = rows.setdefault(key, {"muscle": key[0], "wrap": key[1], **shape(wrap), "poses": []})
                    row["poses"].append(
                        {
                            "coordinate": coordinate.getName(), "value": float(value), "between": names,
                            "a": local_to_wrap(wrap, state, a), "b": local_to_wrap(wrap, state, b), "length": length,
                        }
                    )  # fmt: skip
    return list(rows.values())


def string_row(kind: str, sizes: list[float], quadrant: str, a: np.ndarray, b: np.ndarray) -> dict[str, Any]:
    """Return OpenSim's lengths of a string between the points a and b (T, 3) in the wrap object's frame [m]."""
    model = opensim.Model()
    wrap = getattr(opensim, kind)()
    wrap.setName("wrap")
    wrap.set_quadrant(quadrant)
    if kind == "WrapCylinder":
        wrap.set_radius(sizes[0])
        wrap.set_length(10.0)
    elif kind == "WrapSphere":
        wrap.set_radius(sizes[0])
    else:
        wrap.set_dimensions(opensim.Vec3(*sizes))
    model.getGround().addWrapObject(wrap)
    spring = opensim.PathSpring("string", 0.1, 1, 0)
    for name in "ab":
        body = opensim.Body(name, 1, opensim.Vec3(0), opensim.Inertia(1))
        model.addBody(body)
        model.addJoint(opensim.FreeJoint(f"joint_{name}", model.getGround(), body))
        spring.updGeometryPath().appendNewPathPoint(name, body, opensim.Vec3(0))
    spring.updGeometryPath().addPathWrap(wrap)
    model.addForce(spring)
    state = model.initSystem()
    poses = []
    for one, other in zip(a, b, strict=True):
        for i in range(3):
            model.getCoordinateSet().get(3 + i).setValue(state, float(one[i]), False)
            model.getCoordinateSet().get(9 + i).setValue(state, float(other[i]), False)
        model.realizePosition(state)
        length = spring.getGeometryPath().getLength(state)
        poses.append({"a": one.tolist(), "b": other.tolist(), "length": length})
    return {"kind": kind, "sizes": sizes, "side": direction(quadrant), "poses": poses}


def string_rows() -> list[dict[str, Any]]:
    rows = []
    shift = np.arange(-0.07, 0.0701, 0.005)
    for kind, sizes in (
        ("WrapCylinder", [0.03]), ("WrapSphere", [0.03]), ("WrapEllipsoid", [0.03, 0.04, 0.05]),
        ("WrapEllipsoid", [0.03, 0.03, 0.15]),
    ):  # fmt: skip
        one, ones = np.zeros_like(shift), np.ones_like(shift)
        a = np.stack([shift, -0.08 * ones, one + 0.012 * (kind != "WrapCylinder")], axis=1)
        b = np.stack([shift + 0.004, 0.075 * ones, one - 0.005 * (kind != "WrapCylinder")], axis=1)
        rows.append(string_row(kind, sizes, "+x", a, b))
        turned = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]).T
        rows.append(string_row(kind, sizes, "-y", a @ turned.T, b @ turned.T))
    return rows


if __name__ == "__main__":
    opensim.Logger.setLevelString("Off")
    models, out = Path(sys.argv[1]), Path(sys.argv[2])
    found = {
        "made_by": f"benchmarks/osim/sides.py, OpenSim {opensim.GetVersion()}",
        "model": "arm26.osim",
        "muscles": model_rows(models / "arm26.osim"),
        "strings": string_rows(),
    }
    out.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
