"""The block of memory of each instance: its first contents, its allocation, and updates when the model changes."""
