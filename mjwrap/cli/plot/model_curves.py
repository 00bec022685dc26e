"""The curves of one model for the picture and the table, and the units in which they are drawn."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mjwrap.files.atomic import PartFile
from mjwrap.poses import QUANTITIES, JointCurves

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ModelCurves:
    """The curves of one model: label in the picture, and the curves."""

    label: str
    curves: JointCurves


def shown_unit(quantity: str, turns: bool) -> tuple[float, str]:
    """Return the factor from SI units to the unit in which a quantity is drawn, and this unit."""
    if quantity == "moment_arm" and not turns:
        return 1.0, ""  # per metre of the slide
    if quantity == "moment" and not turns:
        return 1.0, "N"
    return {"m": (1e3, "mm"), "rad": (180.0 / math.pi, "°")}.get(
        QUANTITIES[quantity], (1.0, QUANTITIES[quantity])
    )


def write_curves(output: PartFile, found: Sequence[ModelCurves], quantities: Sequence[str]) -> None:
    """Write the curves as CSV: the position [deg or m], then a column for each quantity and muscle, in SI units.

    Several models are written one below the other, with their columns; those of other models are empty.
    """
    several = len(found) > 1
    turns = found[0].curves.turns
    heads = [f"{found[0].curves.joint} [{'deg' if turns else 'm'}]"]
    columns: list[tuple[int, Array]] = []  # number of the model, values
    for number, each in enumerate(found):
        for quantity in quantities:
            for source, values in (("", each.curves.values), ("native_", each.curves.native)):
                for i, muscle in enumerate(each.curves.names):
                    if quantity not in values:
                        continue
                    about = f":{each.curves.joint}" if quantity == "moment_arm" else ""
                    unit = QUANTITIES[quantity] if turns or quantity != "moment_arm" else ""
                    of = f"@{each.label}" if several else ""
                    heads.append(f"{source}{quantity}:{muscle}{about}{of}" + (f" [{unit}]" if unit else ""))
                    columns.append((number, values[quantity][:, i]))
    writer = csv.writer(output.open_text())
    with output.writing():
        writer.writerow(heads)
        for number, each in enumerate(found):
            for k, at in enumerate(each.curves.at.tolist()):
                cells = [float(values[k]) if of == number else math.nan for of, values in columns]
                place = math.degrees(at) if turns else at
                writer.writerow([place, *("" if math.isnan(x) else x for x in cells)])
    output.publish()
