"""`mjwrap inspect`: list the muscles of a model and judge their parameters."""
