"""Names of a model's objects, for messages that say what is there."""

from __future__ import annotations

from collections.abc import Iterable

import mujoco

PLUGIN_INSTANCE = "mjwrap"  # of the engine plugin, behind the prefix of the model that it was attached with


def name_of(model: mujoco.MjModel, kind: mujoco.mjtObj, index: int) -> str:
    """Return an object's name, or #id where it has none."""
    return mujoco.mj_id2name(model, kind, index) or f"#{index}"


def names(model: mujoco.MjModel, kind: mujoco.mjtObj, count: int) -> list[str]:
    """Return the names of the first `count` objects of a kind, which are all where `count` is how many there are."""
    return [name_of(model, kind, i) for i in range(count)]


def listed(found: Iterable[str]) -> str:
    """Return names for a message: separated by commas, "none" where there are none."""
    return ", ".join(found) or "none"


def has_plugin(model: mujoco.MjModel) -> bool:
    """Return whether mjwrap's engine plugin drives the muscles of a model."""
    kind = mujoco.mjtObj.mjOBJ_PLUGIN
    return any(name_of(model, kind, i).endswith(PLUGIN_INSTANCE) for i in range(model.nplugin))
