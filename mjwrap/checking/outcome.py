"""The result of a check: pass or fail, the worst error, and its location."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjwrap.text import aligned, counted

Array = NDArray[np.float64]


@dataclass
class Check:
    """One check, with the worst error so far; it passes if `worst` is at most `limit`.

    Attributes:
        name: name of the check.
        what: the tested law in words.
        limit: largest error with which it passes.
        unit: unit of `worst` and `limit`.
        worst: largest error so far.
        where: where this error was found.
        count: number of measured values.
        skipped: why the check was not possible, or empty.
        remarks: further notes.
    """

    name: str
    what: str
    limit: float
    unit: str = ""
    worst: float = 0.0
    where: str = ""
    count: int = 0
    skipped: str = ""
    remarks: list[str] = field(default_factory=list)

    def see(self, values: Array | float, where: str, names: list[str] | None = None) -> None:
        """Record measured errors, each named by `names`; NaN means not measured."""
        given = np.atleast_1d(np.asarray(values, dtype=np.float64)).ravel()
        known = np.where(np.isnan(given), -math.inf, given)
        self.count += int((~np.isnan(given)).sum())
        if not known.size or not known.max() > self.worst:
            return
        k = int(np.argmax(known))
        self.worst = float(known[k])
        self.where = f"{names[k]}, {where}" if names else where

    @property
    def verdict(self) -> str:
        """Return "pass", "FAIL" or "skip"."""
        if self.skipped or not self.count:
            return "skip"
        return "pass" if self.worst <= self.limit else "FAIL"

    @property
    def reason(self) -> str:
        """Return why the check was not possible, or an empty string."""
        return self.skipped or ("" if self.count else "no values to measure")


@dataclass(frozen=True)
class Checks:
    """All checks of a model, in order; facts: the numbers of muscles, poses and sweeps."""

    checks: list[Check]
    facts: dict[str, int]

    @property
    def failed(self) -> list[Check]:
        """Return the checks that failed."""
        return [check for check in self.checks if check.verdict == "FAIL"]

    def table(self) -> str:
        """Return a line for each check, with its remarks below."""
        rows = []
        for check in self.checks:
            unit = f" {check.unit}" if check.unit else ""
            if check.verdict == "skip":
                told = f"not tested: {check.reason}"
            elif check.limit == 0.0:
                told = counted(check.worst, check.unit.removesuffix("s"))
            else:
                told = f"{check.worst:.1e}{unit}, limit {check.limit:.0e}"
                told += f"  ({check.where})" if check.where else ""
            rows.append((check.verdict, check.what, told))
        lines = []
        for line, check in zip(aligned(rows, (0, 1, 2)), self.checks, strict=True):
            lines += [line, *(f"      {remark}" for remark in check.remarks)]
        return "\n".join(lines)

    def as_dict(self) -> dict[str, Any]:
        """Return the checks as values for JSON."""
        found = [
            {**asdict(check), "verdict": check.verdict.lower(), "skipped": check.reason}
            for check in self.checks
        ]
        return {**self.facts, "passed": not self.failed, "checks": found}
