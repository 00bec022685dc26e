"""Tables of published data or of another program, read as curves of muscles over the position of a joint."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mjwrap.cli.common.errors import UserError
from mjwrap.files.columns import ANGLES, UNITS, Columns, read_columns
from mjwrap.poses import QUANTITIES

Array = NDArray[np.float64]
# the quantities in OpenSim's files, by the end of their names; MomentArm_ and Moment_ are followed by a coordinate
OPENSIM = {
    "Length": "length",
    "FiberLength": "fiber_length",
    "NormalizedFiberLength": "normalized_fiber_length",
    "TendonLength": "tendon_length",
    "PennationAngle": "pennation",
    "TendonForce": "tension",
    "ActiveFiberForceAlongTendon": "active_fiber_force",
    "PassiveFiberForceAlongTendon": "passive_fiber_force",
}
_FILE = re.compile(r"MuscleAnalysis_(?P<quantity>[A-Za-z]+)(_.+)?$")
ENDINGS = {"_low": "low", "_high": "high", "_std": "std", "_sd": "std"}
FULL_TURN = 2.0 * np.pi


@dataclass(frozen=True, eq=False)
class MeasuredCurve:
    """A column of a table over the position of a joint, with its band if the table has one.

    muscle: its name; quantity: one of `QUANTITIES`; source: the file's name; at (T,) increasing positions [rad or m];
    value (T,) in SI units, NaN where there is only a band; low, high (T,): the band, or None.
    """

    muscle: str
    quantity: str
    source: str
    at: Array
    value: Array
    low: Array | None = None
    high: Array | None = None


@dataclass(frozen=True)
class MeasuredTables:
    """What to read: entries FILE or QUANTITY=FILE, the unit of values without one, and states for tables over time."""

    entries: Sequence[str]
    unit: str | None = None
    states: str | None = None


def read_measured(
    wanted: MeasuredTables,
    joints: Sequence[str],
    turns: bool,
    muscles: Sequence[str],
    quantities: Sequence[str],
    say: Callable[[str], object],
) -> list[MeasuredCurve]:
    """Return the curves in tables.

    A column belongs to the muscle of its name; a path before the name, and KIND: as in tables of mjwrap, are ignored.
    Beside NAME there may be NAME_low and NAME_high, or NAME_std. The position is the column of the joint, or the first
    column. Its unit is the one that its head or the file's header states; without one a .csv file is in degrees.

    Args:
        wanted: the tables.
        joints: names of the joint, one for each model.
        turns: whether it is a hinge.
        muscles: names of the muscles that are drawn.
        quantities: those that are drawn.
        say: called with a line for each table.

    Returns:
        The curves.

    Raises:
        UserError: a table has none of the muscles, or it is not clear what it holds.
        TableError: a table cannot be read.
    """
    found: list[MeasuredCurve] = []
    states = read_columns(wanted.states) if wanted.states else None
    for entry in wanted.entries:
        table, quantity = _open(entry, quantities)
        place, at, how = _positions(table, states, joints, turns)
        parts: dict[tuple[str, str], dict[str, Array]] = {}
        unused = []
        for name in table.names:
            if name in place:
                continue
            read = _column(name, muscles, [*joints, *place], quantity)
            if read is None or read[1] not in quantities:
                unused.append(name)
                continue
            muscle, kind, part = read
            factor = _factor(table, name, kind, wanted.unit)
            parts.setdefault((muscle, kind), {})[part] = factor * table[name]
        if not parts:
            raise UserError(
                f"'{table.source}' has no column for any of the muscles; columns: {', '.join(table.names[:8])}; "
                f"muscles: {', '.join(muscles[:8])}"
            )
        source = Path(table.source).name
        found += [_curve(*key, source, at, given) for key, given in parts.items()]
        kinds = ", ".join(dict.fromkeys(kind for _, kind in parts))
        left = f"; not used: {', '.join(unused[:6])}{', ...' * (len(unused) > 6)}" if unused else ""
        say(f"{source}: {kinds} of {', '.join(dict.fromkeys(m for m, _ in parts))}; {how}{left}")
    return found


def joint_of(entry: str, joints: Sequence[str]) -> str:
    """Return which of the joints a table is over; raises `UserError` if no column is called by one of them."""
    _, file = _split(entry)
    table = read_columns(file)
    for name in table.names:
        bare = name.removeprefix("qpos:").removesuffix("/value").rpartition("/")[2]
        if bare in joints:
            return bare
    raise UserError(
        f"'{file}': no column is called by a joint; columns: {', '.join(table.names[:8])}; joints: {', '.join(joints)}"
    )


def _split(entry: str) -> tuple[str, str]:
    """Return the quantity ("" if not given) and the file of "QUANTITY=FILE"."""
    kind, mark, file = entry.partition("=")
    return ("", entry) if not mark or Path(entry).is_file() else (kind, file)


def _open(entry: str, quantities: Sequence[str]) -> tuple[Columns, str]:
    """Return a table, and the quantity of columns that do not say it ("" if unknown)."""
    kind, file = _split(entry)
    if kind and kind not in QUANTITIES:
        raise UserError(f"--data '{entry}': no quantity '{kind}'; quantities: {', '.join(QUANTITIES)}")
    if kind and kind not in quantities:
        raise UserError(f"--data '{entry}': {kind} is not drawn here, but {', '.join(quantities)}")
    if not kind:
        named = _FILE.search(Path(file).stem)
        known = named["quantity"] if named else ""
        whole = {**OPENSIM, "MomentArm": "moment_arm", "Moment": "moment"}
        kind = whole.get(known, quantities[0] if len(quantities) == 1 else "")
    return read_columns(file), kind


def _column(
    name: str, muscles: Sequence[str], joints: Sequence[str], quantity: str
) -> tuple[str, str, str] | None:
    """Return the muscle, the quantity and the part (value, low, high or std) of a column; None if it is none."""
    kind, mark, rest = name.partition(":")
    if mark and kind in QUANTITIES:
        quantity, name = kind, rest
        head, mark, about = rest.rpartition(":")
        if kind == "moment_arm" and mark:
            ending = next((e for e in ENDINGS if about.endswith(e)), "")
            if about.removesuffix(ending) not in joints:
                return None
            name = head + ending
    name = name.rpartition("/")[2]
    known = name if name in muscles else ""
    part = "value"
    for ending, what in ENDINGS.items():
        if not known and name.removesuffix(ending) in muscles and name.endswith(ending):
            known, part = name.removesuffix(ending), what
    if not known:
        return None
    if not quantity:
        raise UserError(
            f"the columns of a table over several quantities must say which: write --data QUANTITY=FILE, such as "
            f"--data moment_arm=data.csv (column '{name}')"
        )
    return known, quantity, part


def _positions(
    table: Columns, states: Columns | None, joints: Sequence[str], turns: bool
) -> tuple[set[str], Array, str]:
    """Return the columns that are no muscle's, the positions (T,) [rad or m], and how their unit is known."""
    name = _position_column(table, joints)
    if name is None and states is not None and "time" in table.names:
        angle = _position_column(states, joints)
        if angle is None or "time" not in states.names:
            raise UserError(
                f"'{states.source}' must have columns 'time' and '{joints[0]}'; its columns: "
                f"{', '.join(states.names[:8])}"
            )
        factor, how = _angle(states, angle, turns)
        at = np.interp(table["time"], states["time"], factor * states[angle], left=np.nan, right=np.nan)
        if np.isnan(at).all():
            raise UserError(f"'{table.source}' and '{states.source}' have no times in common")
        return {"time"}, at, f"{angle} from {Path(states.source).name}, {how}"
    if name is None and table.names[0].lower() == "time":
        raise UserError(
            f"'{table.source}' is a table over time without a column '{joints[0]}'; add that column, or name the "
            f"motion with --states FILE"
        )
    name = name or table.names[0]
    factor, how = _angle(table, name, turns)
    return {name, *(n for n in table.names if n.lower() == "time")}, factor * table[name], f"{name} {how}"


