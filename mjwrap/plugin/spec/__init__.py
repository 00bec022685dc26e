"""Changes an MjSpec, and the model compiled from it, for `install`, and undoes these changes."""
