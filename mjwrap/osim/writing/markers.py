"""Markers as sites."""

from __future__ import annotations

from mjwrap.osim.description.model import OsimModel
from mjwrap.osim.report import EXACT, Report
from mjwrap.osim.writing.document import Document
from mjwrap.osim.writing.unique_names import UniqueNames

RADIUS = 0.01  # [m]


def write_markers(document: Document, model: OsimModel, report: Report) -> None:
    """Write all markers as sites of group 3."""
    names = UniqueNames(document, "site")
    for marker in model.markers:
        site = names.new(marker.name)
        document.add(document.bodies[marker.frame.body], "site", name=site, pos=marker.frame.position, group=3,
                     size=RADIUS, rgba=(1.0, 0.5, 0.7, 1.0))  # fmt: skip
        report.add("Marker", marker.name, EXACT, f"site '{site}'")
