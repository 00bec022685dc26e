"""Change an MjSpec and its compiled model for `install`, and undo these changes."""
