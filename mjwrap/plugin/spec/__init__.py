"""What `install` changes in an MjSpec, and how that is undone."""
