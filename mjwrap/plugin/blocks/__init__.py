"""Makes the block of memory of each instance: its first contents, its allocation, and what it follows of the model."""
