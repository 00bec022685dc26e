"""Random wrap objects, paths, muscles of all classes, and all other forces."""

from __future__ import annotations

import numpy as np
from elements import element, function, listed, place
from skeletons import Skeleton

MUSCLES = (
    "Thelen2003Muscle",
    "Millard2012EquilibriumMuscle",
    "Millard2012AccelerationMuscle",
    "DeGrooteFregly2016Muscle",
    "RigidTendonMuscle",
    "Schutte1993Muscle_Deprecated",
    "Thelen2003Muscle_Deprecated",
    "Delp1990Muscle_Deprecated",
)
QUADRANTS = ("all", "all", "x", "+x", "-x", "y", "-y", "+y", "+z", "-z")


def wrap_object(rng: np.random.Generator, name: str) -> str:
    kind = str(rng.choice(("WrapCylinder", "WrapSphere", "WrapEllipsoid", "WrapTorus")))
    numbers: dict[str, object] = {
        "WrapCylinder": {"radius": rng.uniform(0.01, 0.05), "length": rng.uniform(0.1, 0.5)},
        "WrapSphere": {"radius": rng.uniform(0.01, 0.05)},
        "WrapEllipsoid": {"dimensions": rng.uniform(0.02, 0.06, 3)},
        "WrapTorus": {"inner_radius": rng.uniform(0.005, 0.01), "outer_radius": rng.uniform(0.03, 0.06)},
    }[kind]
    where = place(rng, 0.05)
    return element(
        kind,
        name=name,
        active=bool(rng.random() < 0.9),
        xyz_body_rotation=where["orientation"],
        translation=where["translation"],
        quadrant=str(rng.choice(QUADRANTS)),
        **numbers,
    )


def path(rng: np.random.Generator, made: Skeleton, wraps: list[str]) -> str:
    """Return a path of two to five points of all kinds, over some of the wrap objects."""
    count = int(rng.integers(2, 6))
    points = []
    for k in range(count):
        frame = str(rng.choice(made.frames))
        inner = 0 < k < count - 1
        kind = (
            str(rng.choice(("PathPoint", "PathPoint", "ConditionalPathPoint", "MovingPathPoint")))
            if inner
            else "PathPoint"
        )
        named: dict[str, object] = {"socket_parent_frame": frame, "location": rng.normal(0.0, 0.12, 3)}
        inside = ""
        if kind != "PathPoint" and not made.coordinates:
            kind = "PathPoint"
        if kind == "ConditionalPathPoint":
            where, low, high = made.coordinates[str(rng.choice(list(made.coordinates)))]
            named |= {"socket_coordinate": where, "range": np.sort(rng.uniform(low, high, 2))}
        elif kind == "MovingPathPoint":
            where, *_ = made.coordinates[str(rng.choice(list(made.coordinates)))]
            for axis in "xyz":
                named[f"socket_{axis}_coordinate"] = where
                moving = function(
                    rng,
                    str(
                        rng.choice(
                            (
                                "SimmSpline",
                                "LinearFunction",
                                "Constant",
                                "PiecewiseLinearFunction",
                                "MultiplierFunction",
                            )
                        )
                    ),
                    0.05,
                )
                inside += f"<{axis}_location>{moving}</{axis}_location>"
        points.append(element(kind, inside, name=f"P{k}", **named))
    chosen = [str(name) for name in rng.permutation(wraps)[: rng.integers(0, 3)]]
    used = []
    for k, name in enumerate(chosen):
        ends = np.sort(rng.integers(1, count + 1, 2)) if rng.random() < 0.4 else (-1, -1)
        used.append(
            element(
                "PathWrap",
                name=f"w{k}",
                wrap_object=name,
                method=str(rng.choice(("hybrid", "midpoint", "axial"))),
                range=f"{ends[0]} {ends[1]}",
            )
        )
    return element("GeometryPath", listed("PathPointSet", points), listed("PathWrapSet", used), name="path")


