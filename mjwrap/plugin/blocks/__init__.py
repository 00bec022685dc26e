"""An instance's block of memory: its first contents, and what of the model it follows."""
