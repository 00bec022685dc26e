"""Random bodies and joints of all classes, in trees with joints in both directions, and constraints."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from elements import element, function, offset_frame, place, rising

COUNTS = {
    "WeldJoint": 0,
    "PinJoint": 1,
    "SliderJoint": 1,
    "PlanarJoint": 3,
    "UniversalJoint": 2,
    "BallJoint": 3,
    "GimbalJoint": 3,
    "FreeJoint": 6,
    "EllipsoidJoint": 3,
    "ScapulothoracicJoint": 4,
}
LENGTHS = {"SliderJoint": (0,), "PlanarJoint": (1, 2), "FreeJoint": (3, 4, 5)}  # coordinates that are lengths
CUSTOM, ON_SURFACES = "CustomJoint", ("EllipsoidJoint", "ScapulothoracicJoint")
NAMES = ("hip", "knee(1)", "Schulter_ü", "a.b", "ground_", "world", "toe-l", "q", "b'c", "x&y", "膝")


@dataclass
class Skeleton:
    """A random skeleton: names of bodies and coordinates, frames to attach things to, and the sets as XML."""

    bodies: list[str] = field(default_factory=list)
    frames: list[str] = field(default_factory=lambda: ["/ground"])  # paths
    coordinates: dict[str, tuple[str, float, float]] = field(default_factory=dict)  # path and range by name
    body_set: list[str] = field(default_factory=list)
    joint_set: list[str] = field(default_factory=list)
    constraint_set: list[str] = field(default_factory=list)


class Maker:
    """Makes one random skeleton; `curved: some coordinates drive only splines."""

    def __init__(self, rng: np.random.Generator, odd_names: bool, curved: bool) -> None:
        self.rng, self.odd, self.curved = rng, odd_names, curved
        self.skeleton = Skeleton()
        self.joints: list[str] = []
        self.held: set[str] = set()  # coordinates that are locked, prescribed or clamped

    def name(self, usual: str, taken: list[str]) -> str:
        free = [name for name in NAMES if name not in taken]
        return str(self.rng.choice(free)) if self.odd and self.rng.random() < 0.5 and free else usual

    def body(self, index: int, inside: str, light: bool) -> str:
        """Add a body; return its name."""
        rng, made = self.rng, self.skeleton
        name = self.name(f"b{index}", made.bodies)
        made.bodies.append(name)
        frames = []
        if rng.random() < 0.4:
            frames.append(offset_frame(rng, "on_it", f"/bodyset/{name}"))
            frames.append(offset_frame(rng, "on_that", f"/bodyset/{name}/on_it"))
            made.frames.append(f"/bodyset/{name}/on_that")
        made.frames.append(f"/bodyset/{name}")
        mass = 0.0 if light else rng.uniform(0.5, 3.0)
        moments = np.array([1.0, rng.uniform(0.6, 1.4), 1.0]) * mass * 0.01
        more = inside
        made.body_set.append(
            element(
                "Body",
                f"<components>{''.join(frames)}</components>" if frames else "",
                more,
                name=name,
                mass=mass,
                mass_center=rng.normal(0.0, 0.05, 3) * (mass > 0.0),
                inertia=[*moments, *(0.05 * moments.min() * rng.normal(size=3) * (mass > 0.0))],
            )
        )
        return name

    def joint(self, index: int, parent: str, child: str, kind: str) -> None:
        """Add a joint between two bodies, sometimes with the child as its parent."""
        rng, made = self.rng, self.skeleton
        turned = rng.random() < 0.2 and kind not in ON_SURFACES
        ends = [("/ground" if body == "ground" else f"/bodyset/{body}") for body in (parent, child)]
        frames, sockets = [], []
        for k, end in enumerate(reversed(ends) if turned else ends):
            name = f"end{k}"
            if rng.random() < 0.75:
                frames.append(offset_frame(rng, name, end))
                if rng.random() < 0.2:
                    frames.append(offset_frame(rng, f"{name}_more", f"../{name}"))
                    name = f"{name}_more"
                sockets.append(name)
            else:
                sockets.append(end)
        same = rng.random() < 0.15 and child not in self.joints
        name = child if same else self.name(f"j{index}", self.joints)
        self.joints.append(name)
        count = int(rng.integers(1, 4)) if kind == CUSTOM else COUNTS[kind]
        coordinates, elements = [], []
        for k in range(count):
            usual = name if k == 0 and rng.random() < 0.1 else f"q{index}_{k}"
            coordinates.append(usual if usual not in made.coordinates else f"q{index}_{k}")
            elements.append(self.coordinate(coordinates[-1], f"/jointset/{name}", k in LENGTHS.get(kind, ())))
        inside = [f"<coordinates>{''.join(elements)}</coordinates>" * bool(elements)]
        inside.append(f"<frames>{''.join(frames)}</frames>" * bool(frames))
        numbers: dict[str, object] = {}
        if kind == CUSTOM:
            inside.append(self.transform(coordinates))
        elif kind == "EllipsoidJoint":
            numbers = {"radii_x_y_z": rng.uniform(0.05, 0.3, 3)}
        elif kind == "ScapulothoracicJoint":
            numbers = {
                "thoracic_ellipsoid_radii_x_y_z": rng.uniform(0.05, 0.3, 3),
                "scapula_winging_axis_origin": rng.normal(0.0, 0.05, 2),
                "scapula_winging_axis_direction": rng.uniform(-1.0, 1.0),
            }
        made.joint_set.append(
            element(
                kind,
                *inside,
                name=name,
                socket_parent_frame=sockets[0],
                socket_child_frame=sockets[1],
                **numbers,
            )
        )

    def coordinate(self, name: str, joint: str, length: bool) -> str:
        rng = self.rng
        size = 0.1 if length else 1.0
        low, high = -rng.uniform(0.2, 1.2) * size, rng.uniform(0.2, 1.2) * size
        self.skeleton.coordinates[name] = f"{joint}/{name}", low, high
        more = "<prescribed_function>" + element("Constant", value=0.1 * size) + "</prescribed_function>"
        locked, prescribed = rng.random() < 0.04, rng.random() < 0.03
        if locked or prescribed:
            self.held.add(name)
        clamped = rng.random() < 0.4
        if clamped:  # OpenSim assembles a coordinate that follows another within its clamp
            self.held.add(name)
        return element(
            "Coordinate",
            more * prescribed,
            name=name,
            default_value=rng.uniform(low, high),
            range=(low, high),
            clamped=bool(clamped),
            locked=bool(locked),
            prescribed=bool(prescribed),
        )

    def transform(self, coordinates: list[str]) -> str:
        """Return six axes: each coordinate has one of its own, the others are functions of any."""
        rng = self.rng
        own = rng.permutation(6)[: len(coordinates)]
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0] if rng.random() < 0.5 else np.eye(3)
        axes = []
        for k in range(6):
            axis = turn[k] + 0.2 * rng.normal(size=3) * (rng.random() < 0.3) if k < 3 else np.eye(3)[k - 3]
            title = f"{'rotation' if k < 3 else 'translation'}{k % 3 + 1}"
            owner = [coordinate for coordinate, place in zip(coordinates, own, strict=True) if place == k]
            if owner:
                _, low, high = self.skeleton.coordinates[owner[0]]
                slope = float(rng.choice([1.0, 1.0, -1.0]))
                made = (
                    rising(rng, low, high)
                    if self.curved and rng.random() < 0.5
                    else element("LinearFunction", coefficients=(slope, rng.normal(0.0, 0.1)))
                )
            elif rng.random() < 0.5:
                owner, made = [str(rng.choice(coordinates))], function(rng, size=0.3 if k < 3 else 0.05)
            else:  # OpenSim's velocities leave out constant turns before others: docs/opensim.md
                made = element("Constant", value=0.0 if k < 2 else rng.normal(0.0, 0.1))
            named = {"coordinates": owner[0]} if owner else {}
            axes.append(element("TransformAxis", made, name=title, axis=axis, **named))
        return f"<SpatialTransform>{''.join(axes)}</SpatialTransform>"

    def couplers(self) -> None:
        """Let some coordinates follow others."""
        rng, made = self.rng, self.skeleton
        names = [name for name in made.coordinates if name not in self.held]
        for k in range(1, len(names)):
            if rng.random() < 0.12:
                leader = names[rng.integers(0, k)]
                kind = str(
                    rng.choice(
                        ("LinearFunction", "SimmSpline", "PolynomialFunction", "PiecewiseLinearFunction")
                    )
                )
                made.constraint_set.append(
                    element(
                        "CoordinateCouplerConstraint",
                        f"<coupled_coordinates_function>{function(rng, kind)}</coupled_coordinates_function>",
                        name=f"c{k}",
                        independent_coordinate_names=leader,
                        dependent_coordinate_name=names[k],
                        scale_factor=rng.uniform(0.3, 1.0),
                    )
                )

    def constraint(self) -> None:
        """Join two bodies by a constraint of a random class."""
        rng, made = self.rng, self.skeleton
        first, second = (f"/bodyset/{body}" for body in rng.choice(made.bodies, 2, replace=False))
        points = rng.normal(0.0, 0.1, (2, 3))
        kind = str(rng.choice(("PointConstraint", "ConstantDistanceConstraint", "PointOnLineConstraint")))
        if kind == "PointOnLineConstraint":
            parts = {
                "socket_line_body": first,
                "socket_follower_body": second,
                "line_direction_vec": rng.normal(size=3),
                "point_on_line": points[0],
                "point_on_follower": points[1],
            }
        else:
            parts = {
                "socket_body_1": first,
                "socket_body_2": second,
                "location_body_1": points[0],
                "location_body_2": points[1],
            }
        if kind == "ConstantDistanceConstraint":
            parts["constant_distance"] = rng.uniform(0.2, 0.6)
        made.constraint_set.append(element(kind, name="closing", **parts))


def marker(rng: np.random.Generator, name: str, frame: str) -> str:
    return element("Marker", name=name, socket_parent_frame=frame, location=place(rng)["translation"])
