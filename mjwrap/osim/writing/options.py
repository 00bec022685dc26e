"""Options of the written model: time step, integrator, gravity, and how the compiler reads it."""

from __future__ import annotations

from mjwrap.osim.description.model import OsimModel
from mjwrap.osim.writing.couplings import TIMESTEP
from mjwrap.osim.writing.document import Document


def write_options(document: Document, model: OsimModel) -> None:
    """Write compiler and options; angles in rad, inertias only as written, gravity as in the file."""
    document.section("compiler").attrib.update(
        {"angle": "radian", "autolimits": "true", "inertiafromgeom": "false"}
    )
    option = document.section("option").attrib
    option.update({"timestep": repr(TIMESTEP), "integrator": "RK4"})
    option["gravity"] = " ".join(repr(float(part)) for part in model.gravity)
