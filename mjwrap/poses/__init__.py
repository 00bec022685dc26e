"""Make poses of a model, follow muscles' paths from pose to pose, and find jumps of their lengths."""
