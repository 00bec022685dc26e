"""`mjwrap inspect`: what a model declares."""
