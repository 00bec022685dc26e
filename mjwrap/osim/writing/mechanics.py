"""All of an OpenSim model but its muscles, as MJCF."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from mjwrap.osim.description.model import OsimModel
from mjwrap.osim.report import LEFT_OUT, Report
from mjwrap.osim.writing.constraints import write_constraints
from mjwrap.osim.writing.contacts import write_contacts
from mjwrap.osim.writing.document import Document
from mjwrap.osim.writing.generalized_forces import write_generalized_forces
from mjwrap.osim.writing.inertia_report import report_inertias
from mjwrap.osim.writing.markers import write_markers
from mjwrap.osim.writing.meshes import write_meshes
from mjwrap.osim.writing.options import write_options
from mjwrap.osim.writing.skeleton import Skeleton, write_bodies


def write_mechanics(
    document: Document, model: OsimModel, report: Report, folders: Sequence[Path] = (), limits: bool = False
) -> Skeleton:
    """Write bodies, joints, couplings, constraints, forces other than muscles, contacts, markers and meshes.

    folders: where mesh files are searched, in this order. limits: whether clamped coordinates get limits.
    """
    write_options(document, model)
    for note in model.notes:
        kind = (
            note.kind if note.outcome == LEFT_OUT else f"note on {note.kind}"
        )  # which has an entry of its own
        report.add(kind, note.name, note.outcome, note.text)
    for other in model.others:
        report.add(other.kind, other.name, LEFT_OUT, other.text)
    skeleton = write_bodies(document, model, report, limits)
    write_constraints(document, model, report, skeleton)
    report_inertias(document, report, skeleton)
    write_generalized_forces(document, model, report, skeleton)
    write_markers(document, model, report)
    write_meshes(document, model, report, folders)
    write_contacts(document, model, report, skeleton, folders)
    return skeleton
