"""One muscle of a system by name, and systems and muscles as a notebook shows them."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from typing import Any, Protocol

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap import html, plots
from mjwrap.errors import MjwrapError, StateError
from mjwrap.mjcf import MuscleDeclaration, Route, is_muscle
from mjwrap.mjcf.conditional_points import when_text
from mjwrap.mjcf.moving_points import site_text
from mjwrap.mjcf.names import name_of
from mjwrap.muscles.laws import ActuatorForce, Law
from mjwrap.paths import Status
from mjwrap.paths.pictures import flattest_view
from mjwrap.text import counted_paths

Array = NDArray[np.float64]
_SITE, _GEOM = mujoco.mjtObj.mjOBJ_SITE, mujoco.mjtObj.mjOBJ_GEOM
SHOWN = 500  # muscles in a notebook's table
FEW = 6  # names in a repr
UNEVALUATED = "not evaluated yet: call forward(data), or for the engine plugin mj_forward(model, data)"
MOVED = 1e-12  # [m, 1] a smaller moment arm is none


class Muscles(Protocol):
    """What a view needs of the results of a system; see `Results`."""

    model: mujoco.MjModel
    declarations: list[MuscleDeclaration]
    native: dict[str, str]

    @property
    def n(self) -> int: ...
    @property
    def names(self) -> list[str]: ...
    @property
    def evaluated(self) -> bool: ...
    @property
    def time(self) -> float: ...
    @property
    def length(self) -> Array: ...
    @property
    def velocity(self) -> Array: ...
    @property
    def tension(self) -> Array: ...
    @property
    def activation(self) -> Array: ...
    @property
    def fiber_length(self) -> Array: ...
    @property
    def status(self) -> NDArray[np.int64]: ...
    @property
    def held(self) -> NDArray[np.bool_]: ...
    def points(self, i: int, spacing: float | None = None) -> Array: ...
    def contact_points(self, i: int) -> Array: ...
    def forces(self, i: int) -> list[tuple[int, Array, Array]]: ...
    def reason(self, i: int) -> str: ...


class MuscleView:
    """One muscle of a `MuscleSystem` or of the plugin's `Muscles`: `muscles["BRA"]`.

    Its numbers are always those of the last evaluation, as in the arrays of the system.

    Attributes:
        name: name of the muscle.
        index: its place in the arrays of the system.
    """

    def __init__(self, muscles: Muscles, index: int) -> None:
        self._muscles = muscles
        self.index = index
        self.name: str = muscles.declarations[index].name

    @property
    def length(self) -> float:
        """Musculotendon length [m]."""
        return float(self._muscles.length[self.index])

    @property
    def velocity(self) -> float:
        """Lengthening speed [m/s]."""
        return float(self._muscles.velocity[self.index])

    @property
    def tension(self) -> float:
        """Tension [N]."""
        return float(self._muscles.tension[self.index])

    @property
    def activation(self) -> float:
        """Activation."""
        return float(self._muscles.activation[self.index])

    @property
    def fiber_length(self) -> float:
        """Fibre length [m], along the fibre; 0 for a law without fibres."""
        return float(self._muscles.fiber_length[self.index])

    @property
    def status(self) -> Status:
        """Status of the path."""
        return Status(int(self._muscles.status[self.index]))

    @property
    def held(self) -> bool:
        """Whether the muscle has no path and keeps its last valid length, velocity and tension."""
        return bool(self._muscles.held[self.index])

    @property
    def reason(self) -> str:
        """Why the muscle last had no path; empty if it always had one."""
        return self._muscles.reason(self.index)

    @property
    def declaration(self) -> MuscleDeclaration:
        """What the model declares: routes, law, actuator."""
        return self._muscles.declarations[self.index]

    @property
    def parameters(self) -> Law:
        """The law's dataclass with its parameters."""
        return self.declaration.parameters

    @property
    def route(self) -> str:
        """The sites and geoms of the route by name."""
        return " | ".join(route_text(self._muscles.model, route) for route in self.declaration.routes)

    def points(self, spacing: float | None = None) -> Array:
        """Return the polyline (m, 3), world [m], as `MuscleSystem.points`."""
        return self._muscles.points(self.index, spacing)

    def contact_points(self) -> Array:
        """Return the first and last contact point (k, 2, 3) of every obstacle that is touched, world [m]."""
        return self._muscles.contact_points(self.index)

    def forces(self) -> list[tuple[int, Array, Array]]:
        """Return the muscle's forces: (body id, point (3,) [m], force (3,) [N]), world."""
        return self._muscles.forces(self.index)

    def moment_arms(self, data: mujoco.MjData) -> dict[str, float]:
        """Return the moment arm [m] about each independent joint that moves the muscle, by name, at `data`.

        As `MuscleSystem.moment_arms`. Raises `StateError` for the plugin's `Muscles`, which have none.
        """
        system: Any = self._muscles
        if not hasattr(system, "moment_arms"):
            raise StateError(
                "the plugin's Muscles have no moment arms; a MuscleSystem of the model without it has"
            )
        arms = system.moment_arms(data)[self.index]
        return {n: float(a) for n, a in zip(system.coordinates, arms, strict=True) if abs(a) > MOVED}

    def plot(self, axes: Any = None) -> Any:
        """Draw the path at the last evaluation in space with matplotlib, and return the axes.

        axes: 3D axes to draw into; None for a new figure. Labels and errors as in `MuscleSystem.plot`.
        """
        marks = self.contact_points().reshape(-1, 3)
        return plots.draw_paths([(label(self._muscles, self.index), self.points())], marks, [], axes)

    def __repr__(self) -> str:
        if not _evaluated(self._muscles):
            return f"MuscleView({self.name!r}, {UNEVALUATED})"
        numbers = ", ".join(f"{name} {value}" for name, value in _numbers(self)[:4])
        return f"MuscleView({self.name!r}, {self.status.name}, {numbers})"

    def _repr_html_(self) -> str:
        law = self.parameters
        given = fields(law) if is_dataclass(law) else ()
        parameters = [(field.name, getattr(law, field.name)) for field in given]
        known = _evaluated(self._muscles)
        facts = [("status", self.status.name), *_numbers(self)] if known else [("status", UNEVALUATED)]
        facts += [("route", self.route), ("law", law.law)]
        kind = "cable" if pulls_as_cable(self._muscles.model, self.declaration) else "muscle"
        shown = html.facts([*facts, *parameters], f"{kind} {self.name}")
        points = self.points()
        good = points[np.isfinite(points).all(axis=1)]
        if len(good) < 2:
            return shown
        view, contacts = flattest_view(good), self.contact_points().reshape(-1, 3)
        marks = np.vstack([good[[0, -1]], contacts]) @ view
        return shown + html.drawing([(points @ view).tolist()], marks.tolist())


