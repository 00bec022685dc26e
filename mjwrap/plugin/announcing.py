"""Register the plugin's name with MuJoCo as soon as both packages are imported.

A model that `install` has changed can reach a process in which no function of mjwrap is called: as a pickle, as an MJB
file, as saved XML. MuJoCo ends with a segmentation fault if the plugin is not registered there. So `import mjwrap`
registers it, or, if mujoco is not imported yet, the import of mujoco does. This takes milliseconds: the plugin's
functions are compiled or loaded when the first mjData is made (`registering.py`).
"""

from __future__ import annotations

import contextlib
import copyreg
import ctypes
import functools
import importlib
import importlib.util
import sys
from collections.abc import Sequence
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any

from mjwrap.errors import VersionError

_NSTATE = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_int)
_INIT = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int)


class _Watcher(MetaPathFinder):
    """Calls `announce` when mujoco has been imported."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return mujoco's own spec, with a loader that calls `announce` at its end; None for other modules."""
        if fullname != "mujoco" or self not in sys.meta_path:
            return None
        sys.meta_path.remove(self)
        spec = importlib.util.find_spec(fullname)
        loader: Any = spec.loader if spec else None
        if loader is None:
            sys.meta_path.insert(0, self)
            return None
        load = loader.exec_module

        def load_and_announce(module: ModuleType) -> None:
            load(module)
            _announce_if_possible()

        loader.exec_module = load_and_announce
        return spec


def announce_with_mujoco() -> None:
    """Announce the plugin now if mujoco is imported, else right after its import."""
    if "mujoco" in sys.modules:
        _announce_if_possible()
    elif not any(type(finder).__qualname__ == _Watcher.__qualname__ for finder in sys.meta_path):
        sys.meta_path.insert(0, _Watcher())


def _announce_if_possible() -> None:
    """Call `announce`; if that fails, `registering.register` raises the error later."""
    with contextlib.suppress(Exception):
        announce()


@functools.cache
def announce() -> None:
    """Register the plugin's name with MuJoCo, and how models and data that use it are pickled."""
    import mujoco

    from mjwrap.plugin.mujoco_c.registration import ATTRIBUTES, PLUGIN_NAME, register_plugin

    register_plugin(PLUGIN_NAME, {"nstate": _NSTATE(_nstate), "init": _INIT(_init)}, ATTRIBUTES)
    copyreg.pickle(mujoco.MjModel, _reduce)  # pyright: ignore[reportArgumentType]
    copyreg.pickle(mujoco.MjData, _reduce)  # pyright: ignore[reportArgumentType]


def _registering() -> Any:
    return importlib.import_module("mjwrap.plugin.registering")


def _nstate(model: int, instance: int) -> int:
    return int(_registering().number_of_states(model, instance))


def _init(model: int, data: int, instance: int) -> int:
    return int(_registering().initialise(model, data, instance))


def _reduce(value: Any) -> tuple[Any, ...]:
    """Return how to pickle a model or data: as MuJoCo does it, but `restore` reads those with mjwrap's."""
    model = getattr(value, "model", value)
    if model.nplugin:
        from mjwrap.mjcf.marks import own_instances
        from mjwrap.plugin.mujoco_c.registration import PLUGIN_NAME, slot_of

        if own_instances(model):
            return restore, (type(value), value.__getstate__(), slot_of(PLUGIN_NAME))
    reduced: tuple[Any, ...] = value.__reduce_ex__(4)
    return reduced


def restore(kind: Any, state: bytes, slot: int) -> Any:
    """Return a pickled model or data; slot: the plugin's number where it was pickled."""
    import mujoco

    from mjwrap.plugin.mujoco_c.registration import PLUGIN_NAME, slot_of

    announce()
    value = kind.__new__(kind)
    if kind is not mujoco.MjModel and slot != slot_of(PLUGIN_NAME):
        raise VersionError(
            f"this mjData was pickled where mjwrap's plugin had the number {slot}, and here it has "
            f"{slot_of(PLUGIN_NAME)}: import mjwrap before other plugins are loaded, in both processes"
        )
    value.__setstate__(state)
    if kind is mujoco.MjModel:
        renumber(value)
    return value


def renumber(model: Any) -> None:
    """Give mjwrap's instances in a model that was loaded the plugin's number in this process."""
    from mjwrap.mjcf.marks import own_instances
    from mjwrap.plugin.mujoco_c.registration import PLUGIN_NAME, slot_of

    own = own_instances(model)
    model.plugin[own] = slot_of(PLUGIN_NAME)
