"""Muscles, ligaments, springs and actuators along paths: tuple, numerics, texts, actuator and tendon of each."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

from mjwrap.mjcf.parameters import NUMERICS
from mjwrap.mjcf.wrapping_geoms import SIZES
from mjwrap.osim.description.forces import Ligament, Muscle, PathActuator, PathSpring
from mjwrap.osim.kinematics import path_length
from mjwrap.osim.report import APPROXIMATED, EXACT, LEFT_OUT, Report
from mjwrap.osim.writing.document import Document
from mjwrap.osim.writing.isometric import largest_difference
from mjwrap.osim.writing.laws import WrittenLaw, law_of, refusal
from mjwrap.osim.writing.piece_algebra import flattened
from mjwrap.osim.writing.routes import Route, RouteWriter
from mjwrap.osim.writing.segment_scan import Sample
from mjwrap.osim.writing.stable_step import PathLine
from mjwrap.osim.writing.unique_names import UniqueNames

DISABLED = "it applies no force in the file"
Pull = Muscle | Ligament | PathSpring | PathActuator


class MuscleWriter:
    """Writes all forces along paths into a document.

    `default_activations` has one number for each state written, `lines` the muscles and the sites of their paths.
    """

    def __init__(
        self, document: Document, report: Report, routes: RouteWriter, poses: Sequence[Sample]
    ) -> None:
        self._document, self._report, self._routes, self._poses = document, report, routes, poses
        self._actuators = UniqueNames(
            document, *(each.tag for each in document.section("actuator")), section="actuator"
        )
        self._tendons = UniqueNames(document, "spatial", "fixed", section="tendon")
        self._tuples = UniqueNames(document, "tuple", section="custom")
        self._labels = 0
        self.default_activations: list[float] = []
        self.lines: list[PathLine] = []

    def write(self, pull: Pull) -> None:
        """Write one force along a path, and its entries in the report."""
        kind = pull.kind if isinstance(pull, Muscle) else type(pull).__name__
        if not pull.active:
            self._report.add(kind, pull.name, LEFT_OUT, DISABLED)
            return
        law = _law(pull)
        fault = refusal(law)
        route = None if fault else self._routes.route(pull.name, pull.path)
        if route is None:
            self._report.add(kind, pull.name, LEFT_OUT, fault or "its path is left out")
            return
        if isinstance(pull, Muscle | PathActuator):
            self._driven(pull.name, route, law, pull.control_range)
        else:
            self._passive(pull.name, route, law)
        if isinstance(pull, Muscle):
            self.lines.append(PathLine(pull, tuple(route.sites)))
            if law.own_states:
                self.default_activations += [float(pull.parameters.get("default_activation", 0.0)), 0.0]
        size = self._measured(pull, law) if law.remarks and isinstance(pull, Muscle) else None
        if size is not None:
            law.remarks.append(
                "largest difference of the tension at rest at the sampled poses, without surfaces"
            )
        outcome = APPROXIMATED if law.remarks else EXACT
        text = "; ".join([f"law {law.name}", *law.remarks])
        self._report.add(
            kind, pull.name, outcome, text, math.nan if size is None else size, "F_max" * (size is not None)
        )

    def _measured(self, muscle: Muscle, law: WrittenLaw) -> float | None:
        """Return how far a law's tension is from that of the curves in the file, at the longest, a middle and the
        shortest straight path of the sampled poses [F_max]; None where the file has no curves."""
        if not muscle.splines or not self._poses:
            return None
        lengths = sorted(path_length(muscle.path, pose.bodies, pose.values) for pose in self._poses)
        chosen = {lengths[k] for k in (0, len(lengths) // 2, -1)} - {0.0}
        return largest_difference(muscle, law, chosen)

    def _driven(self, name: str, route: Route, law: WrittenLaw, controls: tuple[float, float]) -> None:
        """Write a muscle that an actuator drives, with a tendon over its sites for MuJoCo's sake."""
        actuator = self._actuators.new(name)
        tendon = self._tendons.new(f"{actuator}_tendon")
        line = self._document.add("tendon", "spatial", name=tendon)
        for site, _ in itertools.groupby(route.sites):
            self._document.add(line, "site", site=site)
        limited = all(map(math.isfinite, controls)) and controls[0] < controls[1]
        states = {"dyntype": "user", "actdim": 2} if law.own_states else {"dyntype": "none"}
        self._document.add("actuator", "general", name=actuator, tendon=tendon, ctrllimited=limited,
                           ctrlrange=controls if limited else None, gaintype="fixed", gainprm=0, biastype="none",
                           **states)  # fmt: skip
        self._tuple(actuator, route, law, [{"objtype": "actuator", "objname": actuator}])

    def _passive(self, name: str, route: Route, law: WrittenLaw) -> None:
        """Write a muscle without an actuator."""
        self._tuple(name, route, law, [])

    def _tuple(self, name: str, route: Route, law: WrittenLaw, first: Sequence[dict[str, object]]) -> None:
        self._labels += 1
        title = self._tuples.new(f"mjwrap_{name}")
        label = f"mjwrap_path{self._labels}" if any(key in name for key in (*NUMERICS, *SIZES)) else title
        elements = [*first, *route.elements]
        for key, values in law.numbers.items():
            self._document.numeric(f"{label}_{key}", values)
            elements.append({"objtype": "numeric", "objname": f"{label}_{key}"})
        for key, word in {"law": law.name, **law.words}.items():
            self._document.add("custom", "text", name=f"{label}_{key}", data=word)
            elements.append({"objtype": "text", "objname": f"{label}_{key}"})
        record = self._document.add("custom", "tuple", name=title)
        for element in elements:
            self._document.add(record, "element", **element)


def _law(pull: Pull) -> WrittenLaw:
    """Return the law of a force along a path."""
    match pull:
        case Muscle():
            return law_of(pull)
        case PathActuator():
            return WrittenLaw("path_actuator", {"optimal_force": [pull.optimal_force]}, own_states=False)
        case Ligament():
            curve = flattened(pull.curve)
            numbers = {"resting_length": [pull.resting_length], "pcsa_force": [pull.pcsa_force]}
            return WrittenLaw("ligament", {**numbers, "ligament_curve": curve}, own_states=False)
        case PathSpring():
            numbers = {key: [getattr(pull, key)] for key in ("resting_length", "stiffness", "dissipation")}
            return WrittenLaw("path_spring", numbers, own_states=False)
