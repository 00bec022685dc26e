"""Makes poses of a model, takes muscles from pose to pose, and finds jumps of their lengths on the way."""
