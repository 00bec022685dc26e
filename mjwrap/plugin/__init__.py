"""The engine plugin: `mj_step`, the viewer, `rollout` and `batch` run the muscles without Python in the loop."""

import lazy_loader

# `import mjwrap` imports this package to register the plugin, and must stay fast
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
