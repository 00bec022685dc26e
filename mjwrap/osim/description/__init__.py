"""What an .osim file says, as plain data, whatever version wrote it."""