def muscle(rng: np.random.Generator, name: str, along: str) -> str:
    kind = str(rng.choice(MUSCLES))
    numbers: dict[str, object] = {
        "max_isometric_force": rng.uniform(50.0, 2000.0),
        "optimal_fiber_length": rng.uniform(0.05, 0.3),
        "tendon_slack_length": rng.uniform(0.05, 0.3),
        "pennation_angle_at_optimal": rng.uniform(0.0, 0.5),
        "max_contraction_velocity": rng.uniform(6.0, 15.0),
        "ignore_tendon_compliance": bool(rng.random() < 0.3),
    }
    inside = ""
    if kind == "Thelen2003Muscle":
        numbers |= {
            "FmaxTendonStrain": rng.uniform(0.03, 0.06),
            "KshapeActive": rng.uniform(0.3, 0.6),
            "Flen": 1.6,
            "ignore_tendon_compliance": False,
        }
    elif kind == "Millard2012EquilibriumMuscle":
        numbers |= {"minimum_activation": 0.01, "fiber_damping": 0.1, "ignore_tendon_compliance": False}
        inside = element(
            "TendonForceLengthCurve", name=f"{name}_tendon", strain_at_one_norm_force=rng.uniform(0.03, 0.08)
        )
    elif kind == "DeGrooteFregly2016Muscle" or kind.endswith("Deprecated"):
        numbers["ignore_tendon_compliance"] = False
    return element(kind, along, inside, name=name, **numbers)


def other_forces(rng: np.random.Generator, made: Skeleton) -> list[str]:
    """Return forces on coordinates, bushings, and classes that mjwrap does not know."""
    found = []
    for name in made.coordinates:
        kind = rng.integers(0, 8)
        if kind == 0:
            found.append(
                element(
                    "CoordinateActuator",
                    name=f"act_{name}",
                    coordinate=name,
                    optimal_force=rng.uniform(1, 50),
                    min_control=-1.0,
                    max_control=1.0,
                )
            )
        elif kind == 1:
            found.append(
                element(
                    "CoordinateLimitForce",
                    name=f"limit_{name}",
                    coordinate=name,
                    upper_stiffness=20.0,
                    upper_limit=40.0,
                    lower_stiffness=10.0,
                    lower_limit=-30.0,
                    damping=0.1,
                    transition=5.0,
                )
            )
        elif kind == 2:
            found.append(
                element(
                    "SpringGeneralizedForce",
                    name=f"spring_{name}",
                    coordinate=name,
                    stiffness=5.0,
                    rest_length=0.1,
                    viscosity=0.2,
                )
            )
    if rng.random() < 0.4:
        first, second = rng.choice(made.frames, 2, replace=False)
        numbers = {
            f"{motion}_{what}": rng.uniform(1.0, 100.0, 3)
            for motion in ("rotational", "translational")
            for what in ("stiffness", "damping")
        }
        found.append(
            element(
                "BushingForce", name="bushing", socket_frame1=str(first), socket_frame2=str(second), **numbers
            )
        )
    return found


def contact(rng: np.random.Generator, made: Skeleton) -> tuple[str, str]:
    """Return contact geometry and a force between its shapes."""
    body = f"/bodyset/{rng.choice(made.bodies)}"
    shapes = [
        element(
            "ContactSphere", name="ball", socket_frame=body, location=rng.normal(0, 0.05, 3), radius=0.05
        ),
        element(
            "ContactHalfSpace",
            name="floor",
            socket_frame="/ground",
            location=(0, -1, 0),
            orientation=(0, 0, -1.57),
        ),
    ]
    parameters = element(
        "HuntCrossleyForce::ContactParameters",
        geometry="ball floor",
        stiffness=1e6,
        dissipation=1.0,
        static_friction=0.8,
        dynamic_friction=0.4,
        viscous_friction=0.1,
    )
    force = element(
        "HuntCrossleyForce", listed("HuntCrossleyForce::ContactParametersSet", [parameters]), name="contact"
    )
    return listed("ContactGeometrySet", shapes), force


def forces(rng: np.random.Generator, made: Skeleton, wraps: list[str]) -> list[str]:
    """Return all forces of a random model."""
    found = []
    for k in range(int(rng.integers(1, 6))):
        along = path(rng, made, wraps)
        kind = rng.integers(0, 6)
        if kind < 3:
            found.append(muscle(rng, f"m{k}", along))
        elif kind == 3:
            found.append(
                element(
                    "Ligament", along, name=f"lig{k}", resting_length=rng.uniform(0.1, 0.4), pcsa_force=100.0
                )
            )
        elif kind == 4:
            found.append(
                element(
                    "PathSpring",
                    along,
                    name=f"s{k}",
                    resting_length=rng.uniform(0.1, 0.4),
                    stiffness=100.0,
                    dissipation=0.01,
                )
            )
        else:
            found.append(element("PathActuator", along, name=f"pull{k}", optimal_force=50.0))
    return found + other_forces(rng, made)
