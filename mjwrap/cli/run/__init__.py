"""`mjwrap run`: simulate a model."""
