"""Geodesic muscles for MuJoCo: C1 paths over any number of wrapping surfaces.

The public names and their modules are listed in `__init__.pyi`.
"""

from typing import Any

import lazy_loader

from mjwrap.plugin.announcing import announce_with_mujoco

__version__ = "0.1.0"

_load, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> Any:
    """Load a public name from its module when it is first used, so that importing mjwrap is fast."""
    if name not in __all__:
        raise AttributeError(f"module 'mjwrap' has no attribute {name!r}; it has: {', '.join(__all__)}")
    return _load(name)


announce_with_mujoco()
