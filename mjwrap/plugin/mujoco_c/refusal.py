"""The error for a MuJoCo in which the plugin cannot run."""

from __future__ import annotations

import mujoco

from mjwrap.errors import VersionError


def refuse(what: str) -> VersionError:
    """Return the error; what: the reason."""
    return VersionError(
        f"the engine plugin cannot run in MuJoCo {mujoco.__version__}: {what}; MuscleSystem works without it"
    )
