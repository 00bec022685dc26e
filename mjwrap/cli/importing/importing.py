"""Import an OpenSim model, write the model and its report, and verify it."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import mujoco

from mjwrap import import_osim
from mjwrap.cli.common.errors import FAULTS, UserError
from mjwrap.cli.common.output import Report, check_unread, open_output
from mjwrap.cli.common.progress import progress_bar
from mjwrap.cli.importing.page import write_page
from mjwrap.cli.importing.text import tell_entries, tell_verification
from mjwrap.errors import OsimError
from mjwrap.mjcf import read_model
from mjwrap.mjcf.couplings import read_couplings
from mjwrap.mjcf.named_models import osim_file
from mjwrap.osim.importing import Imported
from mjwrap.osim.verifying.differences import Verification, verify
from mjwrap.osim.verifying.opensim_numbers import compute_reference, has_opensim, opensim_geodesic
from mjwrap.osim.verifying.reference import Reference, read_reference, sha256_of
from mjwrap.osim.writing.skeleton import CLAMPED
from mjwrap.text import counted


@dataclass(frozen=True)
class ImportSettings:
    """The settings of `mjwrap import`.

    model: the .osim file. out: the MJCF file, None for the model's name in the present folder. geometry: folders with
    meshes. limits: whether clamped coordinates become limits. page, json: files, or None; json may be "-" for standard
    output. verify: compare with OpenSim, whose numbers are kept in `numbers`, at `poses` random poses drawn with
    `seed`. command: the command line of this import.
    """

    model: str
    out: str | None
    geometry: tuple[str, ...]
    limits: bool
    page: str | None
    json: str | None
    verify: bool
    numbers: str | None
    poses: int
    seed: int
    command: str


def import_model(settings: ImportSettings) -> int:
    """Import, report, write the files, and return the exit code."""
    settings = replace(settings, model=str(osim_file(settings.model)))
    if not os.path.isfile(settings.model):
        raise UserError(f"'{settings.model}' is not a file")
    out = settings.out or f"{Path(settings.model).stem}.xml"
    if not out.lower().endswith(".xml"):
        raise UserError(f"--out '{out}': the name of an MJCF file ends in .xml")
    check_unread(out, "--out")
    page = open_output(settings.page, "--report", ".html", ".htm") if settings.page else None
    report = Report(settings.json)
    known = _numbers(settings) if settings.verify else None  # a mistake here is reported early
    imported = import_osim(settings.model, meshes=settings.geometry, limits=settings.limits)
    imported.save(out)
    model = imported.spec.compile()
    report.say(f"{out}: {_contents(model)}")
    report.say(tell_entries(imported.report))
    clamped = sum(entry.kind == CLAMPED for entry in imported.report.entries)
    if clamped and not settings.limits:
        coordinates = counted(clamped, "clamped coordinate")
        report.say(f"limits:    none for {coordinates}, as in OpenSim's motions; --limits writes them")
    found = _verify(settings, out, known) if settings.verify else None
    if found is not None:
        report.say()
        report.say(tell_verification(found))
    if page is not None:
        write_page(page, settings.model, settings.command, imported.report, found)
        report.say(f"page:      {page.path}")
    report.finish(_values(out, imported, found))
    if found is None:
        inspect = f"mjwrap inspect {out}; " if _has_parts(model) else ""
        report.say(f"next:      {inspect}mjwrap run {out} --duration 1")
    return FAULTS if found is not None and found.unexplained else 0


def _has_parts(model: mujoco.MjModel) -> bool:
    """Return whether a model has paths or couplings, which `mjwrap inspect` lists."""
    return bool((model.wrap_type == int(mujoco.mjtWrap.mjWRAP_SITE)).any() or read_couplings(model))


def _contents(model: mujoco.MjModel) -> str:
    """Return in words what the written model has."""
    return (
        f"{model.nbody - 1} bodies, {model.njnt} joints, {model.nu} actuators, {model.ntendon} tendons, "
        f"{model.neq} equalities"
    )


def _numbers(settings: ImportSettings) -> Reference | None:
    """Return OpenSim's numbers from the file of --numbers, or None if they have to be computed."""
    if settings.numbers and os.path.exists(settings.numbers):
        known = read_reference(settings.numbers)
        if known.sha256 != sha256_of(settings.model):
            raise OsimError(
                f"the numbers in '{settings.numbers}' are those of another file ({known.model}): remove it, or name "
                "another with --numbers"
            )
        return known
    if not has_opensim():
        raise OsimError(
            "--verify needs OpenSim's numbers: install the opensim package (pip install opensim), or copy a file that "
            "--numbers wrote on a machine that has it"
        )
    return None


def _verify(settings: ImportSettings, out: str, known: Reference | None) -> Verification:
    """Compare the file that was written with OpenSim."""
    if known is None:
        with contextlib.closing(progress_bar(settings.poses + 1, "poses", "OpenSim")) as bar:
            known = compute_reference(
                settings.model, settings.poses, seed=settings.seed, progress=lambda done, count: bar.update(1)
            )
        if settings.numbers:
            known.save(settings.numbers)
    model = read_model(out)
    with contextlib.closing(progress_bar(len(known.poses), "poses", "mjwrap")) as bar:
        return verify(model, known, lambda done, count: bar.update(1), opensim_geodesic())


def _values(out: str, imported: Imported, found: Verification | None) -> Mapping[str, Any]:
    """Return the report as values for JSON."""
    values: dict[str, Any] = {
        "model": imported.report.model,
        "file": out,
        "version": imported.report.version,
        "entries": [asdict(entry) for entry in imported.report.entries],
    }
    if found is not None:
        values["verification"] = {
            "opensim": found.reference.opensim,
            "poses": len(found.reference.poses),
            "quantities": [
                {
                    "what": q.what,
                    "unit": q.unit,
                    "count": q.count,
                    "median": q.median,
                    "largest": q.largest,
                    "where": q.worst,
                    "within": q.tight,
                    "share_within": q.share,
                }
                for q in found.quantities
            ],
            "differences": [asdict(d) for d in found.differences],
            "missing": found.missing,
        }
    return values
