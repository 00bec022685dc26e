"""OpenSim models: read .osim files, and write them as MuJoCo models with geodesic muscles."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
