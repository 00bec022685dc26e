"""The engine plugin: plain `mj_step`, the viewer, `rollout` and `batch` run the muscles, with no Python in the loop."""