def _numbers(muscle: MuscleView) -> list[tuple[str, str]]:
    return [
        ("length", f"{muscle.length:.6g} m"),
        ("velocity", f"{muscle.velocity:.4g} m/s"),
        ("tension", f"{muscle.tension:.5g} N"),
        ("activation", f"{muscle.activation:.4g}"),
        ("fibre length", f"{muscle.fiber_length:.6g} m"),
    ]


def label(muscles: Muscles, i: int) -> str:
    """Return the label of a muscle in a picture: its name, and its status if it has no path.

    Raises `StateError` before the first evaluation, when there is nothing to draw.
    """
    if not _evaluated(muscles):
        raise StateError(f"there are no paths to draw: {UNEVALUATED}")
    code, name = int(muscles.status[i]), muscles.names[i]
    return f"{name} ({Status(code).name})" if code else name


def pulls_as_cable(model: mujoco.MjModel, muscle: MuscleDeclaration) -> bool:
    """Return whether an actuator of MuJoCo's that is not a muscle pulls along the path of a muscle."""
    return isinstance(muscle.parameters, ActuatorForce) and not is_muscle(model, muscle.actuator)


def _cables(muscles: Muscles) -> int:
    return sum(pulls_as_cable(muscles.model, muscle) for muscle in muscles.declarations)


def route_text(model: mujoco.MjModel, route: Route) -> str:
    """Return the stops of a route by name."""
    stops = [site_text(model, route.moving, route.origin)]
    for node in route.nodes:
        if node.surface is None:
            stops.append(site_text(model, route.moving, node.site))
        else:
            hint = f", side {name_of(model, _SITE, node.hint_site)}" if node.hint_site >= 0 else ""
            hint += " at every pose" * node.side
            kind = type(node.surface).__name__.lower()
            stops.append(f"{name_of(model, _GEOM, node.geom)} ({kind}{hint}{', held inside' * node.inside})")
    stops.append(site_text(model, route.moving, route.insertion))
    factor = f"{route.weight:g} × " if route.weight != 1.0 else ""
    return factor + " > ".join(stops) + when_text(model, route.when)


def system_text(muscles: Muscles) -> str:
    """Return a line about a system: its muscles, those without a path, and the actuators left to MuJoCo."""
    names = muscles.names
    told = [_few(names)] if names else []
    if names and not _evaluated(muscles):
        told.append(UNEVALUATED)
    failed = [name for name, code in zip(names, _status(muscles), strict=True) if code]
    if failed:
        told.append(f"without a path: {_few(failed)}")
    if muscles.native:
        told.append(f"{len(muscles.native)} left to MuJoCo")
    count = counted_paths(len(names), _cables(muscles))
    return f"{type(muscles).__name__}({count}{': ' * bool(told)}{'; '.join(told)})"


def _few(names: list[str]) -> str:
    return ", ".join(names[:FEW]) + ", ..." * (len(names) > FEW)


def system_html(muscles: Muscles) -> str:
    """Return a system as a notebook shows it: a row for each muscle, and the actuators left to MuJoCo."""
    first = "cable" if 0 < muscles.n == _cables(muscles) else "muscle"
    heads = (first, "law", "path", "length [m]", "velocity [m/s]", "tension [N]", "activation", "route")
    rows: list[list[str]] = []
    known = _evaluated(muscles)
    status = _status(muscles)
    columns = [muscles.length, muscles.velocity, muscles.tension, muscles.activation] if known else []
    for i, muscle in enumerate(muscles.declarations[:SHOWN]):
        route = " | ".join(route_text(muscles.model, route) for route in muscle.routes)
        path = Status(int(status[i])).name if known else ""
        numbers = [f"{column[i]:.5g}" for column in columns] or [""] * 4
        rows.append([muscle.name, muscle.law, path, *numbers, route])
    found = html.table(heads, rows, system_text(muscles))
    if muscles.native:
        found += html.table(("left to MuJoCo", "reason"), list(muscles.native.items()))
    return found


def _status(muscles: Muscles) -> list[int]:
    return muscles.status.tolist() if _evaluated(muscles) else [0] * muscles.n


def _evaluated(muscles: Muscles) -> bool:
    try:
        return muscles.evaluated
    except MjwrapError:  # of the plugin's
        return False
