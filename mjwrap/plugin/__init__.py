"""The engine plugin: plain `mj_step`, the viewer, `rollout` and `batch` run the muscles, with no Python in the loop."""

import lazy_loader

# `import mjwrap` imports this package, to announce the plugin, and shall cost next to nothing.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
