"""The inertias of an imported file, for models that mjwrap has not loaded itself: see `mjcf/file_inertias.py`."""

from mjwrap.mjcf.file_inertias import restore_inertias

__all__ = ["restore_inertias"]
