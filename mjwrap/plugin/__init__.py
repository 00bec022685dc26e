"""The engine plugin: `mj_step`, the viewer, `rollout` and `batch` run the muscles without Python in the loop."""

from mjwrap.plugin.installing import install, load
from mjwrap.plugin.native import native
from mjwrap.plugin.readout import Readout, excitations, read
from mjwrap.plugin.results import Muscles

__all__ = ["Muscles", "Readout", "excitations", "install", "load", "native", "read"]
