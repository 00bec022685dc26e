"""The report of implausible parameters: a finding per muscle and kind, and remarks on what could not be judged."""

from __future__ import annotations

import enum
from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from mjwrap import validation
from mjwrap.calibration.ranges import LengthRange
from mjwrap.errors import ModelError
from mjwrap.text import aligned, counted


class Implausible(enum.StrEnum):
    """Kinds of implausible parameters; the comments give `Finding.value` and `Finding.limit`."""

    NEGATIVE_TENDON = "negative tendon"  # slack length [m], 0
    SHORT_TENDON = "short tendon"  # slack length in optimal fibre lengths
    LONG_TENDON = "long tendon"  # the same
    SHORT_FIBER = "short fibre"  # least normalised fibre length over the joints' ranges, tendon rigid
    LONG_FIBER = "long fibre"  # largest one
    SLACK = "slack throughout"  # longest musculotendon length [m], slack length [m]
    PASSIVE_AT_REST = "passive at rest"  # tension without activation, in maximum isometric forces
    LENGTH_RANGE = "length range"  # how far the path leaves the actuator's length range, as a share of it
    NO_FORCE = "no force"  # maximum isometric force [N]
    HUGE_FORCE = "huge force"  # the same


@dataclass(frozen=True)
class ParameterLimits:
    """The limits of plausible values.

    Args:
        fiber: smallest and largest normalised fibre length.
        tendon: smallest and largest slack length in optimal fibre lengths; about 0.1 to 12 in humans.
        passive: largest tension without activation at rest, in maximum isometric forces.
        excess: largest excess of the path over the declared length range, as a share of the range.
        force: smallest and largest maximum isometric force [N].

    Raises:
        ModelError: a limit is not a number, or a pair of limits not two numbers.
    """

    fiber: tuple[float, float] = (0.4, 1.6)
    tendon: tuple[float, float] = (0.05, 15.0)
    passive: float = 0.1
    excess: float = 0.02
    force: tuple[float, float] = (1.0, 2e4)

    def __post_init__(self) -> None:
        for name in ("fiber", "tendon", "force"):
            validation.several(getattr(self, name), 2, f"ParameterLimits: {name}", ModelError)
        for name in ("passive", "excess"):
            number = validation.is_number(getattr(self, name))
            validation.require(
                number, f"ParameterLimits: {name}", "a number", getattr(self, name), ModelError
            )


@dataclass(frozen=True)
class Finding:
    """One implausible parameter.

    Attributes:
        muscle: name of the muscle.
        kind: the kind of fault.
        value: the value beyond the limit, in the unit given in `Implausible`.
        limit: the limit, in the same unit.
        sentence: the finding in words.
    """

    muscle: str
    kind: Implausible
    value: float
    limit: float
    sentence: str


@dataclass(frozen=True)
class ParameterReport:
    """All findings about the parameters of a model.

    Attributes:
        findings: in the order of the muscles.
        remarks: by muscle, what could not be judged, and why.
        ranges: the length ranges over which the fibres were judged.
    """

    findings: tuple[Finding, ...]
    remarks: Mapping[str, tuple[str, ...]]
    ranges: Mapping[str, LengthRange]

    def of(self, kind: Implausible) -> list[Finding]:
        """Return the findings of one kind."""
        return [finding for finding in self.findings if finding.kind == kind]

    def table(self) -> str:
        """Return a line per finding, then the number of findings of each kind, then the remarks."""
        lines = aligned([(f.muscle, f.kind, f.sentence) for f in self.findings], (0, 1, 2))
        counts = Counter(finding.kind for finding in self.findings)
        muscles = len({finding.muscle for finding in self.findings})
        kinds = ", ".join(f"{kind} {counts[kind]}" for kind in Implausible if counts[kind])
        lines.append(
            f"findings: {len(self.findings)}"
            + (f", in {counted(muscles, 'muscle')} ({kinds})" if self.findings else "")
        )
        lines += [f"{name}: {remark}" for name, remarks in self.remarks.items() for remark in remarks]
        return "\n".join(lines)

    def as_dict(self) -> dict[str, Any]:
        """Return findings, remarks and length ranges as values for JSON; a length that is NaN becomes None."""
        return {
            "findings": [asdict(finding) for finding in self.findings],
            "remarks": {name: list(remarks) for name, remarks in self.remarks.items()},
            "length_ranges": {
                name: {
                    "shortest": found.shortest if found.shortest == found.shortest else None,
                    "longest": found.longest if found.longest == found.longest else None,
                    "poses": found.poses,
                    "without_path": dict(found.without_path),
                    "held": list(found.held),
                }
                for name, found in self.ranges.items()
            },
        }