def _position_column(table: Columns, joints: Sequence[str]) -> str | None:
    for name in table.names:
        bare = name.removeprefix("qpos:").removesuffix("/value").rpartition("/")[2]
        if bare in joints:
            return name
    return next((name for name in table.names if name.lower() in ("angle", "position")), None)


def _angle(table: Columns, name: str, turns: bool) -> tuple[float, str]:
    """Return the factor to rad or m of a column of positions, and how its unit is known."""
    stated = table.units.get(name, "")
    if stated:
        if (stated in ANGLES) != turns:
            wanted = "an angle, in deg or rad" if turns else "a length, in m, cm or mm"
            raise UserError(
                f"'{table.source}': column '{name}' is in {stated}; the joint's position is {wanted}"
            )
        return UNITS[stated], f"in {stated}"
    if not turns:
        return 1.0, "taken as m"
    said = table.stated_angle()
    if said:
        return UNITS[said], f"in {said} by the header's inDegrees"
    if name.startswith("qpos:") or Path(table.source).suffix.lower() != ".csv":
        return 1.0, "in rad"
    small = np.nanmax(np.abs(table[name]), initial=0.0) <= FULL_TURN
    return UNITS["deg"], "taken as degrees" + (
        f": if they are radians, call the column '{name} [rad]'" if small else ""
    )


def _factor(table: Columns, name: str, quantity: str, unit: str | None) -> float:
    """Return the factor to SI units of a column of values."""
    stated = table.units.get(name, "")
    if stated:
        return UNITS[stated]
    if quantity == "pennation":
        return UNITS["deg"] if table.stated_angle() == "deg" else 1.0
    return UNITS[unit] if unit else 1.0


def _curve(muscle: str, quantity: str, source: str, at: Array, given: dict[str, Array]) -> MeasuredCurve:
    value = given.get("value", np.full(len(at), np.nan))
    low, high = given.get("low"), given.get("high")
    if "std" in given:
        low, high = value - given["std"], value + given["std"]
    if (low is None) != (high is None):
        raise UserError(f"'{source}': a band of '{muscle}' needs both {muscle}_low and {muscle}_high")
    order = np.argsort(at, kind="stable")
    order = order[np.isfinite(at[order])]
    low, high = (None if band is None else band[order] for band in (low, high))
    return MeasuredCurve(muscle, quantity, source, at[order], value[order], low, high)


def odd_scales(curves: Iterable[MeasuredCurve], largest: Callable[[str, str], float]) -> list[str]:
    """Return a line for each table whose values are some twenty times larger or smaller than the model's.

    largest: the largest absolute value of the model, by muscle and quantity.
    """
    found: dict[tuple[str, str], str] = {}
    for curve in curves:
        given = np.concatenate([x for x in (curve.value, curve.low, curve.high) if x is not None])
        here, there = float(np.nanmax(np.abs(given), initial=0.0)), largest(curve.muscle, curve.quantity)
        if here > 0.0 and there > 0.0 and not 0.05 < here / there < 20.0:
            unit = QUANTITIES[curve.quantity]
            text = (
                f"{curve.source}: {curve.quantity} of {curve.muscle} goes up to {here:.3g} {unit}, the model's to "
                f"{there:.3g}; if the table is in another unit, write it in the head of the column, such as "
                f"'{curve.muscle} [mm]'"
            )
            found.setdefault((curve.source, curve.quantity), text)
    return list(found.values())
