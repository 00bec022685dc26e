"""Makes the error for a MuJoCo in which the plugin cannot run."""

from __future__ import annotations

import mujoco

from mjwrap.errors import VersionError


def refuse(what: str) -> VersionError:
    """Return the error that says what is wrong with the installed MuJoCo."""
    return VersionError(
        f"the engine plugin cannot run in MuJoCo {mujoco.__version__}: {what}; MuscleSystem works without it"
    )
